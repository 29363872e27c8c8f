"""Rotations, and where the flange of the IRB 4600-60/2.05 is; plain numpy, lengths in millimetres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]


def matrix_of_quaternion(q: Any) -> Array:
    """(3, 3) of (q1 scalar, q2, q3, q4); ValueError where its length is none."""
    v = np.asarray(q, float)
    length = math.sqrt(float(v @ v))
    if length < 1e-9:
        raise ValueError("a quaternion of length 0")
    w, x, y, z = v / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of_matrix(r: Array) -> list[float]:
    """(w, x, y, z), w >= 0: the eigenvector of the largest eigenvalue of Bar-Itzhack's symmetric matrix."""
    k = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [0, 0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [0, 0, 0, r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    q = np.linalg.eigh(k + np.triu(k, 1).T)[1][:, -1]
    return [float(v) for v in (q if q[0] >= 0 else -q)]


def _turn(axis: int, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    t = np.eye(4)
    t[i, i] = t[j, j] = c
    t[i, j], t[j, i] = -s, s
    return t


def _shift(x: float, y: float, z: float) -> Array:
    t = np.eye(4)
    t[:3, 3] = (x, y, z)
    return t


def flange(q: Any) -> Array:
    """(4, 4) of tool0 in the base [mm] at joint angles q (6,) [deg]; lengths of Table 1 of the source paper, a2 900."""
    a = [math.radians(v) for v in q]
    t = _turn(2, a[0]) @ _shift(175, 0, 495) @ _turn(1, a[1]) @ _shift(0, 0, 900) @ _turn(1, a[2]) @ _shift(960, 0, 175)
    return t @ _turn(0, a[3]) @ _turn(1, a[4]) @ _shift(135, 0, 0) @ _turn(0, a[5]) @ _turn(1, math.pi / 2)


def angle_between(a: Array, b: Array) -> float:
    """Angle of the turn from one pose or rotation to the other [rad]."""
    d = a[:3, :3].T @ b[:3, :3]
    v = np.array([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]]) / 2
    return math.atan2(float(np.linalg.norm(v)), (float(np.trace(d)) - 1) / 2)


def distance_to_segment(p: Array, a: Array, b: Array) -> float:
    d = b - a
    length = float(d @ d)
    t = 0.0 if length < 1e-12 else min(1.0, max(0.0, float((p - a) @ d) / length))
    return float(np.linalg.norm(p - a - t * d))


def distance_to_arc(p: Array, a: Array, via: Array, b: Array) -> float:
    """Distance of p to the circle through a, via and b (to the line where they are on one)."""
    u, v = via - a, b - a
    n = np.cross(u, v)
    nn = float(n @ n)
    if nn < 1e-6 * float(u @ u) * float(v @ v) + 1e-9:
        return min(distance_to_segment(p, a, via), distance_to_segment(p, via, b))
    centre = a + (float(u @ u) * np.cross(v, n) - float(v @ v) * np.cross(u, n)) / (2 * nn)
    radius = float(np.linalg.norm(a - centre))
    n = n / math.sqrt(nn)
    out = float((p - centre) @ n)
    inside = float(np.linalg.norm(p - centre - out * n))
    return math.hypot(out, inside - radius)
