"""A curve: a product of functions of signals, with its sentence, its values and its terms in the effect `curve`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from postproc.arrays import Array
from postproc.channels.expression import Channel, channel
from postproc.channels.units import shown, within
from postproc.effects.terms import GATES, law_of
from postproc.identification.curves.signal import Signal, unit

Single = NDArray[np.float32]
Edge = tuple[float, float]
"""Between which values a number of a curve lies."""


@dataclass(frozen=True, eq=False)
class SignalFunction:
    """A function of one signal that a few numbers form.

    Args:
        basis: name of the function (`effects.terms`), with a gate before it in a switch; sentence: its description, a
            template (`SignalFunction.words`).
        kind: curves of one kind are together as likely as those of any other, however many there are.
        numbers: the kind of each number that is searched: edge, knot, width (half of it), reach, order, phase, start or
            duty.
        fixed: numbers of the function before those.
        noun: its description as a factor of a product.
        gate: in words, where it is on and where it is off, if it may restrict another curve to there.
        switch: the curve, and the side, of a curve that `switching` has made.
        derived: for a curve whose one number derives its channel: the function (`play`), the number's unit, and
            f(x, number) of the signal's values.
    """

    basis: str
    sentence: str
    kind: str
    numbers: tuple[str, ...] = ()
    noun: str = ""
    gate: tuple[str, ...] = ()
    switch: tuple[SignalFunction, int] | None = None
    fixed: tuple[float, ...] = ()
    derived: tuple[str, str, Callable[..., Any]] | None = None

    def law(self, x: Any, *numbers: Any) -> Any:
        """Return the curve of the signal's values (n,), or (P, n) of P curves for numbers (P, 1)."""
        if self.derived is not None:
            return self.derived[2](x, *numbers)
        return law_of(self.basis)(x, *self.fixed, *numbers)

    def factor(self, signal: Signal, numbers: Sequence[float]) -> tuple[str, str, tuple[float, ...]]:
        """Return channel, function and its numbers as a term of the effect `curve` has them."""
        if self.derived is None:
            return signal.name, self.basis, (*self.fixed, *numbers)
        head, unit_name, _ = self.derived
        return Channel(head, (channel(signal.name),), float(numbers[0]), unit_name).name, "line", (0.0,)

    def gaps(self, signal: Signal, numbers: Sequence[float]) -> list[float]:
        """Return for each number of `factor` how far apart the measured values are between which an edge lies, or 0."""
        if self.derived is not None:
            return [0.0]
        spans = (span_of(signal, kind, [x]) for kind, x in zip(self.numbers, numbers, strict=True))
        edges = [high - low if kind == "edge" else 0.0 for kind, (low, high) in zip(self.numbers, spans, strict=True)]
        return [*([0.0] * len(self.fixed)), *edges]

    def words(self, template: str, signal: Signal, numbers: Sequence[float], spans: Sequence[Edge]) -> str:
        """Return a template filled with the words for a signal and the numbers of this curve.

        Args:
            template: with `{n0}`, `{n1}` .. for the numbers, `{of}`, `{label}` and `{name}` for the signal; for waves
                with `{each}` for the period, `{verb}` before it, `{at}` for a crest and `{end}` for the end of a pulse.
            spans: lowest and highest value of each number, shown as a value with its uncertainty.
        """
        words = {f"n{k}": within(signal.unit, *span) for k, span in enumerate(spans)}
        if "order" in self.numbers:
            order, share = numbers[0], numbers[1] / (2 * np.pi if self.numbers[1] == "phase" else 1.0)
            words["each"], words["verb"] = repetition(signal, order), "swaying" if signal.leading == "time" else "wave"
            words["at"] = shown(signal.unit, wave_place(signal, order, share))
            if len(numbers) > 2:
                words["end"] = shown(signal.unit, wave_place(signal, order, share) + numbers[2] * 2 * np.pi / order)
        return template.format(of=signal.of, label=signal.label, name=signal.leading, **words)


