"""Small drawings of an arm's postures, seen from the side, for a sheet that is printed."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.report.drawing.charts import line
from postproc.robot.kinematics import body_poses

DRAWING_SIZE = 110
"""Width and height of a drawing [pixels]."""
AIM = 15
"""Length of the arrow at the tool [pixels]."""
ABOVE = 64
"""Width of the view from above beside it [pixels]."""


def posture_drawings(
    model: Model, q: Array, labels: Sequence[str], towards: Array | None = None, above: bool = False
) -> list[str]:
    """Return a drawing (SVG) of each posture, seen along axis 2 with the tool on the right, with its label.

    Args:
        q: (n, 6) joint angles [rad]. labels: (n,) names. towards: (n, 3) directions that an arrow at the tool shows,
            base axes; None or zeros for none. above: also draw each posture from above, the base's x to the right.
    """
    T = body_poses(model.robot, q)
    flange = T[:, 6] @ model.robot.link[6]
    frames = np.concatenate([T, flange[:, None], (flange @ model.T_flange_tcp)[:, None]], axis=1)
    joints = frames[:, :, :3, 3]
    arrows = np.zeros((len(q), 3)) if towards is None else towards
    ahead = joints[:, -1, :2] / np.maximum(np.linalg.norm(joints[:, -1, :2], axis=1), 1e-9)[:, None]
    flat = np.stack([np.einsum("nki,ni->nk", joints[:, :, :2], ahead), joints[:, :, 2]], axis=-1)
    arrow = np.stack([np.sum(arrows[:, :2] * ahead, axis=1), arrows[:, 2]], axis=-1)
    low, high = np.minimum(flat.min(axis=(0, 1)), 0.0), flat.max(axis=(0, 1))
    scale = (DRAWING_SIZE - 30) / float(np.max(high - low))
    corner, floor = np.array([10, DRAWING_SIZE - 10]), np.array([[low[0], 0.0], [high[0], 0.0]])
    reach = float(np.abs(joints[:, :, :2]).max())
    middle, small = np.array([DRAWING_SIZE + ABOVE / 2, DRAWING_SIZE / 2]), (ABOVE / 2 - 5) / reach
    width, drawn = DRAWING_SIZE + above * ABOVE, list[str]()
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{DRAWING_SIZE}" class="posture"'
    head += f' viewBox="0 0 {width} {DRAWING_SIZE}" role="img"'
    for k, label in enumerate(map(escape, labels)):
        places = corner + scale * (flat[k] - low) * [1, -1]
        aim = np.array([places[-1], places[-1] + AIM * arrow[k] * [1, -1]])
        parts = [line(corner + scale * (floor - low) * [1, -1], "frame"), _arm(places), line(aim, "aim")]
        if above:
            x, y = middle
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{small * reach:.1f}" class="frame"/>')
            parts.append(_arm(middle + small * joints[k, :, :2] * [1, -1]))
        text = f'<text x="6" y="14">{label}</text>'
        drawn.append(f'{head} aria-label="{label} from the side">{"".join(parts)}{text}</svg>')
    return drawn


def _arm(places: Array) -> str:
    """Return an arm as SVG: its links, the tool in another colour, and a dot at each joint.

    Args:
        places: (k, 2) of joints, flange and tool [pixels].
    """
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.2"/>' for x, y in places[1:-2])
    return f'{line(places[:-1], "limb")}{line(places[-2:], "tool")}<g class="joints">{dots}</g>'
