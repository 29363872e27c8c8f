"""Vectors in the workspace: from above and from the side, and in 3-D where plotly is installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.report.charts import vectors
from postproc.report.page import grid
from postproc.report.svg import GREY, RED

ARROW = 0.1  # the typical vector is drawn this long, as a share of the workspace
MOST = 600  # more arrows hide each other
VIEWS = (((0, 1), "from above: x [m]", "y [m]"), ((0, 2), "from the side: x [m]", "z [m]"))


def enlargement(position: Array, vector: Array) -> float:
    """How many times vectors (n, 3) at positions (n, 3) are drawn longer than they are, a round number."""
    extent = float(np.ptp(position, axis=0).max()) or 1.0
    typical = float(np.sqrt((vector**2).sum(axis=1).mean())) or 1.0
    return float(f"{ARROW * extent / typical:.1g}")


def chosen(vector: Array) -> Array:
    """Rows (k,) of the vectors (n, 3) that are drawn: every second, third .. where there are many, and the largest."""
    every = np.arange(0, len(vector), -(-len(vector) // MOST) or 1)
    largest = np.argsort(-np.linalg.norm(vector, axis=1))[:10]
    return np.union1d(every, largest)


def plane_views(position: Array, vector: Array, times: float, way: Array | None = None) -> str:
    """Vectors (n, 3) [m] at positions (n, 3) [m], and a way (m, 3) behind them, in two views."""
    tip = position + times * vector
    views = [
        vectors(position[:, axes], tip[:, axes], x, y, None if way is None else way[:, axes]) for axes, x, y in VIEWS
    ]
    return grid(views, 340)


def space_view(position: Array, vector: Array, times: float, label: Sequence[str]) -> str:
    """The same in 3-D, to be turned by hand; empty without plotly.

    Args:
        label: what is said at the tip of each arrow when it is pointed at.
    """
    try:
        from plotly.graph_objects import Figure
    except ImportError:
        return ""
    tip = position + times * vector
    figure = Figure(_arrows(position, tip, vector, times, label))
    both = np.vstack([position, tip])
    margin = 0.03 * np.ptp(both, axis=0).max()
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} [m]"}, "range": [float(low - margin), float(high + margin)]}
        for axis, low, high in zip("xyz", both.min(axis=0), both.max(axis=0), strict=True)
    }
    camera = {"eye": {"x": 1.3, "y": -1.3, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.15}}
    figure.update_layout(
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        showlegend=False,
        scene={**axes, "aspectmode": "data", "camera": camera},
    )
    # "</" would end the script element.
    text = figure.to_json().replace("</", "<\\/")
    return f'<div class="space"><script type="application/json">{text}</script></div>'


def _arrows(position: Array, tip: Array, vector: Array, times: float, label: Sequence[str]) -> list[Any]:
    """Shafts, heads and points of arrows, coloured by the length of the vector [mm]; float32 halves the page."""
    from plotly.graph_objects import Cone, Scatter3d

    size = np.linalg.norm(vector, axis=1) * 1e3
    largest = float(size.max()) or 1.0
    scale = [[0, GREY], [1, RED]]
    line = np.stack([position, tip, np.full_like(position, np.nan)], axis=1).reshape(-1, 3)
    shafts = Scatter3d(
        **_axes("xyz", line),
        mode="lines",
        hoverinfo="skip",
        line={"color": np.repeat(size, 3), "colorscale": scale, "cmin": 0, "cmax": largest, "width": 3},
    )
    heads = Cone(
        **_axes("xyz", tip),
        **_axes("uvw", 0.25 * times * vector),
        sizemode="raw",
        anchor="tip",
        colorscale=scale,
        cmin=0,
        cmax=0.25e-3 * times * largest,
        showscale=False,
        hoverinfo="skip",
    )
    colors = {"size": 3, "color": size.astype(np.float32), "colorscale": scale, "cmin": 0, "cmax": largest}
    points = Scatter3d(
        **_axes("xyz", position),
        mode="markers",
        marker={**colors, "colorbar": {"title": {"text": "mm"}, "thickness": 14, "len": 0.6}},
        text=list(label),
        hovertemplate="%{text}<extra></extra>",
    )
    return [shafts, heads, points]


def _axes(names: str, values: Array) -> dict[str, Array]:
    return dict(zip(names, values.astype(np.float32).T, strict=True))
