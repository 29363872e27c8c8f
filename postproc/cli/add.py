"""``postproc add``: a model with more physics, and the error before and after."""

from __future__ import annotations

from pathlib import Path

from postproc.cli.inputs import load_model, own_effects
from postproc.cli.options import EffectFiles, Flag, MeasuredOptions, Output, ReportFile
from postproc.cli.output import check_outputs, write, write_model
from postproc.cli.report import print_json, say
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.identify.add import add_effects
from postproc.report.addition import addition_page


def run(
    model: Path,
    /,
    *effect: str,
    data: str,
    effects: EffectFiles = (),
    output: Output = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: Flag = False,
) -> int:
    """Add effects to a model, refit everything, and show how far the error falls on rows the fit has not seen.

    Without -o the model file goes to stdout.

    Args:
        model: TOML file of the arm.
        effect: keys of the effects to add, one after another.
        data: table of measured poses (CSV); - reads stdin.
        effects: Python file with effects of your own; its code is run. May be repeated.
        output: model file to write; comments of the model survive.
        report: HTML page to write.
        json: print the postproc/fit/1 document.
    """
    if not effect:
        help_ = "write `postproc add MODEL backlash --data DATA`"
        raise PostprocError(Diagnostic("CLI011", "error", "no effect is named", help=help_))
    check_outputs((model, data, *table.inputs, *effects), output, report)
    arm = load_model(model, effects=effects)
    measured = table.read(data, arm.robot)
    found = add_effects(arm, measured, effect, own_effects(effects), noise=table.sigma)
    write_model(output, found.model, like=model, silent=json)
    if report is not None:
        write(report, addition_page(f"{model.name} {Path(data).name}", found).encode())
    if json:
        print_json(found.as_json())
    else:
        (say if output is None else print)(found.text())
    return 0
