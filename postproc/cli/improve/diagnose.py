"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from postproc.cli.inputs import cell_words, effect_words, open_model, own_effects, short_names
from postproc.cli.options import ArmFile, EffectFiles, Flag, MeasuredOptions, ReportFile, Tables, TextFlag
from postproc.cli.output import check_outputs, present, write
from postproc.cli.progress import watching
from postproc.cli.report import say_next, show

if TYPE_CHECKING:
    from postproc.identification.diagnosis import Diagnosis


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
    from postproc.identification.diagnose import diagnose
    from postproc.identification.interventions import hold_out_levels
    from postproc.render.effect_file import effect_file, nothing_to_draft
    from postproc.results.diagnosis import diagnosis_document

    check_outputs((model, *data, *table.inputs, *effects, cell), report, draft)
    arm = open_model(model, effects, cell, sigma=table.sigma)
    measured = table.read(data, arm.robot, at=arm.station)
    with watching("diagnosing") as watch:
        found = diagnose(arm, measured, own_effects(effects), noise=table.sigma, watch=watch)
        if hold_out is not None:
            watch(f"without each level of {hold_out}", 0.9)
            found = replace(found, hold_out=hold_out_levels(found, hold_out))
    show(d for d in found.diagnostics if d not in measured.diagnostics)
    name, code = effect_file(found, draft.stem if draft is not None else "own", short_names(*data))
    if draft is not None and code is not None:
        write(draft, code)
    elif draft is not None:
        show([nothing_to_draft(found)])
    present(diagnosis_document(short_names(model, *data), found), report, json=json, text=text)
    if not json:
        _say_further(found, _Question(model, data, effects, cell, table), draft, None if code is None else name)
    return 0


@dataclass(frozen=True)
class _Question:
    """What a diagnosis was asked of, as the words of further commands."""

    model: Path
    data: Sequence[str]
    effects: Sequence[Path | str]
    cell: Path | None
    table: MeasuredOptions

    def words(self, *more: Path) -> list[str]:
        """Options of the table, own effects and the cell; ``more`` are further files of effects."""
        return [*self.table.words([*self.effects, *more]), *cell_words(self.cell)]


def _say_further(found: Diagnosis, asked: _Question, draft: Path | None, drafted: str | None) -> None:
    """The commands that come next.

    Args:
        draft: file that was written for what has no name; drafted: key of what could be written, None for nothing.
    """
    from postproc.identification.diagnosis import too_few
    from postproc.results.sentences import of_little_worth, to_record

    little = of_little_worth(found)
    keys = [m.candidate.key for m in found.missing if m.candidate.key not in little]
    _say_named(found, keys, asked)
    if (found.verdict == "complete" or found.untold) and too_few(found.base):
        say_next("chooses them", "plan", asked.model, *asked.data, *asked.words(), "-o", "POSES.csv")
    elif found.verdict == "complete":
        words = ("compensate", "PROGRAM", "-m", asked.model, *effect_words(asked.effects), "-o", "OUT")
        say_next("corrects a program with this model", *words)
    lacking = to_record(found)
    told = drafted is not None and not found.misleading and not lacking
    if told and draft is not None:
        words = ("add", asked.model, *keys, drafted, *_tables(asked.data), *asked.words(draft), "-o", "BETTER.toml")
        what = "adds what remains, too" if keys else "adds it"
        if not found.suspects[0].codes:
            what = "adds what a single pose tells of it, which is not all"
        say_next(what, *words, lead="or" if keys else "next")
    elif told:
        words = ("diagnose", asked.model, *asked.data, *asked.words(), "--draft", "OWN.py")
        say_next("writes what remains as an effect of your own", *words, lead="and" if found.missing else "next")
    elif found.suspects and draft is None and not lacking:
        say_next("shows how to write what remains as an effect of your own", "explain", "DAT028")


def _say_named(found: Diagnosis, keys: Sequence[str], asked: _Question) -> None:
    if keys:
        it, own = "it" if len(keys) == 1 else "them", (*_tables(asked.data), *asked.words())
        say_next(f"writes the model that has {it}", "add", asked.model, *keys, *own, "-o", "BETTER.toml")
    for m in found.missing:
        for other in m.not_separable[:1]:
            pair = ("--between", f"{m.candidate.key},{other}")
            what = "chooses poses that tell them apart"
            words = (asked.model, *asked.data, *pair, *asked.words(), "-o", "POSES.csv")
            say_next(what, "plan", *words, lead="or")


def _tables(data: Sequence[str]) -> list[str]:
    """Tables as `add` takes them."""
    return [word for name in data for word in ("--data", name)]
