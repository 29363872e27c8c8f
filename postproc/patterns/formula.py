"""A pattern: a formula of signals, with its sentence, its values and its text over a state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import groupby
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.fit.channels import within
from postproc.fit.words.wording import joined
from postproc.patterns.signals import Draft, Signal, text_of, unit, written

Edge = tuple[float, float]
"""Between which values an edge lies."""
Law = Callable[..., Any]
"""A formula that takes signals, as values or as text."""
Single = NDArray[np.float32]


@dataclass(frozen=True)
class Pattern:
    """A function of signals without physical unit: its sentence, its values and its text over a state.

    Args:
        signals: what it is a function of; form: what it looks like, such as ``step near {}``, with a place for each of
            its edges; law: the formula.
        kind: patterns of one kind are as likely as those of any other, however many there are.
        at: its edges, knots, .., of the last signal.
        where: the only place at which it makes sense, None for all.
        finer: makes the same with its edge, knot, period or phase at many finer places.
        gate: how it is said of something else that acts only there, only elsewhere, and there the other way round.
        factors: makes what it is a product of, each with the channel that may switch it.
        tries: how many times as many as of its kind were tried.
        label: what it is called as part of a longer sentence.
        rounder: makes the same with sizes of its own for sine and cosine.
        wide: whether the law gives a list of functions, each with a size of its own: a shift for each level.
    """

    signals: tuple[Signal, ...]
    form: str
    law: Law = field(repr=False, compare=False)
    kind: str = ""
    at: tuple[Edge, ...] = ()
    where: str | None = None
    finer: Callable[[], Sequence[Pattern]] | None = field(default=None, repr=False, compare=False)
    gate: tuple[str, ...] = ()
    factors: Callable[[], tuple[tuple[Pattern, str], ...]] | None = field(default=None, repr=False, compare=False)
    rounder: Callable[[], Pattern] | None = field(default=None, repr=False, compare=False)
    tries: float = 1.0
    label: str = ""
    wide: bool = False

    @cached_property
    def values(self) -> Array:
        """(n,), or (n, k) of a wide one, by their largest size."""
        return unit(self._raw())

    def _raw(self) -> Array:
        found = self.law(*(s.values for s in self.signals))
        return np.stack(found, axis=1).astype(float) if self.wide else np.asarray(found, dtype=float)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """The first one of every signal, then the others."""
        most = max(len(s.names) for s in self.signals)
        return tuple(dict.fromkeys(s.names[k] for k in range(most) for s in self.signals if k < len(s.names)))

    @property
    def numbers(self) -> int:
        """How many numbers were searched for it: of what says the same, what needs fewest is the plainest."""
        own = len(self.at) + (2 if self.kind.endswith(("wave", "sway")) else 4 if self.kind.endswith("waves") else 0)
        return own + len(self.signals) - 1

    @property
    def codes(self) -> tuple[str, ...]:
        """What gives its values, as expressions of a state; none where a state does not tell them."""
        return tuple(map(text_of, self.drafts))

    @property
    def drafts(self) -> tuple[Draft, ...]:
        """The same, with what the numbers need that a fit may move."""
        found, largest = written(self.law, self.signals), float(np.abs(self._raw()).max())
        every = () if found is None else found if self.wide else [found]
        return tuple((part if abs(largest - 1) < 1e-3 else part / largest).draft for part in every)

    @property
    def text(self) -> str:
        return self.told()

    @property
    def named(self) -> str:
        """As part of a longer sentence."""
        return self.label or (self.text if len(self.channels) > 1 else f"{self.text} of {self.signals[0].name}")

    def told(self, alike: Sequence[Pattern] = ()) -> str:
        """What it looks like, its edges no closer than patterns that do the same have theirs."""
        if not self.at:
            return self.form
        every = np.array([p.at for p in (self, *alike) if p.form == self.form]).reshape(-1, len(self.at), 2)
        channel = self.signals[-1].unit
        spans = (within(channel, float(e[:, 0].min()), float(e[:, 1].max())) for e in every.transpose(1, 0, 2))
        return self.form.format(*spans)


@dataclass(frozen=True, eq=False)
class Family(Sequence[Pattern]):
    """Patterns of one kind whose values are worked out at once; each of them is made where it is asked for.

    Args:
        many: how many; make: the k-th; raw: (P, n) values of all.
        joined: what it was put together from, each of one form.
    """

    many: int
    make: Callable[[int], Pattern]
    raw: Callable[[], Array]
    joined: tuple[Sequence[Pattern], ...] = ()
    made: dict[int, Pattern] = field(default_factory=dict, repr=False)

    @property
    def parts(self) -> tuple[Sequence[Pattern], ...]:
        return self.joined or (self,)

    def __len__(self) -> int:
        return self.many

    @overload
    def __getitem__(self, at: int) -> Pattern: ...

    @overload
    def __getitem__(self, at: slice) -> list[Pattern]: ...

    def __getitem__(self, at: int | slice) -> Pattern | list[Pattern]:
        if isinstance(at, slice):
            return [self[k] for k in range(*at.indices(self.many))]
        if not 0 <= at < self.many:
            raise IndexError(at)
        if at not in self.made:
            self.made[at] = self.make(at)
        return self.made[at]

    def times(self, change: Callable[[Pattern], Pattern], values: Array | None = None) -> Family:
        """The same after a change of each, their values as many times as large."""
        return Family(self.many, lambda k: change(self[k]), self.raw if values is None else lambda: self.raw() * values)

    def among(self, use: NDArray[np.intp]) -> Family:
        """Some of them."""
        return Family(len(use), lambda k: self[int(use[k])], lambda: self.raw()[use])

    def settled(self) -> Family:
        """The same, which nothing brings closer."""
        return self.times(lambda p: replace(p, finer=None))


def family(
    signals: Sequence[Signal], law: Law, make: Callable[..., Pattern], numbers: Iterable[Sequence[float]]
) -> Family:
    """Patterns that differ in numbers alone: a law of signals and of the numbers, and a pattern by its numbers."""
    every = [tuple(map(float, some)) for some in numbers]

    def raw() -> Array:
        return np.asarray(law(*(s.values for s in signals), *np.array(every).T[:, :, None]), dtype=np.float32)

    return Family(len(every), lambda k: make(*every[k]), raw)


Part = Pattern | Sequence[Pattern]
"""A pattern, or some of one kind."""


def members(part: Part) -> Sequence[Pattern]:
    """The patterns of a part, one alone as well."""
    return [part] if isinstance(part, Pattern) else part


def together(parts: Iterable[Part]) -> Family:
    """Patterns and families of them one after another."""
    groups = list[Sequence[Pattern]]()
    for alone, some in groupby(parts, lambda part: isinstance(part, Pattern)):
        every = [members(part) for part in some]
        groups += [[group[0] for group in every]] if alone else filter(len, every)
    ends = np.cumsum([0, *map(len, groups)])

    def make(k: int) -> Pattern:
        at = int(np.searchsorted(ends, k, side="right")) - 1
        return groups[at][k - int(ends[at])]

    def raw() -> Any:
        # One after another into one array: side by side they would take twice the memory.
        rows = len(groups[0][0].signals[0].values)
        every = np.empty((int(ends[-1]), rows), dtype=np.float32)
        for group, first in zip(groups, ends, strict=False):
            every[first : first + len(group)] = raw_of(group)
        return every

    return Family(int(ends[-1]), make, raw, tuple(groups))


def raw_of(some: Sequence[Pattern]) -> Array:
    """(P, n) values of patterns with one function each."""
    if isinstance(some, Family):
        return some.raw()
    return np.array([p.law(*(s.values for s in p.signals)) for p in some], dtype=np.float32)


def values_of(some: Sequence[Pattern]) -> Single:
    """(n, P) of patterns with one function each, by their largest size; in single precision, which is twice as fast."""
    raw = raw_of(some)
    most = np.maximum(raw.max(axis=1, keepdims=True), -raw.min(axis=1, keepdims=True))
    return np.divide(raw, np.maximum(most, 1e-30), out=raw if raw.dtype == np.float32 else None, dtype=np.float32).T


def spread(moves: Array, values: Array) -> Array:
    """(n, r, m k) moves (n, r, m) by values (n,) or (n, k)."""
    return np.asarray((moves[..., None] * values.reshape(len(values), 1, 1, -1)).reshape(*moves.shape[:2], -1))


def sharper(pattern: Pattern) -> Family:
    """The same with its edge, knot, period or phase at many finer places; none where nothing can be moved."""
    near = () if pattern.finer is None else pattern.finer()
    return near if isinstance(near, Family) else together(near)


def only_at(where: str, pattern: Pattern) -> Pattern:
    """A pattern that makes sense at one place."""
    finer = None if pattern.finer is None else lambda: sharper(pattern).times(partial(only_at, where))
    return replace(pattern, where=where, gate=(), finer=finer)


def side_by_side(some: Sequence[Pattern], tries: float) -> Pattern:
    """Patterns of one signal, each with a size of its own."""
    some = sorted(some, key=lambda p: p.at)

    def law(x: Any) -> list[Any]:
        return [p.law(x) for p in some]

    form, at = joined([p.form for p in some]), tuple(edge for p in some for edge in p.at)
    return Pattern(some[0].signals, form, law, "line", at, tries=tries, wide=True)
