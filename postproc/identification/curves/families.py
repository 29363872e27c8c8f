"""Free curves of channels, one by one, two together and as the tool feels them, without a physical name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.sight import Site
from postproc.channels.state import State
from postproc.channels.units import recorded, shown
from postproc.diagnostics import joined
from postproc.effects.terms import LEANS, LOADED
from postproc.grouping import grouped
from postproc.identification.curves.derived import around, creeps, lags, memories, overturning, pulls, readings
from postproc.identification.curves.form import (
    Block,
    CurveForm,
    Group,
    Single,
    acting,
    block,
    is_angle,
    product_of,
    side_by_side,
    switching,
)
from postproc.identification.curves.functions import (
    GEAR,
    LINE,
    LOW,
    ORIGIN,
    SIDE,
    SIZE,
    SQUARE,
    TEETH,
    WAVE,
    breaks,
    fixed,
    level,
    line,
    may_settle,
    of_channel,
    of_signal,
    periods,
    resolved_orders,
    sways,
    waves,
)
from postproc.identification.curves.prior import APART, UNNAMED_LOG_PRIOR, odds, rarity, sort_of_place
from postproc.identification.curves.signal import TABLE, Signal, added, channel_signal
from postproc.measure.read.channels import MOST_LEVELS

SWAYED = ("q", "dir", "payload", "x", "y", "z")
"""Channels that may be the size of what comes again in time or along a column of the table's own."""


