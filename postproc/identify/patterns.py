"""Free patterns of channels, one by one, two together and as the tool feels them, without a physical name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.effects.geometry import distal_point, point_acceleration
from postproc.identify.channels import varies
from postproc.identify.cycles import EIGHTHS, GEAR, LOW, TEETH, sways, waves
from postproc.identify.shapes import Pattern, breaks, of_channel, of_size, of_sum, renamed, sharper, unit

PLACES = 17
"""Joints, base, instrument, tool, and four bodies that turn or shift."""
Single = NDArray[np.float32]
SIDES = ((0, 1), (1, -1), (1, -2))
"""What a gate makes of a pattern, a + b g: it acts only there, only elsewhere, and there the other way round."""


@dataclass(frozen=True)
class Group:
    """Patterns that are tried together."""

    some: list[Pattern]
    kinds: Mapping[str, int]

    @cached_property
    def values(self) -> Single:
        """(n, P), in single precision: screening many takes half the time."""
        return np.array([p.values for p in self.some], dtype=np.float32).T

    @cached_property
    def odds(self) -> Array:
        """(P,) how many patterns at places stand beside each."""
        return np.array([odds(p, self.kinds) for p in self.some], dtype=float)


def odds(pattern: Pattern, kinds: Mapping[str, int]) -> float:
    """How many patterns at places stand beside one.

    Every kind is as likely, in it every one of its kind, and of those every place where it makes sense.

    Args:
        kinds: how many patterns there are of each kind.
    """
    rooms = {None: PLACES, "joint": 6}.get(pattern.where, 1)
    return len(kinds) * kinds.get(pattern.kind, 1) * pattern.tries * rooms


@dataclass(frozen=True)
class Patterns:
    """Patterns that are tried, and what may switch one of them on.

    Args:
        every: of one channel or two; gates: shapes of one channel that may stand for "only where".
    """

    every: Sequence[Pattern]
    gates: Sequence[Pattern] = ()
    known: dict[str, Group] = field(default_factory=dict)

    @cached_property
    def kinds(self) -> Mapping[str, int]:
        """How many patterns there are of each kind."""
        return Counter(p.kind for p in self.every)

    @cached_property
    def anywhere(self) -> Group:
        """Patterns that make sense at every place."""
        return Group([p for p in self.every if p.where is None], self.kinds)

    def only(self, where: str) -> Group:
        """Patterns that make sense at a place alone, or at every joint."""
        if where not in self.known:
            some = [p for p in self.every if p.where in (where, where.rstrip(" 123456"))]
            self.known[where] = Group(some, self.kinds)
        return self.known[where]

    @cached_property
    def switches(self) -> list[tuple[Pattern, int, Array]]:
        """Gates, what they do there, and (n,) values."""
        return [(g, side, g.values * b + a) for g in self.gates for side, (a, b) in enumerate(SIDES[: len(g.gate)])]

    @cached_property
    def switched(self) -> Single:
        """(n, G) values of the switches."""
        return np.array([values for _, _, values in self.switches], dtype=np.float32).T


def patterns(channels: Mapping[str, Array], state: State, position: Array) -> Patterns:
    """All patterns of the channels of measured rows, and of where gravity and acceleration pull the tool.

    Args:
        channels: (n,) values by name; position: (n, 3) of the tool in base axes [m].
    """
    single: list[Pattern] = []
    found: list[Pattern] = []
    for name, values in channels.items():
        single += [*of_channel(name, values), *of_size(name, values)]
        if name == "time":
            found += sways(values)
    names = list(channels)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            found += _of_two(first, channels[first], second, channels[second])
    angles = [name for name in names if name[0] == "q" and name[1:].isdigit()]
    for name in angles:
        found += waves(name, channels[name], range(1, GEAR + 1))
        # What is as fine as teeth and marks comes from a gear or an encoder, and both turn a joint.
        found += (replace(p, where="joint") for p in waves(name, channels[name], range(GEAR + 1, TEETH + 1)))
    for a, b in pairwise(angles):
        found += _of_sum((a, b), f"{a} + {b}", channels[a] + channels[b])
        found += _of_sum((a, b), f"{a} - {b}", channels[a] - channels[b])
    for a, b, c in zip(angles, angles[1:], angles[2:], strict=False):
        found += _of_sum((a, b, c), f"{a} + {b} + {c}", channels[a] + channels[b] + channels[c])
    if {"x", "y"} <= set(names):
        x, y = channels["x"], channels["y"]
        form = "grows with the square of the distance from joint 1"
        found.append(Pattern(("x", "y"), form, unit(x**2 + y**2), "curve"))
    found += [*_history(channels), *_pulls(state, position), *_overturning(state)]
    return Patterns([*single, *found], [p for p in single if p.gate])


def grown(pattern: Pattern, every: Patterns) -> tuple[Single, list[tuple[Pattern, Pattern, int]]]:
    """(n, G) values of a pattern, or of a factor of it, where another channel switches it on; and what they are."""
    some: list[tuple[Pattern, Pattern, int]] = []
    values = []
    for factor, channel in pattern.factors() if pattern.factors else ((pattern, ""),):
        names = {channel} if channel else {g.channels[0] for g in every.gates} - set(pattern.channels)
        use = [k for k, (gate, _, _) in enumerate(every.switches) if gate.channels[0] in names]
        values.append(every.switched[:, use] * np.asarray(factor.values, dtype=np.float32)[:, None])
        some += [(factor, *every.switches[k][:2]) for k in use]
    return np.hstack(values), some


def switched(pattern: Pattern, gate: Pattern, side: int) -> Pattern:
    """A pattern that acts only where a gate is open."""
    name, text = pattern.channels[0], pattern.text
    label = name if pattern.kind == "line" else text if len(pattern.channels) > 1 else f"{text} of {name}"

    def through(gate: Pattern) -> Pattern:
        channel = gate.channels[0]
        value = unit(pattern.values * (SIDES[side][0] + SIDES[side][1] * gate.values))
        form = f"{label} {gate.gate[side].replace('{0}', channel)}"
        return Pattern((*pattern.channels, channel), form, value, "", gate.at, gate.of, finer=finer(gate))

    def finer(gate: Pattern) -> Callable[[], list[Pattern]] | None:
        if gate.finer is None:
            return None
        return lambda: [through(g) for g in sharper(gate) if len(g.gate) > side]

    return through(gate)


def _of_two(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    text = f"{first} times {second}"
    names = (first, second)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        return (_line(first, a), second), (_line(second, b), first)

    yield Pattern(names, text, unit(a * b), "product", factors=factors)
    yield Pattern(names, text, unit((a - a.mean()) * (b - b.mean())), "product", factors=factors)
    if first[0] == second[0] == "q":
        for k in LOW:
            for j in LOW:
                for f, g in ((np.sin, np.sin), (np.sin, np.cos), (np.cos, np.sin), (np.cos, np.cos)):
                    form = f"wave of {first}, {k} times a turn, times one of {second}, {j} times a turn"
                    yield Pattern(names, form, f(k * a) * g(j * b), "product of waves")
    elif first[0] == "q" and second not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
        sizes = (b, b - b.mean()) if abs(b.mean()) > 0.3 * b.std() else (b,)
        for k in range(1, GEAR + 1):
            for phase in (0.0, np.pi / 2):
                for size in sizes:
                    yield _swelling(names, a, unit(size), k, phase)
    for sign, size, order in ((a, b, names), (b, a, names[::-1])):
        if order[0].startswith(("dir", "v")) and order[1].startswith("load"):
            value = unit(np.sign(sign) * np.abs(size))
            yield Pattern(order, f"side of {order[0]} times size of {order[1]}", value, "product")


def _swelling(names: tuple[str, str], angle: Array, size: Array, order: float, phase: float) -> Pattern:
    """A wave of an angle whose size is another channel: low ones anywhere, a gear's lines at its own joint."""
    where = None if order <= max(LOW) else f"joint {names[0][1:]}"

    def finer() -> list[Pattern]:
        # Less than a wave a turn is hardly more than the other channel alone.
        orders = np.arange(1.0, 4.01, 0.25) if where is None else order + 0.25 * np.arange(-2, 3)
        some = [_swelling(names, angle, size, k, p) for k in orders for p in EIGHTHS]
        return [replace(p, where=where, finer=None) for p in some]

    value = np.asarray(np.cos(order * angle - phase), dtype=np.float64)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        wave = Pattern(names[:1], f"wave {order:.3g} times a turn", value, "wave")
        return (wave, names[1]), (_line(names[1], size), names[0])

    text, kind = f"{names[1]} times a wave of {names[0]}, {order:.3g} times a turn", "swelling wave"
    return Pattern(names, text, value * size, kind, where=where, finer=finer, factors=factors)


def _line(name: str, values: Array) -> Pattern:
    return Pattern((name,), "proportional", unit(values), "line")


def _of_sum(names: tuple[str, ...], label: str, values: Array) -> Iterator[Pattern]:
    """Shapes of what neighbouring joints turn together: linkages, and angles against gravity."""
    for pattern in (*breaks(label, values), *waves(label, values, LOW)):
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
        yield Pattern((name,), "whether it rose or fell since the row before", np.sign(way), "way")
        yield Pattern((name,), "by how much it rose since the row before", unit(way), "way")
        yield Pattern((name,), "by how much it rose or fell since the row before", unit(np.abs(way)), "way")
        if name == "payload" or name[0] == "q":
            cycles = waves(name, before, LOW) if name[0] == "q" else ()
            for pattern in (*of_channel(name, before), *cycles):
                yield replace(renamed(pattern, " in the row before", (name,)), kind="before", gate=())


def _pulls(state: State, position: Array) -> Iterator[Pattern]:
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
    form = f"{what}, about {np.degrees(way):.0f} deg from x"
    return Pattern(("q1", "load2", "y", "x"), form, value, "leaning", where="base", finer=finer)
