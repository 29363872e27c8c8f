"""Poses in which an arm can stand while somebody works at its tool: random ones, moved onto a place where asked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses, forward, jacobian
from postproc.robot.pose import pose_error

FROM_LIMITS = np.radians(10.0)
"""Distance of each joint from its limits."""
LARGEST = np.radians(200.0)
"""Joint angles beyond which hoses and cables wind up."""
LOWEST_TCP, HIGHEST = 0.2, 1.8
"""Heights [m] of the TCP above the floor that a stand and a person reach."""
FROM_ARM = 0.07
"""Distance of the TCP from the arm's own column, upper arm and forearm, over the arm's length."""
LEAST_TURN = np.radians(15.0)
"""Bend of joint 5 by which a posture is away from the straight wrist."""
UPWARD = 0.5
"""Largest height of the tool's direction, a unit vector."""
IN_FRONT = np.cos(np.radians(60.0))
"""Cosine of the largest angle by which the TCP stands beside the side to which the arm points at zero."""
NEWTON_STEPS = 12


def arm_length(robot: Robot) -> float:
    """Return the length [m] of an arm from its second axis to the flange."""
    return float(np.linalg.norm(robot.link[2:, :3, 3], axis=1).sum())


def working_box(robot: Robot) -> Array:
    """Return the box (2, 3) [m], base axes, in front of an arm on the floor in which its TCP is planned."""
    length = arm_length(robot)
    return np.array([[0.35 * length, -0.6 * length, LOWEST_TCP], [0.9 * length, 0.6 * length, min(HIGHEST, length)]])


def comfortable_range(robot: Robot) -> tuple[Array, Array]:
    """Return the lowest and the highest joint angles (6,) [rad] that are planned."""
    return np.maximum(robot.lower + FROM_LIMITS, -LARGEST), np.minimum(robot.upper - FROM_LIMITS, LARGEST)


def from_limits(robot: Robot, q: Array) -> float:
    """Return the least distance [rad] of a joint from its limits at postures (n, 6), at most a turn."""
    return float(np.minimum(q - robot.lower, robot.upper - q).min(initial=2 * np.pi))


def random_postures(robot: Robot, count: int, g: np.random.Generator) -> Array:
    """Return postures (n, 6) [rad] anywhere in the range of the joints that is planned."""
    return g.uniform(*comfortable_range(robot), (count, 6))


def can_work(arm: Model, box: Array, q: Array) -> NDArray[np.bool_]:
    """Return (n,) which postures (n, 6) [rad] have room for a person's hands and a stand at the TCP.

    The TCP is in the box, on the side to which the arm points, and away from the arm itself; no body is near the plane
    of the base, the tool does not point up, the wrist is not straight, and no joint is near a limit.
    """
    robot, length = arm.robot, arm_length(arm.robot)
    T = body_poses(robot, q)
    flange = T[:, 6] @ robot.link[6]
    p = (flange @ arm.T_flange_tcp)[:, :3, 3]
    good = ((p >= box[0] - 1e-6) & (p <= box[1] + 1e-6)).all(axis=1)
    low, high = comfortable_range(robot)
    good &= ((q >= low) & (q <= high)).all(axis=1)
    good &= (flange[:, :3, 2] @ arm.R_world_base[2] < UPWARD) & (T[:, 3:, 2, 3].min(axis=1) > 0.5 * LOWEST_TCP)
    zero = forward(robot, np.zeros((1, 6)))[0, :, 3]
    good &= np.cos(np.arctan2(p[:, 1], p[:, 0]) - np.arctan2(zero[1], zero[0]) - q[:, 0]) > IN_FRONT
    good &= np.abs(np.sin(q[:, 4])) > np.sin(LEAST_TURN)
    for k in (1, 2, 3, 4):  # the column, the upper arm, the forearm, less their far ends
        from_link, along = p - T[:, k, :3, 3], T[:, k + 1, :3, 3] - T[:, k, :3, 3]
        share = np.sum(from_link * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12)
        away = from_link - np.clip(share, 0.0, 0.7)[:, None] * along
        good &= np.linalg.norm(away, axis=1) > FROM_ARM * length
    return np.asarray(good)


def moved_onto(arm: Model, q: Array, place: Array, turned: bool = True) -> Array:
    """Return postures (n, 6) [rad] near some (n, 6), whose TCP is at a place (n, 3) [m]; NaN where none was reached.

    Newton's steps of least turn, damped (Nakamura and Hanafusa 1986).

    Args:
        turned: the tool may turn; False keeps its orientation.
    """
    robot, tool, rows = arm.robot, arm.T_flange_tcp, 3 if turned else 6
    wanted = forward(robot, q) @ tool
    wanted[:, :3, 3] = place
    for _ in range(NEWTON_STEPS):
        off = pose_error(forward(robot, q) @ tool, wanted)[:, :rows, None]
        J = jacobian(robot, q, tool)[:, :rows]
        step = J.mT @ np.linalg.solve(J @ J.mT + 1e-6 * np.eye(rows), off)
        q = q + np.clip(step[:, :, 0], -0.3, 0.3)
    reached = np.abs(pose_error(forward(robot, q) @ tool, wanted)[:, :rows]).max(axis=1) < 1e-5
    return np.where(reached[:, None], q, np.nan)
