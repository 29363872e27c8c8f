"""Axes, marks and labels of small charts as inline SVG, coloured by the style sheet: no script, they print well."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from postproc.arrays import Array

Range = tuple[float, float]


class ChartAxes:
    """Axes of a chart, which convert values to pixels."""

    def __init__(self, x: Range, y: Range, size: tuple[int, int], title: str = "") -> None:
        """Set the ranges of x and y and the size of the image [pixels]; a title takes 16 pixels at the top."""
        self.range_x, self.range_y, self.size, self.title = x, y, size, title
        self.left, self.top = 56, 26 if title else 10
        self.width, self.height = size[0] - self.left - 8, size[1] - self.top - 40

    def places(self, x: Array, y: Array) -> Array:
        """Return the pixels (n, 2), from the left and from the top, of values x (n,) and y (n,)."""
        (x0, x1), (y0, y1) = self.range_x, self.range_y
        across = self.left + (x - x0) / (x1 - x0) * self.width
        down = self.top + (y1 - y) / (y1 - y0) * self.height
        return np.stack([across, down], axis=-1)

    def x(self, value: float) -> float:
        """Return the horizontal place [pixels] of a value of x."""
        return float(self.places(np.array(value), np.array(0.0))[0])

    def y(self, value: float) -> float:
        """Return the vertical place [pixels], from the top, of a value of y."""
        return float(self.places(np.array(0.0), np.array(value))[1])

    def draw(self, parts: Sequence[str], x_label: str, y_label: str, powers: bool = False) -> str:
        """Return the chart as SVG: ``parts`` inside the axes, ticks and labels around them.

        Args:
            parts: SVG elements in pixels. powers: ticks of x show 10^x, for a logarithmic axis.
        """
        bottom, middle = self.top + self.height, self.left + self.width / 2
        frame = f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}"'
        axes = [f'{frame} class="frame"/>']
        for value in ticks(*self.range_y):
            axes.append(f'<text x="{self.left - 5}" y="{self.y(value) + 4:.1f}" text-anchor="end">{value:.6g}</text>')
        for value in ticks(*self.range_x):
            text = f"{10**value:.1g}" if powers else f"{value:.6g}"
            axes.append(f'<text x="{self.x(value):.1f}" y="{bottom + 15}" text-anchor="middle">{text}</text>')
        axes.append(f'<text x="{middle:.0f}" y="{bottom + 33}" text-anchor="middle">{escape(x_label)}</text>')
        y_at = self.top + self.height / 2
        turn = f'transform="rotate(-90 12 {y_at:.0f})"'
        axes.append(f'<text x="12" y="{y_at:.0f}" text-anchor="middle" {turn}>{escape(y_label)}</text>')
        if self.title:
            axes.append(f'<text x="2" y="16" class="title">{escape(self.title)}</text>')
        wide, high = self.size
        name = escape(self.title or f"{y_label} over {x_label}")
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}" viewBox="0 0 {wide} {high}"'
        head += f' role="img" aria-label="{name}" font-family="system-ui, sans-serif" font-size="13">'
        return f"{head}{''.join([*axes, *parts])}</svg>"


def line(places: Array, kind: str) -> str:
    """Return a line through points (n, 2) [pixels] as SVG; NaN interrupts it.

    Args:
        kind: its class in the style sheet.
    """
    known = np.asarray(np.isfinite(places).all(axis=1))
    begins = known & ~np.concatenate([[False], known[:-1]])
    path = "".join(f"{'M' if begins[i] else 'L'}{places[i, 0]:.1f} {places[i, 1]:.1f}" for i in np.flatnonzero(known))
    return f'<path d="{path}" class="line {kind}"/>'


def band(low: Array, high: Array, kind: str) -> str:
    """Return the area between two lines (n, 2) [pixels] as SVG, of a class ``kind`` of the style sheet."""
    around = np.concatenate([low, high[::-1]])
    return f'<path d="M{"L".join(f"{x:.1f} {y:.1f}" for x, y in around)}Z" class="{kind}"/>'


def ticks(low: float, high: float) -> Array:
    """Return three to seven round values between two limits, for the ticks of an axis."""
    rough = (high - low) / 5
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(power * k for k in (1.0, 2.0, 5.0, 10.0) if power * k >= rough)
    return np.arange(np.ceil(low / step), np.floor(high / step) + 0.5) * step + 0.0  # no negative zero


def spread(values: Array) -> Range:
    """Return the lowest and the highest of some values, with a margin of 5 % on each side."""
    low, high = float(values.min()), float(values.max())
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin
