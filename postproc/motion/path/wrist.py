r"""Lines and arcs under ``SingArea\Wrist``: axes 4 to 6 go evenly from start to goal while the TCP keeps its curve.

    q_4..6(u) = start + u change + u (1 - u) bend,    p_flange(q_1..6) = p_curve(u)

The bend is zero on a line; on an arc it lets the wrist pass the circle point in the orientation programmed there. What
the tool's orientation is between the targets follows. ABB's manuals say so of every line and arc, near a singular wrist
or not: the wrist axes are interpolated axis by axis, with the TCP on its line or circle (RAPID Overview,
Interpolation with ``SingArea\Wrist``; Technical reference manual RAPID, ``SingArea``). How evenly the wrist goes on an
arc is not published; a parabola is assumed. ``SingArea\LockAxis4`` is read alike: axis 4, at 0 or 180 degrees at both
ends, stays there.
"""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.motion.mounts import Mounts
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.kinematics import forward, jacobian

_STEPS = 20
_LARGEST_STEP = 0.5  # [rad]
_REACHED = 1e-10  # [m]


def arm_joints(robot: Robot, mounts: Mounts, T_work_tcp: Array, q: Array) -> Array:
    """Joint angles (n, 6) [rad] that bring the TCP to its place without changing axes 4 to 6; NaN where none are found.

    Found by Newton steps of axes 1 to 3: a point of the flange (of the carried work, for a stationary tool) is to be at
    a place in the base.

    Args:
        T_work_tcp: (n, 4, 4); only the positions count.
        q: (n, 6), with axes 1 to 3 near the solution.
    """
    on_flange = mounts.flange_tcp(T_work_tcp)
    place = mounts.base_tcp(T_work_tcp)[:, :3, 3]
    q = np.array(q, dtype=float)
    rows = np.arange(len(q))
    for _ in range(_STEPS):
        lacks = place[rows] - (forward(robot, q[rows]) @ on_flange[rows])[:, :3, 3]
        open_ = np.linalg.norm(lacks, axis=1) > _REACHED
        rows, lacks = rows[open_], lacks[open_]
        if not len(rows):
            return q
        J = jacobian(robot, q[rows], on_flange[rows])[:, :3, :3]
        step = (np.linalg.pinv(J) @ lacks[:, :, None])[:, :, 0]
        q[rows, :3] += step * np.minimum(1.0, _LARGEST_STEP / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
    q[rows] = np.nan
    return q


def wrist_bend(robot: Robot, T_base_flange: Array, ends: tuple[Array, Array], share: float) -> Array:
    """(6,) coefficients [rad] of u (1 - u), zero for axes 1 to 3, that let the wrist pass a given orientation.

    They are all zero if the arm cannot reach the pose.

    Args:
        T_base_flange: (4, 4) at the circle point.
        ends: (6,) joint angles at both ends [rad].
        share: fraction u of the way at the circle point.
    """
    even = ends[0] + share * (ends[1] - ends[0])
    solutions = inverse(robot, T_base_flange[None])[0]
    away = (solutions - even + np.pi) % (2 * np.pi) - np.pi
    travel = np.abs(away).max(axis=1)
    if np.isnan(travel).all():
        return np.zeros(6)
    return np.asarray(away[np.nanargmin(travel)] * (0, 0, 0, 1, 1, 1) / (share * (1 - share)))