def is_angle(signal: Signal) -> bool:
    """Return whether a signal has the unit of a joint angle, so that its waves are counted per turn."""
    return signal.unit.rstrip("123456") == "q"


def repetition(signal: Signal, order: float) -> str:
    """Return in words how often a wave repeats: ``3 times a turn`` of an angle, else ``with a period of 20 s``.

    Args:
        order: angular frequency of the wave [rad per unit of the signal].
    """
    return (
        f"{order:.3g} times a turn" if is_angle(signal) else f"with a period of {shown(signal.unit, 2 * np.pi / order)}"
    )


def wave_place(signal: Signal, order: float, share: float) -> float:
    """Return where, next to the signal's median, a wave has passed a given share of its period, in the signal's unit.

    Args:
        order: angular frequency of the wave [rad per unit of the signal].
        share: of a period, counted from the signal's zero.
    """
    period = 2 * np.pi / order
    return (share + round(signal.middle / period - share)) * period


def span_of(signal: Signal, kind: str, numbers: Iterable[float]) -> Edge:
    """Return the lowest and highest value that several estimates of one number of a curve leave open.

    An edge lies anywhere between the measured values beside it, and a width is doubled (to a whole width).

    Args:
        kind: of the number, as in `SignalFunction`; numbers: the estimates, in the signal's unit.
    """
    low, high = min(numbers := list(numbers)), max(numbers)
    if kind == "edge":
        at = np.searchsorted(signal.distinct, (low, high)).clip(1, len(signal.distinct) - 1)
        return float(signal.distinct[at[0] - 1]), float(signal.distinct[at[1]])
    return (2 * low, 2 * high) if kind == "width" else (low, high)


@dataclass(frozen=True, eq=False)
class CurveForm:
    """A product of functions of signals, without a physical unit.

    Args:
        factors: functions, each with its signal; numbers: of all of them, one after another.
        kind: for the prior odds; where: the only place at which it makes sense, None for all.
        tries: by how many times the curves of its kind are multiplied by a further search.
        level: how often its numbers were refined.
        parts: curves side by side, each with a size of its own, instead of factors, such as a shift for each level.
        sentence: description of these parts.
    """

    factors: tuple[tuple[SignalFunction, Signal], ...]
    numbers: tuple[float, ...] = ()
    kind: str = ""
    where: str | None = None
    tries: float = 1.0
    level: int = 0
    parts: tuple[CurveForm, ...] = ()
    sentence: str = ""

    @property
    def wide(self) -> bool:
        """Whether it consists of several parts side by side, each with a size of its own."""
        return bool(self.parts)

    @cached_property
    def signals(self) -> tuple[Signal, ...]:
        """The signals of its factors, or of all its parts, each once."""
        signals = dict.fromkeys(s for p in self.parts for s in p.signals)
        return tuple(signals) if self.parts else tuple(s for _, s in self.factors)

    @cached_property
    def each(self) -> list[tuple[SignalFunction, Signal, tuple[float, ...]]]:
        """Its factors as (function, signal, its numbers)."""
        numbers, factors = list(self.numbers), []
        for curve, signal in self.factors:
            taken, numbers = tuple(numbers[: len(curve.numbers)]), numbers[len(curve.numbers) :]
            factors.append((curve, signal, taken))
        return factors

    @cached_property
    def raw(self) -> Array:
        """(n,) product of its functions in every row, or (n, k) for k parts side by side; not normalized."""
        if self.parts:
            return np.stack([p.raw for p in self.parts], axis=1)
        return np.asarray(reduce(mul, (c.law(s.values, *numbers) for c, s, numbers in self.each)), dtype=float)

    @cached_property
    def values(self) -> Array:
        """(n,) or (n, k) values divided by their largest absolute value, over all parts together."""
        return unit(self.raw)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it follows, each once: the leading one of every signal first, then the others."""
        most = max(len(s.channels) for s in self.signals)
        return tuple(dict.fromkeys(s.channels[k] for k in range(most) for s in self.signals if k < len(s.channels)))

    @property
    def factors_of_terms(self) -> list[tuple[list[tuple[str, str, tuple[float, ...]]], tuple[float, ...]]]:
        """Of each of its parts channel, function and numbers of every factor, and the numbers' gaps (`curve`)."""
        every = (part.each for part in self.parts or (self,))
        return [
            ([c.factor(s, x) for c, s, x in each], tuple(g for c, s, x in each for g in c.gaps(s, x))) for each in every
        ]

    @property
    def text(self) -> str:
        """Description of the curve in words, without other curves to widen its numbers."""
        return self.sentence_with()

    def sentence_with(self, limits: Sequence[Edge] = ()) -> str:
        """Return the curve in words, its numbers with the range that the rows leave open.

        Args:
            limits: lowest and highest value of each number; by default they are told without a range.
        """
        if self.sentence:
            return self.sentence
        sentence, left = "", list(limits) or [(x, x) for x in self.numbers]
        for curve, signal, numbers in self.each:
            ranges, left = left[: len(numbers)], left[len(numbers) :]
            # To either side as far as to the farther: the number that is told is that of the model.
            reach = [max(high - x, x - low) for x, (low, high) in zip(numbers, ranges, strict=True)]
            every = zip(curve.numbers, numbers, reach, strict=True)
            spans = [span_of(signal, kind, (x - r, x + r)) for kind, x, r in every]
            noun = curve.noun or (curve.sentence if signal.of else curve.sentence + " of {label}")
            word = curve.words(curve.sentence if len(self.factors) == 1 else noun, signal, numbers, spans)
            sentence += (" " if curve.switch else " times ") * bool(sentence) + word
        return sentence


