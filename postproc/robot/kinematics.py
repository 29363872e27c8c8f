"""Nominal forward kinematics, as the controller computes them."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.robot.arm import Robot

_BLOCK = 5000  # poses whose bodies are held at a time: long programs need little memory


def skew(vector: Array) -> Array:
    """Cross-product matrices, (..., 3) -> (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(vector, dtype=float), -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


def axis_rotation(axis: Array, angle: Array) -> Array:
    """Rotations about one unit axis, I + sin(q) S + (1 - cos(q)) S^2 (Rodrigues), (n,) [rad] -> (n, 3, 3)."""
    S = skew(axis)
    return np.eye(3) + np.sin(angle)[:, None, None] * S + (1.0 - np.cos(angle))[:, None, None] * (S @ S)


def body_poses(robot: Robot, q: Array) -> Array:
    """Poses of the body frames 0 (base) to 6 in the base frame, (n, 6) [rad] -> (n, 7, 4, 4)."""
    angles = np.asarray(q, dtype=float).reshape(-1, 6).T
    sine, cosine = np.sin(angles), np.cos(angles)
    # Poses run along the last axis while they are built: long plain sums are faster than many small products.
    T = np.zeros((7, 4, 4, angles.shape[1]))
    T[:, 3, 3] = 1.0
    T[0, [0, 1, 2], [0, 1, 2]] = 1.0
    S = skew(robot.axis)
    turn = robot.link[:6, :3, :3]
    still, wave, tilt = (M[..., None] for M in (turn @ (np.eye(3) + S @ S), turn @ S, -turn @ S @ S))  # Rodrigues
    for j in range(6):
        R, p, link = T[j, :3, :3], T[j, :3, 3], robot.link[j, :3, 3]
        step = still[j] + wave[j] * sine[j] + tilt[j] * cosine[j]
        T[j + 1, :3, 3] = p + R[:, 0] * link[0] + R[:, 1] * link[1] + R[:, 2] * link[2]
        T[j + 1, :3, :3] = R[:, 0, None] * step[0] + R[:, 1, None] * step[1] + R[:, 2, None] * step[2]
    return T.transpose(3, 0, 1, 2)


def forward(robot: Robot, q: Array) -> Array:
    """Flange poses link[0] Rot(axis[0], q1) .. Rot(axis[5], q6) link[6], (n, 6) [rad] -> T_base_flange (n, 4, 4)."""
    q = np.asarray(q, dtype=float).reshape(-1, 6)
    T = np.empty((len(q), 4, 4))
    for start in range(0, len(q), _BLOCK):
        rows = slice(start, start + _BLOCK)
        T[rows] = body_poses(robot, q[rows])[:, 6] @ robot.link[6]
    return T


def jacobian(robot: Robot, q: Array, T_flange_tcp: Array | None = None) -> Array:
    """Geometric Jacobian of the flange (of the TCP, if a tool is given) in base axes, (n, 6, 6).

    Column j is [z_j x (p - p_j); z_j] (seed paper, Sec. 2.2): linear part first, [m/rad] and [rad/rad].
    """
    T = body_poses(robot, q)
    tip = T[:, 6] @ robot.link[6]
    if T_flange_tcp is not None:
        tip = tip @ T_flange_tcp
    axes = np.einsum("njab,jb->nja", T[:, 1:, :3, :3], robot.axis)
    arms = tip[:, None, :3, 3] - T[:, 1:, :3, 3]
    return np.concatenate([np.cross(axes, arms), axes], axis=-1).transpose(0, 2, 1)
