"""Columns ``eax_a`` .. ``eax_f``: where the external axes stood, and with them the arm and what was measured.

Points are in the coordinates of the work that an axis carries, else in the world.
"""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.measure.checks.readings import CLEARER, PlacedArm, align_arm, fits
from postproc.measure.measurements import FEWEST_ROWS_JUDGED
from postproc.measure.read.columns import EXTERNAL_AXES
from postproc.measure.read.lookup import Table
from postproc.measure.read.values import UNITS, fitting
from postproc.model.arm import in_world, with_axes
from postproc.rapid.data.records import NO_AXIS
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS, Joint
from postproc.robot.cells.station import Station

AXIS_UNITS = {"linear": "mm", "rotary": "deg", "fixed": "mm"}
DESCRIBE = "`[[external_axes]]` of the model, or `--cell FILE` of `fit`, describes it (docs/my-cell.md)"


def with_external_axes(state: State, table: Table, station: Station | None, extax: Array | None) -> State:
    """Return the state with the external axes, the arm's pose by them, and the axes as channels [mm], [deg].

    Args:
        table: has the columns, gets the findings; station: the cell that the axes belong to, if known.
        extax: (n, 6) those of a program's targets, for axes that have no column; None where there is none.

    Raises:
        PostprocError: DAT038, the table has an axis that the cell has not, or the arm's place cannot be computed.
    """
    joints = {} if station is None else station.joints
    stated = {name: _stated(table, name, joints.get(name[-1])) for name in EXTERNAL_AXES if name in table.place}
    programmed = {} if extax is None else {f"eax_{axis}": extax[:, LETTERS.index(axis)] for axis in joints}
    stated = programmed | stated
    stated = {name: values for name, values in stated.items() if np.isfinite(values).any()}
    if stated or joints:
        _check(table, stated, station)
    positions = {name: np.nan_to_num(values) for name, values in stated.items()}
    state = state.with_(channels={**state.channels, **positions})
    if station is None or not joints:
        return state
    stood = np.full((len(state), 6), np.inf)
    for axis in joints:
        stood[:, LETTERS.index(axis)] = positions.get(f"eax_{axis}", 0.0)
    placed = with_axes(station, state.with_(station=station), station.positions(stood))
    if placed.T_reference_base is not None and not np.isfinite(placed.T_reference_base).all():
        why = "; ".join(finding.message for finding in station.findings) or "a unit of the cell cannot be read"
        raise _wrong(table, f"nobody can tell where the arm stands: {why}", DESCRIBE)
    return placed


def _stated(table: Table, name: str, joint: Joint | None) -> Array:
    """Return (n,) positions in a column of an external axis [mm] or [deg], NaN for empty cells and 9E9.

    Args:
        joint: the cell's axis of that letter, None where it has none.

    Raises:
        PostprocError: DAT038 where the column's unit does not suit the kind of axis.
    """
    values = table.column(name)
    assert values is not None
    unit, wanted = table.place[name].unit, AXIS_UNITS[joint.kind] if joint is not None else "mm"
    if unit != "1":
        if joint is not None and not fitting(unit, wanted):
            help_ = "give it in the unit of its axis, or correct `kind` in `[[external_axes]]`"
            raise _wrong(table, f"`{name}` is in {unit}, and the cell has a {joint.kind} axis there", help_)
        values = values / UNITS["deg" if fitting(unit, "deg") else "mm"]
    return np.where(np.abs(values) < NO_AXIS, values, np.nan)


def _check(table: Table, stated: dict[str, Array], station: Station | None) -> None:
    """Report DAT038 for axes without a cell, without a column or outside their limits; raise it for unknown axes.

    Args:
        table: gets the findings; stated: positions (n,) [mm], [deg] by column name.
    """
    moving = [name for name, values in stated.items() if np.nanmax(np.abs(values)) > 0]
    if station is None or not station.joints:
        if moving:
            what = f"the table has `{moving[0]}`, and no cell says what it carries: the arm is taken to stand still"
            table.say("DAT038", "warning", what, DESCRIBE)
        return
    for name in moving:
        if name[-1] not in station.joints:
            known = ", ".join(f"`eax_{axis}`" for axis in sorted(station.joints))
            raise _wrong(table, f"the table has `{name}`, and the cell has no such axis: it has {known}", DESCRIBE)
    for axis, joint in station.joints.items():
        name, unit = f"eax_{axis}", AXIS_UNITS[joint.kind]
        if name not in stated:
            if joint.leader is None:
                what = f"the cell has an axis `{name}` and the table no such column: it is taken to stand at 0 {unit}"
                table.say("DAT038", "warning", what, f"give `{name}` in every row where it stood elsewhere")
            continue
        scale = UNITS[unit]
        low, high = (-np.inf if joint.lower is None else joint.lower), (np.inf if joint.upper is None else joint.upper)
        beyond = np.flatnonzero((scale * stated[name] < low - 1e-6) | (scale * stated[name] > high + 1e-6))
        if len(beyond):
            what = f"`{name}` stands at {stated[name][beyond[0]]:g} {unit}, outside its limits"
            what += f" {low / scale:g} .. {high / scale:g} {unit}"
            table.say("DAT038", "warning", what, "check the column, its unit and the limits", int(beyond[0]))


def check_work(state: State, table: Table, robot: Robot, position: Array) -> None:
    """Raise DAT038 where points (n, 3) [m], to be given in coordinates of the work, clearly are those of the world."""
    station = state.station
    if station is None or station.work is None or state.external_axes is None:
        return
    rows = np.flatnonzero(np.isfinite(position).all(axis=1) & np.isfinite(state.q).all(axis=1))
    if len(rows) < FEWEST_ROWS_JUDGED:
        return
    other = with_axes(in_world(station), state.with_(T_reference_base=None), state.external_axes)
    arms = (PlacedArm(robot, s.T_reference_base).rows(rows) for s in (state, other))
    work, world = (align_arm(arm, state.q[rows], position[rows]) for arm in arms)
    if fits(world) and not fits(work) and world.typical < work.typical / CLEARER:
        message = f"the points do not move with the work on `{station.work}`: in the world they fit to"
        help_ = 'points are measured in the coordinates of the work; say `carries = "nothing"` of these axes for others'
        raise _wrong(table, f"{message} {1e3 * world.typical:.2f} mm", help_)


def _wrong(table: Table, message: str, help_: str) -> PostprocError:
    """Return the exception for DAT038 with this message and help, and with all findings about the table so far."""
    return PostprocError([*table.diagnostics, table.cells.finding("DAT038", "error", message, help_)])
