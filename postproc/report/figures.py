"""The residual vectors in the workspace: in 3-D where plotly is installed, else from above and from the side."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.report.svg import MOST_POINTS, vectors

ARROW = 0.12  # the typical residual is drawn this long, as a share of the workspace


def residual_vectors(position: Array, residual: Array) -> tuple[str, float]:
    """HTML of the residuals (n, 3) [m] as lines at their positions (n, 3) [m], and how many times they are enlarged."""
    good = np.isfinite(position).all(axis=1) & np.isfinite(residual).all(axis=1)
    position, residual = position[good], residual[good]
    if len(position) == 0:
        return "", 1.0
    step = -(-len(position) // MOST_POINTS)
    position, residual = position[::step], residual[::step]
    extent = float(np.ptp(position, axis=0).max()) or 1.0
    typical = float(np.sqrt((residual**2).sum(axis=1).mean())) or 1.0
    times = float(f"{ARROW * extent / typical:.1g}")
    tip = position + times * residual
    try:
        return _in_space(position, tip), times
    except ImportError:
        views = (((0, 1), "from above: x [m]", "y [m]"), ((0, 2), "from the side: x [m]", "z [m]"))
        return "".join(vectors(position[:, axes], tip[:, axes], x, y) for axes, x, y in views), times


def _in_space(position: Array, tip: Array) -> str:
    from plotly import graph_objects

    gap = np.full_like(position, np.nan)
    line = np.stack([position, tip, gap], axis=1).reshape(-1, 3).astype(np.float32)
    points = position.astype(np.float32)
    figure = graph_objects.Figure(
        [
            graph_objects.Scatter3d(
                x=line[:, 0],
                y=line[:, 1],
                z=line[:, 2],
                mode="lines",
                line={"color": "#c5221f", "width": 3},
                name="residual",
            ),
            graph_objects.Scatter3d(
                x=points[:, 0],
                y=points[:, 1],
                z=points[:, 2],
                mode="markers",
                marker={"size": 2, "color": "#174ea6"},
                name="measured",
            ),
        ]
    )
    axes = {"xaxis_title": "x [m]", "yaxis_title": "y [m]", "zaxis_title": "z [m]", "aspectmode": "data"}
    figure.update_layout(height=560, margin={"l": 0, "r": 0, "t": 0, "b": 0}, scene=axes)
    html: str = figure.to_html(full_html=False, include_plotlyjs=False)
    return html
