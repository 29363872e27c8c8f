"""Joint torques of a moving arm with its payload."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array, blocks
from postproc.effects.geometry import point_acceleration
from postproc.model.chain import deflected_chain, directions
from postproc.model.multibody import Multibody
from postproc.robot.arm import Drives, Robot
from postproc.robot.kinematics import body_motions

NO_GRAVITY = np.zeros(3)
DRIVEN = slice(0, 3)
"""Columns of the joints whose accelerations `Drives` limit: axes 1 to 3."""


def point_velocity(robot: Robot, T_base_body: Array, v: Array, point: Array) -> Array:
    """Velocities (n, 3) [m/s] of flange-fixed points: sum over the joints of v_j z_j x (p - p_j).

    Args:
        T_base_body: (n, 7, 4, 4) poses of base and bodies.
        v: (n, 6) joint speeds [rad/s].
        point: (n, 3) positions in base axes [m].
    """
    axes = (T_base_body[:, 1:, :3, :3] @ robot.axis[:, :, None])[..., 0] * v[:, :, None]
    return np.cross(axes.sum(axis=1), point) - np.cross(axes, T_base_body[:, 1:, :3, 3]).sum(axis=1)


def inertial_torque(
    robot: Robot, motion: tuple[Array, Array, Array], payload: tuple[Array, Array], gravity: Array = NO_GRAVITY
) -> Array:
    """Joint torques M(q) a + C(q, v) v (+ weight where gravity is given) of links and payload, (n, 6) [N m].

    Args:
        motion: q, v, a, (n, 6) each [rad], [rad/s], [rad/s^2].
        payload: mass (n,) [kg], a point mass, and its center (n, 3) in tool0 [m].
        gravity: (3,) in base axes [m/s^2].
    """
    (q, v, a), (mass, center) = motion, payload
    arm = Multibody(robot, gravity, ())
    result = np.empty((len(q), 6))
    for rows in blocks(len(q)):
        chain = deflected_chain(robot, q[rows], {}, False)
        along, T, flange = directions(robot, chain, ()), chain.T_base_body, chain.T_base_flange
        point = (flange[:, :3, :3] @ center[rows, :, None])[..., 0] + flange[:, :3, 3]
        flange_motion = body_motions(robot, T, v[rows], a[rows])[6]
        force = mass[rows, None] * (point_acceleration(flange_motion, T[:, 6], point) - gravity)
        # z_j . ((p - p_j) x f) = (z_j x (p - p_j)) . f, moments about the origin taken once.
        moment = np.cross(point, force)[:, None] - np.cross(along.origin, force[:, None])
        result[rows] = arm.rnea(chain, along, v[rows], a[rows]) + np.sum(along.spin * moment, axis=2)
    return result


def drive_shares(
    robot: Robot, drives: Drives, motion: tuple[Array, Array, Array], payload: tuple[Array, Array]
) -> Array:
    """Shares (n, 3), with their sign, that a motion takes of the torques with which axes 1 to 3 accelerate.

    Args:
        motion: q, v, a, (n, 6) each [rad], [rad/s], [rad/s^2].
        payload: mass (n,) [kg], a point mass, and its center (n, 3) in tool0 [m].
    """
    torque = inertial_torque(robot, motion, payload)[:, DRIVEN]
    return np.asarray((torque + drives.rotor * motion[2][:, DRIVEN]) / drives.torque)