@dataclass(frozen=True)
class CurveForms:
    """CurveForms that are tried, and what may switch one of them on.

    Args:
        blocks: curves with one size each; wide: those with several sizes.
        gates: blocks of curves that may restrict another curve to where they are on.
        slow: channels that do not come from the arm's state: time, temperature, payload and the table's own columns.
    """

    blocks: Sequence[Block]
    wide: Sequence[CurveForm] = ()
    gates: Sequence[Block] = ()
    slow: frozenset[str] = frozenset()

    @cached_property
    def kinds(self) -> Mapping[str, float]:
        """Number of curves of each kind, by kind; those of the size of a signal count less (`rarity`)."""
        counts: dict[str, float] = {}
        for form, count in [*((p, 1) for p in self.wide), *((b.like, len(b)) for b in self.blocks)]:
            counts[form.kind] = counts.get(form.kind, 0.0) + count / rarity(form)
        return counts

    @cached_property
    def user_columns(self) -> frozenset[str]:
        """Names of the channels that are columns of the table which the program does not know."""
        return self.slow - TABLE

    @cached_property
    def every(self) -> Group:
        """All curves with one size, sorted by the only place where they make sense, then by what they follow.

        At one place those that follow the arm come first, then those that do not, last those of the table's own columns
        alone.
        """

        def order(some: Block) -> tuple[str, bool, bool]:
            """Return the sorting key of a block: place, then what it follows."""
            names = some.like.channels
            return some.like.where or "", self.slow.issuperset(names), self.user_columns.issuperset(names)

        return Group(sorted(self.blocks, key=order))

    @cached_property
    def runs(self) -> list[tuple[str | None, range]]:
        """Blocks of `every` by their numbers, with the only place where they make sense, place by place."""
        runs = [(b.like.where, k) for k, b in enumerate(self.every.blocks)]
        return [(only, range(ks[0], ks[-1] + 1)) for only, ks in grouped(runs).items()]

    def at(self, where: str) -> Iterator[tuple[slice, bool]]:
        """Yield (slice of `every`, whether it makes sense at any place) for the curves that make sense at a place."""
        blocks, ends = self.every.blocks, self.every.ends
        for only, some in self.runs:
            good: Sequence[int] = some if only == where or self.sensible(blocks[some[0]].like, where) else ()
            if only is None and where in APART:
                good = [k for k in some if self.sensible(blocks[k].like, where)]
            if good:
                yield slice(int(ends[good[0]]), int(ends[good[-1] + 1])), only is None

    def price(self, pattern: CurveForm) -> float:
        """Return 2 log of the prior odds against a curve at a place.

        All curves and places that are tried count, and `UNNAMED_LOG_PRIOR` for a curve without a physical name.
        """
        return 2 * float(np.log(odds(pattern, self.kinds))) + UNNAMED_LOG_PRIOR

    @cached_property
    def prices(self) -> Array:
        """(P,) price of each curve in `every`, 2 log of the prior odds against it."""
        return self.every.of_blocks(lambda b: self.price(b.like))

    @cached_property
    def lines(self) -> list[CurveForm]:
        """The curves that are proportional to a signal."""
        return [b[0] for b in self.blocks if b.like.kind == "line"]

    def sensible(self, pattern: CurveForm, where: str) -> bool:
        """Return whether a curve makes sense at a place, by name as in `suspects.places`.

        CurveForms of the arm's channels do not at an instrument or frame, which feels no load, unless they are made for
        it.
        """
        free = self.user_columns if where in LOADED else self.slow
        feels = where not in APART or free.issuperset(pattern.channels)
        return (feels and pattern.where is None and where != LEANS) or pattern.where == sort_of_place(where)

    @cached_property
    def sizes(self) -> Group:
        """CurveForms proportional to a channel, counted from its median and from zero, that a switch may multiply."""
        some = [p.signals[0] for p in self.lines if p.channels != ("row",) and p.where is None]
        return Group(line(s, origin) for s in some for origin in dict.fromkeys((s.middle, 0.0)))

    @cached_property
    def switches(self) -> tuple[Group, Single]:
        """All switches, and their values (n, G): factors that let a curve act only where a channel is in some range.

        Each of them is on in more than a few rows, and off in more than a few.
        """
        blocks = list[Block]()
        for some in self.gates:
            [(curve, signal)] = some.like.factors
            sides = range(3 if len(curve.gate) > 1 else 1)
            blocks += [acting(block(switching(curve, side), signal, some.numbers, some.like.kind)) for side in sides]
        group = Group(blocks)
        return group, group.values

    def grown(self, pattern: CurveForm) -> Iterator[tuple[Single, Callable[[int], CurveForm]]]:
        """Yield (values (n, G), which returns the k-th of G curves): a curve, or one of its factors, times switches.

        The switches are those of other channels; of a product of two, each factor is switched by the channel of the
        other. A curve that may itself be a switch is also multiplied by what is proportional to another channel: a
        clamp gives under a load.
        """
        switches, values = self.switches
        ends = switches.ends
        for one, other in _factors(pattern):
            kept = [
                k for k, b in enumerate(switches.blocks)
                if (b.like.channels[0] == other if other else b.like.channels[0] not in pattern.channels)
            ]  # fmt: skip
            if kept:
                columns = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in kept])
                of_columns = partial(_switched, one, switches, columns)
                yield values[:, columns] * one.values.astype(np.float32)[:, None], of_columns
        if len(pattern.factors) == 1 and pattern.factors[0][0].gate:
            [(curve, signal)] = pattern.factors
            sizes = self.sizes
            apart = [set(pattern.channels).isdisjoint(b.like.channels) for b in sizes.blocks]
            columns = np.flatnonzero(np.repeat(apart, [len(b) for b in sizes.blocks]))
            for side in range(3 if len(curve.gate) > 1 else 1) if len(columns) else ():
                gate = replace(pattern, factors=((switching(curve, side), signal),))
                yield (
                    sizes.values[:, columns] * gate.raw.astype(np.float32)[:, None],
                    partial(_gated, gate, sizes, columns),
                )


def _switched(one: CurveForm, switches: Group, columns: NDArray[np.intp], k: int) -> CurveForm:
    """Return the product of a curve with a switch, the k-th of some, which says where another channel lets it act."""
    switch = switches[int(columns[k])]
    return replace(one, factors=one.factors + switch.factors, numbers=one.numbers + switch.numbers, level=0)


def _gated(gate: CurveForm, sizes: Group, columns: NDArray[np.intp], k: int) -> CurveForm:
    """Return the product of what is proportional to a channel, the k-th of some, with a gate."""
    size = sizes[int(columns[k])]
    factors, numbers = size.factors + gate.factors, size.numbers + gate.numbers
    return replace(size, factors=factors, numbers=numbers, kind=gate.kind, where=gate.where)


def _factors(pattern: CurveForm) -> Iterator[tuple[CurveForm, str]]:
    """Yield (part of a curve, channel that may switch that part).

    A curve of one factor comes whole with "", for any channel but its own. Of a product of two, each factor comes
    with the channel of the other one.
    """
    if len(pattern.factors) == 1:
        yield pattern, ""
    elif len(pattern.factors) == 2:
        for k, (curve, signal, numbers) in enumerate(pattern.each):
            plain = LINE if curve.kind == "line" else curve
            yield replace(pattern, factors=((plain, signal),), numbers=numbers), pattern.factors[1 - k][1].leading


