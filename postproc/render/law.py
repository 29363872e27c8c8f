"""The law of a pattern as a formula over a state: a polygon of a channel or of a sum of angles, times a channel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np

from postproc.arrays import Array

CLOSE = 0.01
"""Share of its size by which the table may miss the shape."""
SHORT = 0.5
"""Of the rows, as many points of a table at most: what takes more is no function of that channel."""
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
    for argument, x, factor, by in _forms(names, channels):
        seen = np.abs(by) > 1e-9 * np.abs(by).max()
        if np.abs(values[~seen]).max(initial=0.0) > CLOSE:
            continue
        table = _polygon(x[seen], values[seen] / by[seen], np.abs(by[seen]))
        if table is not None and len(table[0]) < (SHORT * len(values) if best is None else len(best.at)):
            best = Law(argument, factor, *table)
    return best


def _forms(names: Sequence[str], channels: Mapping[str, Array]) -> Iterator[tuple[str, Array, str, Array]]:
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
    for (a, x), (b, y) in permutations(known, 2):
        yield a, x, f" * {b}", y
        yield a, x, f" * np.sign({b})", np.sign(y)
        yield a, x, f" * ({b} - {y.mean():.5g})", y - float(f"{y.mean():.5g}")


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
