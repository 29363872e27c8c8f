"""Patterns of what the tool and the footing feel: they lie loosely in their seats, or lift off them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import distal_point, point_acceleration
from postproc.estimation.channels import varies
from postproc.patterns.curves import LEVELLING, ROOT, SQUARE, breaks, fixed, line, of_signal
from postproc.patterns.formula import Block, Pattern, block, product_of, side_by_side
from postproc.patterns.signals import TOOL, Signal, tool_poses

MOMENT = ("load2", "q1", "x", "y")
"""Channels that the overturning moment follows."""
LEAN = "(state.body_load[:, 0, 3:] + np.cross(state.robot.link[0][:3, 3], state.body_load[:, 0, :3]))"
LEANING, LEANS = "the overturning moment", "base, as it leans"
"""Its name, and the place that it turns and shifts."""
WAYS = 4
"""Horizontal axes about which the footing is asked, half a turn apart in all."""


def pulls(state: State, position: Array) -> Iterator[Block]:
    """Yield candidate patterns in each component, along the tool's axes, of weight and acceleration (`felt_by_tool`).

    A tool that is not held firmly moves with them. Components that do not vary are passed over.

    Args:
        position: (n, 3) of the tool in base axes [m], from which its acceleration is worked out.
    """
    for what, names, felt, code in felt_by_tool(state, position):
        for k, axis in enumerate("xyz"):
            if varies(felt[:, k]):
                label = f"{what} along {axis} of the tool"
                signal = Signal(names, felt[:, k], code.replace("AXIS", str(k)), what, label)
                for some in of_signal(signal):
                    # In proportion, it pulls on hoses and joints as well.
                    where = None if some.like.kind == "line" else "tool"
                    yield some.with_(where=where)


def felt_by_tool(state: State, position: Array) -> list[tuple[str, tuple[str, ...], Array, str]]:
    """Return (name, channels, components (n, 3) in tool axes, expression) of each force or acceleration on the tool.

    They are gravity, the tool's acceleration [m/s^2], the payload's weight with its inertia and the process force [N].
    ``AXIS`` stands in the expression for the index of the component; the expression is empty where a state has none.
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


def overturning(state: State, others: Iterable[Signal] = ()) -> tuple[list[Block], list[Pattern]]:
    """Return patterns, with one size and with several, of the moment with which the arm leans on its footing.

    They describe anchors that lift or rock and legs that stiffen; what is proportional to the moment is left to the
    effect `base_compliance`. The moment is taken about `WAYS` horizontal axes, about x and y with a size for each, and
    by its magnitude; both lists are empty where loads are not known.

    Args:
        others: signals by which a footing may soften, such as a temperature.
    """
    lean = overturning_moment(state)
    if lean is None:
        return [], []
    axes = (_moment(lean, float(way)) for way in np.pi / WAYS * np.arange(WAYS))
    found = [
        b.with_(where="base", kind=f"{b.like.kind} of the moment")
        for signal in axes
        if varies(signal.values)
        for b in of_signal(signal)
        if b.like.kind not in ("line", "window")
    ]
    both, wide = [_moment(lean, 0.0), _moment(lean, np.pi / 2)], list[Pattern]()
    if all(varies(s.values) for s in both):
        # Legs and anchors at two sides each, or a footing that is alike all around.
        for word, law in (("square", lambda x: x * np.abs(x)), ("cube", lambda x: x**3)):
            said = f"growing with the {word} of the overturning moment about x and about y, to its side"
            curve = fixed(law, said, "leaning")
            wide.append(side_by_side((block(curve, s)[0] for s in both), said, "leaning", "base"))
        for other in others:
            said = f"the overturning moment about x and about y times {other.whole}"
            parts = (product_of(line(other), line(s), "leaning")[0] for s in both)
            wide.append(side_by_side(parts, said, "leaning", "base"))
    size = Signal(MOMENT, np.hypot(lean[:, 0], lean[:, 1]), f"np.hypot(*{LEAN}[:, :2].T)", "load", LEANING)
    if varies(size.values):
        always = fixed(lambda x: x**0.0, "to the side of {label}, however large", "curve")
        some = [block(curve, size) for curve in (always, ROOT, SQUARE)]
        some.append(block(LEVELLING, size, [(k,) for k in np.quantile(size.values, np.linspace(0.1, 0.9, 9))]))
        found += [b.with_(where=LEANS, kind=f"{b.like.kind} of the moment") for b in (*some, *breaks(size))]
        for other in others:
            found.append(product_of(line(size), line(replace(other, label=other.whole)), "leaning", LEANS))
            if other.values.min() > 0:
                over = fixed(lambda x: 1 / x, f"over {other.whole}", "leaning", f"one over {other.whole}")
                found.append(product_of(line(size), block(over, other), "leaning", LEANS))
    return found, wide


def overturning_moment(state: State) -> Array | None:
    """Return the moment (n, 3) on the base about its origin [N m], None where loads are not known."""
    if state.body_load is None or state.robot is None:
        return None
    force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
    return np.asarray(moment + np.cross(distal_point(state.robot, 0), force))


def leaning(lean: Array) -> Array:
    """Return (n, 3, 2) unit turn axis and unit shift of a base that tilts the way the moment (n, 3) pulls it.

    The turn comes first on the last axis; together they tilt the base about a point at any height.
    """
    size = np.hypot(lean[:, 0], lean[:, 1])
    x, y = lean[:, :2].T / np.maximum(size, 1e-9)
    still = np.zeros(len(lean))
    return np.stack([np.stack([x, y, still], axis=1), np.stack([y, -x, still], axis=1)], axis=2)


def _moment(lean: Array, way: float) -> Signal:
    """Return the component of the moment (n, 3) about the horizontal axis at ``way`` [rad] from x, as a signal."""
    along = np.array([np.cos(way), np.sin(way), 0.0])
    code = f"({LEAN} @ {np.round(along, 4).tolist()})"
    axis = {0: "x", 90: "y"}.get(round(np.degrees(way)), f"an axis {np.degrees(way):.0f} deg from x")

    def near(level: int) -> list[Signal]:
        """Return moments about eight axes nearby, closer at higher levels."""
        apart = np.pi / (8 * WAYS) / 4**level
        return [_moment(lean, float(other)) for other in way + apart * np.arange(-4, 5) if other != way]

    return Signal(MOMENT, np.asarray(lean @ along), code, "load", f"the overturning moment about {axis}", near=near)
