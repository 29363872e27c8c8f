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
from postproc.identify.cycles import GEAR, LOW, TEETH, sways, waves
from postproc.identify.felt import overturning, pulls
from postproc.identify.pairs import of_two
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
            found += of_two(first, channels[first], second, channels[second])
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
    found += [*_history(channels), *pulls(state, position), *overturning(state)]
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
