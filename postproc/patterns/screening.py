"""Patterns tried at places of the arm: what each takes off the residual, at the price of all that were tried."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.evidence import log_evidence, unit_information
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.patterns.curves import sharper
from postproc.patterns.dictionary import Patterns
from postproc.patterns.formula import Group, Pattern, spread
from postproc.patterns.pattern_prior import SEATED, UNNAMED_LOG_PRIOR, odds, off_everywhere
from postproc.patterns.place import Place, above, taken_off, with_and_without_a_row
from postproc.patterns.suspects import Suspect, places

MOST = 40
"""Patterns at one place that are kept, and that are told in the end."""
FINE = 400
"""Edges of a pattern that are told at most."""
SHARPER, NARROWER, SWITCHED = 1.65, 2.5, 3.0
"""As much more as a saw tooth may take off than its wave, a narrow window than a wide one around it, what acts in a
third of the rows than the same in all."""
ALIKE = 4.0
"""Edges whose worth differs by no more are not told apart: 95 % of the chi-square distribution."""
UNDECIDED = 8.0
"""Shapes of one channel at a place whose worth differs by less (odds of 50 to 1) are not told apart."""
KINDS, ELSEWHERE = 8, 2
"""Kinds of patterns of the same signals that are sharpened; further places at which the best of them is."""
Kind = tuple[tuple[str, ...], str]
"""Signals by their labels, and the kind of a pattern of them."""
TOGETHER = 0.97
"""Rank correlation of two channels (Spearman 1904) from which on one stands for the other."""
Made = Callable[[int], Pattern]


@dataclass(frozen=True)
class Found:
    """A pattern at a place; alike: those that the data cannot tell from it."""

    worth: float
    fall: float
    where: str
    pattern: Pattern
    alike: Callable[[], Iterable[Pattern]] = tuple


@dataclass
class PatternScreen:
    """Every pattern at every place, the fitted parameters projected out; the best of them are sharpened where asked.

    Args:
        found: the best at each place as they were tried; moves: by place. anywhere: (P,) the most that each took off at
            one place. last: the suspects as they were asked for last; least: worth from which on these are sharp.
    """

    problem: Problem
    linear: Linear
    every: Patterns
    found: list[Found] = field(default_factory=list)
    moves: dict[str, Array] = field(init=False)
    prepared: dict[str, Place] = field(default_factory=dict)
    anywhere: Array = field(init=False)
    last: list[Suspect] = field(default_factory=list)
    least: float = np.inf

    def __post_init__(self) -> None:
        self.anywhere = np.zeros(len(self.every.every))
        self.moves = places(self.problem, weighed=bool(self.every.own))
        for where in self.moves:
            self.screen(where)

    def suspects(self, asked: float = 0.0) -> list[Suspect]:
        """The patterns that would bring the residual down most, strongest first.

        Args:
            asked: worth below which they may be told as they were tried.
        """
        if asked < self.least:
            # Whatever is so near the best is sharpened in any case.
            sure = max(f.worth for f in self.found) - UNNAMED_LOG_PRIOR
            tried = list(self.found)
            self.sharpen(asked)
            self.last, self.least = self._suspects(self.best()), 0.0 if asked < sure else asked
            self.found = tried
        return self.last

    def _suspects(self, best: Sequence[Found]) -> list[Suspect]:
        all_, result = above(self.linear), list[Suspect]()
        for found in best:
            share, one = min(1.0, found.fall / all_), found.pattern
            first = Suspect(
                one.channels[0],
                found.where,
                one.told(tuple(found.alike())).rstrip(","),
                share,
                found.fall,
                found.worth,
                self.moves[found.where],
                one.values,
                one.channels,
                one.drafts,
                2 * float(np.log(odds(one, self.every.kinds))),
            )
            result += [replace(first, channel=c) for c in one.channels]
        return [*result[:1], *_together(result[:1], self.every), *result[1:]]

    def screen(self, where: str) -> None:
        """The best patterns at a place, each with the price of all that were tried."""
        group = self.every.every
        for some, everywhere in self.every.at(where):
            use = np.arange(some.start, some.stop)
            values = group.values[:, some]
            # What moves a casting is seen at the joints beside it, and what turns a tool where it shifts.
            if everywhere and (where.startswith("body") or where == SEATED):
                use = use[np.argsort(-self.anywhere[some])[: max(MOST, len(use) // 8)]]
                values = group.values[:, use]
            falls = self._seen(where).falls(values)
            self.anywhere[use] = np.maximum(self.anywhere[use], falls)
            self._ranked(where, falls, self.every.odds[use], _among(group, use), MOST)
        for pattern in self.every.wide:
            if self.every.sensible(pattern, where):
                self.add(where, pattern)

    def add(self, where: str, pattern: Pattern) -> None:
        """A single pattern at a place."""
        columns, linear = self._columns(where, pattern), self._seen(where).linear
        fall = float(taken_off(linear, columns)[1].sum())
        price = odds(pattern, self.every.kinds)
        worth = float(_worth(linear.square, fall, columns.shape[1], linear.freedom, price))
        self.found.append(Found(worth, fall, where, pattern))

    def best(self) -> list[Found]:
        """The best pattern of the same channels at each place, strongest first.

        One bad reading makes no law: without the row that gains most there must be something left to say.
        """
        once: dict[tuple[str, tuple[str, ...]], list[Found]] = {}
        for one in self.found:
            once.setdefault((one.where, one.pattern.channels), []).append(one)
        found = sorted(map(_plainest, once.values()), key=lambda f: -f.worth)[:MOST]
        return sorted((self._without_a_row(f) if f.worth > 0 else f for f in found), key=lambda f: -f.worth)

    def _columns(self, where: str, pattern: Pattern) -> Array:
        return self.problem.whiten(spread(self.moves[where], pattern.values))

    def _without_a_row(self, one: Found) -> Found:
        linear, columns = self._seen(one.where).linear, self._columns(one.where, one.pattern)
        _, (left, fall) = with_and_without_a_row(linear, columns)
        price = odds(one.pattern, self.every.kinds)
        return replace(one, worth=min(one.worth, float(_worth(left, fall, columns.shape[1], linear.freedom, price))))

    def _ranked(self, where: str, falls: Array, price: Array, made: Made, top: int) -> list[Found]:
        """The best of some patterns (P,), which are added to what was found; of one alone those that do as well."""
        linear, count = self._seen(where).linear, self._seen(where).count
        worth = _worth(linear.square, falls, count, linear.freedom, price)
        order = np.argpartition(-worth, top)[:top] if len(worth) > top else np.arange(len(worth))
        best = [Found(float(worth[k]), float(falls[k]), where, made(int(k))) for k in order[np.argsort(-worth[order])]]
        if top == 1:
            near = np.flatnonzero(worth > best[0].worth - ALIKE)
            best[0] = replace(best[0], alike=lambda: map(made, near[:FINE].tolist()))
        self.found += best
        return best

    def _seen(self, where: str) -> Place:
        if where not in self.prepared:
            place = self.problem.whiten(self.moves[where])
            linear = self.linear.extended(place) if off_everywhere(where) else self.linear
            self.prepared[where] = Place(linear, place)
        return self.prepared[where]

    def sharpen(self, asked: float = 0.0) -> None:
        """The best patterns closer, and where another channel switches them, as far as that may make them the best.

        1. The best of each kind, at the place where it tells most. 2. The best of these at two more places: nearby
        places answer alike, and each has its own edge, phase or period. 3. What another channel makes of them. 4. What
        turns out best at every place.

        Args:
            asked: worth below which none is of interest.
        """
        ranked = sorted(self.found, key=lambda f: -f.worth)
        plain, asked = ranked[0].worth, min(asked, 0.9 * self._could(ranked[0], np.inf))
        closest: dict[Kind, Found] = {}
        for one in ranked:
            least = max(asked, plain - UNNAMED_LOG_PRIOR)
            if len(closest) == KINDS or self._could(one, NARROWER) < least:
                break
            if _kind(one) not in closest and (one.pattern.kind == "window" or self._could(one, SHARPER) >= least):
                closest[_kind(one)] = self._closest(one)
                plain = max(plain, closest[_kind(one)].worth)
        of_best = max(closest, key=lambda kind: closest[kind].worth, default=None)
        near = {f.where: f for f in reversed(ranked) if _kind(f) == of_best and f.where != closest[_kind(f)].where}
        some = list(closest.values())
        for one in sorted(near.values(), key=lambda f: -f.worth)[:ELSEWHERE]:
            if self._could(one, NARROWER) > max(asked, plain):
                some.append(self._closest(one))
        best = max([ranked[0], *some], key=lambda f: f.worth)
        for one in some:
            known, least = len(self.found), max(asked, best.worth)
            switched = [self._closest(other) for other in self._switched(one, least)]
            best, before = max([best, *switched], key=lambda f: f.worth), best
            if best is before:
                del self.found[known:]
        # A pattern is no more at home in what moves every direction in its own way.
        for where in self.moves:
            if where != best.where and self.every.sensible(best.pattern, where):
                self.add(where, best.pattern)

    def _could(self, one: Found, times: float, tries: float = 1.0) -> float:
        """What a pattern would be worth if it took so many times as much off, for so many more that are tried."""
        seen = self._seen(one.where)
        most = min(times * one.fall, 0.99 * seen.linear.square)
        price = tries * odds(one.pattern, self.every.kinds)
        return float(_worth(seen.linear.square, most, seen.count, seen.linear.freedom, price))

    def _closest(self, one: Found) -> Found:
        best = one
        while near := sharper(one.pattern):
            price = near.of_blocks(lambda b: odds(b.like, self.every.kinds))
            one = self._ranked(one.where, self._seen(one.where).falls(near.values), price, near.__getitem__, 1)[0]
            best = max(best, one, key=lambda f: f.worth)
        return best

    def _switched(self, one: Found, least: float) -> list[Found]:
        """The pattern, or a factor of it, where another channel switches it on: at the price of all switches.

        None where that cannot be worth so much.
        """
        count = len(self.every.switches[0])
        if not count or one.pattern.wide or self._could(one, SWITCHED, count) < least:
            return []
        parts = list(self.every.grown(one.pattern))
        if not parts:
            return []
        falls = np.concatenate([self._seen(one.where).falls(values) for values, _ in parts])
        which = [(group, k) for _, group in parts for k in range(len(group))]

        def made(k: int) -> Pattern:
            group, at = which[k]
            return replace(group[at], tries=one.pattern.tries * len(which))

        price = np.full(len(falls), len(which) * odds(one.pattern, self.every.kinds))
        found = self._ranked(one.where, falls, price, made, 1)
        # A switch that is worth its price is nearly so at the coarse edge nearest to its own.
        return [f for f in found if f.worth > one.worth - UNNAMED_LOG_PRIOR and self.every.sensible(f.pattern, f.where)]


def _among(group: Group, use: NDArray[np.intp]) -> Made:
    return lambda k: group[int(use[k])]


def _plainest(some: Sequence[Found]) -> Found:
    """Of the shapes that the data does not tell from the best one that which needs the fewest numbers."""
    least = max(f.worth for f in some) - UNDECIDED
    return min((f for f in some if f.worth >= least), key=lambda f: (f.pattern.cost, -f.worth))


def _kind(one: Found) -> Kind:
    return tuple(s.label for s in one.pattern.signals), one.pattern.kind


def _worth(before: float, fall: Array | float, count: int, freedom: int, tried: Array | float) -> Array:
    """Log evidence of patterns with ``count`` sizes each, less what they were searched for and have no name."""
    evidence = log_evidence(before, before - np.asarray(fall), freedom, unit_information(count, freedom))
    return np.asarray(evidence - 2 * np.log(tried) - UNNAMED_LOG_PRIOR)


def _together(first: Sequence[Suspect], every: Patterns) -> list[Suspect]:
    """The same of channels that go with the first one on this data: a hall that warms up while time goes by."""
    lines = {p.channels[0]: _ranks(p.values) for p in every.lines}
    return [
        replace(s, channel=name, pattern=f"{s.pattern}; {name} goes with {s.channel} here", channels=(name,))
        for s in first
        if len(s.channels) == 1 and s.channel in lines
        for name, ranks in lines.items()
        if name != s.channel and abs(np.corrcoef(ranks, lines[s.channel])[0, 1]) > TOGETHER
    ]


def _ranks(values: Array) -> Array:
    """(n,) mean rank of each value."""
    _, index, count = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - 0.5 * count)[index])
