"""Patterns tried at places of the arm: what each takes off the residual, at the price of all that were tried."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array
from postproc.fit.linear import Linear
from postproc.fit.problem import Problem
from postproc.patterns.change_point_sets import chains
from postproc.patterns.dictionary import Patterns, grown, switched
from postproc.patterns.formula import Pattern, Single, sharper, spread, values_of
from postproc.patterns.pattern_prior import SEATED, odds, off_everywhere
from postproc.patterns.place import Place, taken_off, with_and_without_a_row
from postproc.patterns.shapes import CLOSER
from postproc.patterns.signals import Signal

MOST = 40
"""Patterns at one place that are kept, and that are told in the end."""
FINE = 400
"""Edges of a pattern that are told at most."""
SHARPER, NARROWER, SWITCHED, ROUND, SIDE_BY_SIDE = 1.65, 2.5, 3.0, 2.0, 5.0
"""As much more as a saw tooth may take off than its wave, a narrow window than a wide one around it, what acts in a
third of the rows than the same in all, what goes round in a circle than a wave along a line, and five shapes than
one."""
ALIKE = 4.0
"""Edges whose worth differs by no more are not told apart: 95 % of the chi-square distribution."""
UNDECIDED = 8.0
"""Shapes of one channel at a place whose worth differs by less (odds of 50 to 1) are not told apart."""
FEW, CHAINS = 4, 4
"""Values of a channel that has no shapes side by side; channels at places that are asked for them."""
ELSEWHERE = 2
"""Further places at which the best kind of pattern is sharpened."""
UNNAMED_LOG_PRIOR = 16.0
"""2 log of the odds against a pattern without a name: it needs 3000 times the likelihood of a named effect."""


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
class Tried:
    """Patterns that were tried at places, best first; anywhere: the most that each took off at one."""

    problem: Problem
    linear: Linear
    every: Patterns
    found: list[Found] = field(default_factory=list)
    moves: dict[str, Array] = field(default_factory=dict)
    prepared: dict[str, Place] = field(default_factory=dict)
    screened: list[str] = field(default_factory=list)
    anywhere: Array = field(default_factory=lambda: np.zeros(1))

    def screen(self, where: str) -> None:
        """The best patterns at a place, each with the price of all that were tried."""
        self.screened.append(where)
        for group in self.every.groups(where):
            if group is self.every.anywhere and (where.startswith("body") or where == SEATED):
                # What moves a casting is seen at the joints beside it, and what turns a tool where it shifts.
                use = np.argsort(-self.anywhere)[: max(MOST, len(group.some) // 8)]
                falls = self._seen(where).falls(group.values[:, use])
                self._ranked(where, falls, group.odds[use], group.some.among(use).__getitem__, MOST)
                continue
            falls = self._seen(where).falls(group.values)
            if group is self.every.anywhere:
                self.anywhere = np.maximum(self.anywhere, falls)
            self._ranked(where, falls, group.odds, group.some.__getitem__, MOST)
        for pattern in self.every.wide:
            if self.every.sensible(pattern, where):
                self._wide(where, pattern)

    def _wide(self, where: str, pattern: Pattern) -> Found:
        """A pattern with several sizes."""
        linear = self._seen(where).linear
        columns = self.problem.whiten(spread(self.moves[where], pattern.values))
        fall = float(taken_off(linear, columns)[1].sum())
        price = odds(pattern, self.every.kinds)
        worth = float(_worth(linear.square, fall, columns.shape[1], linear.freedom, price))
        self.found.append(Found(worth, fall, where, pattern))
        return self.found[-1]

    def add(self, where: str, pattern: Pattern) -> None:
        """A single pattern at a place."""
        if pattern.wide:
            self._wide(where, pattern)
        else:
            self._best(where, values_of([pattern]), odds(pattern, self.every.kinds), lambda k: pattern, 1)

    def best(self) -> list[Found]:
        """The best pattern of the same channels at each place, strongest first.

        One bad reading makes no law: without the row that gains most there must be something left to say.
        """
        once: dict[tuple[str, tuple[str, ...]], list[Found]] = {}
        for one in self.found:
            once.setdefault((one.where, one.pattern.channels), []).append(one)
        found = sorted(map(_plainest, once.values()), key=lambda f: -f.worth)[:MOST]
        return sorted((self._without_a_row(f) if f.worth > 0 else f for f in found), key=lambda f: -f.worth)

    def _without_a_row(self, one: Found) -> Found:
        linear = self._seen(one.where).linear
        columns = self.problem.whiten(spread(self.moves[one.where], one.pattern.values))
        _, (left, fall) = with_and_without_a_row(linear, columns)
        price = odds(one.pattern, self.every.kinds)
        return replace(one, worth=min(one.worth, float(_worth(left, fall, columns.shape[1], linear.freedom, price))))

    def _best(self, where: str, values: Single, price: Array | float, made: Made, top: int) -> list[Found]:
        return self._ranked(where, self._seen(where).falls(values), price, made, top)

    def _ranked(self, where: str, falls: Array, price: Array | float, made: Made, top: int) -> list[Found]:
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

    def sharpen(self, asked: float = 0.0, most: int = 8) -> None:
        """The best patterns closer, and where another channel switches them, as far as that may make them the best.

        Each at the place where it tells most, the best of them at two more; what turns out best is tried everywhere.

        Args:
            asked: worth below which none is of interest.
        """
        ranked = sorted(self.found, key=lambda f: -f.worth)
        best, plain = ranked[0], ranked[0].worth
        asked = min(asked, 0.9 * self._could(best, np.inf))
        of_best, done = _kind(best), set[tuple[tuple[str, ...], str]]()
        for one in ranked:
            least = max(asked, plain - UNNAMED_LOG_PRIOR)
            if len(done) == most or self._could(one, NARROWER) < least:
                break
            if _kind(one) in done or (one.pattern.kind != "window" and self._could(one, SHARPER) < least):
                continue
            done.add(_kind(one))
            closest, switched = self._sharpened(one, max(asked, best.worth))
            plain = max(plain, closest.worth)
            if switched.worth > best.worth:
                best, of_best = switched, _kind(one)
        # Nearby places answer alike, and each has its own edge, phase or period.
        near = {f.where: f for f in reversed(ranked) if _kind(f) == of_best and f.where != best.where}
        for one in sorted(near.values(), key=lambda f: -f.worth)[:ELSEWHERE]:
            if self._could(one, NARROWER) > max(asked, best.worth):
                best = max(best, self._sharpened(one, max(asked, best.worth))[1], key=lambda f: f.worth)
        for one, signal in self._channels([best, *ranked[:MOST]]):
            if self._could(one, NARROWER) > best.worth and self._could(one, SIDE_BY_SIDE) > asked:
                best = max(best, self._several(one.where, signal), key=lambda f: f.worth)
        for one in (f for f in [best, *ranked[:MOST]] if f.pattern.rounder is not None):
            if self._could(one, ROUND) > max(asked, best.worth):
                best = max([best, *self._rounded(one.pattern)], key=lambda f: f.worth)
        # A pattern is no more at home in what moves every direction in its own way.
        for where in self.screened:
            if where != best.where and self.every.sensible(best.pattern, where):
                self.add(where, best.pattern)

    def _could(self, one: Found, times: float, tries: float = 1.0) -> float:
        """What a pattern would be worth if it took so many times as much off, for so many more that are tried."""
        seen = self._seen(one.where)
        most = min(times * one.fall, 0.99 * seen.linear.square)
        price = tries * odds(one.pattern, self.every.kinds)
        return float(_worth(seen.linear.square, most, seen.count, seen.linear.freedom, price))

    def _sharpened(self, one: Found, least: float) -> tuple[Found, Found]:
        """A pattern closer, and the better of that and what another channel makes of it, if that may reach a worth."""
        closest = self._closest(one)
        known = len(self.found)
        # Its edge may lie elsewhere once it switches something.
        movable = replace(closest, pattern=replace(closest.pattern, finer=one.pattern.finer))
        every = [closest, *(self._closest(other) for other in self._switched(movable, max(closest.worth, least)))]
        best = max(every, key=lambda f: f.worth)
        if best is closest:
            del self.found[known:]
        return closest, best

    def _closest(self, one: Found) -> Found:
        best = one
        while near := sharper(one.pattern):
            one = self._best(one.where, values_of(near), *self._made(one.pattern, CLOSER, near.__getitem__), 1)[0]
            best = max(best, one, key=lambda f: f.worth)
        return best

    def _several(self, where: str, signal: Signal) -> Found:
        """Shapes of a signal side by side, each with its own size: several slips, a tooth that lags and leads."""
        seen = self._seen(where)

        def worth(falls: Array, count: int, tries: Array) -> Array:
            return _worth(seen.linear.square, falls, count, seen.linear.freedom, tries)

        own = (where,) == tuple(f"joint {name[1:]}" for name in signal.names)
        some = chains(self.problem, seen, self.moves[where], signal, worth, own)
        return max((self._wide(where, chain) for chain in some), key=lambda f: f.worth)

    def _rounded(self, wave: Pattern) -> list[Found]:
        """A wave that goes round, wherever there is more than one way to go."""
        every = (w for w in self.screened if self.moves[w].shape[2] > 1 and self.every.sensible(wave, w))
        assert wave.rounder is not None
        ellipse = replace(wave.rounder(), kind=wave.kind, tries=wave.tries, where=wave.where)
        known = {(f.where, f.pattern.form) for f in self.found if f.pattern.wide}
        return [self._wide(w, ellipse) for w in every if (w, ellipse.form) not in known]

    def _channels(self, ranked: Sequence[Found]) -> list[tuple[Found, Signal]]:
        """The best patterns with their signals: angles themselves, too, of what follows their size or their sum."""
        plain = {p.signals[0].label: p.signals[0] for p in self.every.lines}
        some: dict[tuple[str, str], tuple[Found, Signal]] = {}
        for one in ranked:
            for s in one.pattern.signals:
                label = s.label.strip("|")
                for signal in (plain.get(label, s), *(plain[name] for name in plain if name in label.split())):
                    known = sum(name == signal.label for _, name in some)
                    if known < 2 and len(np.unique(signal.values)) > FEW:
                        some.setdefault((one.where, signal.label), (one, signal))
        return list(some.values())[:CHAINS]

    def _made(self, pattern: Pattern, times: float, made: Made) -> tuple[float, Made]:
        """Odds of those that were made of a pattern, so many times as rare, and how to make one."""
        tries = times * pattern.tries
        price = times * odds(pattern, self.every.kinds)
        return price, lambda k: replace(made(k), kind=pattern.kind, tries=tries)

    def _switched(self, one: Found, least: float) -> list[Found]:
        """The pattern, or a factor of it, where another channel switches it on: at the price of all switches.

        None where that cannot be worth so much.
        """
        count = len(self.every.switches)
        if not count or one.pattern.kind == "field" or one.pattern.wide or self._could(one, SWITCHED, count) < least:
            return []
        parts = [(self._seen(one.where).falls(values), of) for values, of in grown(one.pattern, self.every)]
        which = [made for _, of in parts for made in of]
        if not which:
            return []

        def switch(k: int) -> Pattern:
            return replace(switched(*which[k]), where=one.pattern.where)

        made = self._made(one.pattern, len(which), switch)
        found = self._ranked(one.where, np.concatenate([falls for falls, _ in parts]), *made, 1)
        # A switch that is worth its price is nearly so at the coarse edge nearest to its own.
        return [f for f in found if f.worth > one.worth - UNNAMED_LOG_PRIOR and self.every.sensible(f.pattern, f.where)]


def _plainest(some: Sequence[Found]) -> Found:
    """Of the shapes that the data does not tell from the best one that which needs the fewest numbers."""
    least = max(f.worth for f in some) - UNDECIDED
    return min((f for f in some if f.worth >= least), key=lambda f: (f.pattern.numbers, -f.worth))


def _kind(one: Found) -> tuple[tuple[str, ...], str]:
    return tuple(s.label for s in one.pattern.signals), one.pattern.kind


def above(linear: Linear) -> float:
    """What is left above the noise, of the whitened sum of squares."""
    return max(linear.square - (len(linear.residual) - linear.parameters), 0.1 * linear.square)


def _worth(before: float, fall: Array | float, count: int, freedom: int, tried: Array | float) -> Array:
    """Nu log(S / (S - fall)) - m log(nu) - 2 log(tried) for many patterns, less the odds of having no name."""
    after = np.maximum(before - np.asarray(fall), 1e-12 * before)
    if freedom - count < 1:
        return np.full(np.shape(fall), -np.inf)
    return np.asarray(
        freedom * np.log(before / after) - count * np.log(freedom) - 2 * np.log(tried) - UNNAMED_LOG_PRIOR
    )
