"""Small drawings of an arm's postures, seen from the side, for a sheet that is printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.report.drawing.charts import line
from postproc.robot.kinematics import body_poses

DRAWING_SIZE = 110
"""Width and height of a drawing [pixels]."""
ABOVE = 64
"""Width of the view from above beside it [pixels], without marks at the tool."""
MARGIN = 22
"""Of a view from above with marks at the tool [pixels]."""
NOTE = 16
"""Height of a line of text below it [pixels]."""
PLUNGER, DIAL, ARROW, HEAD, OFFSET = 9.0, 4.5, 20.0, 5.0, 8.0
"""Sizes of the marks at the tool [pixels]: of a gauge, of the arrow of a load, and how far aside a ring stands."""
SLANT = 0.5
"""Share of a direction in the plane of a view below which it is drawn as pointing at the viewer, or away."""


def posture_drawings(
    model: Model, q: Array, labels: Sequence[str], above: bool = False, at_tool: AtTool | None = None
) -> list[str]:
    """Return a drawing (SVG) of each posture, seen along axis 2 with the tool on the right, with its label.

    Args:
        q: (n, 6) joint angles [rad]. labels: (n,) names. above: also draw each posture from above, the base's x to the
            right. at_tool: what is drawn at the tool, and a line of text below.
    """
    T = body_poses(model.robot, q)
    flange = T[:, 6] @ model.robot.link[6]
    frames = np.concatenate([T, flange[:, None], (flange @ model.T_flange_tcp)[:, None]], axis=1)
    joints = frames[:, :, :3, 3]
    ahead = np.zeros((len(q), 3))
    ahead[:, :2] = joints[:, -1, :2] / np.maximum(np.linalg.norm(joints[:, -1, :2], axis=1), 1e-9)[:, None]
    up = np.tile([0.0, 0.0, 1.0], (len(q), 1))
    side = np.stack([ahead, up, np.cross(ahead, up)], axis=1)  # to the right, up, towards the viewer
    flat = np.einsum("nij,nkj->nki", side[:, :2], joints)
    low, high = np.minimum(flat.min(axis=(0, 1)), 0.0), flat.max(axis=(0, 1))
    scale = (DRAWING_SIZE - 30) / float(np.max(high - low))
    corner, floor = np.array([10, DRAWING_SIZE - 10]), np.array([[low[0], 0.0], [high[0], 0.0]])
    reach = float(np.abs(joints[:, :, :2]).max())
    added, margin, note = (ABOVE, 5, 0) if at_tool is None else (DRAWING_SIZE, MARGIN, NOTE)
    middle, small = np.array([DRAWING_SIZE + added / 2, DRAWING_SIZE / 2]), (added / 2 - margin) / reach
    width, height, drawn = DRAWING_SIZE + above * added, DRAWING_SIZE + note, list[str]()
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" class="posture"'
    head += f' viewBox="0 0 {width} {height}" role="img"'
    for k, label in enumerate(map(escape, labels)):
        places = corner + scale * (flat[k] - low) * [1, -1]
        parts = [line(corner + scale * (floor - low) * [1, -1], "frame"), _arm(places)]
        parts += [] if at_tool is None else at_tool.drawn(k, places[-1], side[k])
        if above:
            x, y = middle
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{small * reach:.1f}" class="frame"/>')
            places = middle + small * joints[k, :, :2] * [1, -1]
            parts.append(_arm(places))
            parts += [] if at_tool is None else at_tool.drawn(k, places[-1], np.eye(3))
        text, seen = f'<text x="6" y="14">{label}</text>', "from the side and from above" if above else "from the side"
        if at_tool is not None:
            text += f'<text x="6" y="{height - 4}">{escape(at_tool.notes[k])}</text>'
        drawn.append(f'{head} aria-label="{label} {seen}">{"".join(parts)}{text}</svg>')
    return drawn


@dataclass(frozen=True)
class AtTool:
    """What is drawn at the tool of n postures.

    Args:
        gauge, load: (n, 3) direction in which a gauge reads more, from whose side it feels the tool, and of a load;
            base axes, zeros for none.
        notes: (n,) lines of text below.
    """

    gauge: Array
    load: Array
    notes: Sequence[str]

    def drawn(self, k: int, place: Array, view: Array) -> list[str]:
        """Return the marks at the tool of posture k as SVG.

        A gauge is a circle at the end of its plunger, on the side to which its reading grows; a load an arrow onto the
        tool. What points at the viewer is a dot in a ring, what points away a cross.

        Args:
            place: (2,) of the tool [pixels]. view: (3, 3) rows to the right, up and towards the viewer, base axes.
        """
        marks = []
        for kind, vector, draw, side in (("gauge", self.gauge[k], _gauge, -1), ("load", self.load[k], _load, 1)):
            if not vector.any():
                continue
            seen = view @ vector / np.linalg.norm(vector) * [1, -1, 1]
            in_plane = np.linalg.norm(seen[:2])
            way = seen[:2] / max(float(in_plane), 1e-9)
            body = draw(place, way) if in_plane > SLANT else _ring(place + OFFSET * np.array([1, side]), seen[2] > 0)
            marks.append(f'<g class="{kind}">{body}</g>')
        return marks


def _gauge(place: Array, way: Array) -> str:
    """Return a plunger from the tool and the dial at its end, along a unit vector (2,) [pixels], as SVG."""
    x, y = place + (PLUNGER + DIAL) * way
    plunger = line(np.array([place, place + PLUNGER * way]), "plunger")
    return f'{plunger}<circle cx="{x:.1f}" cy="{y:.1f}" r="{DIAL}"/>'


def _load(place: Array, way: Array) -> str:
    """Return an arrow onto the tool along a unit vector (2,) [pixels], as SVG."""
    across, tip = np.array([-way[1], way[0]]), place - 2 * way
    wings = np.array([tip - HEAD * (way + across * 0.7), tip, tip - HEAD * (way - across * 0.7)])
    return line(np.array([tip - ARROW * way, tip]), "shaft") + line(wings, "shaft")


def _ring(place: Array, near: bool) -> str:
    """Return a ring with a dot where something points at the viewer, with a cross where it points away, as SVG."""
    x, y = place
    ring, r = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{DIAL}"/>', DIAL / np.sqrt(2)
    if near:
        return f'{ring}<circle cx="{x:.1f}" cy="{y:.1f}" r="1" class="dot"/>'
    return ring + "".join(line(np.array([place - r * d, place + r * d]), "cross") for d in np.array([[1, -1], [1, 1]]))


def _arm(places: Array) -> str:
    """Return an arm as SVG: its links, the tool in another colour, and a dot at each joint.

    Args:
        places: (k, 2) of joints, flange and tool [pixels].
    """
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.2"/>' for x, y in places[1:-2])
    return f'{line(places[:-1], "limb")}{line(places[-2:], "tool")}<g class="joints">{dots}</g>'
