"""``postproc seam``: seam points in, a compensated weld module out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from postproc.cli.inputs import load_model, read_source
from postproc.cli.options import Distance, EffectFiles, ModelFile, Tolerance, VectorText, parse_vector
from postproc.cli.output import output_path, write
from postproc.cli.report import print_json, say, show
from postproc.compensate.options import Options


def run(
    points: str,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    tool: str | None = None,
    wobj: str | None = None,
    seam_data: str | None = None,
    weld_data: str | None = None,
    side_files: Annotated[tuple[str, ...], Parameter(name="--with", n_tokens=1)] = (),
    routine: str = "main",
    speed: Tolerance = 8.0,
    clearance: Distance = 50.0,
    model: ModelFile = None,
    robot: str | None = None,
    force: VectorText = "0,0,0",
    moment: VectorText = "0,0,0",
    force_on: Literal["all", "arc"] = "all",
    inertia: Literal["on", "off"] = "on",
    tolerance: Tolerance = 0.01,
    template: Path | None = None,
    effects: EffectFiles = (),
    json: bool = False,
) -> int:
    """Make a complete weld module out of seam points and compensate it; nothing is written if a row is wrong.

    Args:
        points: CSV with x_mm,y_mm,z_mm and qw,qx,qy,qz or tx,ty,tz,nx,ny,nz, also speed_mm_s; - reads stdin.
        output: module to write; its name becomes the name of the module.
        tool: tooldata, NAME:=VALUE as in RAPID, or the NAME of one in a --with file.
        wobj: wobjdata in whose frame the points are, given in the same way. Default: wobj0.
        seam_data: seamdata, given in the same way.
        weld_data: welddata, given in the same way; its speed gives way to the column speed_mm_s.
        side_files: RAPID module with data that the options name. May be repeated.
        routine: name of the procedure.
        speed: welding speed where neither the table nor --weld-data gives one [mm/s].
        clearance: how far in front of the seam the arm arrives and leaves [mm].
        model: TOML file of the real arm. Default: the shipped model with elastic joints.
        robot: arm of the library, in place of the model's.
        force: force on the TCP in base axes [N], FX,FY,FZ.
        moment: moment on the TCP in base axes [N m], MX,MY,MZ.
        force_on: where the force acts: along the whole program, or while the arc burns.
        inertia: compensate the deflection under sustained acceleration.
        tolerance: largest distance from the programmed path [mm].
        template: folder of Jinja templates in place of the shipped ones, seam_module.j2 among them.
        effects: Python file with effects of your own; its code is run. May be repeated.
        json: print the postproc/compensate/1 document.
    """
    from postproc.convert import compensate_program
    from postproc.diagnostics import Source
    from postproc.render.seam import SeamOptions, seam_module
    from postproc.render.seampoints import read_seam_points

    table = read_seam_points(read_source(points))
    target = output_path(points, output, in_place=False)
    arm = load_model(model, robot, effects)
    sides = [read_source(name) for name in side_files]
    name = (re.sub(r"\W", "_", output.stem, flags=re.ASCII).lstrip("_0123456789") or "Seam")[:32]
    said = SeamOptions(name, routine, tool, wobj, seam_data, weld_data, speed, clearance)
    text, notes = seam_module(table, arm.robot, arm.T_flange_tcp, said, sides, template)
    for note in notes:
        say(f"by default, {note}")
    options = Options(
        tolerance_m=tolerance * 1e-3,
        force=parse_vector("--force", force),
        moment=parse_vector("--moment", moment),
        force_on=force_on,
        inertia=inertia == "on",
        template_dir=template,
        entry=routine,
    )
    module = Source(str(output), text)
    result = compensate_program([module, *sides], arm, options)
    show(result.diagnostics)
    if json:
        print_json(result.report)
    if not result.outputs:
        return max(1, result.exit_code)
    write(target, result.outputs[module.path])
    say(result.summary)
    return 0
