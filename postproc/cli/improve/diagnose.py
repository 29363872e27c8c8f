"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from postproc.cli.inputs import cell_words, effect_words, open_model, own_effects, short_names
from postproc.cli.options import ArmFile, EffectFiles, Flag, MeasuredOptions, ReportFile, Tables, TextFlag
from postproc.cli.output import check_outputs, write
from postproc.cli.progress import watching
from postproc.cli.report import print_result, say_next, show

if TYPE_CHECKING:
    from postproc.identify.diagnosis import Diagnosis


def run(
    model: ArmFile,
    /,
    *data: Tables,
    effects: EffectFiles = (),
    cell: Path | None = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    draft: Path | None = None,
    hold_out: Literal["payload", "temperature", "session", "approach", "region"] | None = None,
    json: Flag = False,
    text: TextFlag = False,
) -> int:
    """Find which physical effect a model lacks on measurements, with evidence; or none; or that the library lacks it.

    The exit code is 0 whatever the verdict is.

    Args:
        draft: Python file to write where something remains without a name: it as an effect of your own.
        hold_out: fit without each level of this channel, predict it, and mark names that do not carry over.
        json: print the postproc/diagnose/1 document.
        cell: what carries the arm and its work, in place of what the model says: as for ``compensate``.
    """
    from postproc.identify.diagnose import diagnose
    from postproc.identify.interventions import hold_out_levels
    from postproc.identify.words.sentences import of_little_worth, to_record, too_few
    from postproc.identify.words.text import diagnosis_json, diagnosis_text
    from postproc.render.effect_file import effect_file, nothing_to_draft
    from postproc.report.diagnosis import diagnosis_page

    check_outputs((model, *data, *table.inputs, *effects, cell), report, draft)
    arm = open_model(model, effects, cell, sigma=table.sigma)
    measured = table.read(data, arm.robot, at=arm.station)
    with watching("diagnosing") as watch:
        found = diagnose(arm, measured, own_effects(effects), noise=table.sigma, watch=watch)
        if hold_out is not None:
            watch(f"without each level of {hold_out}", 0.9)
            found = replace(found, hold_out=hold_out_levels(found, hold_out))
    show(d for d in found.diagnostics if d not in measured.diagnostics)
    if report is not None:
        write(report, diagnosis_page(short_names(model, *data), found))
    name, code = effect_file(found, draft.stem if draft is not None else "own", short_names(*data))
    if draft is not None and code is not None:
        write(draft, code)
    elif draft is not None:
        show([nothing_to_draft(found)])
    print_result(diagnosis_json(found), diagnosis_text(found), json, text)
    if not json:
        little = of_little_worth(found)
        keys = [m.candidate.key for m in found.missing if m.candidate.key not in little]
        given = [*table.words(effects), *cell_words(cell)]
        _say_named(found, keys, model, data, given)
        if found.verdict == "complete" and too_few(found.base):
            say_next("chooses them", "plan", model, *data, *table.words(effects), *cell_words(cell), "-o", "POSES.csv")
        elif found.verdict == "complete":
            words = ("compensate", "PROGRAM", "-m", model, *effect_words(effects), "-o", "OUT")
            say_next("corrects a program with this model", *words)
        lacking = to_record(found)
        told = code is not None and not found.misleading and not lacking
        if told and draft is not None:
            own = [*table.words([*effects, draft]), *cell_words(cell)]
            words = ("add", model, *keys, name, *_tables(data), *own, "-o", "BETTER.toml")
            what = "adds what remains, too" if keys else "adds it"
            if not found.suspects[0].codes:
                what = "adds what a single pose tells of it, which is not all"
            say_next(what, *words, lead="or" if keys else "next")
        elif told:
            words = ("diagnose", model, *data, *table.words(effects), *cell_words(cell), "--draft", "OWN.py")
            say_next("writes what remains as an effect of your own", *words, lead="and" if found.missing else "next")
        elif found.suspects and draft is None and not lacking:
            say_next("shows how to write what remains as an effect of your own", "explain", "DAT028")
    return 0


def _say_named(found: Diagnosis, keys: Sequence[str], model: Path, data: Sequence[str], own: Sequence[str]) -> None:
    if keys:
        it = "it" if len(keys) == 1 else "them"
        say_next(f"writes the model that has {it}", "add", model, *keys, *_tables(data), *own, "-o", "BETTER.toml")
    for m in found.missing:
        for other in m.not_separable[:1]:
            pair = ("--between", f"{m.candidate.key},{other}")
            what = "chooses poses that tell them apart"
            say_next(what, "plan", model, *data, *pair, *own, "-o", "POSES.csv", lead="or")


def _tables(data: Sequence[str]) -> list[str]:
    """Tables as `add` takes them."""
    return [word for name in data for word in ("--data", name)]
