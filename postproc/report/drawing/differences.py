"""Two paths over each other, as a page draws them: that of the first program, and how far that of the second is off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.rapid.diff.paths import Point, Stop, paired_paths
from postproc.rapid.program.program import Program
from postproc.report.blocks import Values
from postproc.report.drawing.columns import exact

ON_ARC, LEAST_ON_ARC, MOST_PLACES = 64, 8, 20_000
"""Places on an arc; on each of many arcs; and of all arcs together."""


def differences_data(a: Program, b: Program, lines: Sequence[tuple[int | None, int | None]]) -> Values:
    """Return both paths, ``a`` and ``b``, for the scripts of a page.

    Each has places ``p`` (n, 3) [m]; ``stop`` (n,) the number of the target to which each leads; ``row`` (n,) the
    number of the difference there, -1 for none; ``joined`` (n,): a line leads here from the place before; ``unknown``:
    how many targets are not known. ``b`` has the vectors ``away`` (n, 3) [m] to its places from the nearest of ``a``.

    Args:
        lines: on which the statement of each difference stands in both programs.
    """
    stops = paired_paths(a, b)
    every = list(enumerate(lines))
    rows = [{line: k for k, pair in reversed(every) if (line := pair[side]) is not None} for side in (0, 1)]
    first, second = (_path(some, row) for some, row in zip(stops, rows, strict=True))
    shown = [{**path, "p": exact(path["p"])} for path in (first, second)]
    return {"a": shown[0], "b": {**shown[1], "away": exact(_away(first, second, stops[1]))}}


def _path(stops: Sequence[Stop], rows: Mapping[int, int]) -> dict[str, Any]:
    """Return one path, its places as an array.

    Args:
        rows: number of the difference by line.
    """
    known = [i for i, stop in enumerate(stops) if stop.point is not None]
    arcs = sum(stop.via is not None for stop in stops)
    places = int(np.clip(MOST_PLACES // max(arcs, 1), LEAST_ON_ARC, ON_ARC))
    curves = [1e-3 * _segment(stops, i, places) for i in known]
    which = [i for i, curve in zip(known, curves, strict=True) for _ in curve]
    begins = [k == 0 for curve in curves for k in range(len(curve))]
    return {
        "p": np.concatenate([np.zeros((0, 3)), *curves]),
        "stop": which,
        "row": [rows.get(stops[i].line, -1) for i in which],
        "joined": [not begin or _start(stops, i) is not None for i, begin in zip(which, begins, strict=True)],
        "unknown": len(stops) - len(known),
    }


def _away(first: Values, second: Values, stops: Sequence[Stop]) -> Array:
    """Return the vectors (n, 3) [m] to the places of the second path from the nearest of the first, NaN without one.

    Only the part of the first path counts that lies between the partners of the paired targets around a place, so that
    a path that crosses itself, or is welded in several passes, is compared pass by pass.

    Args:
        stops: of the second program.
    """
    p, stop = first["p"], np.array(first["stop"], dtype=int)
    partners = [-1 if s.partner is None else s.partner for s in stops]
    before = np.maximum.accumulate([-1, *partners])[:-1]
    behind = np.minimum.accumulate([len(p) + 1 if k < 0 else k for k in [*partners, -1]][::-1])[::-1][1:]
    away = np.full_like(second["p"], np.nan)
    for k, (place, i) in enumerate(zip(second["p"], second["stop"], strict=True)):
        last = partners[i] if partners[i] > before[i] else behind[i]
        part = np.flatnonzero((stop >= before[i]) & (stop <= max(last, before[i])))
        if len(part):
            away[k] = place - _nearest(p[part], np.array(first["joined"])[part], place)
    return away


def _nearest(p: Array, joined: Array, place: Array) -> Array:
    """Return the place (3,) on the lines through places (n, 3) that is nearest to another.

    Args:
        joined: (n,) whether a line leads to a place from the one before.
    """
    start = np.concatenate([p[:1], p[:-1]])
    along = np.where(joined[:, None], p - start, 0.0)
    along[0] = 0.0
    share = np.sum((place - start) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-18)
    at = np.where(joined[:, None], start, p) + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(at[np.argmin(np.sum((at - place) ** 2, axis=1))])


def _start(stops: Sequence[Stop], i: int) -> Point | None:
    """Return the place from which a line leads to a stop; None where there is none, or it is not known."""
    return stops[i - 1].point if i > 0 and stops[i].joined else None


def _segment(stops: Sequence[Stop], i: int, places: int) -> Array:
    """Return places (n, 3) [mm] from behind the stop before to a stop: its end, or so many on the arc through `via`."""
    start, via, end = _start(stops, i), stops[i].via, stops[i].point
    assert end is not None
    return np.array([end]) if via is None or start is None else arc(start, via, end, places)


def arc(start: Point, via: Point, end: Point, places: int) -> Array:
    """Return places (n, 3) on the arc from a start, which is not among them, through a point to an end.

    That point and the end where the three lie on a line.
    """
    p, v, q = (np.array(x, dtype=float) for x in (start, via, end))
    a, b = v - p, q - p
    normal = np.cross(a, b)
    square = float(normal @ normal)
    if square < 1e-12 * float(a @ a) * float(b @ b) or square == 0.0:
        return np.array([v, q])
    center = p + (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2 * square)
    radial = p - center
    radius = float(np.linalg.norm(radial))
    x = radial / radius
    y = np.cross(normal / np.sqrt(square), x)
    turn = float(np.arctan2((q - center) @ y, (q - center) @ x)) % (2 * np.pi)
    u = np.linspace(0.0, turn, places + 1)[1:, None]
    return np.asarray(center + radius * (np.cos(u) * x + np.sin(u) * y))
