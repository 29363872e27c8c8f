"""Closed-form geometry of arms with ortho-parallel basis and spherical wrist, and confdata.

Geometry: Brandstoetter, Angerer, Hofbaur 2014. Confdata says which joint solution of a pose a robtarget means (ABB
RAPID reference, serial six-axis arms).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.robot.arm import Opw, Robot

ZERO_POSE_AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)
SQUARE_WITHIN = 1e-9
FLANGE = np.array(
    [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=float
)  # tool0 at the zero pose: z along base x, x downwards


def fault(link: Array, axis: Array) -> str:
    """Say how a chain differs from an ABB arm at zero (upper arm up, forearm forward); empty where it does not.

    Args:
        link: (7, 4, 4) transforms, axis: (6, 3) joint axes, as in `Robot`.
    """
    points, axes, T_flange = _at_zero(link, axis)
    wrist = _wrist(points)
    conditions = {
        "at zero its axes are not z, y, y, x, y, x of the base": np.allclose(axes, ZERO_POSE_AXES, atol=SQUARE_WITHIN),
        "axes 4, 5 and 6 do not run through one point": np.allclose(points[4, 2], wrist[2], atol=SQUARE_WITHIN)
        and np.allclose(points[5, 1:], wrist[1:], atol=SQUARE_WITHIN),
        "axis 1 does not run through the origin of the base": np.allclose(points[0, :2], 0.0, atol=SQUARE_WITHIN),
        "axes 2 and 3 do not stand one above the other at zero": abs(points[2, 0] - points[1, 0]) < SQUARE_WITHIN,
        "its flange is not on axis 6": np.allclose(T_flange[1:3, 3], wrist[1:], atol=SQUARE_WITHIN),
        "its flange is turned: at zero its z points along x of the base and its x downwards (`flange_rpy_deg ="
        " [0, 90, 0]`; in a URDF a `tool0` frame)": np.allclose(T_flange[:3, :3], FLANGE, atol=SQUARE_WITHIN),
    }
    return next((text for text, holds in conditions.items() if not holds), "")


def derive(link: Array, axis: Array) -> Opw | None:
    """Return the closed-form parameters of a chain; None where `fault` of the same arguments finds a difference."""
    if fault(link, axis):
        return None
    p, _, T_flange = _at_zero(link, axis)
    wrist = _wrist(p)
    return Opw(
        a1=float(p[1, 0]),
        a2=float(p[2, 2] - wrist[2]),
        b=float(wrist[1]),
        c1=float(p[1, 2]),
        c2=float(p[2, 2] - p[1, 2]),
        c3=float(wrist[0] - p[2, 0]),
        c4=float(T_flange[0, 3] - wrist[0]),
        offsets=(0.0, 0.0, -np.pi / 2, 0.0, 0.0, 0.0),
    )


def _at_zero(link: Array, axis: Array) -> tuple[Array, Array, Array]:
    """Return points (6, 3) on the axes, their directions (6, 3) and the flange (4, 4) in the base, all joints at zero.

    Args:
        link: (7, 4, 4) transforms, axis: (6, 3) joint axes, as in `Robot`.
    """
    points, axes, T = [], [], np.eye(4)
    for j in range(6):
        T = T @ link[j]
        points.append(T[:3, 3])
        axes.append(T[:3, :3] @ axis[j])
    return np.array(points), np.array(axes), T @ link[6]


def _wrist(points: Array) -> Array:
    """Return the wrist centre (3,) from points (6, 3) on the axes at zero: x of that on axis 5, y and z of axis 4."""
    return np.array([points[4, 0], points[3, 1], points[3, 2]])


def wrist_place(opw: Opw, q: Array) -> tuple[Array, Array]:
    """Return how far [m] the wrist centre is before axis 1 and before the lower arm, (..., 6) [rad] -> two (...)."""
    upper = q[..., 1] - opw.offsets[1]
    reach, bend = np.hypot(opw.a2, opw.c3), np.arctan2(opw.a2, opw.c3)
    inner = q[..., 2] - opw.offsets[2] + bend
    return opw.a1 + opw.c2 * np.sin(upper) + reach * np.sin(upper + inner), reach * np.sin(inner)


QUARTER = np.pi / 2
TURNING = [0, 3, 5]  # axes that cf1, cf4 and cf6 speak of
ON_BOUNDARY = 1e-9  # a joint this close below a quadrant's edge [rad] stands on it: rounding must not flip a confdata


def closed_form(robot: Robot) -> Opw:
    """Return the closed-form parameters of an arm.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    if robot.opw is None:
        raise PostprocError.of(
            "KIN005",
            f"robot `{robot.name}` does not stand as ABB arms do at zero: {fault(robot.link, robot.axis)}; confdata and"
            " the closed-form inverse do not apply to it",
            help="mend that in the robot's file; an arm that is built so is fitted and predicted from joint angles",
        )
    return robot.opw


def branch(opw: Opw, q: Array) -> NDArray[np.int64]:
    """Return the cfx 0 to 7 of joint angles, (..., 6) [rad] -> (...).

    4 if the wrist centre is behind axis 1, plus 2 if it is behind the lower arm, plus 1 if axis 5 is negative.
    """
    forward, above = wrist_place(opw, q)
    return 4 * (forward < 0) + 2 * (above < 0) + (q[..., 4] < -ON_BOUNDARY)


def confdata(robot: Robot, q: Array) -> NDArray[np.int64]:
    """Return [cf1, cf4, cf6, cfx] of joint angles, (n, 6) [rad] -> (n, 4).

    cf is the quarter turn k with q in [90 k, 90 (k + 1)) degrees; cfx is that of `branch`.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    opw = closed_form(robot)
    turns = np.floor((np.asarray(q)[..., TURNING] + ON_BOUNDARY) / QUARTER).astype(np.int64)
    return np.concatenate([turns, branch(opw, q)[..., None]], axis=-1)


def quadrant_excess(q: Array, conf: NDArray[np.int64]) -> Array:
    """Return (n,) how far [rad] axes 1, 4, 6 of joint angles (n, 6) are outside the quadrants of confdata, at most.

    Negative inside. ``conf``: (n, 4), of which cfx does not count.
    """
    away: Array = np.abs(np.asarray(q)[..., TURNING] - (conf[..., :3] + 0.5) * QUARTER) - QUARTER / 2
    return np.asarray(away.max(axis=-1))
