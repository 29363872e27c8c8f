"""The charts of the reports, as inline SVG that the style sheet colours: they print well, and are saved as CSV and PNG.

Points over a channel with a law through them, lines, bars with a floor; axes with ticks and labels around them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.report.blocks import Bars
from postproc.report.drawing.columns import packed

Range = tuple[float, float]
FEW_LEVELS = 6  # a channel with so few values is drawn as columns of points
SIZE = (340, 220)  # as wide as a phone shows without making its text smaller


@dataclass(frozen=True, slots=True)
class Bins:
    """Means of the points in k bins over x, with their standard errors and the texts they show when pointed at."""

    x: Array
    mean: Array
    error: Array
    text: Sequence[str]


@dataclass(frozen=True, slots=True)
class DrawnCurve:
    """A curve y (k,) to draw over x (k,), with its standard deviation sigma (k,)."""

    x: Array
    y: Array
    sigma: Array


def scatter(
    x: Array,
    y: Array,
    x_label: str,
    y_label: str,
    *,
    noise: float | None = None,
    title: str = "",
    bins: Bins | None = None,
    marks: Sequence[tuple[int, str]] = (),
    curve: DrawnCurve | None = None,
    across: Range | None = None,
) -> str:
    """Return a chart of points y over x, (n,) each, as SVG; few distinct values of x become columns of points.

    Args:
        noise: half width of a grey band about zero. bins: means to draw.
        marks: indices of points that are ringed, each with the text it shows.
        curve: drawn with a band of twice its standard deviation.
        across: lowest and highest y of the axis, where charts are to be compared; None fits it to the points.
    """
    good = np.isfinite(x) & np.isfinite(y)
    if not good.any():
        return ""
    measured, distinct = x, np.unique(x[good])
    columns = len(distinct) <= FEW_LEVELS and good.sum() > len(distinct)
    if columns:
        wide = 0.3 * (float(np.diff(distinct).min()) if len(distinct) > 1 else 1.0)
        x = x + wide * ((0.618034 * np.arange(len(x))) % 1.0 - 0.5)  # golden ratio: evenly, whatever the order
    reach = np.concatenate([y[good], [0.0], np.zeros(0) if curve is None else curve.y])
    if noise is not None:
        reach = np.append(reach, [noise, -noise])
    frame = ChartAxes(spread(x[good]), across or spread(reach), SIZE, title)
    parts = []
    if noise is not None:
        top, bottom = max(frame.y(noise), frame.top), min(frame.y(-noise), frame.top + frame.height)
        place = f'x="{frame.margin}" width="{frame.width:.1f}" y="{top:.1f}" height="{bottom - top:.1f}"'
        parts.append(f'<rect {place} class="noise"/>')
    places = frame.places(x, np.clip(y, *frame.range_y))
    points = np.unique(np.round(2 * places[good]).astype(int), axis=0) / 2  # once on the same half pixel
    path = "".join(f"M{right:g} {down:g}h0" for right, down in points)
    parts.append(f'<path d="{path}" class="points" stroke-width="{3 if len(points) < 1000 else 2}"/>')
    if bins is not None:
        parts += _means(frame, bins)
    if curve is not None:
        parts += _curve(frame, curve, columns)
    for (right, down), text in ((places[i], text) for i, text in marks if good[i]):
        ring = f'<circle cx="{right:.1f}" cy="{down:.1f}" r="4" class="ring">'
        parts.append(f"{ring}<title>{escape(text)}</title></circle>")
    known = {x_label: measured[good], y_label: y[good]}
    if curve is not None:
        known |= {f"{x_label} of the curve": curve.x, "curve": curve.y, "its standard deviation": curve.sigma}
    return frame.draw(parts, x_label, y_label, known)


def shares(curves: Mapping[str, tuple[str, Array]], unit: str, title: str, most: float | None = None) -> str:
    """Return an SVG chart of the share of poses [%] at or below each distance, a curve for each name.

    Args:
        curves: by name, class in the style sheet and (n,) distances [unit]; NaN is left out.
        most: end of the axis [unit], where charts are to be compared; None fits it to the curves.
    """
    known = {name: (kind, np.sort(values[np.isfinite(values)])) for name, (kind, values) in curves.items()}
    known = {name: (kind, values) for name, (kind, values) in known.items() if len(values)}
    if not known:
        return ""
    most = most or max(float(np.percentile(values, 99.5)) for _, values in known.values()) or 1.0
    frame = ChartAxes((0.0, 1.05 * most), (0.0, 100.0), SIZE, title)
    parts = []
    for k, (name, (kind, values)) in enumerate(known.items()):
        at = np.linspace(0.0, 1.05 * most, 120)
        parts.append(line(frame.places(at, 100 * np.searchsorted(values, at, side="right") / len(values)), kind))
        y = frame.top + frame.height - 12 - 17 * (len(known) - 1 - k)
        right = frame.margin + frame.width - 8
        parts.append(f'<text x="{right - 26}" y="{y}" text-anchor="end">{escape(name)}</text>')
        parts.append(line(np.array([[right - 20, y - 4], [right, y - 4]]), kind))
    columns = {f"{name} [{unit}]": values for name, (_, values) in known.items()}
    return frame.draw(parts, f"distance [{unit}]", "% of the poses", columns)


def bars(block: Bars) -> str:
    """Return horizontal bars as HTML, with a dashed line at the floor if known; the bar named ``grey`` is grey.

    Bars that are steps, or have a grey one beside them, go from the model as it came to what was found.
    """
    known = [level for level in block.bars if level.value is not None]
    floor = block.floor
    # A grey bar may be of any length, and ends where the others do.
    values = [level.value or 0.0 for level in known if level.name != block.grey or len(known) == 1]
    percent = 100 / max([*values, floor or 0.0, 1e-12])
    end = "" if floor is None else f'<i class="floor" style="left: {floor * percent:.1f}%"></i>'
    rows = []
    for k, level in enumerate(known):
        fall = bool(block.steps or block.grey)
        kind = "aside" if level.name == block.grey else "later" if fall and k else "first" if fall else ""
        hint = f' title="{escape(level.note)}"' if level.note else ""
        bar = f'<i class="{kind}"{hint} style="width: {min((level.value or 0.0) * percent, 100.0):.1f}%"></i>'
        name = f"<span>{escape(level.name)}</span>"
        if level.name in block.steps:
            name = f'<button type="button" data-step="{block.steps.index(level.name)}">{escape(level.name)}</button>'
        rows.append(f"{name}<b>{bar}{end}</b><span>{level.value:.3f} {block.unit}</span>")
    if floor is not None:
        figure = f'<span class="noise">{floor:.3f} {block.unit}</span>'
        rows.append(f'<span class="noise">noise</span><b>{end}</b>{figure}')
    return f'<div class="bars">{"".join(rows)}</div>'


def _means(frame: ChartAxes, bins: Bins) -> list[str]:
    """Return the means of bins joined by a line, each with its standard error, as SVG."""
    low, high = frame.range_y
    places = frame.places(bins.x, np.clip(bins.mean, low, high))
    parts = [line(places, "means")] if len(bins.x) > FEW_LEVELS else []
    for (x, y), mean, error, text in zip(places, bins.mean, bins.error, bins.text, strict=True):
        ends = [frame.y(float(np.clip(mean + side * error, low, high))) for side in (-1, 1)]
        parts.append(
            f'<g class="mean"><title>{escape(text)}</title><circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/>'
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{ends[0]:.1f}" y2="{ends[1]:.1f}"/></g>'
        )
    return parts


def _curve(frame: ChartAxes, curve: DrawnCurve, columns: bool) -> list[str]:
    """Return a curve with a band of twice its standard deviation as SVG.

    Args:
        columns: x has few values; then each has a bar at the height of the curve, without a band.
    """
    low, high = frame.range_y
    if columns:
        ends = [np.stack([curve.x + side, curve.y]) for side in (-0.3, 0.3)]
        rows = zip(*(frame.places(*end) for end in ends), strict=True)
        return [line(np.stack(row), "law") for row in rows]
    y = frame.places(curve.x, curve.y)
    least, most = (frame.places(curve.x, np.clip(curve.y + k * curve.sigma, low, high)) for k in (-2.0, 2.0))
    return [band(least, most, "sure"), line(y, "law")]


class ChartAxes:
    """Axes of a chart, which convert values to pixels."""

    def __init__(self, x: Range, y: Range, size: tuple[int, int], title: str = "") -> None:
        """Set the ranges of x and y and the size of the image [pixels]; a title takes 16 pixels at the top."""
        self.range_x, self.range_y, self.size, self.title = x, y, size, title
        self.margin, self.top = 56, 26 if title else 10
        self.width, self.height = size[0] - self.margin - 8, size[1] - self.top - 40

    def places(self, x: Array, y: Array) -> Array:
        """Return the pixels (n, 2), from the left and from the top, of values x (n,) and y (n,)."""
        (x0, x1), (y0, y1) = self.range_x, self.range_y
        across = self.margin + (x - x0) / (x1 - x0) * self.width
        down = self.top + (y1 - y) / (y1 - y0) * self.height
        return np.stack([across, down], axis=-1)

    def x(self, value: float) -> float:
        """Return the horizontal place [pixels] of a value of x."""
        return float(self.places(np.array(value), np.array(0.0))[0])

    def y(self, value: float) -> float:
        """Return the vertical place [pixels], from the top, of a value of y."""
        return float(self.places(np.array(0.0), np.array(value))[1])

    def draw(self, parts: Sequence[str], x_label: str, y_label: str, columns: Mapping[str, Array]) -> str:
        """Return the chart as a figure: SVG with ``parts`` inside the axes, ticks and labels, and buttons that save it.

        Args:
            parts: SVG elements in pixels. columns: of the table of its values, by their head.
        """
        bottom, middle = self.top + self.height, self.margin + self.width / 2
        frame = f'<rect x="{self.margin}" y="{self.top}" width="{self.width}" height="{self.height}"'
        axes = [f'{frame} class="frame"/>']
        for value in ticks(*self.range_y):
            axes.append(f'<text x="{self.margin - 5}" y="{self.y(value) + 4:.1f}" text-anchor="end">{value:.6g}</text>')
        for value in ticks(*self.range_x):
            axes.append(f'<text x="{self.x(value):.1f}" y="{bottom + 15}" text-anchor="middle">{value:.6g}</text>')
        axes.append(f'<text x="{middle:.0f}" y="{bottom + 33}" text-anchor="middle">{escape(x_label)}</text>')
        y_at = self.top + self.height / 2
        turn = f'transform="rotate(-90 12 {y_at:.0f})"'
        axes.append(f'<text x="12" y="{y_at:.0f}" text-anchor="middle" {turn}>{escape(y_label)}</text>')
        if self.title:
            axes.append(f'<text x="2" y="16" class="title">{escape(self.title)}</text>')
        wide, high = self.size
        name = escape(self.title or f"{y_label} over {x_label}")
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}" viewBox="0 0 {wide} {high}"'
        head += f' role="img" aria-label="{name}" font-family="system-ui, sans-serif" font-size="13"'
        table = escape(json.dumps({label: packed(values) for label, values in columns.items()}, separators=(",", ":")))
        save = "".join(
            f'<button type="button" data-save="{kind.lower()}" aria-label="save {name} as {kind}">{kind}</button>'
            for kind in ("CSV", "PNG")
        )
        drawing = f'{head} data-columns="{table}">{"".join([*axes, *parts])}</svg>'
        return f'<figure class="drawn">{drawing}<span class="exports">{save}</span></figure>'


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