def switching(curve: SignalFunction, side: int) -> SignalFunction:
    """Return the curve that restricts a curve by multiplication with one side of a gate, ``only where ..`` in words.

    Args:
        curve: a gate: 0, 1 or between over its signal.
        side: 0 acts where the gate is on, 1 where it is off, 2 everywhere, with the other sign where it is on.
    """
    only, other = "only where {label} is ", "the other way where {label} is "
    sentence = other + curve.gate[0] if side == 2 else only + curve.gate[side]
    basis = f"{tuple(GATES)[side]} {curve.basis}"
    return replace(curve, basis=basis, sentence=sentence, noun=sentence, switch=(curve, side))


FEW, FEW_SHARE = 6, 0.05
"""Rows, and share of them, that a switch must take from what it switches, and leave it, to be one."""


@dataclass(frozen=True, eq=False)
class Block:
    """P curves that differ only in their K numbers each; their values are computed at once.

    Args:
        like: the curve, whatever its numbers; numbers: (P, K).
    """

    like: CurveForm
    numbers: Array

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, at: int) -> CurveForm:
        return replace(self.like, numbers=tuple(self.numbers[at].tolist()))

    def __iter__(self) -> Iterator[CurveForm]:
        return map(self.__getitem__, range(len(self)))

    def with_(self, **changes: Any) -> Block:
        """Return the block with some fields of its curve (`CurveForm`) changed, such as ``kind`` or ``where``."""
        return replace(self, like=replace(self.like, **changes))

    @property
    def raw(self) -> Array:
        """(P, n) product of the curves of every curve in every row, not normalized."""
        product: Any = np.float32(1.0)
        numbers = self.numbers.T[:, :, None]
        for curve, signal in self.like.factors:
            product = product * curve.law(signal.values, *numbers[: len(curve.numbers)])
            numbers = numbers[len(curve.numbers) :]
        return np.broadcast_to(product, (len(self), len(signal.values)))


def block(
    curve: SignalFunction,
    signal: Signal,
    numbers: Iterable[Sequence[float]] | Array = ((),),
    kind: str = "",
    where: str | None = None,
) -> Block:
    """Return the curves of one curve of one signal that differ in the curve's numbers.

    Args:
        numbers: one row of numbers for each curve; a single curve without numbers by default.
        kind: for the prior odds, the curve's by default; where: the only place at which they make sense, None for all.
    """
    every = numbers if isinstance(numbers, np.ndarray) else np.array([tuple(some) for some in numbers], dtype=float)
    like = CurveForm(((curve, signal),), kind=kind or curve.kind, where=where)
    return Block(like, every.reshape(len(every), len(curve.numbers)))


