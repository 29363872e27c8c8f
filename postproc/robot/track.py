"""Nominal inverse kinematics along a path: the continuous solution in the branch of its start."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array, blocks
from postproc.diagnostics import PostprocError
from postproc.robot.arm import Opw, Robot
from postproc.robot.closed_form import inverse
from postproc.robot.configuration import branch, wrist_place
from postproc.robot.inverse import TAUGHT_WRIST
from postproc.robot.kinematics import forward, jacobian
from postproc.robot.pose import pose_error

ARM_SINGULAR = 1e-3
"""As near the wrist's centre [m] comes to the edge of two branches where the arm may change between them."""


def track(robot: Robot, T_base_flange: Array, q_start: Array) -> Array:
    """Compute joint angles along a path in the branch of its start, continuous over turns and straight wrists.

    Args:
        T_base_flange: (n, 4, 4) poses, close enough that no joint turns by half a turn from one to the next.
        q_start: (6,) [rad] at or shortly before the first pose.

    Returns:
        (n, 6) [rad]; limits are not applied.

    Raises:
        PostprocError: KIN004, a pose cannot be reached in this branch.
    """
    poses = np.asarray(T_base_flange, dtype=float).reshape(-1, 4, 4)
    if not len(poses):
        return np.zeros((0, 6))
    if robot.opw is None:
        return np.stack(_stepwise(robot, poses, q_start))
    arm = _arm(robot, robot.opw, np.asarray(q_start, dtype=float), poses[:1])
    wrists = np.empty((len(poses), 2, 6))
    for rows in blocks(len(poses)):
        wrists[rows] = _of_arm(robot, robot.opw, poses[rows], arm, rows.start)
    options = _wrist_pair(wrists, q_start)
    # Both wrists differ by an isometry (half turns, mirrored axis 5), so whether to change over does not depend on
    # which one the arm is in, and the changes add up.
    before = np.concatenate([np.repeat(np.asarray(q_start)[None, None], 2, axis=1), options[:-1]])
    stay = np.abs(_wrapped(options[:, 0] - before[:, 0])).max(axis=-1)
    change = np.abs(_wrapped(options[:, 1] - before[:, 0])).max(axis=-1)
    chosen = np.cumsum(change < stay) % 2
    q = options[np.arange(len(poses)), chosen]
    return np.unwrap(np.concatenate([np.asarray(q_start, dtype=float)[None], q]), axis=0)[1:]


def _arm(robot: Robot, opw: Opw, q_start: Array, first: Array) -> int:
    """Return the branch of shoulder and elbow (cfx without its last bit) of the posture ``q_start`` (6,) [rad].

    Within 1 mm of the edge of two branches it is that of the solution of the pose ``first`` (1, 4, 4) whose joints are
    nearest.
    """
    if np.any(np.abs(wrist_place(opw, q_start)) < ARM_SINGULAR):
        solutions = inverse(robot, first)[0]
        travel = np.abs(_wrapped(solutions - q_start))[:, :3].max(axis=1)
        if not np.isnan(travel).all():
            return int(branch(opw, solutions)[np.nanargmin(travel)]) >> 1
    return int(branch(opw, q_start)) >> 1


def _of_arm(robot: Robot, opw: Opw, poses: Array, arm: int, start: int) -> Array:
    """Return the two solutions (n, 2, 6) [rad] of each pose in one branch of shoulder and elbow; KIN004 without.

    They differ in the sign of axis 5.

    Args:
        arm: the branch, cfx without its last bit.
        start: number of poses of the path before these, for the message.
    """
    solutions = inverse(robot, poses)
    bits = branch(opw, solutions)
    pair = np.argsort(np.where((bits >> 1) == arm, bits, 99) + 50 * np.isnan(solutions[..., 0]), axis=1)[:, :2]
    rows = np.arange(len(poses))[:, None]
    options: Array = solutions[rows, pair]
    lost = ((bits[rows, pair] >> 1) != arm).any(axis=1) | np.isnan(options).any(axis=(1, 2))
    if lost.any():
        _raise_unreachable(robot, start + int(np.argmax(lost)))
    return options


def _wrist_pair(options: Array, q_start: Array) -> Array:
    """Return the two solutions (n, 2, 6) of each pose; at a straight wrist axis 4 stays as it was and axis 6 follows.

    Args:
        options: (n, 2, 6) solutions [rad] that differ at the wrist; only the first of each pose is used.
        q_start: (6,) posture before the first pose [rad].
    """
    first = options[:, 0].copy()
    singular = np.abs(np.sin(first[:, 4])) < TAUGHT_WRIST
    if singular.any():
        known = np.where(singular, -1, np.arange(len(first)))
        last = np.maximum.accumulate(known)
        q4 = np.where(last < 0, q_start[3], first[last, 3])
        sign = np.where(np.cos(first[:, 4]) > 0, 1.0, -1.0)
        total = first[:, 3] + sign * first[:, 5]
        first[:, 3] = np.where(singular, q4, first[:, 3])
        first[:, 4] = np.where(singular, np.round(first[:, 4] / np.pi) * np.pi, first[:, 4])
        first[:, 5] = np.where(singular, sign * (total - q4), first[:, 5])
    second = first * np.array([1, 1, 1, 1, -1, 1]) + np.array([0, 0, 0, np.pi, 0, np.pi])
    return np.stack([first, second], axis=1)


def _wrapped(angle: Array) -> Array:
    """Return angles [rad] moved by whole turns to [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _raise_unreachable(robot: Robot, index: int) -> None:
    """Raise KIN004: the pose with this index is out of reach in the branch of the path."""
    raise PostprocError.of(
        "KIN004",
        f"`{robot.name}` cannot follow the path: pose {index} of it is out of reach in this configuration",
        help="move the path into the working range, or pass the point with a joint move",
        exit_code=1,
    )


def _stepwise(robot: Robot, poses: Array, q_start: Array) -> list[Array]:
    """Solve poses in turn by Newton's method, each from the solution before, without closed form; KIN004 if lost."""
    q, result = np.asarray(q_start, dtype=float), []
    for index, T in enumerate(poses):
        for _ in range(50):
            error = pose_error(forward(robot, q)[0], T)
            if np.abs(error).max() < 1e-12:
                break
            step = np.linalg.lstsq(jacobian(robot, q)[0], error, rcond=1e-9)[0]
            q = q + step * min(1.0, 0.5 / max(np.abs(step).max(), 1e-300))
        else:
            if np.abs(error).max() > 1e-9:
                _raise_unreachable(robot, index)
        result.append(q)
    return result
