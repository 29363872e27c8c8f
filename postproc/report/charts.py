"""The charts of the reports: points over a channel, arrows in a plane, a course over time, bars with a floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.report.svg import BLUE, GREY, RED, Frame, arrows, dots, line, ring, spread

FEW = 6  # a channel with so few values is drawn as columns of points


@dataclass(frozen=True, slots=True)
class Bins:
    """Means of the points over (k,) values of x, with their standard errors, and what each says when pointed at."""

    x: Array
    mean: Array
    error: Array
    text: Sequence[str]


def scatter(
    x: Array,
    y: Array,
    x_label: str,
    y_label: str,
    *,
    band: float | None = None,
    title: str = "",
    bins: Bins | None = None,
    marks: Sequence[tuple[int, str]] = (),
    size: tuple[int, int] = (330, 210),
) -> str:
    """Points (n,) over (n,), with a grey band of plus and minus ``band``; few values of x become columns of points.

    Args:
        marks: points that are ringed, and what each says when pointed at.
    """
    good = np.isfinite(x) & np.isfinite(y)
    if not good.any():
        return ""
    distinct = np.unique(x[good])
    if len(distinct) <= FEW and good.sum() > len(distinct):
        wide = 0.3 * (float(np.diff(distinct).min()) if len(distinct) > 1 else 1.0)
        x = x + wide * ((0.618034 * np.arange(len(x))) % 1.0 - 0.5)  # golden ratio: evenly, whatever the order
    frame = Frame(spread(x[good]), spread(np.append(y[good], [0.0, *([band, -band] if band else [])])), size, title)
    parts = []
    if band:
        top, bottom = frame.y(band), frame.y(-band)
        parts.append(
            f'<rect x="{frame.left}" width="{frame.width:.1f}" y="{top:.1f}" height="{bottom - top:.1f}" '
            f'fill="{GREY}" fill-opacity="0.25"/>'
        )
    places = frame.places(x, y)
    parts.append(dots(places[good]))
    if bins is not None:
        parts += _means(frame, bins)
    parts += [ring(places[i], text) for i, text in marks if good[i]]
    return frame.draw(parts, x_label, y_label)


def vectors(start: Array, end: Array, x_label: str, y_label: str, way: Array | None) -> str:
    """Arrows from points (n, 2) to points (n, 2), both axes to the same scale; ``way`` (m, 2) is a line behind them."""
    both = np.vstack([start, end] if way is None else [start, end, way[np.isfinite(way).all(axis=1)]])
    center = (both.max(axis=0) + both.min(axis=0)) / 2
    frame = Frame((0.0, 1.0), (0.0, 1.0), (500, 420))
    half = max(np.ptp(both[:, 0]) / frame.width, np.ptp(both[:, 1]) / frame.height, 1e-9) * 0.53
    wide, high = half * frame.width, half * frame.height
    frame.range_x = (center[0] - wide, center[0] + wide)
    frame.range_y = (center[1] - high, center[1] + high)
    behind = [] if way is None else [line(frame.places(*way.T), GREY)]
    first, last = frame.places(*start.T), frame.places(*end.T)
    return frame.draw([*behind, dots(first), arrows(first, last, RED)], x_label, y_label)


def course(x: Array, y: Array, x_label: str, y_label: str, *, limit: float, color: str, title: str) -> str:
    """The largest of (n,) values in every pixel over (n,), not negative, with a dashed line at ``limit``."""
    frame = Frame((float(x.min()), float(x.max()) + 1e-9), (0.0, 1.06 * max(float(y.max()), limit)), (1030, 190), title)
    pixel = np.clip(((x - x.min()) / max(float(np.ptp(x)), 1e-9) * frame.width).astype(int), 0, frame.width - 1)
    top = np.full(frame.width, -np.inf)
    np.maximum.at(top, pixel, y)
    seen = np.flatnonzero(np.isfinite(top))
    at = frame.y(limit)
    parts = [
        line(np.stack([frame.left + seen + 0.5, frame.places(np.zeros(len(seen)), top[seen])[:, 1]], axis=1), color),
        f'<line x1="{frame.left}" x2="{frame.left + frame.width}" y1="{at:.1f}" y2="{at:.1f}" stroke="#444" '
        'stroke-dasharray="4 3"/>',
    ]
    return f'<div class="course">{frame.draw(parts, x_label, y_label)}</div>'


def bars(levels: Mapping[str, float | None], floor: float | None = None, aside: str = "", unit: str = "mm") -> str:
    """Horizontal bars, a dashed line at ``floor`` where one is given; the level ``aside`` is drawn in grey."""
    known = {label: value for label, value in levels.items() if value is not None}
    percent = 100 / max([*known.values(), floor or 0.0, 1e-12])
    end = "" if floor is None else f'<i class="floor" style="left: {floor * percent:.1f}%; border-color: {RED}"></i>'
    rows = []
    for label, value in known.items():
        bar = f"width: {value * percent:.1f}%; background: {GREY if label == aside else BLUE}"
        figure = f"{value:.3f} {unit}"
        rows.append(f'<span>{escape(label)}</span><b><i style="{bar}"></i>{end}</b><span>{figure}</span>')
    if floor is not None:
        rows.append(f'<span style="color: {RED}">noise</span><b>{end}</b><span>{floor:.3f} {unit}</span>')
    return f'<div class="bars">{"".join(rows)}</div>'


def _means(frame: Frame, bins: Bins) -> list[str]:
    """Bin means joined by a line, each with its standard error."""
    places = frame.places(bins.x, bins.mean)
    parts = [line(places, RED)] if len(bins.x) > FEW else []
    for (x, y), mean, error, text in zip(places, bins.mean, bins.error, bins.text, strict=True):
        low, high = frame.y(mean - error), frame.y(mean + error)
        parts.append(
            f'<g stroke="{RED}" fill="{RED}"><title>{escape(text)}</title><circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/>'
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{low:.1f}" y2="{high:.1f}"/></g>'
        )
    return parts
