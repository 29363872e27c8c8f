"""What the remaining structure follows when no effect of the library explains it: patterns at places of the arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.identify.fields import fields
from postproc.identify.forms import schwarz
from postproc.identify.linear import Linear
from postproc.identify.problem import Problem
from postproc.identify.sensitivity import BODY, INSTRUMENT, TOOL
from postproc.identify.shapes import Pattern, sharper

FINEST = 8
"""Finer places of one pattern that are looked at closely."""
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
        """(N, m) whitened columns for the rows that a fit uses; fits of one search may set other rows aside."""
        return problem.whiten(self.place * self.values[:, None, None])

    def as_json(self) -> dict[str, Any]:
        return {"channel": self.channel, "where": self.where, "share": round(self.share, 4), "pattern": self.pattern}


def places(problem: Problem) -> dict[str, Array]:
    """(n, r, m) derivative of the prediction by a move at each place.

    Joints and base (turn), instrument and tool (translation).
    """
    J = problem.sensitivity.matrix
    found = {f"joint {j + 1}": J[:, :, j : j + 1] for j in range(6)}
    found["base"] = J[:, :, BODY + 3 : BODY + 6]
    found["instrument"] = J[:, :, INSTRUMENT : INSTRUMENT + 3]
    found["tool"] = J[:, :, TOOL : TOOL + 3]
    return {name: columns for name, columns in found.items() if columns.any()}


def bodies(problem: Problem) -> dict[str, Array]:
    """(n, r, 3) derivative of the prediction by a turn of the far end of each arm body about any axis.

    The last two are a few centimetres long: the tool and the joints beside them do what they do.
    """
    J = problem.sensitivity.matrix
    found = {f"body {b}": J[:, :, BODY + 6 * b + 3 : BODY + 6 * b + 6] for b in range(1, 5)}
    return {name: columns for name, columns in found.items() if columns.any()}


def find_suspects(problem: Problem, linear: Linear, every: Sequence[Pattern], top: int = 40) -> list[Suspect]:
    """The patterns that would bring the residual down most, strongest first.

    With the fitted parameters projected out.
    """
    somewhere = places(problem)
    everywhere = [p for p in every if p.where is None]
    tried = _Tried(problem, linear, len(every) + len(everywhere) * (len(somewhere) - 1))
    values = np.array([p.values for p in everywhere]).T
    for where, moves in somewhere.items():
        tried.screen(where, moves, everywhere, top, values=values)
        tried.screen(where, moves, [p for p in every if p.where == where], top)
    # What a casting does, the joints, base and tool beside it do in part.
    some = list({id(p): p for _, _, _, p in tried.found if p.where is None}.values())
    for where, moves in bodies(problem).items():
        tried.screen(where, moves, some, top, RARER)
    for where, names, text, moves in fields(problem):
        tried.screen(where, moves, [Pattern(names, text, np.ones(len(problem.error)))], top)
    tried.sharpen(top)
    above = max(linear.square - linear.freedom, 0.1 * linear.square)
    result: list[Suspect] = []
    for worth, fall, where, pattern in tried.found[:top]:
        share, moves = min(1.0, fall / above), tried.moves[where]
        result += [
            Suspect(c, where, pattern.text, share, fall, worth, moves, pattern.values, pattern.channels)
            for c in pattern.channels
        ]
    return result


@dataclass
class _Tried:
    """Patterns that were tried at places: worth, fall of the sum of squares, place and pattern."""

    problem: Problem
    linear: Linear
    count: int
    found: list[tuple[float, float, str, Pattern]] = field(default_factory=list)
    moves: dict[str, Array] = field(default_factory=dict)

    def screen(
        self,
        where: str,
        moves: Array,
        some: Sequence[Pattern],
        top: int,
        times: int = 1,
        values: Array | None = None,
    ) -> None:
        """The best of some patterns at a place, with the price of all that were tried, and ``times`` as many.

        Args:
            values: (n, P) of these patterns, where many places share them.
        """
        if not some:
            return
        self.moves[where] = moves
        values = np.array([p.values for p in some]).T if values is None else values
        linear = self.linear
        fall, count = _falls(self.problem, linear, self.problem.whiten(moves), values)
        for k in np.argsort(-fall)[:top]:
            worth = schwarz(linear.square, float(fall[k]), count, linear.freedom, times * self.count) - ODDS
            if worth > 0:
                # One bad reading makes no law: without the row that gains most there must be something left to say.
                columns = self.problem.whiten(moves * some[k].values[:, None, None])
                square, shared = _without_a_row(linear, columns)
                worth = min(worth, schwarz(square, shared, count, linear.freedom, times * self.count) - ODDS)
            self.found.append((worth, float(fall[k]), where, some[k]))

    def sharpen(self, top: int, most: int = 8) -> None:
        """The same with the edge, knot, phase .. of the best patterns moved to where they explain most."""
        self.found.sort(key=lambda item: -item[0])
        done: set[tuple[str, tuple[str, ...], str]] = set()
        for _, _, where, pattern in self.found[:top]:
            kind = (where, pattern.channels, pattern.text.split(" ")[0])
            if pattern.finer is not None and kind not in done and len(done) < most:
                done.add(kind)
                before = len(self.found)
                rarer = RARER if where.startswith("body") else 1
                self.screen(where, self.moves[where], sharper(pattern), FINEST, 4 * rarer)
                for _, _, _, best in sorted(self.found[before:], key=lambda item: -item[0])[:1]:
                    self.screen(where, self.moves[where], sharper(best), FINEST, 16 * rarer)
        self.found.sort(key=lambda item: -item[0])


def _without_a_row(linear: Linear, columns: Array) -> tuple[float, float]:
    """The sum of squares, and what columns take off it, without the row of which they take most."""
    inside = linear.project(columns)
    fitted = inside @ np.linalg.lstsq(inside, linear.rest, rcond=1e-6)[0]
    square = np.bincount(linear.row, linear.rest**2)
    taken = square - np.bincount(linear.row, (linear.rest - fitted) ** 2)
    most = int(np.argmax(taken))
    return float(square.sum() - square[most]), float(taken.sum() - taken[most])


def _falls(problem: Problem, linear: Linear, place: Array, values: Array) -> tuple[Array, int]:
    """Fall of the sum of squares by a place times each pattern, (P,), and the parameters of one.

    A pattern has one value a pose, so that all products are summed over the numbers of a pose first.

    Args:
        place: (N, m) whitened columns; values: (n, P).
    """
    m = place.shape[1]
    starts = np.flatnonzero(np.diff(problem.row, prepend=-1))
    pose = problem.row[starts]

    size = len(problem.row) // len(pose)
    even = len(problem.row) == size * len(pose) and bool((np.diff(starts) == size).all())

    def by_pose(x: Array) -> Array:
        # Ten times as fast as `reduceat` where all poses have as many numbers.
        return x.reshape(len(pose), size, *x.shape[1:]).sum(axis=1) if even else np.add.reduceat(x, starts, axis=0)

    U = [by_pose(linear.nuisance * place[:, i, None]).T for i in range(m)]
    square = by_pose(place[:, :, None] * place[:, None, :])
    rest = by_pose(linear.rest[:, None] * place)
    P = values.shape[1]
    fall = np.zeros(P)
    chunk = max(1, int(2e7 / max(1, len(pose) * m)))
    for at in range(0, P, chunk):
        b = values[:, at : at + chunk]
        b = b if len(pose) == len(values) else b[pose]
        inside = np.stack([(V @ b).T for V in U], axis=1)
        raw = ((b * b).T @ square.reshape(len(pose), m * m)).reshape(-1, m, m)
        gram = raw - inside @ np.swapaxes(inside, 1, 2)
        along = (rest.T @ b).T
        scale = np.einsum("cii->c", raw)
        alive = np.einsum("cii->c", gram) > 1e-5 * scale
        ridge = 1e-6 * np.where(scale > 0, scale, 1.0)[:, None, None] * np.eye(m)
        solved = np.linalg.solve(gram + ridge, along[:, :, None])[:, :, 0]
        fall[at : at + chunk] = np.where(alive, np.einsum("ci,ci->c", along, solved), 0.0)
    return fall, m


def by_channel(suspects: Sequence[Suspect], beside: Sequence[Suspect] = (), count: int = 5) -> list[Suspect]:
    """The strongest suspect of each channel, and other structures.

    First the strongest pattern, then another place that it cannot be told from, then patterns that were found with it
    taken, before the third dress of the first. What could be chance is left out.
    """
    if not suspects:
        return []
    first = suspects[0]
    suspects = [s for s in suspects if s.evidence > min(0.0, first.evidence - ODDS)]
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
