"""The law of a pattern as a formula over a state: a polygon of a channel or of a sum of angles, times a channel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise, permutations

import numpy as np

from postproc.arrays import Array

CLOSE = 0.01
"""Share of its size by which the table may miss the shape."""
STRAIGHT = 0.1
"""A last edge as long as this share of the range is a straight line and goes on; a shorter one may be bent."""
FAR, MOST = 0.1, 0.1
"""A table of every other row may be off by more than FAR in a share MOST of the others: else it is no function."""
ORDERS = (*np.arange(0.25, 6.01, 0.25), *range(7, 129))
"""Waves a turn that are tried, before the best is moved."""
ARRAYS = {
    "q": ("q", "q"),
    "v": ("v", "v"),
    "a": ("a", "a"),
    "dir": ("approach", "approach"),
    "load": ("joint_load", "load"),
}
PLAIN = {"temperature": "temperature", "time": "time", "payload": "payload_mass", "session": "session"}


@dataclass(frozen=True)
class Law:
    """factor * f(argument), as expressions of a state; f is the polygon through (at, shape)."""

    argument: str
    factor: str
    at: Array
    shape: Array


def find_law(names: Sequence[str], values: Array, channels: Mapping[str, Array]) -> Law | None:
    """The shortest polygon that gives the values (n,) from the channels of these names; None where there is none.

    Args:
        channels: (n,) values by name.
    """
    values = values / np.abs(values).max()
    best: Law | None = None
    for argument, x, factor, by in _forms(names, values, channels):
        seen = np.abs(by) > 1e-9 * np.abs(by).max()
        if np.abs(values[~seen]).max(initial=0.0) > CLOSE:
            continue
        points = x[seen], values[seen] / by[seen], np.abs(by[seen])
        table = _polygon(*points) if _is_function(*points) else None
        if table is not None and (best is None or len(table[0]) < len(best.at)):
            best = Law(argument, factor, *table)
    if best is None:
        return None
    at, shape = _going_on(best.at, best.shape)
    return replace(best, at=at, shape=shape)


def _going_on(at: Array, shape: Array) -> tuple[Array, Array]:
    """The polygon with its straight ends longer by its range: what a program asks may lie beyond what was measured."""
    span = float(at[-1] - at[0])
    for end, inner in ((0, 1), (-1, -2)):
        if len(at) > 1 and abs(edge := float(at[end] - at[inner])) >= STRAIGHT * span > 0:
            beyond = span * np.sign(edge)
            on = shape[end] + (shape[end] - shape[inner]) * beyond / edge
            place = 0 if end == 0 else len(at)
            at, shape = np.insert(at, place, at[end] + beyond), np.insert(shape, place, on)
    return at, shape


def _forms(
    names: Sequence[str], values: Array, channels: Mapping[str, Array]
) -> Iterator[tuple[str, Array, str, Array]]:
    """Argument and factor of every law that is tried, as text and as (n,) values; the plainest first."""
    known = [(expression(c), np.asarray(channels[c], dtype=float)) for c in names if expression(c) and c in channels]
    one = np.ones(len(next(iter(channels.values()))))
    for text, x in known:
        yield text, x, "", one
    angles = [(text, x) for text, x in known if text.startswith("state.q[")]
    for (a, x), (b, y) in pairwise(angles):
        yield f"{a} + {b}", x + y, "", one
        yield f"{a} - {b}", x - y, "", one
    if len(angles) == 3:
        yield " + ".join(a for a, _ in angles), np.sum([x for _, x in angles], axis=0), "", one
    for a, x in angles:
        for factor, by in [("", one), *chain.from_iterable(_factors(b, y) for b, y in known if b != a)]:
            order, phase = _wave(values, x, by)
            yield f"np.cos({order:.6g} * {a} - {phase})", np.cos(order * x - phase), factor, by
    for (a, x), (b, y) in pairwise(angles):
        order, phase, other, turn = _waves(values, x, y)
        factor = f" * np.cos({other:.6g} * {b} - {turn})"
        yield f"np.cos({order:.6g} * {a} - {phase})", np.cos(order * x - phase), factor, np.cos(other * y - turn)
    for (a, x), (b, y) in permutations(known, 2):
        for factor, by in _factors(b, y):
            yield a, x, factor, by


def _factors(text: str, values: Array) -> Iterator[tuple[str, Array]]:
    """A channel as it is, its side, and how far it is from its mean."""
    mean = f"{values.mean():.5g}"
    yield f" * {text}", values
    yield f" * np.sign({text})", np.sign(values)
    yield f" * ({text} - {mean})", values - float(mean)


def _wave(values: Array, x: Array, by: Array) -> tuple[float, float]:
    """Order k and phase p of the wave cos(k x - p) by that comes nearest."""
    from scipy.optimize import minimize_scalar

    def rest(k: float) -> float:
        columns = np.stack([np.cos(k * x) * by, np.sin(k * x) * by], axis=1)
        return float(np.sum((values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]) ** 2))

    near = min(ORDERS, key=rest)
    k = float(minimize_scalar(rest, bounds=(max(near - 0.5, 0.1), near + 0.5), method="bounded").x)
    k = near if rest(near) <= rest(k) + 1e-9 else k
    columns = np.stack([np.cos(k * x) * by, np.sin(k * x) * by], axis=1)
    c, s = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(k), _phase(c, s)


def _waves(values: Array, x: Array, y: Array) -> tuple[float, float, float, float]:
    """Orders and phases of the product of two waves cos(k x - p) cos(j y - r) that comes nearest."""

    def fitted(k: float, j: float) -> tuple[float, Array]:
        waves = [f(k * x) * g(j * y) for f in (np.cos, np.sin) for g in (np.cos, np.sin)]
        columns = np.stack(waves, axis=1)
        size = np.linalg.lstsq(columns, values, rcond=None)[0]
        return float(np.sum((values - columns @ size) ** 2)), size.reshape(2, 2)

    grid = np.arange(0.25, 4.01, 0.25)
    k, j = min(((k, j) for k in grid for j in grid), key=lambda pair: fitted(*pair)[0])
    left, _, right = np.linalg.svd(fitted(k, j)[1])
    return float(k), _phase(*left[:, 0]), float(j), _phase(*right[0])


def _phase(c: float, s: float) -> float:
    """Of c cos(x) + s sin(x), from 0 to a turn, as many digits as a file shows."""
    return float(round(np.arctan2(s, c) % (2 * np.pi), 5))


def _is_function(x: Array, y: Array, weight: Array) -> bool:
    """Whether every other point (n,) foretells those between them."""
    order = np.argsort(x, kind="stable")
    x, y, weight = x[order], y[order], weight[order]
    off = np.abs(np.interp(x[1::2], x[::2], y[::2]) - y[1::2]) * weight[1::2]
    return float(np.mean(off > FAR)) <= MOST


def _polygon(x: Array, y: Array, weight: Array) -> tuple[Array, Array] | None:
    """Corners of a short polygon through points (n,), (n,) to CLOSE / weight; None where one x has two values of y.

    Corners are added where the polygon is farthest off (Ramer 1972, Douglas and Peucker 1973).
    """
    order = np.lexsort((y, x))
    x, y, weight = x[order], y[order], weight[order]
    same = np.diff(x) < 1e-9 * (1 + np.abs(x).max())
    if np.any((np.abs(np.diff(y)) * np.minimum(weight[1:], weight[:-1]))[same] > CLOSE):
        return None
    first = np.concatenate([[True], ~same])
    x, y, weight = x[first], y[first], weight[first]
    corners, open_ = [0, len(x) - 1], [(0, len(x) - 1)]
    while open_:
        i, k = open_.pop()
        off = np.abs(np.interp(x[i : k + 1], x[[i, k]], y[[i, k]]) - y[i : k + 1]) * weight[i : k + 1]
        if off.max() > CLOSE:
            middle = i + int(np.argmax(off))
            corners.append(middle)
            open_ += [(i, middle), (middle, k)]
    chosen = np.unique(corners)
    return x[chosen], y[chosen]


def expression(channel: str) -> str:
    """A channel as an expression of a state; empty where a state has none."""
    base, number = _split(channel)
    if base in ARRAYS and number:
        return f"state.{ARRAYS[base][0]}[:, {number - 1}]"
    if channel in PLAIN:
        return f"state.{PLAIN[channel]}"
    if channel in ("fx", "fy", "fz"):
        return f"state.wrench[:, {'xyz'.index(channel[1])}]"
    return "" if channel in ("x", "y", "z") else f'state.channels["{channel}"]'


def channel_read(channel: str) -> str:
    base, number = _split(channel)
    if base in ARRAYS and number:
        return ARRAYS[base][1]
    return "wrench" if channel in ("fx", "fy", "fz") else channel


def _split(channel: str) -> tuple[str, int]:
    base = channel.rstrip("123456")
    return base, int(channel[len(base) :] or 0)
