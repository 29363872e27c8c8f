"""``postproc seam``: seam points in, a compensated weld module out."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from postproc.cli.convert.finish import show_result
from postproc.cli.data_names import check_names
from postproc.cli.inputs import read_source
from postproc.cli.options import CertificateFile, CheckFlag, Distance, ReportFile, RequiredOutput, Tolerance
from postproc.cli.output import check_outputs, write
from postproc.cli.printing import print_document, say, show
from postproc.cli.program_options import ConvertOptions
from postproc.cli.programs import read_lent, settled
from postproc.cli.progress import watching
from postproc.diagnostics import Source


def run(
    points: str,
    /,
    *,
    output: RequiredOutput,
    tool: str | None = None,
    wobj: str | None = None,
    seam_data: str | None = None,
    weld_data: str | None = None,
    routine: str = "main",
    speed: Tolerance = 8.0,
    clearance: Distance = 50.0,
    convert: ConvertOptions = ConvertOptions(),
    report: ReportFile = None,
    certificate: CertificateFile = None,
    json: CheckFlag = False,
) -> int:
    """Make a complete weld module out of seam points and compensate it; nothing is written if a row is wrong.

    Args:
        points: CSV with x_mm,y_mm,z_mm and qw,qx,qy,qz or tx,ty,tz,nx,ny,nz, also speed_mm_s; - reads stdin.
        output: module to write; its name becomes the name of the module.
        tool: tooldata, NAME:=VALUE as in RAPID, or the NAME of one in a --with file.
        wobj: wobjdata in whose frame the points are, given in the same way. Default: wobj0.
        seam_data: seamdata, given in the same way.
        weld_data: welddata, given in the same way; its speed gives way to the column speed_mm_s.
        routine: name of the procedure.
        speed: welding speed where neither the table nor --weld-data gives one [mm/s].
        clearance: how far in front of the seam the arm arrives and leaves [mm].
        json: print the postproc/compensate/1 document.
    """
    from postproc.render.seam import SeamOptions, seam_module
    from postproc.render.seampoints import read_seam_points
    from postproc.runtime.passes import correct_program

    settings = convert.settings_at(Path(points).parent)
    settings = replace(settings, options=replace(settings.options, entry=routine, run_time="off"))
    check_outputs((points, *settings.inputs), output, report, certificate)
    source = read_source(points)
    settings, arm = settled(settings, points)
    table = read_seam_points(source)
    show(doubts := table.doubts())
    sides = read_lent(settings.side_files)
    choices = SeamOptions(_module_name(output), routine, tool, wobj, seam_data, weld_data, speed, clearance)
    templates = settings.options.template_dir
    text, notes = seam_module(table, arm.robot, arm.T_flange_tcp, choices, sides, templates=templates)
    for note in notes:
        say(f"by default, {note}")
    module = Source(str(output), text)
    check_names(convert, [module, *sides])
    with watching(f"correcting `{output}`", len(module.line_starts)) as watch:
        result = correct_program([module, *sides], arm, settings.options, watch)
    show(result.diagnostics)
    if result.outputs:
        write(output, result.outputs[module.path])
    show_result(output, result, settings, report, certificate)
    if json:
        findings = [d.as_json() for d in doubts] + result.report["diagnostics"]
        print_document({**result.report, **settings.document(arm.robot.name), "diagnostics": findings})
    return 0 if result.outputs else max(1, result.exit_code)


def _module_name(output: Path) -> str:
    """Return a valid RAPID name of at most 32 characters, from the name of the file."""
    return (re.sub(r"\W", "_", output.stem, flags=re.ASCII).lstrip("_0123456789") or "Seam")[:32]