def curve_forms(state: State, site: Site, seen: bool = True) -> CurveForms:
    """Return all curves to try on measured rows: of channels, of forces on tool and footing, and of the rows before.

    Args:
        state: of the rows, with poses and loads filled in; site: where the measured point and the instrument are.
        seen: whether an instrument sees the point, so that curves may follow its readings.
    """
    channels = recorded(state, site)
    signals = {name: channel_signal(name, values, state) for name, values in channels.items()}
    word_columns = words(signals)
    signals = {name: s for name, s in signals.items() if name.partition("=")[0] not in word_columns}
    # A row's number stands for a time that nobody wrote down: it has shapes, and leads nothing else.
    number = [signals.pop("row")] if "row" in signals else []
    every = list(signals.values())
    single = [b for s in every for b in of_channel(s)]
    single += [b for column in word_columns.values() for b in of_words(column)]
    blocks = [*single, *(b for s in number for b in of_signal(s)), *(sways(s) for s in every if may_settle(s))]
    for first, second in combinations(every, 2):
        blocks += of_two(first, second)
    slow = [s for s in every if s.leading in ("temperature", "time", "payload") or s.column]
    others = [*slow, *(s for column in word_columns.values() for s in column)]
    blocks += of_angles([s for s in every if s.leading[0] == "q" and s.leading[1:].isdigit()], slow)
    # What flows into a tank or off a drum weighs as much as there is of it.
    blocks += [line(s).with_(where="weight") for s in slow if s.column]
    if {"x", "y"} <= set(signals):
        x, y = signals["x"], signals["y"]
        away = Signal(("x", "y"), np.hypot(x.values, y.values), "radius", "x", "the distance from joint 1")
        blocks.append(block(SQUARE, away))
    if "time" in signals or number:
        blocks += memories(signals, state.session)
    blocks += [*lags(signals), *creeps(signals), *pulls(state, site)]
    blocks += () if state.touches else around(state, site)
    blocks += readings(state, site, others) if seen and not state.touches else ()
    leaning, wide = overturning(state, others)
    wide = [*wide, *(p for s in every if s.column for p in each_level(s))]
    wide += [p for column in word_columns.values() for p in each_word(column)]
    gates = [b for b in single if len(b) and b.like.factors[0][0].gate]
    apart = frozenset({"row", "session", *word_columns, *(s.leading for s in slow)})
    return CurveForms([b for b in (*blocks, *leaning) if len(b)], wide, gates, apart)


def of_angles(angles: Sequence[Signal], slow: Sequence[Signal]) -> Iterator[Block]:
    """Yield waves of angles and of sums of two or three of them, and steps and kinks of these sums.

    Sums of neighbouring joints stand for linkages and for angles against gravity; the sums of joints far apart only for
    the winding of hoses (kinks).

    Args:
        angles: of the joints, in their order.
        slow: signals that do not come from the arm's state, to which the amplitude of a wave may be proportional.
    """
    for angle in angles:
        yield waves(angle, range(1, GEAR + 1))
        # What is as fine as teeth and marks comes from a gear or an encoder, and both turn a joint.
        yield waves(angle, range(GEAR + 1, TEETH + 1)).with_(where="joint")
    sums = [added(pair, sign) for pair in combinations(angles, 2) for sign in "+-"]
    near = [a.channels + b.channels for a, b in pairwise(angles)]
    for turn in [*sums, *map(added, zip(angles, angles[1:], angles[2:], strict=False))]:
        close = turn.channels in near or len(turn.channels) > 2
        yield waves(turn, LOW)
        yield from (b for b in breaks(turn) if close or b.like.kind == "kink")
        for size in slow if close else ():
            yield from swelling(turn, size, LOW)


