"""Nominal forward kinematics, as the controller computes them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.arrays import Array, blocks
from postproc.robot.arm import Robot


def skew(vector: Array) -> Array:
    """Return cross-product matrices of vectors, (..., 3) -> (..., 3, 3)."""
    vector = np.asarray(vector, dtype=float)
    S = np.zeros((*vector.shape, 3))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        S[..., j, i], S[..., i, j] = vector[..., k], -vector[..., k]
    return S


def joint_turns(robot: Robot, q: Array) -> Array:
    """Compute the rotation from each body to the next, link and joint together, (n, 6) [rad] -> (6, 3, 3, n)."""
    angles = np.asarray(q, dtype=float).reshape(-1, 6).T[:, None, None]
    S, turn = skew(robot.axis), robot.link[:6, :3, :3]
    still, wave, tilt = (M[..., None] for M in (turn @ (np.eye(3) + S @ S), turn @ S, -turn @ S @ S))
    return np.asarray(still + wave * np.sin(angles) + tilt * np.cos(angles))


def times(R: Array, other: Array) -> Array:
    """Multiply rotations (3, 3, n) by matrices (3, m, n) or vectors (3, n), with the poses along the last axis.

    Long plain sums are faster than many small products.
    """
    if other.ndim == 2:
        return np.asarray(R[:, 0] * other[0] + R[:, 1] * other[1] + R[:, 2] * other[2])
    return np.asarray(R[:, 0, None] * other[0] + R[:, 1, None] * other[1] + R[:, 2, None] * other[2])


def body_poses(robot: Robot, q: Array) -> Array:
    """Compute the poses of the body frames 0 (base) to 6 in the base frame, (n, 6) [rad] -> (n, 7, 4, 4)."""
    turns = joint_turns(robot, q)
    T = np.zeros((7, 4, 4, turns.shape[-1]))
    T[:, 3, 3] = 1.0
    T[0, [0, 1, 2], [0, 1, 2]] = 1.0
    for j in range(6):
        R = T[j, :3, :3]
        T[j + 1, :3, 3] = T[j, :3, 3] + times(R, robot.link[j, :3, 3, None])
        T[j + 1, :3, :3] = times(R, turns[j])
    return T.transpose(3, 0, 1, 2)


class BodyMotion(NamedTuple):
    """How a body moves, in base axes: a point p has a + spin_rate x (p - o) + spin x (spin x (p - o)).

    Args:
        acceleration: (n, 3) of its origin o [m/s^2]; spin, spin_rate: (n, 3) angular velocity [rad/s] and
            acceleration [rad/s^2].
    """

    acceleration: Array
    spin: Array
    spin_rate: Array

    def swung(self, arm: Array) -> Array:
        """Return the acceleration (n, 3) [m/s^2] of points, relative to the origin, at ``arm`` (n, 3) [m] from it."""
        spin, arm = self.spin.T, np.asarray(arm).T
        return (cross(self.spin_rate.T, arm) + cross(spin, cross(spin, arm))).T


def cross(a: Array, b: Array) -> Array:
    """Return cross products (3, n) of vectors (3, n), components along the first axis; faster than numpy's."""
    x, y, z = a
    u, v, w = b
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u])


def body_motions(
    robot: Robot, T_base_body: Array, v: Array, a: Array, base: tuple[Array | None, Array | None] = (None, None)
) -> list[BodyMotion]:
    """Compute the motion of bodies 0 to 6 by the outward Newton-Euler recursion.

    Args:
        T_base_body: (n, 7, 4, 4); v, a: (n, 6) joint speeds [rad/s] and accelerations [rad/s^2].
        base: (n, 3) angular velocity [rad/s] and acceleration [rad/s^2] of the base, whose origin is at rest.
    """
    # Points run along the last axis: components are long rows.
    T = np.moveaxis(T_base_body, 0, -1)
    acceleration, origin = np.zeros((2, 3, len(v)))
    spin, spin_rate = (np.zeros((3, len(v))) if rate is None else rate.T for rate in base)
    motions = [BodyMotion(acceleration.T, spin.T, spin_rate.T)]
    for j in range(6):
        R, p = T[j + 1, :3, :3], T[j + 1, :3, 3]
        arm = p - origin
        acceleration = acceleration + cross(spin_rate, arm) + cross(spin, cross(spin, arm))
        origin = p
        turn = times(R, robot.axis[j, :, None])
        rate = turn * v[:, j]
        spin_rate = spin_rate + turn * a[:, j] + cross(spin, rate)
        spin = spin + rate
        motions.append(BodyMotion(acceleration.T, spin.T, spin_rate.T))
    return motions


def forward(robot: Robot, q: Array) -> Array:
    """Return flange poses T_base_flange (n, 4, 4) at joint angles q (n, 6) [rad], by the chain of `Robot`."""
    q = np.asarray(q, dtype=float).reshape(-1, 6)
    T = np.empty((len(q), 4, 4))
    for rows in blocks(len(q)):
        T[rows] = body_poses(robot, q[rows])[:, 6] @ robot.link[6]
    return T


def jacobian(robot: Robot, q: Array, T_flange_tcp: Array | None = None) -> Array:
    """Return the geometric Jacobian (n, 6, 6) of the flange (of the TCP, if a tool is given) in base axes.

    Column j is [z_j x (p - p_j); z_j] (seed paper, Sec. 2.2): linear part first, [m/rad] and [rad/rad].
    """
    T = body_poses(robot, q)
    tip = T[:, 6] @ robot.link[6]
    if T_flange_tcp is not None:
        tip = tip @ T_flange_tcp
    axes = np.einsum("njab,jb->nja", T[:, 1:, :3, :3], robot.axis)
    arms = tip[:, None, :3, 3] - T[:, 1:, :3, 3]
    return np.concatenate([np.cross(axes, arms), axes], axis=-1).transpose(0, 2, 1)
