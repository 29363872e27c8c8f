"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions, opened
from postproc.cli.inputs import short_names
from postproc.cli.options import ArmFile, CheckFlag, ReportFile, Tables, TextFlag
from postproc.cli.output import present
from postproc.cli.printing import say_next, show
from postproc.cli.progress import watching

if TYPE_CHECKING:
    from postproc.channels.state import State
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
    json: CheckFlag = False,
    text: TextFlag = False,
) -> int:
    """Find which physical effect a model lacks on measurements, with evidence; or none; or that the library lacks it.

    The exit code is 0 whatever the verdict is.

    Args:
        json: print the postproc/diagnose/1 document.
    """
    from postproc.identification.diagnose import diagnose
    from postproc.results.improve.diagnosis import diagnosis_document

    arm, measured = opened(model, data, arm_options, table, report)
    with watching("diagnosing") as watch:
        diagnosis = diagnose(arm, measured, arm_options.classes, noise=table.sigma, watch=watch)
    show(d for d in diagnosis.diagnostics if d not in measured.diagnostics)
    present(diagnosis_document(short_names(model, *data), diagnosis), report, json=json, text=text)
    if not json:
        _say_further(diagnosis, (model, data, arm_options, table))
    return 0


def _say_further(diagnosis: Diagnosis, question: Question) -> None:
    """Print the commands that may come next.

    Args:
        question: model, tables and their options, as diagnosed.
    """
    from postproc.identification.diagnosis import shortage
    from postproc.identification.planning.setups import SHOP
    from postproc.results.improve.sentences import of_little_worth, to_record

    model, data, arm, table = question
    little = of_little_worth(diagnosis)
    keys = [m.key for m in diagnosis.missing if m.key not in little]
    same = (*table.words(), *arm.words())
    tables = [word for name in data for word in ("--data", name)]  # as `add` takes them
    if diagnosis.remaining and not diagnosis.misleading and not to_record(diagnosis):
        keys.append("curve")
    if keys:
        what = f"writes the model that has {'it' if len(keys) == 1 else 'them'}"
        say_next(what, "add", model, *keys, *tables, *same, "-o", "BETTER.toml")
    for m in diagnosis.missing:
        for other in m.not_separable[:1]:
            pair = ("--between", f"{m.key},{other}")
            words = (model, *data, *pair, *same, "-o", "POSES.csv")
            say_next("says which poses would tell them apart", "plan", *words, lead="or")
    lacking = shortage(diagnosis.base) if diagnosis.verdict == "complete" or diagnosis.untold else None
    if lacking is not None and lacking.kind in SHOP:
        loads = _loads(diagnosis.base.data.state) if lacking.kind == "gauge" else []
        words = ("--kind", lacking.kind, *loads, "-n", lacking.count, *arm.words(), "-o", "MORE.csv")
        say_next("chooses them", "plan", model, *words)
    elif lacking is not None:
        say_next("chooses them", "plan", model, *data, *same, "-o", "POSES.csv")
    elif diagnosis.verdict == "complete":
        words = ("compensate", "PROGRAM", "-m", model, *ArmOptions(effects=arm.effects).words(), "-o", "OUT")
        say_next("corrects a program with this model", *words)


def _loads(state: State) -> list[object]:
    """Return the options of a plan that state the heaviest payload and the strongest pull of some rows."""
    import numpy as np

    mass = 0.0 if state.payload_mass is None else float(np.nanmax(state.payload_mass, initial=0.0))
    pull = 0.0 if state.wrench is None else float(np.nanmax(np.abs(state.wrench[:, :3]), initial=0.0))
    return [*(["--load", f"{mass:g}"] if mass else []), *(["--pull", f"{pull:g}"] if pull else [])]
