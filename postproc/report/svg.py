"""Small charts as inline SVG: they need no script and print well."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from postproc.arrays import Array

BLUE, RED, GREY = "#174ea6", "#c5221f", "#9aa0a6"
MOST_POINTS = 4000  # more do not show and make the page heavy


def scatter(
    x: Array, y: Array, x_label: str, y_label: str, band: float | None = None, size: tuple[int, int] = (330, 190)
) -> str:
    """Points (n,) over (n,), with a grey band of plus and minus ``band`` where one is given."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) == 0:
        return ""
    step = -(-len(x) // MOST_POINTS)
    frame = _Frame(_range(x), _range(np.append(y, [0.0, *([band, -band] if band else [])])), size)
    parts = []
    if band:
        top, bottom = frame.y(band), frame.y(-band)
        parts.append(
            f'<rect x="{frame.left}" width="{frame.width:.1f}" y="{top:.1f}" height="{bottom - top:.1f}" '
            f'fill="{GREY}" fill-opacity="0.25"/>'
        )
    parts += [
        f'<circle cx="{frame.x(a):.1f}" cy="{frame.y(b):.1f}" r="1.6" fill="{BLUE}" fill-opacity="0.6"/>'
        for a, b in zip(x[::step], y[::step], strict=True)
    ]
    return frame.draw(parts, x_label, y_label)


def vectors(start: Array, end: Array, x_label: str, y_label: str, size: tuple[int, int] = (500, 420)) -> str:
    """Lines from points (n, 2) to points (n, 2), both axes to the same scale."""
    both = np.vstack([start, end])
    center = (both.max(axis=0) + both.min(axis=0)) / 2
    frame = _Frame((0.0, 1.0), (0.0, 1.0), size)
    half = max(np.ptp(both[:, 0]) / frame.width, np.ptp(both[:, 1]) / frame.height, 1e-9) * 0.55
    wide, high = half * frame.width, half * frame.height
    frame.range_x = (center[0] - wide, center[0] + wide)
    frame.range_y = (center[1] - high, center[1] + high)
    parts = [
        f'<line x1="{frame.x(a[0]):.1f}" y1="{frame.y(a[1]):.1f}" x2="{frame.x(b[0]):.1f}" y2="{frame.y(b[1]):.1f}" '
        f'stroke="{RED}"/><circle cx="{frame.x(a[0]):.1f}" cy="{frame.y(a[1]):.1f}" r="1.6" fill="{BLUE}"/>'
        for a, b in zip(start, end, strict=True)
    ]
    return frame.draw(parts, x_label, y_label)


def bars(labels: Sequence[str], values: Sequence[float], unit: str, floor: float | None = None) -> str:
    """Horizontal bars, with a dashed line at ``floor`` where one is given."""
    width, height, left = 700, 26 * len(values) + 30, 260
    scale = (width - left - 90) / max([*values, floor or 0.0, 1e-12])
    parts: list[str] = []
    for row, (label, value) in enumerate(zip(labels, values, strict=True)):
        y = 26 * row + 8
        parts.append(f'<text x="{left - 8}" y="{y + 13}" text-anchor="end">{escape(label)}</text>')
        parts.append(f'<rect x="{left}" y="{y}" width="{value * scale:.1f}" height="18" fill="{BLUE}"/>')
        parts.append(f'<text x="{left + value * scale + 6:.1f}" y="{y + 13}">{value:.4g} {escape(unit)}</text>')
    if floor is not None:
        x = left + floor * scale
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="2" y2="{height - 22}" stroke="{RED}" stroke-dasharray="4 3"/>'
        )
        parts.append(f'<text x="{x:.1f}" y="{height - 6}" fill="{RED}">noise {floor:.4g} {escape(unit)}</text>')
    return _svg(width, height, parts)


class _Frame:
    """Axes of a chart: from values to places on the page."""

    def __init__(self, x: tuple[float, float], y: tuple[float, float], size: tuple[int, int]) -> None:
        self.range_x, self.range_y, self.size = x, y, size
        self.left, self.top = 52, 10
        self.width, self.height = size[0] - self.left - 8, size[1] - self.top - 36

    def x(self, value: float) -> float:
        low, high = self.range_x
        return self.left + (value - low) / (high - low) * self.width

    def y(self, value: float) -> float:
        low, high = self.range_y
        return self.top + (high - value) / (high - low) * self.height

    def draw(self, parts: list[str], x_label: str, y_label: str) -> str:
        bottom = self.top + self.height
        frame = f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}"'
        axes = [f'{frame} fill="none" stroke="#bbb"/>']
        for value in _ticks(*self.range_y):
            axes.append(f'<text x="{self.left - 5}" y="{self.y(value) + 4:.1f}" text-anchor="end">{value:.6g}</text>')
        for value in _ticks(*self.range_x):
            axes.append(f'<text x="{self.x(value):.1f}" y="{bottom + 14}" text-anchor="middle">{value:.6g}</text>')
        middle = self.left + self.width / 2
        axes.append(f'<text x="{middle:.0f}" y="{bottom + 30}" text-anchor="middle">{escape(x_label)}</text>')
        turn = f'transform="rotate(-90 10 {self.top + self.height / 2:.0f})"'
        y_at = self.top + self.height / 2
        axes.append(f'<text x="10" y="{y_at:.0f}" text-anchor="middle" {turn}>{escape(y_label)}</text>')
        return _svg(*self.size, [*axes, *parts])


def _ticks(low: float, high: float) -> Array:
    """Three to seven round values between two limits."""
    rough = (high - low) / 5
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(power * k for k in (1.0, 2.0, 5.0, 10.0) if power * k >= rough)
    ticks: Array = np.arange(np.ceil(low / step), np.floor(high / step) + 0.5) * step + 0.0  # no negative zero
    return ticks


def _range(values: Array) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _svg(width: int, height: int, parts: Sequence[str]) -> str:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    return f'{head} font-family="sans-serif" font-size="11">{"".join(parts)}</svg>'
