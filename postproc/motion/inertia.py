"""Joint torques of a moving arm with its payload, through pinocchio."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.geometry import point_acceleration
from postproc.model.multibody import Multibody
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses, jacobian
from postproc.robot.pose import transform

NO_GRAVITY = np.zeros(3)


def inertial_torque(
    robot: Robot, q: Array, v: Array, a: Array, mass: Array, center: Array, gravity: Array = NO_GRAVITY
) -> Array:
    """Joint torques M(q) a + C(q, v) v (+ weight where gravity is given) of links and payload, (n, 6) [N m].

    Args:
        q, v, a: (n, 6) [rad], [rad/s], [rad/s^2]; mass: (n,) payload [kg], a point mass at center (n, 3) in tool0 [m].
        gravity: (3,) in base axes [m/s^2].
    """
    if len(q) == 0:
        return np.zeros((0, 6))
    links = Multibody(robot, gravity, ()).rnea(q, v, a)
    T = body_poses(robot, q)
    T_flange_center = transform(center)
    point = (T[:, 6] @ robot.link[6] @ T_flange_center)[:, :3, 3]
    force = mass[:, None] * (point_acceleration(robot, T, v, a, 6, point) - gravity)
    total: Array = links + np.einsum("nij,ni->nj", jacobian(robot, q, T_flange_center)[:, :3], force)
    return total
