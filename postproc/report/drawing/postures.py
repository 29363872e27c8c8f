"""Small drawings of an arm's postures, seen from the side, for a sheet that is printed."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.report.drawing.charts import line
from postproc.robot.kinematics import body_poses

SIZE = 110
"""Width and height of a drawing [pixels]."""
AIM = 15
"""Length of the arrow at the tool [pixels]."""


def posture_drawings(model: Model, q: Array, labels: Sequence[str], towards: Array) -> list[str]:
    """Return a drawing (SVG) of each posture, seen along axis 2 with the tool on the right, with its label.

    Args:
        q: (n, 6) joint angles [rad]. labels: (n,) names. towards: (n, 3) directions that an arrow at the tool shows,
            base axes; zeros for none.
    """
    T = body_poses(model.robot, q)
    flange = T[:, 6] @ model.robot.link[6]
    frames = np.concatenate([T, flange[:, None], (flange @ model.T_flange_tcp)[:, None]], axis=1)
    joints = frames[:, :, :3, 3]
    ahead = joints[:, -1, :2] / np.maximum(np.linalg.norm(joints[:, -1, :2], axis=1), 1e-9)[:, None]
    flat = np.stack([np.einsum("nki,ni->nk", joints[:, :, :2], ahead), joints[:, :, 2]], axis=-1)
    arrow = np.stack([np.sum(towards[:, :2] * ahead, axis=1), towards[:, 2]], axis=-1)
    low, high = np.minimum(flat.min(axis=(0, 1)), 0.0), flat.max(axis=(0, 1))
    scale = (SIZE - 30) / float(np.max(high - low))
    drawn = []
    for points, way, label in zip(flat, arrow, labels, strict=True):
        floor = np.array([[low[0], 0.0], [high[0], 0.0]])
        aim = np.array([points[-1], points[-1] + AIM / scale * way])
        strokes = [(floor, "frame"), (points, "chosen"), (aim, "aim")]
        placed = [(np.array([10, SIZE - 10]) + scale * (p - low) * [1, -1], kind) for p, kind in strokes]
        lines = "".join(line(p, kind) for p, kind in placed)
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE}" height="{SIZE}" viewBox="0 0 {SIZE} {SIZE}"'
        text = f'<text x="6" y="14">{escape(label)}</text>'
        drawn.append(f'{head} role="img" aria-label="{escape(label)} from the side">{lines}{text}</svg>')
    return drawn
