"""``postproc add``: a model with more physics, and the error before and after."""

from __future__ import annotations

from pathlib import Path

from postproc.cli.inputs import load_measurements, load_model, own_effects
from postproc.cli.options import Columns, EffectFiles, Flag, Noise, Output, RunProgram
from postproc.cli.output import output_path, write_model
from postproc.cli.report import print_json, say
from postproc.identify.add import add_effects


def run(
    model: Path,
    /,
    *effect: str,
    data: str,
    effects: EffectFiles = (),
    output: Output = None,
    noise: Noise = None,
    program: RunProgram = None,
    columns: Columns = None,
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
        noise: standard deviation of the instrument per axis [mm]. Default: from repeated poses.
        program: RAPID module that was run, for tables that name targets.
        columns: TOML file that maps the columns of another layout.
        json: print the postproc/fit/1 document.
    """
    target = output_path(str(model), output, in_place=False)
    arm = load_model(model, effects=effects)
    table = load_measurements(data, arm.robot, program, columns)
    found = add_effects(arm, table, effect, own_effects(effects), noise=None if noise is None else noise * 1e-3)
    if json:
        print_json(found.as_json())
    else:
        (say if target is None else print)(found.text())
    write_model(target, found.model, like=model, silent=json)
    return 0
