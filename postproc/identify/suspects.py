"""What the remaining structure follows when no effect of the library explains it: patterns at places of the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.identify.fields import fields
from postproc.identify.linear import Linear
from postproc.identify.patterns import Patterns, grown, switched
from postproc.identify.problem import Problem
from postproc.identify.sensitivity import BODY, INSTRUMENT, TOOL
from postproc.identify.shapes import CLOSER, Pattern, sharper

FINEST = 8
"""Finer places of one pattern that are looked at closely."""
ALIKE = 4.0
"""Edges whose worth differs by no more are not told apart: 95 % of the chi-square distribution."""
RARER = 3000
"""As much less likely is a casting that bends or gives way in every direction than a joint that turns."""
ODDS = 16.0
"""A pattern that nobody has a name for needs exp(ODDS / 2) = 3000 times the likelihood of a named effect."""


@dataclass(frozen=True)
class Suspect:
    """A place of the arm that moves with a pattern of a channel.

    Args:
        channel, where, pattern: for people; share: of the whitened sum of squares above the noise that it explains.
        fall: of the whitened sum of squares; evidence: worth after counting all patterns that were tried and the odds
            of having no name.
        place: (n, r, m) how the prediction moves with the place; values: (n,) of the pattern.
        channels: all that the pattern follows, this one among them.
    """

    channel: str
    where: str
    pattern: str
    share: float
    fall: float
    evidence: float
    place: Array
    values: Array
    channels: tuple[str, ...] = ()

    def columns(self, problem: Problem) -> Array:
        """(N, m) whitened columns for the rows that a fit uses; fits of one search may set other rows aside.

        With what the place is off everywhere, which offsets, frame and tool take up but at the end of a body.
        """
        moved = problem.whiten(self.place * self.values[:, None, None])
        return np.hstack([moved, problem.whiten(self.place)]) if self.where.startswith("body") else moved

    def as_json(self) -> dict[str, Any]:
        return {"channel": self.channel, "where": self.where, "share": round(self.share, 4), "pattern": self.pattern}


def places(problem: Problem) -> dict[str, Array]:
    """(n, r, m) derivative of the prediction by a move at each place.

    Joints and base (turn), instrument and tool (translation), the far end of each arm body (turn or shift). The last
    two bodies are a few centimetres long: the tool and the joints beside them do what they do.
    """
    J = problem.sensitivity.matrix
    found = {f"joint {j + 1}": J[:, :, j : j + 1] for j in range(6)}
    found["base"] = J[:, :, BODY + 3 : BODY + 6]
    found["instrument"] = J[:, :, INSTRUMENT : INSTRUMENT + 3]
    found["tool"] = J[:, :, TOOL : TOOL + 3]
    for b in range(1, 5):
        found[f"body {b}"] = J[:, :, BODY + 6 * b + 3 : BODY + 6 * b + 6]
        found[f"body {b}, shifted"] = J[:, :, BODY + 6 * b : BODY + 6 * b + 3]
    return {name: columns for name, columns in found.items() if columns.any()}


def find_suspects(problem: Problem, linear: Linear, every: Patterns, top: int = 40) -> list[Suspect]:
    """The patterns that would bring the residual down most, strongest first.

    With the fitted parameters projected out.
    """
    somewhere = places(problem)
    tried = _Tried(problem, linear, every, len(somewhere))
    for where, moves in somewhere.items():
        tried.moves[where] = moves
        tried.screen(where, every.anywhere, top, every.values)
        tried.screen(where, every.only(where), top)
    smooth = list(fields(problem))
    for where, names, text, moves in smooth:
        tried.moves[where] = moves
        # One of so many, and all together are one kind of patterns.
        one = Pattern(names, text, np.ones(len(problem.error)), "field", tries=len(smooth) / len(somewhere))
        tried.screen(where, [one], top)
    tried.sharpen()
    above = max(linear.square - (len(linear.residual) - linear.parameters), 0.1 * linear.square)
    result: list[Suspect] = []
    once = {(found.where, found.pattern.channels): found for found in reversed(tried.found)}
    for found in sorted(once.values(), key=lambda f: -f.worth)[:top]:
        share, text, names = min(1.0, found.fall / above), found.pattern.told(found.alike), found.pattern.channels
        place = tried.moves[found.where], found.pattern.values
        result += [Suspect(c, found.where, text, share, found.fall, found.worth, *place, names) for c in names]
    return result


Made = Callable[[int], Pattern]


@dataclass(frozen=True)
class _Found:
    """A pattern at a place; alike: those that the data cannot tell from it."""

    worth: float
    fall: float
    where: str
    pattern: Pattern
    alike: tuple[Pattern, ...] = ()


@dataclass
class _Tried:
    """Patterns that were tried at places, best first."""

    problem: Problem
    linear: Linear
    every: Patterns
    places: int
    found: list[_Found] = field(default_factory=list)
    moves: dict[str, Array] = field(default_factory=dict)
    seen: dict[str, _Seen] = field(default_factory=dict)

    def screen(self, where: str, some: Sequence[Pattern], top: int, values: Array | None = None) -> list[_Found]:
        """The best of some patterns at a place, each with the price of all that were tried.

        Args:
            values: (n, P) of these patterns, where many places share them.
        """
        if not some:
            return []
        values = _values(some) if values is None else values
        return self._best(where, values, self.every.odds(some), some.__getitem__, top)

    def _best(self, where: str, values: Array, odds: Array, made: Made, top: int, told: bool = False) -> list[_Found]:
        moves, seen = self.moves[where], self._seen(where)
        linear, falls, count = seen.linear, seen.falls(values), moves.shape[2]
        tried = np.broadcast_to(odds, falls.shape) * self.places * (RARER if where.startswith("body") else 1)
        worth = _worth(linear.square, falls, count, linear.freedom, tried)
        best = []
        for k in np.argsort(-worth)[:top]:
            pattern, least = made(int(k)), float(worth[k])
            if least > 0:
                # One bad reading makes no law: without the row that gains most there must be something left to say.
                columns = self.problem.whiten(moves * pattern.values[:, None, None])
                square, shared = _without_a_row(linear, columns)
                least = min(least, float(_worth(square, shared, count, linear.freedom, tried[k])))
            best.append(_Found(least, float(falls[k]), where, pattern))
        best.sort(key=lambda f: -f.worth)
        if told:
            near = np.flatnonzero(worth > best[0].worth - ALIKE)
            best[0] = replace(best[0], alike=tuple(made(int(k)) for k in near))
        self.found += best
        return best

    def _seen(self, where: str) -> _Seen:
        if where not in self.seen:
            place = self.problem.whiten(self.moves[where])
            # Offsets, frame and tool take up what the other places are off everywhere.
            linear = self.linear.extended(place) if where.startswith("body") else self.linear
            self.seen[where] = _Seen(self.problem, linear, place)
        return self.seen[where]

    def sharpen(self, most: int = 10) -> None:
        """The best patterns closer, and where another channel switches them."""
        self.found.sort(key=lambda f: -f.worth)
        done: set[tuple[str, tuple[str, ...], str]] = set()
        for one in list(self.found):
            kind = (one.where, one.pattern.channels, one.pattern.kind)
            if len(done) == most:
                break
            if kind not in done:
                done.add(kind)
                best = self._closest(one)
                known = len(self.found)
                more = [self._closest(other) for other in self._switched(best)]
                if not any(other.worth > best.worth for other in more):
                    del self.found[known:]
        self.found.sort(key=lambda f: -f.worth)

    def _closest(self, one: _Found) -> _Found:
        best = one
        while one.pattern.finer is not None:
            near = sharper(one.pattern)
            rarer = self._rarer(one.pattern, CLOSER, near.__getitem__)
            one = self._best(one.where, _values(near), *rarer, FINEST, True)[0]
            best = max(best, one, key=lambda f: f.worth)
        return best

    def _rarer(self, pattern: Pattern, times: float, made: Callable[[int], Pattern]) -> tuple[Array, Made]:
        """Odds of those that were made of a pattern, so many times as rare, and how to make one."""
        tries = times * pattern.tries
        odds = times * self.every.odds([pattern])
        return odds, lambda k: replace(made(k), kind=pattern.kind, tries=tries)

    def _switched(self, one: _Found) -> list[_Found]:
        """The pattern, or a factor of it, where another channel switches it on: at the price of all switches."""
        values, which = grown(one.pattern, self.every)
        if not which or one.pattern.kind == "field":
            return []
        where = one.pattern.where
        rarer = self._rarer(one.pattern, len(which), lambda k: replace(switched(*which[k]), where=where))
        return self._best(one.where, values, *rarer, 1)


def _values(some: Sequence[Pattern]) -> Array:
    return np.array([p.values for p in some]).T


def _worth(before: float, fall: Array | float, count: int, freedom: int, tried: Array | float) -> Array:
    """Nu log(S / (S - fall)) - m log(nu) - 2 log(tried) for many patterns, less the odds of having no name."""
    after = np.maximum(before - np.asarray(fall), 1e-12 * before)
    if freedom - count < 1:
        return np.full(np.shape(fall), -np.inf)
    return np.asarray(freedom * np.log(before / after) - count * np.log(freedom) - 2 * np.log(tried) - ODDS)


def _without_a_row(linear: Linear, columns: Array) -> tuple[float, float]:
    """The sum of squares, and what columns take off it, without the row of which they take most."""
    inside = linear.project(columns)
    fitted = inside @ np.linalg.lstsq(inside, linear.rest, rcond=1e-6)[0]
    square = np.bincount(linear.row, linear.rest**2)
    taken = square - np.bincount(linear.row, (linear.rest - fitted) ** 2)
    most = int(np.argmax(taken))
    return float(square.sum() - square[most]), float(taken.sum() - taken[most])


class _Seen:
    """A place as the data sees it once the fitted parameters are projected out.

    A pattern has one value a pose, so that all products are summed over the numbers of a pose first.
    """

    def __init__(self, problem: Problem, linear: Linear, place: Array) -> None:
        """place: (N, m) whitened columns."""
        self.linear = linear
        starts = np.flatnonzero(np.diff(problem.row, prepend=-1))
        self.pose = problem.row[starts]
        self.count = place.shape[1]
        size = len(problem.row) // len(self.pose)
        even = len(problem.row) == size * len(self.pose) and bool((np.diff(starts) == size).all())

        def by_pose(x: Array) -> Array:
            # Ten times as fast as `reduceat` where all poses have as many numbers.
            if even:
                return np.asarray(x.reshape(len(self.pose), size, *x.shape[1:]).sum(axis=1))
            return np.add.reduceat(x, starts, axis=0)

        self.nuisance = [by_pose(linear.nuisance * place[:, i, None]).T for i in range(self.count)]
        self.square = by_pose(place[:, :, None] * place[:, None, :]).reshape(len(self.pose), -1)
        self.rest = by_pose(linear.rest[:, None] * place)

    def falls(self, values: Array) -> Array:
        """Fall of the sum of squares by the place times each pattern, (P,), for (n, P) values."""
        P, m = values.shape[1], self.count
        fall = np.zeros(P)
        chunk = max(1, int(2e7 / max(1, len(self.pose) * m)))
        for at in range(0, P, chunk):
            b = values[:, at : at + chunk]
            b = b if len(self.pose) == len(values) else b[self.pose]
            inside = np.stack([(V @ b).T for V in self.nuisance], axis=1)
            raw = ((b * b).T @ self.square).reshape(-1, m, m)
            gram = raw - inside @ np.swapaxes(inside, 1, 2)
            along = (self.rest.T @ b).T
            scale = np.einsum("cii->c", raw)
            alive = np.einsum("cii->c", gram) > 1e-5 * scale
            ridge = 1e-6 * np.where(scale > 0, scale, 1.0)[:, None, None] * np.eye(m)
            solved = np.linalg.solve(gram + ridge, along[:, :, None])[:, :, 0]
            fall[at : at + chunk] = np.where(alive, np.einsum("ci,ci->c", along, solved), 0.0)
        return fall


def by_channel(suspects: Sequence[Suspect], beside: Sequence[Suspect] = (), count: int = 5) -> list[Suspect]:
    """The strongest suspect of each channel, and other structures.

    First the strongest pattern, then another place that it cannot be told from, then patterns that were found with it
    taken, before the third dress of the first. What could be chance is left out, and what leaves more than twice as
    much as the first.
    """
    if not suspects:
        return []
    first = suspects[0]
    suspects = [
        s
        for s in suspects
        if s.evidence > first.evidence - ODDS or (s.evidence > 0 and 1 - s.share < 2 * (1 - first.share))
    ]
    same = list({s.channel: s for s in suspects if s.where == first.where and s.values is first.values}.values())
    close = (s for s in suspects if s.channel == first.channel and s.evidence > first.evidence - ODDS)
    elsewhere = [s for s in close if s.where != first.where][:1]
    above = first.fall / max(first.share, 1e-12)
    mine = {s.channel for s in same}
    others = [replace(s, share=min(1.0, s.fall / above)) for s in beside if s.channel not in mine]
    # What else the same place follows comes before other places.
    best: dict[str, Suspect] = {}
    for suspect in sorted(suspects, key=lambda s: s.where != first.where):
        best.setdefault(suspect.channel, suspect)
    dresses = [s for channel, s in best.items() if channel not in mine]
    early = max(0, 2 - len(same))
    return [*same[:2], *elsewhere, *dresses[:early], *others, *same[2:], *dresses[early:]][:count]
