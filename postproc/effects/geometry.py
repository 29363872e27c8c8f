"""Lengths and axes of the nominal arm that effects need, and wrenches moved to the base origin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.robot.arm import Robot
from postproc.robot.kinematics import BodyMotion


def distal_point(robot: Robot, body: int) -> Array:
    """Return the distal end (3,) of a body in its own axes [m]: where the next joint, or the flange, is."""
    return np.asarray(robot.link[body][:3, 3], dtype=float)


def joint_axis(robot: Robot, joint: int) -> Array:
    """Return the unit axis (3,) of a joint (from 0) in the axes of the body before it, at whose end it sits."""
    return np.asarray(robot.link[joint][:3, :3] @ robot.axis[joint], dtype=float)


def long_bodies(robot: Robot, share: float = 0.5) -> tuple[int, ...]:
    """Return the numbers of bodies 1 to 5 that are at least ``share`` as long as the longest: usually the two arms."""
    length = np.linalg.norm(robot.link[1:6, :3, 3], axis=1)
    return tuple(int(b) + 1 for b in np.flatnonzero(length >= share * length.max()))


def point_in_base(T_base_body: Array, point: Array) -> Array:
    """Return a point (3,) of a body in the base frame, (n, 3), from the poses (n, 4, 4) of the body."""
    return T_base_body[:, :3, :3] @ point + T_base_body[:, :3, 3]


def force_at(point: Array, force: Array) -> Array:
    """Return a force (n, 3) at a point (n, 3) and its moment about the base origin, (n, 6)."""
    return np.concatenate([force, np.cross(point, force)], axis=1)


def point_acceleration(motion: BodyMotion, T_base_body: Array, point: Array) -> Array:
    """Return the acceleration (n, 3) [m/s^2] of a point (n, 3) of a body, base axes.

    Args:
        motion: of the body (`kinematics.body_motions`); T_base_body: (n, 4, 4) the body.
    """
    return motion.acceleration + motion.swung(point - T_base_body[:, :3, 3])


def turned(matrix: Array, vectors: Array) -> Array:
    """Multiply matrices (n, 3, 3) by vectors (n, 3)."""
    return np.asarray((matrix @ vectors[:, :, None])[:, :, 0])


FAR_M = 2.0
"""Centres farther than this from the origin of their body [m] are no compact masses."""

Mass = tuple[float | Array, Array]
"""A compact mass on a body: mass [kg], or (n,), and mass times its centre [kg m], (3,) or (n, 3)."""


def weight(state: State, body: int, masses: Sequence[Mass], T_body_part: Array | None = None) -> Array:
    """Return the wrench (n, 6) about the base origin of compact masses on a body: m (g - a), each at its centre.

    Linear in masses and first moments at rest. Where the body turns, a mass m with the first moment f has the second
    moment f f^T / m; a first moment without a mass, whose centre is out of reach, has none.

    Args:
        masses: mass [kg] and first moment [kg m] of each, in the axes of the body, or of a part of it.
        T_body_part: (4, 4) the part; None for the body itself.
    """
    T_base = np.asarray(state.T_base_body)[:, body]
    T = T_base if T_body_part is None else T_base @ T_body_part
    origin, n = T_base[:, :3, 3], len(state)
    each = []
    for mass_kg, moment in masses:
        m = np.broadcast_to(np.asarray(mass_kg, dtype=float), (n,))[:, None]
        each.append((m, turned(T[:, :3, :3], np.broadcast_to(moment, (n, 3))) + m * (T[:, :3, 3] - origin)))
    mass, first = sum((m for m, _ in each), np.zeros((n, 1))), sum((f for _, f in each), np.zeros((n, 3)))
    force, torque = mass * state.gravity, np.cross(first, state.gravity)
    if state.motions is not None:
        motion = state.motions[body]
        force = force - mass * motion.acceleration - motion.swung(first)
        torque = torque - np.cross(first, motion.acceleration)
        for m, f in each:
            torque = torque - _over(m, f) * np.cross(f, motion.swung(f))
    return np.concatenate([force, torque + np.cross(origin, force)], axis=1)


def _over(mass: Array, first_moment: Array) -> Array:
    """Return (n, 1) one over a mass, or nearly zero where its centre is beyond 2 m: m^3 / (m^4 + (f / far)^4)."""
    least = (np.linalg.norm(first_moment, axis=1, keepdims=True) / FAR_M) ** 4
    return np.asarray(mass**3 / np.maximum(mass**4 + least, 1e-300))
