"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.inputs import load_model, own_effects
from postproc.cli.options import EffectFiles, Flag, MeasuredOptions, ReportFile
from postproc.cli.output import check_outputs, write
from postproc.cli.report import print_json, say_next, show

if TYPE_CHECKING:
    from postproc.identify.diagnose import Diagnosis


def run(
    model: Path,
    data: str,
    /,
    *,
    effects: EffectFiles = (),
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: Flag = False,
) -> int:
    """Find which physical effect a model lacks on measurements, with evidence; or none; or that the library lacks it.

    The exit code is 0 whatever the verdict is.

    Args:
        model: TOML file of the arm.
        data: table of measured poses (CSV); - reads stdin.
        effects: Python file with effects of your own, which take part; its code is run. May be repeated.
        report: HTML page to write.
        json: print the postproc/diagnose/1 document.
    """
    from postproc.identify.diagnose import diagnose
    from postproc.report.diagnosis import diagnosis_page

    check_outputs((model, data, *table.inputs, *effects), report)
    arm = load_model(model, effects=effects)
    measured = table.read(data, arm.robot)
    found = diagnose(arm, measured, own_effects(effects), noise=table.sigma)
    show(d for d in found.diagnostics if d not in measured.diagnostics)
    if report is not None:
        write(report, diagnosis_page(f"{model.name} {Path(data).name}", found).encode())
    if json:
        print_json(found.as_json())
    else:
        print(found.text())
        _say_what_follows(found, model, data, table.words(effects))
    return 0


def _say_what_follows(found: Diagnosis, model: Path, data: str, own: Sequence[str]) -> None:
    keys = [m.candidate.key for m in found.missing]
    if keys:
        it = "it" if len(keys) == 1 else "them"
        say_next(f"writes the model that has {it}", "add", model, *keys, "--data", data, *own, "-o", "BETTER.toml")
    for m in found.missing:
        for other in m.not_separable[:1]:
            pair = ("--between", f"{m.candidate.key},{other}")
            what = "chooses poses that tell them apart"
            say_next(what, "plan", model, data, *pair, *own, "-o", "POSES.csv", lead="or")
    if found.verdict == "unknown":
        words = ("add", model, *keys, "YOUR_KEY", "--data", data, *own, "--effects", "YOURS.py", "-o", "BETTER.toml")
        say_next("once you have written what remains as an effect", *words, lead="then" if keys else "next")
    if found.verdict == "complete":
        say_next("corrects a program with this model", "compensate", "PROGRAM", "-m", model, "-o", "OUT")
