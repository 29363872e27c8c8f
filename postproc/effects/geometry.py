"""Lengths and axes of the nominal arm that effects need, and wrenches moved to the base origin."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.robot.arm import Robot

BODIES = 7


def distal_point(robot: Robot, body: int) -> Array:
    """(3,) distal end of a body in its own axes [m]: where the next joint, or the flange, sits."""
    return np.asarray(robot.link[body][:3, 3], dtype=float)


def joint_axis(robot: Robot, joint: int) -> Array:
    """(3,) axis of joint ``joint`` (from 0) in the axes of the body that carries it."""
    return np.asarray(robot.link[joint][:3, :3] @ robot.axis[joint], dtype=float)


def long_bodies(robot: Robot, share: float = 0.3) -> tuple[int, ...]:
    """Arm bodies (1 to 5) at least ``share`` as long as the longest one: the upper arm and the forearm."""
    length = np.linalg.norm(robot.link[1:6, :3, 3], axis=1)
    return tuple(int(b) + 1 for b in np.flatnonzero(length >= share * length.max()))


def point_in_base(T_base_body: Array, point: Array) -> Array:
    """(n, 3) a point of a body in base axes, from (n, 4, 4) and (3,)."""
    return T_base_body[:, :3, :3] @ point + T_base_body[:, :3, 3]


def force_at(point: Array, force: Array) -> Array:
    """(n, 6) force and its moment about the base origin, of a force (n, 3) that acts at a point (n, 3)."""
    return np.concatenate([force, np.cross(point, force)], axis=1)


