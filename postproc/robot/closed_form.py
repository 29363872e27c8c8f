"""All closed-form solutions of n poses through py-opw-kinematics, with what it loses at straight wrists repaired."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from postproc.arrays import Array, invert
from postproc.robot.arm import Opw, Robot
from postproc.robot.configuration import FLANGE, closed_form
from postproc.robot.kinematics import body_poses
from postproc.robot.pose import displace, transform

STRAIGHT_WRIST = 1e-10  # |sin q5| below which only q4 + q6 (or q4 - q6) has a meaning
COARSE_WRIST = 1e-3  # |sin q5| below which the arc cosine of the closed form loses digits


def _solver(opw: Opw) -> Any:
    """Return the py-opw-kinematics solver of an arm, in radians."""
    from py_opw_kinematics import KinematicModel
    from py_opw_kinematics import Robot as Solver

    model = KinematicModel(opw.a1, opw.a2, opw.b, opw.c1, opw.c2, opw.c3, opw.c4, offsets=opw.offsets)
    return Solver(model, degrees=False)


def inverse(robot: Robot, T_base_flange: Array) -> Array:
    """Compute all closed-form joint angles of flange poses, (n, 4, 4) -> (n, 8, 6) [rad] in (-pi, pi].

    A solution that does not exist is NaN. The eight are in the order of py-opw-kinematics; `branch` computes the cfx of
    each. Rotations are normalised before.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    from py_opw_kinematics import RigidTransform

    solver = _solver(closed_form(robot))
    poses = np.asarray(T_base_flange, dtype=float).reshape(-1, 4, 4)
    finite = np.isfinite(poses).all(axis=(1, 2))
    poses = RigidTransform.from_matrix(np.where(finite[:, None, None], poses, np.eye(4))).as_matrix()

    def solve(T: Array) -> Array:
        """Return the solutions (n, 8, 6) of poses (n, 4, 4), without limits."""
        # Limits that nothing meets: skips the singular values that reach() would compute, four times faster.
        reach = solver.reach(RigidTransform.from_matrix(T), joint_limits=np.tile([10.0, 11.0], (6, 1)))
        return np.array(reach.joints)

    joints = solve(poses)
    lost = np.isnan(joints).any(axis=(1, 2))
    if lost.any():
        joints[lost] = _with_lost_wrists(closed_form(robot), poses[lost], joints[lost], solve)
    row, slot = np.nonzero(np.abs(np.sin(joints[..., 4])) < COARSE_WRIST)
    joints[row, slot, 3:] = _wrist_angles(robot, poses[row], joints[row, slot], np.where(slot < 4, 1.0, -1.0))
    joints[~finite] = np.nan
    return joints


def _with_lost_wrists(opw: Opw, T: Array, joints: Array, solve: Callable[[Array], Array]) -> Array:
    """Return the solutions with those repaired that are NaN at a straight wrist because cos q5 rounds to more than one.

    ``solve`` computes them again with the hand turned by a microradian about the wrist centre: axes 1 to 3 are right,
    4 to 6 coarse.

    Args:
        T: (n, 4, 4) flange poses; joints: (n, 8, 6) their solutions [rad].
    """
    hand = transform(np.array([0.0, 0.0, opw.c4]))
    turned = solve(T @ invert(hand) @ displace(np.array([0.0, 0.0, 0.0, 1e-6, 0.0, 0.0])) @ hand)
    repair = np.isnan(joints).any(axis=-1) & (np.abs(np.sin(turned[..., 4])) < 1e-5)
    return np.where(repair[..., None], turned, joints)


def _wrist_angles(robot: Robot, T: Array, q: Array, sign: Array) -> Array:
    """Compute axes 4 to 6 (n, 3) [rad] from Rx(q4) Ry(q5) Rx(q6) by arctangents, accurate at a straight wrist.

    Args:
        T: (n, 4, 4) flange poses; q: (n, 6), of which axes 1 to 3 are used; sign: (n,) wanted sign of q5.
    """
    # Body 3 in axes that are parallel to the base at the zero pose, whatever frames the robot's file chose.
    zero = body_poses(robot, np.zeros((1, 6)))[0, 3, :3, :3]
    R = zero @ np.swapaxes(body_poses(robot, q)[:, 3, :3, :3], 1, 2) @ T[:, :3, :3] @ FLANGE.T
    bend = np.hypot(R[:, 1, 0], R[:, 2, 0])
    q4 = np.arctan2(sign * R[:, 1, 0], -sign * R[:, 2, 0])
    straight = bend < STRAIGHT_WRIST
    q4 = np.where(straight, 0.0, q4)
    q5 = np.arctan2(np.where(straight, 0.0, sign * bend), R[:, 0, 0])
    # What is left after axis 4: axes 4 and 6 lose digits singly, their sum must not.
    c, s = np.cos(q4), np.sin(q4)
    q6 = np.arctan2(-c * R[:, 1, 2] - s * R[:, 2, 2], c * R[:, 1, 1] + s * R[:, 2, 1])
    return np.stack([q4, q5, q6], axis=-1)
