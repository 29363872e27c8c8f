"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions, opened
from postproc.cli.inputs import short_names
from postproc.cli.options import ArmFile, Flag, ReportFile, Tables, TextFlag
from postproc.cli.output import present, write
from postproc.cli.printing import say_next, show
from postproc.cli.progress import watching

if TYPE_CHECKING:
    from postproc.identification.diagnosis import Diagnosis


Question = tuple[Path, Sequence[str], ArmOptions, MeasuredOptions]
"""Model, tables, and how both are read."""


def run(
    model: ArmFile,
    /,
    *data: Tables,
    arm_options: ArmOptions = ArmOptions(),
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    draft: Path | None = None,
    json: Flag = False,
    text: TextFlag = False,
) -> int:
    """Find which physical effect a model lacks on measurements, with evidence; or none; or that the library lacks it.

    The exit code is 0 whatever the verdict is.

    Args:
        draft: Python file to write where something remains without a name: it as an effect of your own.
        json: print the postproc/diagnose/1 document.
    """
    from postproc.identification.diagnose import diagnose
    from postproc.render.effect_file import effect_file, nothing_to_draft
    from postproc.results.diagnosis import diagnosis_document

    arm, measured = opened(model, data, arm_options, table, report, draft)
    with watching("diagnosing") as watch:
        diagnosis = diagnose(arm, measured, arm_options.classes, noise=table.sigma, watch=watch)
    show(d for d in diagnosis.diagnostics if d not in measured.diagnostics)
    name, code = effect_file(diagnosis, draft.stem if draft is not None else "own", short_names(*data))
    if draft is not None and code is not None:
        write(draft, code)
    elif draft is not None:
        show([nothing_to_draft(diagnosis)])
    present(diagnosis_document(short_names(model, *data), diagnosis), report, json=json, text=text)
    if not json:
        _say_further(diagnosis, (model, data, arm_options, table), draft, None if code is None else name)
    return 0


def _say_further(diagnosis: Diagnosis, question: Question, draft: Path | None, drafted: str | None) -> None:
    """Print the commands that may come next.

    Args:
        question: model, tables and their options, as diagnosed.
        draft: file that was written for what has no name; drafted: key of what could be written, None for nothing.
    """
    from postproc.identification.diagnosis import too_few
    from postproc.results.sentences import of_little_worth, to_record

    model, data, arm, table = question
    little = of_little_worth(diagnosis)
    keys = [m.key for m in diagnosis.missing if m.key not in little]
    same = (*table.words(), *arm.words())
    tables = [word for name in data for word in ("--data", name)]  # as `add` takes them
    lacking = to_record(diagnosis)
    names_draft = drafted is not None and not diagnosis.misleading and not lacking
    written = draft if names_draft else None
    if written is not None:
        words = ("add", model, *keys, drafted, *tables, *table.words(), *arm.words(written), "-o", "BETTER.toml")
        what = "adds what was found, the draft included" if keys else "adds it"
        if not diagnosis.suspects[0].drafts:
            what = "adds what a single pose tells of it, which is not all"
        say_next(what, *words)
    elif keys:
        what = f"writes the model that has {'it' if len(keys) == 1 else 'them'}"
        say_next(what, "add", model, *keys, *tables, *same, "-o", "BETTER.toml")
    for m in diagnosis.missing:
        for other in m.not_separable[:1]:
            pair = ("--between", f"{m.key},{other}")
            words = (model, *data, *pair, *same, "-o", "POSES.csv")
            say_next("chooses poses that tell them apart", "plan", *words, lead="or")
    if (diagnosis.verdict == "complete" or diagnosis.untold) and too_few(diagnosis.base):
        say_next("chooses them", "plan", model, *data, *same, "-o", "POSES.csv")
    elif diagnosis.verdict == "complete":
        words = ("compensate", "PROGRAM", "-m", model, *ArmOptions(effects=arm.effects).words(), "-o", "OUT")
        say_next("corrects a program with this model", *words)
    if names_draft and written is None:
        words = ("diagnose", model, *data, *same, "--draft", "OWN.py")
        say_next("writes what remains as an effect of your own", *words, lead="and" if diagnosis.missing else "next")
    elif diagnosis.suspects and draft is None and not lacking:
        say_next("shows how to write what remains as an effect of your own", "explain", "DAT028")
