"""Poses as (..., 4, 4) arrays: build, compare."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.robot.kinematics import skew

LOCKED = 1e-9
"""Cosine of a pitch below which roll and yaw turn about one axis."""


def transform(translation: Array, rotation: Array | None = None) -> Array:
    """Return the pose [R p; 0 1] of translation (..., 3) [m] and rotation matrix (..., 3, 3)."""
    translation = np.asarray(translation, dtype=float)
    T = np.zeros((*translation.shape[:-1], 4, 4))
    T[..., :3, :3] = np.eye(3) if rotation is None else rotation
    T[..., :3, 3] = translation
    T[..., 3, 3] = 1.0
    return T


def displace(xi: Array) -> Array:
    """Return the pose of a displacement: translation xi[:3], then the rotation vector xi[3:], (..., 6) -> (..., 4, 4).

    Equal to Exp(xi) of SE(3) up to |translation| |rotation| / 2, which is below 1 micrometre at 1 mm and 1 mrad.
    """
    xi = np.asarray(xi, dtype=float)
    rotation = Rotation.from_rotvec(xi[..., 3:].reshape(-1, 3)).as_matrix().reshape(*xi.shape[:-1], 3, 3)
    return transform(xi[..., :3], rotation)


def pose_error(T: Array, T_wanted: Array) -> Array:
    """Return the difference from pose T to T_wanted, (n, 6): position [m] and rotation vector [rad], base axes."""
    rotation = T_wanted[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    vector = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_rotvec().reshape(*rotation.shape[:-2], 3)
    return np.concatenate([T_wanted[..., :3, 3] - T[..., :3, 3], vector], axis=-1)


def between(T: Array, T_other: Array, share: Array) -> Array:
    """Return poses (n, 4, 4) that lie a share (n,) of the way from T to T_other: 0 is T, 1 is T_other."""
    step = share[:, None] * pose_error(T, T_other)
    turn = Rotation.from_rotvec(step[:, 3:]).as_matrix()
    return transform(T[:, :3, 3] + step[:, :3], turn @ T[:, :3, :3])


def rpy(angles: Array) -> Array:
    """Return the rotation Rz(yaw) Ry(pitch) Rx(roll) of fixed-axis angles (roll, pitch, yaw) [rad], as in URDF."""
    return np.asarray(Rotation.from_euler("xyz", angles).as_matrix(), dtype=float)


def rpy_degrees(R: Array) -> Array:
    """Return the angles (3,) [deg] of which `rpy` makes R (3, 3), to 1e-9; roll is 0 where pitch is 90 or -90 degrees.

    Yaw is what is left once roll is turned back: R Rx(-roll) = Rz(yaw) Ry(pitch), which holds for any roll there.
    """
    upright = np.hypot(R[2, 1], R[2, 2])
    roll = np.arctan2(R[2, 1], R[2, 2]) if upright > LOCKED else 0.0
    side = R[:, 1] * np.cos(roll) - R[:, 2] * np.sin(roll)
    angles = np.array([roll, np.arctan2(-R[2, 0], upright), np.arctan2(-side[0], side[1])])
    return np.asarray(np.degrees(angles).round(9) + 0.0)


def left_jacobian(vector: Array) -> Array:
    """Return the left Jacobian (n, 3, 3) of rotation vectors (n, 3): rotation per change of the vector, outer axes.

    J = I + (1 - cos t)/t^2 S + (t - sin t)/t^3 S^2 (Chirikjian 2011, Sec. 10.8.1), at angles t of any size.
    """
    t = np.linalg.norm(vector, axis=1)[:, None, None]
    S = skew(vector)
    small = t < 1e-5
    safe = np.where(small, 1.0, t)
    a = np.where(small, 0.5, (1 - np.cos(safe)) / safe**2)
    b = np.where(small, 1 / 6, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + a * S + b * (S @ S))


def rotation_vectors(R: Array) -> Array:
    """Return the rotation vectors (n, 3) [rad] of rotations (n, 3, 3); NaN rows stay NaN."""
    result = np.full((len(R), 3), np.nan)
    good = np.isfinite(R).all(axis=(1, 2))
    if good.any():
        result[good] = Rotation.from_matrix(R[good]).as_rotvec()
    return result
