"""Patterns of what the tool and the footing feel: they lie loosely in their seats, or lift off them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import distal_point, point_acceleration
from postproc.fit.channels import varies
from postproc.patterns.change_points import breaks
from postproc.patterns.formula import Edge, Pattern, only_at, sharper
from postproc.patterns.shapes import of_signal
from postproc.patterns.signals import TOOL, Signal, tool_poses

MOMENT = ("load2", "q1", "x", "y")
"""Channels that the overturning moment follows."""
LEAN = "(state.body_load[:, 0, 3:] + np.cross(state.robot.link[0][:3, 3], state.body_load[:, 0, :3]))"
LEANING, LEANS = "the overturning moment", "base, as it leans"
"""Its name, and the place that it turns and shifts."""
WAYS = 4
"""Horizontal axes about which the footing is asked, half a turn apart in all."""
NEAR = 0.03
"""Share of the moment's range by which an edge may move when the axis is found more closely."""


def pulls(state: State, position: Array) -> Iterator[Pattern]:
    """Shapes of gravity, acceleration .. along the axes of the tool: it may lie loosely in its seat."""
    for what, names, felt, code in felt_by_tool(state, position):
        for k, axis in enumerate("xyz"):
            if varies(felt[:, k]):
                label = f"{what} along {axis} of the tool"
                signal = Signal(names, felt[:, k], code.replace("AXIS", str(k)), what, label)
                for some in of_signal(signal):
                    # In proportion, it pulls on hoses and joints as well.
                    line = some.kind == "line"
                    yield replace(some, form=label if line else some.form, where=None if line else "tool", gate=())


def felt_by_tool(state: State, position: Array) -> list[tuple[str, tuple[str, ...], Array, str]]:
    """Name, channels, (n, 3) components in the axes of the tool of what it feels, and the text of one.

    Gravity, its acceleration, the weight of the payload with its inertia, and the process force.
    """
    assert state.T_base_body is not None
    turn = tool_poses(state)[:, :3, :3]
    wrist, axis = ("q5", "q6", "q4", "q3", "q2"), f"({TOOL})[:, :3, AXIS]"
    free, gravity = np.broadcast_to(state.gravity, (len(turn), 3)), f"({axis} @ state.gravity)"
    pulls: list[tuple[str, tuple[str, ...], Array, str]] = [("gravity", wrist, free, gravity)]
    if state.a is not None and state.v is not None and state.motions is not None:
        a = point_acceleration(state.motions[6], np.asarray(state.T_base_body)[:, 6], position)
        pulls.append(("acceleration", ("a1", "a2", "a3", "a4", "a5"), a, ""))
        free, gravity = free - a, ""
    if state.payload_mass is not None and varies(state.payload_mass):
        code = f"(state.payload_mass * {gravity})" if gravity else ""
        weight = state.payload_mass[:, None] * free
        pulls.append(("payload's weight", ("payload", "q5", "q6", "q4"), weight, code))
    if state.wrench is not None:
        code = f"({axis} * state.wrench[:, :3]).sum(axis=1)"
        pulls.append(("process force", ("fx", "fy", "fz", "q5", "q6"), np.asarray(state.wrench)[:, :3], code))
    return [
        (what, names, np.einsum("nji,nj->ni", turn, pull), code) for what, names, pull, code in pulls if varies(pull)
    ]


def overturning(state: State, others: Iterable[Signal] = ()) -> Iterator[Pattern]:
    """Shapes of the moment with which the arm leans on its footing: anchors that lift or rock, legs that stiffen.

    In proportion to it the base tilts on `base_compliance`.

    Args:
        others: channels by which a footing may soften: water under it, its temperature.
    """
    lean = overturning_moment(state)
    if lean is None:
        return
    for way in np.pi / WAYS * np.arange(WAYS):
        yield from _leaning(lean, float(way))
    both = [_moment(lean, 0.0), _moment(lean, np.pi / 2)]
    if all(varies(s.values) for s in both):
        # Legs and anchors at two sides each, or a footing that is alike all around.
        for text, law in (
            ("square of the overturning moment about x and about y", lambda x, y: [x * np.abs(x), y * np.abs(y)]),
            ("cube of the overturning moment about x and about y", lambda x, y: [x**3, y**3]),
        ):
            form = f"growing with the {text}, to its side"
            yield Pattern(tuple(both), form, law, "leaning", where="base", wide=True)
        for other in others:
            form = f"the overturning moment about x and about y times {other.whole}"
            yield Pattern((other, *both), form, lambda c, x, y: [c * x, c * y], "leaning", where="base", wide=True)

    yield from _all_around(lean, others)