def grid(*axes: ArrayLike) -> Array:
    """Return (P, K) every combination of the values of K numbers, those of the last one fastest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes)).astype(float)


def product_of(first: Block, second: Block, kind: str, where: str | None = None) -> Block:
    """Return the products of every curve of one block with every one of another: len(first) * len(second) curves.

    Args:
        kind: for the prior odds; where: the only place at which they make sense, None for all.
    """
    i, j = (index.ravel() for index in np.indices((len(first), len(second))))
    like = replace(first.like, factors=first.like.factors + second.like.factors, kind=kind, where=where)
    return Block(like, np.hstack([first.numbers[i], second.numbers[j]]))


class Group:
    """The curves of several blocks, one block after another."""

    def __init__(self, blocks: Iterable[Block]) -> None:
        self.blocks = [b for b in blocks if len(b)]
        self.ends = np.cumsum([0, *map(len, self.blocks)])

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __getitem__(self, at: int) -> CurveForm:
        which = int(self.block_of(at))
        return self.blocks[which][at - int(self.ends[which])]

    def block_of(self, at: ArrayLike) -> NDArray[np.intp]:
        """Return the index of the block of each curve, by its number."""
        return np.asarray(np.searchsorted(self.ends, at, side="right") - 1)

    def __iter__(self) -> Iterator[CurveForm]:
        return (pattern for some in self.blocks for pattern in some)

    @cached_property
    def values(self) -> Single:
        """(n, P) values of all curves, each divided by its largest absolute value, in single precision for speed."""
        rows = len(self.blocks[0].like.factors[0][1].values) if self.blocks else 0
        raw = np.empty((len(self), rows), dtype=np.float32)
        for some, first in zip(self.blocks, self.ends, strict=False):
            raw[first : first + len(some)] = some.raw
        most = np.maximum(raw.max(axis=1, keepdims=True), -raw.min(axis=1, keepdims=True)) if len(self) else raw
        return np.divide(raw, np.maximum(most, 1e-30), out=raw).T

    def of_blocks(self, measure: Callable[[Block], float]) -> Array:
        """Return (P,) for every curve the number that a function ``measure`` gives for its block."""
        return np.repeat([measure(b) for b in self.blocks], [len(b) for b in self.blocks])


def side_by_side(some: Iterable[CurveForm], sentence: str, kind: str, where: str | None = None) -> CurveForm:
    """Return one curve whose parts each have a size of their own in a fit.

    Args:
        some: the parts; sentence: what the whole is called in reports; kind: for the prior odds.
        where: the only place at which it makes sense, None for all.
    """
    return CurveForm((), kind=kind, where=where, parts=tuple(some), sentence=sentence)


def times_form(moves: Array, values: Array) -> Array:
    """Return the moves of a place multiplied by the values of a curve, (n, r, m k).

    Args:
        moves: (n, r, m) derivative of the measured numbers by m moves of the place.
        values: (n,), or (n, k) for a curve of k parts.
    """
    return np.asarray((moves[..., None] * values.reshape(len(values), 1, 1, -1)).reshape(*moves.shape[:2], -1))


def acting(some: Block) -> Block:
    """Return the curves of a block whose last factor, if a switch, is both on and off in more than a few rows.

    A few rows are `FEW`, or `FEW_SHARE` of all. Blocks without a switch come back as they are.
    """
    [*_, (curve, signal)] = some.like.factors
    if curve.switch is None or not len(some):
        return some
    plain = curve.switch[0]
    gate = block(plain, signal, some.numbers[:, some.numbers.shape[1] - len(plain.numbers) :]).raw
    on = np.count_nonzero(2 * gate > gate.max(axis=1, keepdims=True), axis=1)
    few = max(FEW, FEW_SHARE * gate.shape[1])
    return replace(some, numbers=some.numbers[np.minimum(on, gate.shape[1] - on) >= few])
