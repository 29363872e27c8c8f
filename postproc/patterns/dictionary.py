"""Free patterns of channels, one by one, two together and as the tool feels them, without a physical name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, blocks
from postproc.effects.contract import State
from postproc.patterns.change_points import breaks
from postproc.patterns.formula import Family, Part, Pattern, Single, members, raw_of, sharper, together, values_of
from postproc.patterns.harmonics import GEAR, LOW, TEETH, comes_again, sways, waves
from postproc.patterns.hysteresis_and_lag import lags, memories
from postproc.patterns.instrument_model import Sight, around
from postproc.patterns.levels import of_few, of_words, words
from postproc.patterns.pairs import of_two, swelling
from postproc.patterns.pattern_prior import APART, LOADED, odds, sort
from postproc.patterns.shapes import line, of_channel, of_signal
from postproc.patterns.signals import added, channel_signal, place_code
from postproc.patterns.tool_frame_forces import LEANS, overturning, pulls

CHUNK = 2048
"""Switches that are multiplied with a pattern at once."""
FEW, FEW_SHARE = 6, 0.05
"""Rows, and share of them, that a switch must take from what it switches, and leave it, to be one."""
SIDES: tuple[Callable[[Any], Any], ...] = (lambda g: g, lambda g: 1 - g, lambda g: 1 - 2 * g)
"""What a gate g makes of a pattern: it acts only there, only elsewhere, and there the other way round."""


@dataclass(frozen=True)
class Group:
    """Patterns that are tried together.

    Args:
        parts: patterns and families of them; kinds: how many there are of each kind.
    """

    parts: list[Part]
    kinds: Mapping[str, int]

    @cached_property
    def some(self) -> Family:
        return together(self.parts)

    @cached_property
    def values(self) -> Single:
        """(n, P)."""
        return values_of(self.some)

    @cached_property
    def odds(self) -> Array:
        """(P,) how many patterns at places stand beside each."""
        every = [members(part) for part in self.parts]
        return np.repeat([odds(some[0], self.kinds) for some in every], [len(some) for some in every])


@dataclass(frozen=True)
class Patterns:
    """Patterns that are tried, and what may switch one of them on.

    Args:
        parts: of one channel or two, alone or as families; gates: shapes of one channel that may stand for "only
            where"; slow: channels that are not the arm's.
    """

    parts: Sequence[Part]
    gates: Sequence[Pattern] = ()
    slow: frozenset[str] = frozenset()
    known: dict[str, Group] = field(default_factory=dict)

    @cached_property
    def every(self) -> Family:
        """All of them, one by one."""
        return together(self.parts)

    @cached_property
    def kinds(self) -> Mapping[str, int]:
        """How many patterns there are of each kind."""
        found = Counter[str]()
        for some in map(members, self.parts):
            found[some[0].kind] += len(some)
        return found

    @cached_property
    def lines(self) -> list[Pattern]:
        """What grows in proportion to a channel."""
        return [p for p in self.parts if isinstance(p, Pattern) and p.kind == "line"]

    def groups(self, where: str) -> Iterator[Group]:
        """Patterns at a place: the arm does not change what an instrument makes of its readings."""
        every = self.carried if where in LOADED else self.apart if where in APART else self.anywhere
        groups = (*([] if where == LEANS else [every]), self.only(where))
        return (group for group in groups if group.parts)

    def sensible(self, pattern: Pattern, where: str) -> bool:
        """Whether a pattern makes sense at a place: an instrument reads what it sees, and feels no load."""
        free = self.own if where in LOADED else self.slow
        anywhere = (
            pattern.where is None and where != LEANS and (where not in APART or free.issuperset(pattern.channels))
        )
        return anywhere or pattern.where == sort(where)

    @cached_property
    def own(self) -> frozenset[str]:
        """The table's own columns."""
        return self.slow - {"row", "session", "temperature", "time", "payload"}

    @cached_property
    def narrow(self) -> Mapping[str | None, list[Part]]:
        """Patterns with one size by where alone they make sense; those that do at every place by None."""
        found: dict[str | None, list[Part]] = {}
        for part in self.parts:
            if not _first(part).wide:
                found.setdefault(_first(part).where, []).append(part)
        return found

    @cached_property
    def anywhere(self) -> Group:
        """Patterns that make sense at every place."""
        return Group(self.narrow.get(None, []), self.kinds)

    @cached_property
    def apart(self) -> Group:
        """Those that do not follow the arm."""
        return Group([p for p in self.anywhere.parts if self.slow.issuperset(_first(p).channels)], self.kinds)

    @cached_property
    def carried(self) -> Group:
        """Those of the table's own columns: what is filled, unwound or changed has one."""
        return Group([p for p in self.apart.parts if self.own.issuperset(_first(p).channels)], self.kinds)

    def only(self, where: str) -> Group:
        """Patterns that make sense at a place alone, at every joint, or for every error of the instrument."""
        if where not in self.known:
            some = [p for here in dict.fromkeys([where, sort(where)]) for p in self.narrow.get(here, ())]
            self.known[where] = Group(some, self.kinds)
        return self.known[where]

    @cached_property
    def wide(self) -> list[Pattern]:
        """Patterns with several sizes."""
        return [p for p in self.parts if isinstance(p, Pattern) and p.wide]

    @cached_property
    def sizes(self) -> list[Pattern]:
        """What grows in proportion to a channel, from its middle or from nothing on."""
        some = [p for p in self.lines if p.channels != ("row",)]
        return [*some, *(line(p.signals[0]) for p in some if p.law(*(s.middle for s in p.signals)) == 0.0)]

    @cached_property
    def open(self) -> Single:
        """(n, gates) values of the gates."""
        return values_of(self.gates) if self.gates else np.zeros((0, 0), dtype=np.float32)

    @cached_property
    def switches(self) -> NDArray[np.int_]:
        """(G, 2) gates that are open in some rows and shut in others, and what each does there."""
        every = [(k, side) for k in _open_and_shut(self.open) for side in range(len(self.gates[k].gate))]
        return np.array(every, dtype=int).reshape(-1, 2)

    @cached_property
    def switching(self) -> NDArray[np.str_]:
        """(G,) channels of the switches."""
        return np.array([self.gates[k].channels[0] for k in self.switches[:, 0]])


