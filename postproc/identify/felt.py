"""Patterns of what the tool and the footing feel: they lie loosely in their seats, or lift off them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import distal_point, point_acceleration
from postproc.identify.channels import varies
from postproc.identify.shapes import Pattern, of_channel, renamed, unit


def pulls(state: State, position: Array) -> Iterator[Pattern]:
    """Shapes of gravity, acceleration .. along the axes of the tool: it may lie loosely in its seat."""
    for what, names, felt in felt_by_tool(state, position):
        for axis, along in zip("xyz", felt.T, strict=True):
            if varies(along):
                label = f"{what} along {axis} of the tool"
                for pattern in of_channel(what, along):
                    some = renamed(pattern, f" of {label}", names)
                    form = label if some.kind == "line" else some.form
                    yield replace(some, form=form, where="tool", gate=())


def felt_by_tool(state: State, position: Array) -> list[tuple[str, tuple[str, ...], Array]]:
    """Name, channels and (n, 3) components in the axes of the flange of what the tool feels.

    Gravity, its acceleration, the weight of the payload with its inertia, and the process force.
    """
    assert state.T_base_body is not None
    turn = np.asarray(state.T_base_body)[:, 6, :3, :3]
    wrist = ("q5", "q6", "q4", "q3", "q2")
    free = np.broadcast_to(state.gravity, (len(turn), 3))
    pulls: list[tuple[str, tuple[str, ...], Array]] = [("gravity", wrist, free)]
    if state.a is not None and state.v is not None and state.robot is not None:
        a = point_acceleration(state.robot, np.asarray(state.T_base_body), state.v, state.a, 6, position)
        pulls.append(("acceleration", ("a1", "a2", "a3", "a4", "a5"), a))
        free = free - a
    if state.payload_mass is not None and varies(state.payload_mass):
        pulls.append(("payload's weight", ("payload", "q5", "q6", "q4"), state.payload_mass[:, None] * free))
    if state.wrench is not None:
        pulls.append(("process force", ("fx", "fy", "fz", "q5", "q6"), np.asarray(state.wrench)[:, :3]))
    return [(what, names, np.einsum("nji,nj->ni", turn, pull)) for what, names, pull in pulls if varies(pull)]


def overturning(state: State) -> Iterator[Pattern]:
    """The moment by which the arm leans on its footing to one side only, and its side: it lifts, or rocks."""
    if state.body_load is None or state.robot is None:
        return
    force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
    lean = (moment + np.cross(distal_point(state.robot, 0), force))[:, :2]
    for way in np.pi / 2 * np.arange(4):
        for rocks in (False, True):
            if varies(lean @ [np.cos(way), np.sin(way)]):
                yield _leaning(lean, float(way), rocks)


def _leaning(lean: Array, way: float, rocks: bool) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_leaning(lean, float(w), rocks), finer=None) for w in np.pi / 16 * np.arange(32)]

    along = np.asarray(lean @ [np.cos(way), np.sin(way)], dtype=np.float64)
    what = "side of the overturning moment" if rocks else "overturning moment to one side only"
    value = np.sign(along) if rocks else unit(np.maximum(along, 0.0))
    form = f"{what}, about {np.degrees(way):.0f} deg from x"
    return Pattern(("q1", "load2", "y", "x"), form, value, "leaning", where="base", finer=finer)
