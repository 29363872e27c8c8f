"""Where external axes put the arm at each state, in the frame to which measured points count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.arrays import Array, invert
from postproc.channels.state import State
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station


def with_axes(station: Station, state: State, positions: Array) -> State:
    """Return the states with external axes at these positions (n, 6) [m], [rad].

    Sets ``T_reference_base``: measured points are in the frame of the unit that carries work, else in the world.
    Gravity is set by row where a turning axis carries the arm.
    """
    unit, gravity = station.work, station.gravity(positions)
    state = state.with_(external_axes=positions)
    if unit is not None or not station.in_world:
        T = station.base(positions) if unit is None else invert(station.frame(unit, positions))
        state = state.with_(T_reference_base=T, work=np.full(len(state), unit or ""))
    turning = any(station.joints[axis].kind == "rotary" for axis, side in station.sides(None).items() if side > 0)
    return state if gravity is None or not turning else state.with_(gravity=gravity)


def in_world(station: Station) -> Station:
    """Return the station with all units marked as carrying nothing: measured points then count in the world."""
    units = {name: replace(unit, idle=True) for name, unit in station.cell.units.items()}
    return replace(station, cell=replace(station.cell, units=units))


def as_written(station: Station, positions: Array) -> dict[str, Array]:
    """Convert positions (n, 6) [m, rad] to columns ``eax_a`` .. of the station's axes, in mm and degrees."""
    scales = {axis: 1e3 if joint.kind == "linear" else 180.0 / np.pi for axis, joint in station.joints.items()}
    return {f"eax_{axis}": scale * positions[:, LETTERS.index(axis)] for axis, scale in sorted(scales.items())}