def patterns(channels: Mapping[str, Array], state: State, position: Array, sight: Sight | None = None) -> Patterns:
    """All patterns of the channels of measured rows, and of where gravity and acceleration pull the tool.

    Args:
        channels: (n,) values by name; position: (n, 3) of the tool in base axes [m]; sight: the same
            as the instrument sees it.
    """
    place = place_code(state, position)
    signals = {name: channel_signal(name, values, place) for name, values in channels.items()}
    said = words(signals)
    signals = {name: s for name, s in signals.items() if name.partition("=")[0] not in said}
    # A row's number stands for a time that nobody wrote down: it has shapes, and leads nothing else.
    number = [signals.pop("row")] if "row" in signals else []
    single = [p for signal in signals.values() for p in of_channel(signal)]
    single += [p for column in said.values() for p in of_words(column)]
    single += [replace(p, gate=()) for signal in number for p in of_signal(signal)]
    found: list[Part] = [p for s in signals.values() if "channels[" in s.code for p in of_few(s)]
    found += [sways(signal) for signal in signals.values() if comes_again(signal)]
    for first, second in combinations(signals.values(), 2):
        found += of_two(first, second)
    angles = [s for s in signals.values() if s.name[0] == "q" and s.name[1:].isdigit()]
    for angle in angles:
        found.append(waves(angle, range(1, GEAR + 1)))
        # What is as fine as teeth and marks comes from a gear or an encoder, and both turn a joint.
        found.append(waves(angle, range(GEAR + 1, TEETH + 1)).times(partial(replace, where="joint")))
    slow = [s for s in signals.values() if s.name in ("temperature", "time", "payload") or "channels[" in s.code]
    others = [*slow, *(s for column in said.values() for s in column)]
    # What flows into a tank or off a drum weighs as much as there is of it.
    found += [replace(line(s), where="weight", gate=()) for s in slow if "channels[" in s.code]
    # What neighbouring joints turn together: linkages, and angles against gravity. Hoses are wound by joints far apart.
    sums = [added(pair, sign) for pair in combinations(angles, 2) for sign in "+-"]
    near = {f"{a.name} {sign} {b.name}" for a, b in pairwise(angles) for sign in "+-"}
    for turn in [*sums, *map(added, zip(angles, angles[1:], angles[2:], strict=False))]:
        close = turn.label in near or len(turn.names) > 2
        found += [waves(turn, LOW), *(p for p in breaks(turn) if close or p.kind == "kink")]
        found += [p for size in (slow if close else ()) for p in swelling(turn, size, LOW)]
    if {"x", "y"} <= set(signals):
        form = "grows with the square of the distance from joint 1"
        found.append(Pattern((signals["x"], signals["y"]), form, lambda x, y: x * x + y * y, "curve"))
    ordered = "time" in signals or bool(number)
    found += [
        *(memories(signals, state.session) if ordered else ()),
        *lags(signals),
        *pulls(state, position),
        *overturning(state, others),
    ]
    found += [*around(position, place), *(sight.patterns(others) if sight is not None else ())]
    apart = frozenset({"row", "session", *said, *(s.name for s in slow)})
    return Patterns([p for p in (*single, *found) if len(members(p))], [p for p in single if p.gate], apart)


