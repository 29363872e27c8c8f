"""Confdata: which joint solution of a pose a robtarget means (ABB RAPID reference, serial six-axis arms)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.robot.arm import Opw, Robot
from postproc.robot.opw import fault, wrist_place

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


def outside_quadrants(q: Array, conf: NDArray[np.int64]) -> Array:
    """Return (n,) how far [rad] axes 1, 4, 6 of joint angles (n, 6) are outside the quadrants of confdata, at most.

    Negative inside. ``conf``: (n, 4), of which cfx does not count.
    """
    away: Array = np.abs(np.asarray(q)[..., TURNING] - (conf[..., :3] + 0.5) * QUARTER) - QUARTER / 2
    return np.asarray(away.max(axis=-1))
