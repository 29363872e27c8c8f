"""Closed-form geometry of arms with ortho-parallel basis and spherical wrist (Brandstoetter, Angerer, Hofbaur 2014)."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.robot.arm import Opw

ZERO_POSE_AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)
FLANGE = np.array(
    [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=float
)  # tool0 at the zero pose: z along base x, x downwards


def derive(link: Array, axis: Array) -> Opw | None:
    """Closed-form parameters of a chain, or None where it is not such an arm.

    The chain must stand as ABB arms do at zero: upper arm up, forearm forward, axes z, y, y, x, y, x.

    Args:
        link: (7, 4, 4), axis: (6, 3): see Robot.
    """
    points, axes, T = [], [], np.eye(4)
    for j in range(6):
        T = T @ link[j]
        points.append(T[:3, 3])
        axes.append(T[:3, :3] @ axis[j])
    T = T @ link[6]
    p = np.array(points)
    wrist = np.array([p[4, 0], p[3, 1], p[3, 2]])
    spherical = (
        np.allclose(axes, ZERO_POSE_AXES, atol=1e-9)
        and np.allclose(p[4, [2]], wrist[[2]], atol=1e-9)  # axis 5 cuts axis 4
        and np.allclose(p[5, 1:], wrist[1:], atol=1e-9)  # axis 6 runs through the same point
        and np.allclose(p[0, :2], 0.0, atol=1e-9)
        and np.allclose(T[1:3, 3], wrist[1:], atol=1e-9)
        and np.allclose(T[:3, :3], FLANGE, atol=1e-9)
        and abs(p[2, 0] - p[1, 0]) < 1e-9
    )
    if not spherical:
        return None
    return Opw(
        a1=float(p[1, 0]),
        a2=float(p[2, 2] - wrist[2]),
        b=float(wrist[1]),
        c1=float(p[1, 2]),
        c2=float(p[2, 2] - p[1, 2]),
        c3=float(wrist[0] - p[2, 0]),
        c4=float(T[0, 3] - wrist[0]),
        offsets=(0.0, 0.0, -np.pi / 2, 0.0, 0.0, 0.0),
    )


def wrist_place(opw: Opw, q: Array) -> tuple[Array, Array]:
    """Where the wrist centre is: forward of axis 1 and forward of the lower arm, (..., 6) [rad] -> two (...) [m]."""
    upper = q[..., 1] - opw.offsets[1]
    reach, bend = np.hypot(opw.a2, opw.c3), np.arctan2(opw.a2, opw.c3)
    inner = q[..., 2] - opw.offsets[2] + bend
    return opw.a1 + opw.c2 * np.sin(upper) + reach * np.sin(upper + inner), reach * np.sin(inner)