def grown(pattern: Pattern, every: Patterns) -> Iterator[tuple[Single, list[tuple[Pattern, Pattern, int]]]]:
    """(n, G) values of a pattern, or a factor of it, where another channel switches it on, and what each is made of.

    In blocks: all at once are the largest array of a search.

    What is a switch itself may switch whatever grows with another channel: a clamp that gives under the payload.
    """
    for factor, channel in pattern.factors() if pattern.factors else ((pattern, ""),):
        names = {channel} if channel else {g.channels[0] for g in every.gates} - set(pattern.channels)
        use, there = np.flatnonzero(np.isin(every.switching, list(names))), factor.values.astype(np.float32)
        for gate, side in (every.switches[use[rows]].T for rows in blocks(len(use), CHUNK)):
            shut, opened = (np.array([of(x) for of in SIDES], dtype=np.float32)[side] for x in (0, 1))
            values = (shut + (opened - shut) * every.open[:, gate]) * there[:, None]
            yield values, [(factor, every.gates[k], s) for k, s in zip(gate.tolist(), side.tolist(), strict=True)]
    growing = [p for p in every.sizes if not set(pattern.channels).intersection(p.channels)]
    for side in range(len(pattern.gate) if growing else 0):
        there = SIDES[side](pattern.values.astype(np.float32))
        yield values_of(growing) * there[:, None], [(p, pattern, side) for p in growing]


def switched(pattern: Pattern, gate: Pattern, side: int) -> Pattern:
    """A pattern that acts only where a gate is open."""

    def through(gate: Pattern) -> Pattern:
        def law(*signals: Any) -> Any:
            return pattern.law(*signals[:-1]) * SIDES[side](gate.law(signals[-1]))

        return Pattern(
            (*pattern.signals, *gate.signals), f"{pattern.named} {gate.gate[side]}", law, at=gate.at, finer=finer(gate)
        )

    def finer(gate: Pattern) -> Callable[[], Family] | None:
        return None if gate.finer is None else lambda: together(map(every_through, sharper(gate).parts))

    def every_through(gates: Sequence[Pattern]) -> Family:
        """The same for all of some gates, which are said alike."""
        use = _open_and_shut(values_of(gates)) if len(gates[0].gate) > side else np.zeros(0, dtype=int)

        def raw() -> Array:
            return np.asarray(raw_of([pattern]) * SIDES[side](raw_of(gates)))

        return Family(len(gates), lambda k: through(gates[k]), raw).among(use)

    return through(gate)


def _first(part: Part) -> Pattern:
    return members(part)[0]


def _open_and_shut(values: Single) -> NDArray[np.intp]:
    """Gates (n, G) that more than a few rows have open, and more than a few have shut: chance makes one of any few."""
    few = max(FEW, FEW_SHARE * len(values))
    return np.flatnonzero(np.minimum((values > 0.5).sum(axis=0), (values < 0.5).sum(axis=0)) >= few)
