"""What the remaining structure follows when no effect of the library explains it.

Free patterns of channels at places of the arm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import shown
from postproc.identify.forms import schwarz
from postproc.identify.linear import Linear
from postproc.identify.problem import Problem
from postproc.identify.sensitivity import INSTRUMENT, TOOL

STEPS, KINKS, HARMONICS = 24, 9, (1, 2, 3)
ODDS = 16.0
"""A pattern that nobody has a name for needs exp(ODDS / 2) = 3000 times the likelihood of a named effect."""


@dataclass(frozen=True)
class Pattern:
    """A function of one or two channels, (n,) values without physical unit.

    Args:
        channels: one or two names; text: such as ``step near 22 deg``.
        source: the channel itself, where the pattern has an edge or a knot that can be moved.
    """

    channels: tuple[str, ...]
    text: str
    values: Array
    source: Array | None = None


@dataclass(frozen=True)
class Suspect:
    """A place of the arm that moves with a pattern of a channel.

    Args:
        channel, where, pattern: for people; share: of the whitened sum of squares above the noise that it explains.
        fall: of the whitened sum of squares; evidence: worth after counting all patterns that were tried.
        columns: (N, m) whitened columns.
    """

    channel: str
    where: str
    pattern: str
    share: float
    fall: float
    evidence: float
    columns: Array

    def as_json(self) -> dict[str, Any]:
        return {"channel": self.channel, "where": self.where, "share": round(self.share, 4), "pattern": self.pattern}


def patterns(channels: Mapping[str, Array]) -> list[Pattern]:
    """Steps, kinks, low powers and windows of every channel, and products of two."""
    found: list[Pattern] = []
    for name, values in channels.items():
        found += _of_one(name, values)
    names = list(channels)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            if {first[0], second[0]} <= {"x", "y", "z"} and len(first) == len(second) == 1:
                continue
            found += _of_two(first, channels[first], second, channels[second])
    return found


def _of_one(name: str, values: Array) -> Iterator[Pattern]:
    distinct = np.unique(values)
    if len(distinct) <= 4:
        # Approach sides, payloads, sessions: their own value, and being one of them.
        yield Pattern((name,), "proportional", values)
        if len(distinct) > 2:
            for value in distinct:
                yield Pattern((name,), f"at {shown(name, float(value))}", (values == value).astype(float))
        return
    centre, half = float(np.median(values)), 0.5 * float(np.ptp(values))
    scaled = (values - centre) / half
    yield Pattern((name,), "proportional", scaled)
    yield Pattern((name,), "curved", scaled**2)
    yield Pattern((name,), "s-shaped", scaled**3)
    span = np.quantile(values, np.linspace(0.04, 0.96, STEPS))
    edges = list(span) + ([0.0] if values.min() < 0 < values.max() else [])
    for edge in edges:
        yield Pattern((name,), f"step near {shown(name, float(edge))}", (values > edge) * 1.0, values)
    knots = list(np.quantile(values, np.linspace(0.1, 0.9, KINKS))) + ([0.0] if values.min() < 0 < values.max() else [])
    for knot in knots:
        yield Pattern((name,), f"kink near {shown(name, float(knot))}", np.abs(values - knot) / half, values)
    if name == "time":
        since = (values - values.min()) / max(float(np.ptp(values)), 1e-300)
        for share in (0.05, 0.1, 0.2, 0.4):
            yield Pattern((name,), f"settling within {shown(name, share * 2 * half)}", np.exp(-since / share))
        for k in range(1, 6):
            for wave in (np.sin, np.cos):
                yield Pattern(
                    (name,), f"swaying with a period of {shown(name, 2 * half / k)}", wave(2 * np.pi * k * since)
                )
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4):
            if k + width < STEPS:
                inside = (values > span[k]) & (values < span[k + width])
                text = f"only between {shown(name, float(span[k]))} and {shown(name, float(span[k + width]))}"
                yield Pattern((name,), text, inside * 1.0)


def _of_two(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    text = f"product of {first} and {second}"
    names = (first, second)
    raw = a * b
    yield Pattern(names, text, raw / max(float(np.abs(raw).max()), 1e-300))
    middle = (a - a.mean()) * (b - b.mean())
    yield Pattern(names, text, middle / max(float(np.abs(middle).max()), 1e-300))
    if first[0] == second[0] == "q":
        for k in HARMONICS:
            for j in HARMONICS:
                for f, g in ((np.sin, np.sin), (np.sin, np.cos), (np.cos, np.sin), (np.cos, np.cos)):
                    yield Pattern(names, f"product of {k} {first} and {j} {second} waves", f(k * a) * g(j * b))
    for sign, size, order in ((a, b, names), (b, a, names[::-1])):
        if order[0].startswith(("dir", "v")) and order[1].startswith("load"):
            value = np.sign(sign) * np.abs(size)
            yield Pattern(
                order, f"side of {order[0]} times size of {order[1]}", value / max(float(np.abs(value).max()), 1e-300)
            )


def places(problem: Problem) -> dict[str, Array]:
    """(n, r, m) derivative of the prediction by a move at each place.

    Joints (turn), instrument and tool (translation).
    """
    J = problem.sensitivity.matrix
    found = {f"joint {j + 1}": J[:, :, j : j + 1] for j in range(6)}
    found["instrument"] = J[:, :, INSTRUMENT : INSTRUMENT + 3]
    found["tool"] = J[:, :, TOOL : TOOL + 3]
    return {name: columns for name, columns in found.items() if columns.any()}


def _scaling(problem: Problem) -> Array:
    """(n, r, 1) what a scale error of the instrument does: every position moves along itself.

    The predicted one: a column that holds the measured numbers would explain their noise.
    """
    scaling = np.zeros((*problem.error.shape, 1))
    predicted = problem.data.position - problem.error[:, :3]
    scaling[:, :3, 0] = np.where(np.isfinite(predicted), predicted, 0.0)
    return scaling


def find_suspects(problem: Problem, linear: Linear, every: list[Pattern], top: int = 40) -> list[Suspect]:
    """The patterns that would bring the residual down most, strongest first.

    With the fitted parameters projected out.
    """
    rows = problem.row
    values = np.array([p.values for p in every]).T
    before = linear.square
    places_ = {name: problem.whiten(J) for name, J in places(problem).items()}
    tried = len(every) * len(places_)
    found: list[tuple[float, float, str, int]] = []
    for where, J in places_.items():
        fall, count = _falls(problem, linear, J, values)
        for k in np.argsort(-fall)[:top]:
            worth = schwarz(before, float(fall[k]), count, linear.freedom, tried) - ODDS
            found.append((worth, float(fall[k]), where, int(k)))
    every = list(every)
    scale = problem.whiten(_scaling(problem))
    scaled = float(_falls(problem, linear, scale, np.ones((len(problem.error), 1)))[0][0])
    every.append(Pattern(("x", "y", "z"), "proportional: the instrument's scale", np.ones(len(problem.error))))
    places_["scale of the instrument"] = scale
    found.append(
        (schwarz(before, scaled, 1, linear.freedom, tried) - ODDS, scaled, "scale of the instrument", len(every) - 1)
    )
    found.sort(key=lambda item: -item[0])
    found, every = _sharpened(problem, linear, found[:top], every, places_, tried)
    above = max(before - linear.freedom, 0.1 * before)
    result: list[Suspect] = []
    for worth, fall_, where, k in found[:top]:
        pattern = every[k]
        columns = places_[where] * pattern.values[rows, None]
        share = min(1.0, fall_ / above)
        for channel in pattern.channels:
            result.append(Suspect(channel, where, pattern.text, share, fall_, worth, columns))
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
        finer = _finer(kind, pattern)
        fall, count = _falls(problem, linear, places_[where], np.array([p.values for p in finer]).T)
        best = int(np.argmax(fall))
        worth = schwarz(before, float(fall[best]), count, linear.freedom, 4 * tried) - ODDS
        every.append(finer[best])
        found.append((worth, float(fall[best]), where, len(every) - 1))
    found.sort(key=lambda item: -item[0])
    return found, every


def _finer(kind: str, pattern: Pattern) -> list[Pattern]:
    assert pattern.source is not None
    values, name = pattern.source, pattern.channels[0]
    distinct = np.unique(values)
    edges = 0.5 * (distinct[1:] + distinct[:-1])
    edges = edges[:: max(1, len(edges) // 400)]
    half = 0.5 * float(np.ptp(values))
    if kind == "step":
        return [Pattern((name,), f"step near {shown(name, float(e))}", (values > e) * 1.0) for e in edges]
    # A step lies between two rows, a kink anywhere.
    edges = np.linspace(float(np.quantile(values, 0.02)), float(np.quantile(values, 0.98)), 400)
    return [Pattern((name,), f"kink near {shown(name, float(e))}", np.abs(values - e) / half) for e in edges]


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
