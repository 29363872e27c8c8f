"""``postproc compare``: where a model fails on measurements."""

from __future__ import annotations

from pathlib import Path

from postproc.cli.inputs import load_measurements, load_model
from postproc.cli.options import Columns, EffectFiles, Flag, Noise, ReportFile, RunProgram
from postproc.cli.output import output_path, write
from postproc.cli.report import print_json
from postproc.identify.compare import compare
from postproc.report.comparison import comparison_page


def run(
    model: Path,
    data: str,
    /,
    *,
    effects: EffectFiles = (),
    noise: Noise = None,
    program: RunProgram = None,
    columns: Columns = None,
    report: ReportFile = None,
    json: Flag = False,
) -> int:
    """Compare a model with measurements: figures, the worst poses, the residual against every channel.

    Args:
        model: TOML file of the arm.
        data: table of measured poses (CSV); - reads stdin.
        effects: Python file with effects of your own; its code is run. May be repeated.
        noise: standard deviation of the instrument per axis [mm]. Default: from repeated poses.
        program: RAPID module that was run, for tables that name targets.
        columns: TOML file that maps the columns of another layout.
        report: HTML page to write.
        json: print the postproc/compare/1 document.
    """
    page = output_path(data, report, in_place=False)
    arm = load_model(model, effects=effects)
    table = load_measurements(data, arm.robot, program, columns)
    found = compare(arm, table, noise=None if noise is None else noise * 1e-3)
    if page is not None:
        write(page, comparison_page(data, found).encode())
    if json:
        print_json(found.as_json())
    else:
        print(found.text())
    return 0
