"""``postproc compensate``: a program in, the corrected program out."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from postproc.cli.inputs import load_model, read_source
from postproc.cli.options import EffectFiles, Flag, ModelFile, Output, ReportFile, Tolerance, VectorText, parse_vector
from postproc.cli.output import finish, output_path, write
from postproc.cli.report import print_json, say, show
from postproc.compensate.options import Options


def run(
    program: str,
    /,
    *,
    model: ModelFile = None,
    robot: str | None = None,
    output: Output = None,
    force: VectorText = "0,0,0",
    moment: VectorText = "0,0,0",
    force_on: Literal["all", "arc"] = "all",
    inertia: Literal["on", "off"] = "on",
    tolerance: Tolerance = 0.01,
    template: Path | None = None,
    effects: EffectFiles = (),
    report: ReportFile = None,
    in_place: Flag = False,
    check: Flag = False,
    diff: Flag = False,
    json: Flag = False,
) -> int:
    """Correct a program so that the real arm goes where the program says.

    Without -o the corrected program goes to stdout; with --json the document does, and the program only to -o.

    Args:
        program: RAPID module; - reads stdin.
        model: TOML file of the real arm. Default: the shipped model with elastic joints.
        robot: arm of the library, in place of the model's.
        output: where to write the corrected program.
        force: force on the TCP in base axes [N], FX,FY,FZ.
        moment: moment on the TCP in base axes [N m], MX,MY,MZ.
        force_on: where the force acts: along the whole program, or while the arc burns.
        inertia: compensate the deflection under sustained acceleration.
        tolerance: largest distance from the programmed path [mm].
        template: folder of Jinja templates in place of the shipped ones.
        effects: Python file with effects of your own; its code is run. May be repeated.
        report: HTML page to write.
        in_place: write over the program itself.
        check: write nothing; exit 1 if the output (the program, without -o) would change.
        diff: write nothing; print the textual difference, exit 1 if there is one.
        json: print the postproc/compensate/1 document.
    """
    from postproc.convert import compensate_program
    from postproc.report.compensation import compensation_page

    source = read_source(program)
    target = output_path(program, output, in_place)
    report = output_path(program, report, in_place=False)
    options = Options(
        tolerance_m=tolerance * 1e-3,
        force=parse_vector("--force", force),
        moment=parse_vector("--moment", moment),
        force_on=force_on,
        inertia=inertia == "on",
        template_dir=template,
    )
    result = compensate_program(source, load_model(model, robot, effects), options)
    show(result.diagnostics)
    if json:
        print_json(result.report)
    if report is not None:
        write(report, compensation_page(source.path, result).encode())
    if result.output is None:
        return max(1, result.exit_code)
    say(result.summary)
    names = (source.path, str(target or "compensated"))
    return finish(source.data, result.output, names, target, check=check, diff=diff, silent=json)