def overturning_moment(state: State) -> Array | None:
    """(n, 3) about the base origin [N m]; None where loads are not known."""
    if state.body_load is None or state.robot is None:
        return None
    force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
    return np.asarray(moment + np.cross(distal_point(state.robot, 0), force))


def leaning(lean: Array) -> Array:
    """(n, 3, 2) turn and shift of a base that leans as the moment (n, 3) pulls it, about a point above or below it."""
    size = np.hypot(lean[:, 0], lean[:, 1])
    x, y = lean[:, :2].T / np.maximum(size, 1e-9)
    still = np.zeros(len(lean))
    return np.stack([np.stack([x, y, still], axis=1), np.stack([y, -x, still], axis=1)], axis=2)


def _all_around(lean: Array, others: Iterable[Signal]) -> Iterator[Pattern]:
    """Shapes of the size of the moment (n, 3), for a footing that is alike all around: cushions, springs, play."""
    size = Signal(MOMENT, np.hypot(lean[:, 0], lean[:, 1]), f"np.hypot(*{LEAN}[:, :2].T)", "load", LEANING)
    if not varies(size.values):
        return
    laws: tuple[tuple[str, Callable[[Any], Any]], ...] = (
        (f"to the side of {LEANING}, however large", lambda x: x**0.0),
        (f"growing with the root of {LEANING}", lambda x: np.sqrt(x)),
        (f"growing with the square of {LEANING}", lambda x: x * x),
    )
    every = [Pattern((size,), form, law, "curve") for form, law in laws]
    every += [_levelling(size, float(k)) for k in np.quantile(size.values, np.linspace(0.1, 0.9, 9))]
    for shape in [*every, *breaks(size)]:
        yield only_at(LEANS, replace(shape, kind=f"{shape.kind} of the moment"))
    for other in others:
        both, kind = (other, size), "leaning"
        yield only_at(LEANS, Pattern(both, f"{LEANING} times {other.whole}", lambda c, x: c * x, kind))
        if other.values.min() > 0:
            yield only_at(LEANS, Pattern(both, f"{LEANING} over {other.whole}", lambda c, x: x / c, kind))


def _levelling(size: Signal, over: float) -> Pattern:
    """What grows in proportion at first and hardly at all in the end."""

    def finer() -> list[Pattern]:
        return [replace(_levelling(size, over * k), finer=None) for k in np.geomspace(0.3, 3.0, 41)]

    at = ((over, over),)
    return Pattern((size,), f"levelling off over {{}}{size.of}", lambda x: np.tanh(x / over), "rise", at, None, finer)


def _moment(lean: Array, way: float) -> Signal:
    """The moment (n, 3) about a horizontal axis."""
    along = np.array([np.cos(way), np.sin(way), 0.0])
    code = f"({LEAN} @ {np.round(along, 4).tolist()})"
    axis = {0: "x", 90: "y"}.get(round(np.degrees(way)), f"an axis {np.degrees(way):.0f} deg from x")
    return Signal(MOMENT, np.asarray(lean @ along), code, "load", f"the overturning moment about {axis}")


def _leaning(lean: Array, way: float) -> Iterator[Pattern]:
    """Shapes of the moment (n, 3) about a horizontal axis."""
    for shape in _shapes(_moment(lean, way)):
        finer = partial(_turned, lean, _plain(shape), way, np.pi / (8 * WAYS))
        yield replace(shape, kind=f"{shape.kind} of the moment", where="base", gate=(), finer=finer)


def _turned(lean: Array, form: str, way: float, apart: float, at: tuple[Edge, ...] | None = None) -> list[Pattern]:
    """A shape about axes near one, so far apart [rad]: the place of an edge moves with the axis, so both at once.

    Twice, the second time with edges (``at``) near the one that was found.
    """
    found: list[Pattern] = []
    for near in way + apart * np.arange(-4, 5):
        one = next((p for p in _shapes(_moment(lean, float(near))) if _plain(p) == form), None)
        some = [] if one is None else [one, *sharper(one)]
        reach = NEAR * float(np.ptp(lean))
        for p in (p for p in some if at is None or np.abs(np.subtract(p.at, at)).max(initial=0.0) < reach):
            finer = partial(_turned, lean, form, near, apart / 5, p.at) if at is None else None
            found.append(replace(p, where="base", gate=(), finer=finer))
    return found


def _shapes(signal: Signal) -> list[Pattern]:
    return [p for p in of_signal(signal) if p.kind not in ("line", "window")] if varies(signal.values) else []


def _plain(shape: Pattern) -> str:
    """What a shape is called, whatever it is a shape of."""
    return shape.form.replace(shape.signals[0].label, "")
