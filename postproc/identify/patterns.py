"""Free patterns of channels, one by one, two together and as the tool feels them, without a physical name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import distal_point, point_acceleration
from postproc.identify.channels import shown, varies
from postproc.identify.shapes import (
    HARMONICS,
    PHASES,
    Pattern,
    breaks,
    edges,
    knots,
    of_channel,
    of_size,
    of_sum,
    unit,
    waves,
)

GATES = 60
"""Places at which what one channel does is switched on by another."""
WINDOWS = 20
"""Places between which it is on."""
LINES = 12
"""Highest order of a gear's line whose size is another channel."""


def patterns(channels: Mapping[str, Array], state: State, position: Array) -> list[Pattern]:
    """All patterns of the channels of measured rows, and of where gravity and acceleration pull the tool.

    Args:
        channels: (n,) values by name; position: (n, 3) of the tool in base axes [m].
    """
    found: list[Pattern] = []
    for name, values in channels.items():
        found += [*of_channel(name, values), *of_size(name, values)]
    names = list(channels)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            found += _of_two(first, channels[first], second, channels[second])
    angles = [name for name in names if name[0] == "q" and name[1:].isdigit()]
    for a, b in pairwise(angles):
        found += _of_sum((a, b), f"{a} + {b}", channels[a] + channels[b])
        found += _of_sum((a, b), f"{a} - {b}", channels[a] - channels[b])
    for a, b, c in zip(angles, angles[1:], angles[2:], strict=False):
        found += _of_sum((a, b, c), f"{a} + {b} + {c}", channels[a] + channels[b] + channels[c])
    if {"x", "y"} <= set(names):
        x, y = channels["x"], channels["y"]
        found.append(Pattern(("x", "y"), "grows with the square of the distance from joint 1", unit(x**2 + y**2)))
    return [*found, *_history(channels), *_pulls(state, position), *_overturning(state)]


def _of_two(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    text = f"product of {first} and {second}"
    names = (first, second)

    def gated() -> list[Pattern]:
        return [*_gates(first, a, second, b), *_gates(second, b, first, a)]

    yield Pattern(names, text, unit(a * b), finer=gated)
    yield Pattern(names, text, unit((a - a.mean()) * (b - b.mean())), finer=gated)
    if first[0] == second[0] == "q":
        for k in HARMONICS:
            for j in HARMONICS:
                for f, g in ((np.sin, np.sin), (np.sin, np.cos), (np.cos, np.sin), (np.cos, np.cos)):
                    yield Pattern(names, f"product of {k} {first} and {j} {second} waves", f(k * a) * g(j * b))
    elif first[0] == "q" and second not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        for k in range(1, LINES + 1):
            for phase in (0.0, np.pi / 2):
                for size in (b, b - b.mean()):
                    yield _swelling(names, a, size, k, phase, gated if k in HARMONICS else None)
    for sign, size, order in ((a, b, names), (b, a, names[::-1])):
        if order[0].startswith(("dir", "v")) and order[1].startswith("load"):
            value = unit(np.sign(sign) * np.abs(size))
            yield Pattern(order, f"side of {order[0]} times size of {order[1]}", value)


def _gates(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    """What the first channel does where the second is on one side of an edge, between two, or more and more so."""
    if len(np.unique(b)) <= 4:
        return
    names, label = (first, second), f"{first} only where {second} is"
    for edge in edges(b, GATES):
        for side, inside in (("high", b > edge), ("low", b <= edge)):
            yield Pattern(names, f"{label} {side}", unit(a * inside))
    for low, high in combinations(edges(b, WINDOWS), 2):
        text = f"{label} between {shown(second, low)} and {shown(second, high)}"
        yield Pattern(names, text, unit(a * ((b > low) & (b < high))))
    for knot in knots(b, GATES):
        for side, above in (("high", b - knot), ("low", knot - b)):
            yield Pattern(names, f"{label} {side}, growing", unit(a * np.maximum(above, 0.0)))


def _swelling(
    names: tuple[str, str],
    angle: Array,
    size: Array,
    order: float,
    phase: float,
    gated: Callable[[], list[Pattern]] | None,
) -> Pattern:
    """A wave of an angle whose size is another channel: low ones anywhere, a gear's lines at its own joint."""
    where = None if gated else f"joint {names[0][1:]}"

    def finer() -> list[Pattern]:
        # Less than a wave a turn is hardly more than the other channel alone.
        orders = np.arange(1.0, 4.01, 0.25) if gated else order + 0.25 * np.arange(-2, 3)
        waves_ = [_swelling(names, angle, size, k, p, gated) for k in orders for p in PHASES]
        return [replace(p, finer=None) for p in waves_] + (gated() if gated else [])

    text = f"product of {order:g} {names[0]} waves and {names[1]}"
    return Pattern(names, text, unit(np.cos(order * angle - phase) * size), where, finer)


def _of_sum(names: tuple[str, ...], label: str, values: Array) -> Iterator[Pattern]:
    """Shapes of what neighbouring joints turn together: linkages, and angles against gravity."""
    for pattern in (*breaks(label, values), *waves(label, values)):
        yield of_sum(pattern, names, label)


def _history(channels: Mapping[str, Array]) -> Iterator[Pattern]:
    """Where the arm stood in the row before, and what it bore: what hangs behind knows no other approach side."""
    angles = [values for name, values in channels.items() if name[0] == "q" and name[1:].isdigit()]
    if not angles:
        return
    whole = np.stack(angles, axis=1)
    moved = np.any(np.diff(whole, axis=0, prepend=whole[:1]) != 0, axis=1)
    last = np.maximum.accumulate(np.where(moved, np.arange(len(moved)), 0))
    for name, values in channels.items():
        if name.rstrip("0123456789") not in ("q", "load", "payload"):
            continue
        before = values[np.maximum(last - 1, 0)]
        way = values[last] - before
        yield Pattern((name,), "side on which it stood in the row before", np.sign(way))
        yield Pattern((name,), "way from the row before", unit(way))
        yield Pattern((name,), "way from the row before, of its size", unit(np.abs(way)))
        if name == "payload":
            for pattern in of_channel(name, before):
                yield replace(pattern, text=f"{pattern.text} in the row before", finer=None)


def _pulls(state: State, position: Array) -> Iterator[Pattern]:
    """Gravity, and its acceleration, as the tool feels them: along its axes, and by their side."""
    for what, names, felt in felt_by_tool(state, position):
        for axis, along in zip("xyz", felt.T, strict=True):
            if varies(along):
                yield Pattern(names, f"{what} along {axis} of the tool", unit(along), "tool")
                yield Pattern(names, f"side to which {what} pulls along {axis} of the tool", np.sign(along), "tool")


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


def _overturning(state: State) -> Iterator[Pattern]:
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
    return Pattern(("q1", "load2", "y", "x"), f"{what}, about {np.degrees(way):.0f} deg from x", value, "base", finer)
