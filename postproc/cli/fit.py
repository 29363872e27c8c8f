"""``postproc fit``: the model of an arm from measured poses."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from postproc.cli.inputs import load_measurements
from postproc.cli.options import Columns, Flag, Noise, Output, RunProgram
from postproc.cli.output import output_path, write_model
from postproc.cli.report import print_json, say
from postproc.effects.base import Effect
from postproc.effects.registry import effect_library, find_effect, load_effect_file
from postproc.identify.add import grown
from postproc.identify.fit import fit_model
from postproc.model.arm import Model
from postproc.robot.library import load_robot


def run(
    data: str,
    /,
    *,
    robot: str,
    effects: Annotated[str, Parameter(name="--effects")],
    output: Output = None,
    noise: Noise = None,
    program: RunProgram = None,
    columns: Columns = None,
    json: Flag = False,
) -> int:
    """Fit the model of an arm to measured poses. Without -o the model file goes to stdout.

    Args:
        data: table of measured poses (CSV); - reads stdin.
        robot: library name, or a robot TOML or URDF file.
        effects: effects to fit, KEY,KEY,..; FILE.py among them stands for the effects it defines, its code is run.
        output: model file to write.
        noise: standard deviation of the instrument per axis [mm]. Default: from repeated poses.
        program: RAPID module that was run, for tables that name targets.
        columns: TOML file that maps the columns of another layout.
        json: print the postproc/fit/1 document.
    """
    target = output_path(data, output, in_place=False)
    arm = load_robot(robot)
    classes: list[type[Effect]] = []
    for word in effects.split(","):
        classes += load_effect_file(word) if word.endswith(".py") else [find_effect(word.strip(), effect_library())]
    table = load_measurements(data, arm, program, columns)
    sigma = None if noise is None else noise * 1e-3
    fit = fit_model(Model(arm, robot_name=robot), table, [c.null() for c in classes if not c.structures()], noise=sigma)
    for cls in classes:
        if cls.structures():
            fit = grown(fit, cls, sigma)
    if json:
        print_json(fit.as_json())
    else:
        (say if target is None else print)(fit.text())
    write_model(target, fit.recorded(), silent=json)
    return 0
