"""What the remaining structure follows when no effect of the library explains it: patterns at places of the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.identify.forms import schwarz
from postproc.identify.linear import Linear
from postproc.identify.patterns import Pattern, sharper
from postproc.identify.problem import Problem
from postproc.identify.sensitivity import BODY, INSTRUMENT, TOOL

ODDS = 16.0
"""A pattern that nobody has a name for needs exp(ODDS / 2) = 3000 times the likelihood of a named effect."""


@dataclass(frozen=True)
class Suspect:
    """A place of the arm that moves with a pattern of a channel.

    Args:
        channel, where, pattern: for people; share: of the whitened sum of squares above the noise that it explains.
        fall: of the whitened sum of squares; evidence: worth after counting all patterns that were tried.
        place: (n, r, m) how the prediction moves with the place; values: (n,) of the pattern.
    """

    channel: str
    where: str
    pattern: str
    share: float
    fall: float
    evidence: float
    place: Array
    values: Array

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


def _fields(problem: Problem) -> dict[str, Array]:
    """(n, r, m) what an instrument does that measures space wrongly: a scale, axes of their own, curved axes.

    Smooth fields of the predicted position: a column that holds the measured numbers would explain their noise.
    """
    predicted = np.nan_to_num(problem.data.position - problem.error[:, :3])
    p = (predicted - predicted.mean(axis=0)) / max(float(np.abs(predicted).max()), 1e-300)
    square = np.stack([p[:, i] * p[:, j] for i in range(3) for j in range(i, 3)], axis=1)

    def moves(values: Array) -> Array:
        found = np.zeros((*problem.error.shape, 3 * values.shape[1]))
        found[:, :3] = np.einsum("nk,ij->nikj", values, np.eye(3)).reshape(len(p), 3, -1)
        return found

    scale = np.zeros((*problem.error.shape, 1))
    scale[:, :3, 0] = p
    return {"scale": scale, "axes of their own scale and angle": moves(p), "curved axes": moves(square)}


def find_suspects(problem: Problem, linear: Linear, every: list[Pattern], top: int = 40) -> list[Suspect]:
    """The patterns that would bring the residual down most, strongest first.

    With the fitted parameters projected out.
    """
    values = np.array([p.values for p in every]).T
    before = linear.square
    moves = places(problem)
    places_ = {name: problem.whiten(J) for name, J in moves.items()}
    tried = len(every) * len(places_)
    found: list[tuple[float, float, str, int]] = []
    for where, J in places_.items():
        fall, count = _falls(problem, linear, J, values)
        for k in np.argsort(-fall)[:top]:
            worth = schwarz(before, float(fall[k]), count, linear.freedom, tried) - ODDS
            found.append((worth, float(fall[k]), where, int(k)))
    every = list(every)
    for text, field in _fields(problem).items():
        where = f"instrument, {text}"
        every.append(Pattern(("x", "y", "z"), "smooth in the place", np.ones(len(problem.error))))
        moves[where], places_[where] = field, problem.whiten(field)
        one, count = _falls(problem, linear, places_[where], every[-1].values[:, None])
        worth = schwarz(before, float(one[0]), count, linear.freedom, tried) - ODDS
        found.append((worth, float(one[0]), where, len(every) - 1))
    found.sort(key=lambda item: -item[0])
    found, every = _sharpened(problem, linear, found[:top], every, places_, tried)
    above = max(before - linear.freedom, 0.1 * before)
    result: list[Suspect] = []
    for worth, fall_, where, k in found[:top]:
        pattern = every[k]
        share = min(1.0, fall_ / above)
        for channel in pattern.channels:
            result.append(Suspect(channel, where, pattern.text, share, fall_, worth, moves[where], pattern.values))
    return result


def _sharpened(
    problem: Problem,
    linear: Linear,
    found: list[tuple[float, float, str, int]],
    every: list[Pattern],
    places_: Mapping[str, Array],
    tried: int,
) -> tuple[list[tuple[float, float, str, int]], list[Pattern]]:
    """The same with the edge of the best step and the knot of the best kink moved to where they explain most."""
    before = linear.square
    every = list(every)
    done: set[tuple[str, str, str]] = set()
    for _, _, where, k in list(found):
        pattern = every[k]
        kind = pattern.text.split(" ")[0]
        if pattern.source is None or (where, pattern.channels[0], kind) in done or len(done) >= 6:
            continue
        done.add((where, pattern.channels[0], kind))
        finer = sharper(pattern)
        fall, count = _falls(problem, linear, places_[where], np.array([p.values for p in finer]).T)
        best = int(np.argmax(fall))
        worth = schwarz(before, float(fall[best]), count, linear.freedom, 4 * tried) - ODDS
        every.append(finer[best])
        found.append((worth, float(fall[best]), where, len(every) - 1))
    found.sort(key=lambda item: -item[0])
    return found, every


def _falls(problem: Problem, linear: Linear, place: Array, values: Array) -> tuple[Array, int]:
    """Fall of the sum of squares by a place times each pattern, (P,), and the parameters of one.

    A pattern has one value a pose, so that all products are summed over the numbers of a pose first.

    Args:
        place: (N, m) whitened columns; values: (n, P).
    """
    m = place.shape[1]
    starts = np.flatnonzero(np.diff(problem.row, prepend=-1))
    pose = problem.row[starts]

    def by_pose(x: Array) -> Array:
        return np.asarray(np.add.reduceat(x, starts, axis=0))

    U = [by_pose(linear.nuisance * place[:, i, None]).T for i in range(m)]
    square = by_pose(place[:, :, None] * place[:, None, :])
    rest = by_pose(linear.rest[:, None] * place)
    P = values.shape[1]
    fall = np.zeros(P)
    chunk = max(1, int(2e7 / max(1, len(pose) * m)))
    for at in range(0, P, chunk):
        b = values[pose, at : at + chunk]
        inside = np.stack([V @ b for V in U])
        raw = np.einsum("nij,nc->cij", square, b**2)
        gram = raw - np.einsum("ikc,jkc->cij", inside, inside)
        along = (rest.T @ b).T
        scale = np.einsum("cii->c", raw)
        alive = np.einsum("cii->c", gram) > 1e-5 * scale
        ridge = 1e-6 * np.where(scale > 0, scale, 1.0)[:, None, None] * np.eye(m)
        solved = np.linalg.solve(gram + ridge, along[:, :, None])[:, :, 0]
        fall[at : at + chunk] = np.where(alive, np.einsum("ci,ci->c", along, solved), 0.0)
    return fall, m


def by_channel(suspects: list[Suspect], count: int = 5) -> list[Suspect]:
    """The strongest suspect of each channel."""
    seen: dict[str, Suspect] = {}
    for suspect in suspects:
        seen.setdefault(suspect.channel, suspect)
    return list(seen.values())[:count]
