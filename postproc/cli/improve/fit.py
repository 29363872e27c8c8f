"""``postproc fit``: the model of an arm from measured poses."""

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from postproc import BASE
from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions
from postproc.cli.inputs import assumed, say_uses, short_names
from postproc.cli.options import CheckFlag, Output, ReportFile, Tables, TextFlag, VectorText, parse_tool, parse_vector
from postproc.cli.output import check_outputs, present, write_model
from postproc.cli.printing import say, show
from postproc.cli.progress import watching
from postproc.diagnostics import Diagnostic, PostprocError, joined

if TYPE_CHECKING:
    from postproc.effects.base import Effect
    from postproc.estimation.fitted import Fit
    from postproc.robot.cells.station import Station
    from postproc.settings_files import FitChoices

NO_FRAME = 1e-3
"""Error [m] beyond which a fit without one of the frames is told so; far beyond it nothing is written."""


def run(
    *data: Tables,
    robot: str | None = None,
    effects: Annotated[str | None, Parameter(name="--effects")] = None,
    mounting: VectorText | None = None,
    tool: VectorText | None = None,
    cell: Path | None = None,
    output: Output = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: CheckFlag = False,
    text: TextFlag = False,
) -> int:
    """Fit the model of an arm to measured poses.

    Args:
        robot: library name, or a robot TOML or URDF file. Default: that of ``postproc.toml``.
        effects: effects to fit, KEY,KEY,..; FILE.py among them stands for the effects it defines, its code is run.
            Default: instrument_frame,tool_frame,joint_offset,joint_compliance.
        mounting: roll, pitch, yaw of the base in the world [deg], R,P,Y: 180,0,0 hangs from a gantry. Default: 0,0,0.
        tool: TCP of tables of joint angles, X,Y,Z [mm] in tool0. Default: the fit finds it where the rows tell it.
        cell: what carries the arm and its work: TOML file with [[external_axes]], controller's backup, or its MOC.cfg.
            Default: that of ``postproc.toml``.
        output: model file to write. Default: stdout, and nowhere with --json.
        json: print the postproc/fit/1 document.
    """
    import numpy as np

    from postproc.effects.roles import FRAME_ROLES
    from postproc.estimation.recorded import no_farther_than_nominal, recorded_model, silent
    from postproc.identification.add import fit_effects
    from postproc.model.arm import Model
    from postproc.results.improve.fit import fit_document
    from postproc.robot.catalogue import doubts, load_robot
    from postproc.robot.pose import rpy

    robot, cell, stated, robot_from = _stated(data[0], robot, cell)
    check_outputs((*data, *table.inputs, robot, cell), output, report)
    arm = load_robot(robot)
    show(doubts(arm))
    words, classes = _effects(effects if effects is not None else ",".join(stated.effects or BASE))
    station = _station(cell, mounting)
    say(f"{assumed(arm.name, [c.key for c in classes], table.sigma)}; {robot_from}")
    measured = table.read(data, arm, at=station)
    default = effects is None and stated.effects is None
    if default and measured.T_frame_object is not None:
        stays = FRAME_ROLES if measured.state.session is None else FRAME_ROLES[1:]
        classes = [cls for cls in classes if cls.role not in stays]
        say(f"the table states the tool and where the work is: fitted are {', '.join(cls.key for cls in classes)}")
    turned = stated.mounting or (0.0, 0.0, 0.0) if mounting is None else parse_vector("--mounting", mounting, "180,0,0")
    model = Model(arm, (), rpy(np.radians(turned)), np.eye(4) if tool is None else parse_tool(tool), robot)
    model = model if station is None else model.at_station(station)
    with watching("fitting") as watch:
        fit = fit_effects(model, measured, classes, noise=table.sigma, watch=watch)
        if default and measured.readings is not None and (nothing := silent(fit)):
            say(f"the rows say nothing of {joined([f'`{key}`' for key in nothing])}: left out; `--effects` names more")
            classes = [c for c in classes if c.key not in nothing]
            fit = fit_effects(model, measured, classes, noise=table.sigma, watch=watch)
    _check_frames(fit, {cls.key for cls in classes})
    no_farther_than_nominal(fit)
    write_model(output, recorded_model(fit), silent=json)
    present(fit_document(short_names(*data), fit), report, json=json, text=text, on_stderr=output is None)
    if not json and output is not None:
        arm_options = ArmOptions(effects=tuple(Path(word) for word in words if word.endswith(".py")))
        tables = (*data, *table.words(), *arm_options.words())
        say_uses(output, tables, arm_options.words(), correct_first=measured.readings is not None)
    return 0


def _effects(effects: str) -> tuple[list[str], list[type[Effect]]]:
    """Return the words of ``--effects`` and the effect classes they name, each once; CLI011 for none."""
    from postproc.effects.loading import load_effect_file
    from postproc.effects.registry import effect_library, find_effect

    words = [word.strip() for word in effects.split(",") if word.strip()]
    if not words:
        help_ = f"write `--effects {','.join(BASE)}`"
        raise PostprocError.of("CLI011", "no effect is named", help=help_)
    classes: list[type[Effect]] = []
    for word in words:
        classes += load_effect_file(word) if word.endswith(".py") else [find_effect(word, effect_library())]
    return words, list(dict.fromkeys(classes))


def _station(cell: Path | None, mounting: VectorText | None) -> Station | None:
    """Return the arm in its cell, or None without a cell; CLI011 where a mounting is given beside it."""
    from postproc.robot.cells.cell_file import restated
    from postproc.settings import read_station

    if cell is not None and mounting is not None:
        help_ = "write `[mounting]` into the cell's file"
        raise PostprocError.of("CLI011", "`--cell` and `--mounting` both say how the base stands", help=help_)
    return None if cell is None else restated(read_station(cell))


def _stated(data: str, robot: str | None, cell: Path | None) -> tuple[str, Path | None, FitChoices, str]:
    """Return arm, cell, choices of ``[fit]`` and the arm's origin: by options, else the nearest ``postproc.toml``."""
    from postproc.settings_files import FitChoices, find_settings, in_folder

    path, choices = find_settings(Path(data).parent) or (Path(), None)
    stated = {} if choices is None else choices.stated()
    origin = "arm from `--robot`" if robot is not None else f"arm from `{path}`"
    if robot is None and "robot" in stated:
        robot = in_folder(path.parent, stated["robot"])
    if cell is None and "cell" in stated:
        cell = path.parent / stated["cell"]
    if robot is None:
        help_ = "add `--robot NAME`; `postproc robots list` has the names"
        raise PostprocError.of("CLI013", "nothing says which arm was measured", help=help_)
    return robot, cell, choices.fit if choices else FitChoices(), origin


def _check_frames(fit: Fit, fitted_effects: Set[str]) -> None:
    """Report DAT030 where a fit without instrument or tool frame misses points by over 1 mm per axis.

    Raises:
        PostprocError: DAT030 where it misses them by over `MISMATCH_M`.
    """
    from postproc.effects.registry import effect_in_role
    from postproc.effects.roles import FRAME_ROLES
    from postproc.measure.checks.readings import MISMATCH_M

    omitted = [f"`{key}`" for key in (effect_in_role(role).key for role in FRAME_ROLES) if key not in fitted_effects]
    if not omitted or fit.rms < NO_FRAME:
        return
    message = f"without {' and '.join(omitted)} the model misses the points by {1e3 * fit.rms:.1f} mm per axis"
    mismatch = fit.rms > MISMATCH_M
    finding = Diagnostic("DAT030", "error" if mismatch else "warning", message, help="name them among the effects")
    if mismatch:
        raise PostprocError(finding)
    show([finding])