def of_two(first: Signal, second: Signal) -> Iterator[Block]:
    """Yield products of two signals: line by line, wave by wave, and waves of one with the other as amplitude."""
    for a, b in ((0.0, 0.0), (float(first.values.mean()), float(second.values.mean()))):
        yield product_of(line(first, a), line(second, b), "product")
    if first.leading[0] == second.leading[0] == "q":
        yield product_of(_quarters(first, LOW), _quarters(second, LOW), "product of waves")
    elif first.leading[0] == "q" and second.leading not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        yield from swelling(first, second, range(1, GEAR + 1))
    for side, size in ((first, second), (second, first)):
        if may_settle(side) and size.leading.rstrip("123456") in SWAYED:
            yield from swelling(side, size, periods(side))
        if side.leading.startswith(("dir", "v")) and size.leading.startswith("load"):
            yield product_of(block(SIDE, side), block(SIZE, size), "product")


def swelling(angle: Signal, size: Signal, orders: Iterable[float]) -> Iterator[Block]:
    """Yield waves of one signal whose amplitude is proportional to another signal.

    Waves of low order may act at any place, those of a higher order (a gear's) at the joint of the angle alone.

    Args:
        angle: an angle, a sum of angles, or another signal that repeats, such as time.
        size: what the amplitude follows; orders: of the waves [rad per unit of the angle].
    """
    middle, every = float(size.values.mean()), list(orders)
    kind = "swelling wave" if is_angle(angle) else "swelling sway"
    low = [order for order in every if order <= max(LOW) or not is_angle(angle)]
    # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
    for origin in (0.0, middle) if abs(middle) > 0.3 * size.values.std() else (0.0,):
        for where, some in ((None, low), (f"joint {angle.leading[1:]}", every[len(low) :])):
            yield product_of(line(size, origin), _quarters(angle, some), kind, where)


def _quarters(signal: Signal, orders: Iterable[float]) -> Block:
    """Return the cosine and the sine of a signal at every order that its measured values can tell from lower ones."""
    return block(WAVE, signal, [(k, p) for k in resolved_orders(signal, orders) for p in (0.0, np.pi / 2)])


def words(signals: Mapping[str, Signal]) -> dict[str, list[Signal]]:
    """Return the columns of words in a table, by name: one signal per word, 1 where the word stands and 0 elsewhere.

    They are channels with names such as ``shift=night``. Empty cells count as one more word, labelled ``empty``.

    Args:
        signals: of all channels, by name.
    """
    columns: dict[str, list[Signal]] = {}
    for name, signal in signals.items():
        column, sign, word = name.partition("=")
        if sign and set(signal.distinct) <= {0.0, 1.0}:
            columns.setdefault(column, []).append(replace(signal, channels=(column,), unit="", label=word))
    for some in columns.values():
        if (nothing := 1 - np.sum([s.values for s in some], axis=0)).any():
            name = " - ".join(["1", *(s.name for s in some)])
            some.append(replace(some[0], values=nothing, name=name, label="empty"))
    return columns


def of_words(column: Sequence[Signal]) -> Iterator[Block]:
    """Yield for each word of a column the curve that is 1 where the word stands; of two words only the first.

    Args:
        column: one signal per word (`words`).
    """
    for signal in column[:1] if len(column) == 2 else column:
        sentence = f"where {signal.leading} is {signal.label}"
        word = fixed("line", sentence, "level", sentence, gate=signal.label, numbers=ORIGIN)
        yield block(word, replace(signal, label=signal.leading))


def each_word(column: Sequence[Signal]) -> Iterator[CurveForm]:
    """Yield one curve with a shift for every word of a column of at least three; the shift of the first word is zero.

    Args:
        column: one signal per word (`words`).
    """
    if len(column) > 2:
        sentence = f"another value at each of {joined([s.label for s in column])}"
        yield side_by_side((block(LINE, s)[0] for s in column[1:]), sentence, "levels")


def each_level(signal: Signal) -> Iterator[CurveForm]:
    """Yield one curve with a shift for each value of a signal of 3 to `MOST_LEVELS` values, all of them repeated.

    The shift of the lowest value is zero.
    """
    distinct, count = np.unique(signal.values, return_counts=True)
    if 2 < len(distinct) <= MOST_LEVELS and count.min() > 1:
        sentence = f"another value at each of {joined([shown(signal.unit, float(v)) for v in distinct])}"
        near = 0.5 * float(np.diff(distinct).min())
        some = (block(level(signal, [float(v)], near), signal)[0] for v in distinct[1:])
        yield side_by_side(some, sentence, "levels")
