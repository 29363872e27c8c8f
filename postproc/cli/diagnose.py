"""``postproc diagnose``: which physics a model lacks."""

from __future__ import annotations

from pathlib import Path

from postproc.cli.inputs import load_model, own_effects
from postproc.cli.options import EffectFiles, Flag, MeasuredOptions, ReportFile
from postproc.cli.output import check_outputs, write
from postproc.cli.report import print_json, say, show
from postproc.identify.diagnose import diagnose
from postproc.report.diagnosis import diagnosis_page


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
        own = table.words + "".join(f" --effects {file}" for file in effects)
        if found.missing:
            keys = " ".join(m.candidate.key for m in found.missing)
            say(f"next: `postproc add {model} {keys} --data {data}{own} -o BETTER.toml` writes the model that has it")
        for m in found.missing:
            for other in m.not_separable[:1]:
                pair = f"--between {m.candidate.key},{other}"
                say(f"or: `postproc plan {model} {data} {pair}{own} -o POSES.csv` chooses poses that tell them apart")
    return 0
