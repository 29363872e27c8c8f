"""Geometry of the deflected arm: the product of nominal transforms, joint turns and displacements of bodies' ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses, joint_turns, times

UNIT_AXES = np.eye(3)


@dataclass(frozen=True, slots=True)
class Chain:
    """The deflected arm in the base frame.

    Args:
        q: (n, 6) real joint angles [rad]; body: displacement (n, 6) at the far end of a body, by its number.
        T_base_body: (n, 7, 4, 4); T_base_flange: (n, 4, 4).
        tip: (n, 7, 3) displaced far ends [m]; turn: (n, 7, 3, 3) columns are the axes about which they turn.
    """

    q: Array
    body: Mapping[int, Array]
    T_base_body: Array
    T_base_flange: Array
    tip: Array | None
    turn: Array | None


def deflected_chain(robot: Robot, q: Array, body: Mapping[int, Array], ends: bool) -> Chain:
    """Compute the chain of the deflected arm, in which body b is Trans(p_b + xi) Rx Ry Rz R_b Rot(axis_b, q_b).

    Args:
        q: (n, 6) joint angles with their deflection [rad].
        body: by number of the body, (n, 6) displacement of its far end in body axes: xi [m], then the angles of Rx
            Ry Rz.
        ends: also compute ``tip`` and ``turn`` where no body is displaced; else they are None.
    """
    if not body and not ends:
        T = body_poses(robot, q)
        return Chain(q, body, T, T[:, 6] @ robot.link[6], None, None)
    n = len(q)
    # Poses run along the last axis while they are built.
    T, tip, turn = np.zeros((7, 4, 4, n)), np.empty((7, 3, n)), np.empty((7, 3, 3, n))
    T[:, 3, 3] = 1.0
    turns = [*joint_turns(robot, q), robot.link[6, :3, :3, None]]
    R, p = np.broadcast_to(UNIT_AXES[..., None], (3, 3, n)), np.zeros((3, n))
    for b in range(7):
        T[b, :3, :3], T[b, :3, 3], turn[b] = R, p, R
        span = robot.link[b, :3, 3, None]
        if b in body:
            xi = body[b].T
            p = p + times(R, span + xi[:3])
            R = R.copy()
            for k, (sine, cosine) in enumerate(zip(np.sin(xi[3:]), np.cos(xi[3:]), strict=True)):
                turn[b, :, k] = R[:, k]
                y, z = R[:, (k + 1) % 3], R[:, (k + 2) % 3]
                R[:, (k + 1) % 3], R[:, (k + 2) % 3] = y * cosine + z * sine, z * cosine - y * sine
        else:
            p = p + times(R, span)
        tip[b] = p
        R = times(R, turns[b])
    flange = np.zeros((4, 4, n))
    flange[:3, :3], flange[:3, 3], flange[3, 3] = R, p, 1.0
    poses, ends_at = (np.ascontiguousarray(np.moveaxis(each, -1, 0)) for each in (T, tip))
    return Chain(q, body, poses, flange.transpose(2, 0, 1), ends_at, turn.transpose(3, 0, 1, 2))


@dataclass(frozen=True)
class Directions:
    """How every coordinate moves what lies beyond it, in chain order, m coordinates.

    Args:
        slide: (n, m, 3) unit direction of sliding coordinates, zero for turns.
        spin: (n, m, 3) axis of turns, zero for slides; origin: (n, m, 3) a point on the axis [m].
        carried: (m,) first body that the coordinate moves (7: flange).
    """

    slide: Array
    spin: Array
    origin: Array
    carried: tuple[int, ...]

    def some(self, index: NDArray[np.int_]) -> Directions:
        """Return the directions of the coordinates with these numbers, from 0 in chain order, ascending."""
        carried = tuple(self.carried[k] for k in index)
        return Directions(self.slide[:, index], self.spin[:, index], self.origin[:, index], carried)

    @cached_property
    def line(self) -> Array:
        """(n, m, 6) line [s + o x a, a] of each coordinate; times a wrench about the base origin it is the load."""
        return np.concatenate([self.slide + np.cross(self.origin, self.spin), self.spin], axis=-1)


def directions(robot: Robot, chain: Chain, bodies: tuple[int, ...]) -> Directions:
    """Compute the directions of the six joints and of six springs for each of these bodies (0 to 6), in base axes."""
    axes = (chain.T_base_body[:, 1:, :3, :3] @ robot.axis[:, :, None])[..., 0]
    origin = chain.T_base_body[:, 1:, :3, 3]
    if not bodies:
        return Directions(np.zeros_like(axes), axes, origin, tuple(range(1, 7)))
    assert chain.tip is not None and chain.turn is not None
    n = len(chain.q)
    m = 6 + 6 * len(bodies)
    slide, spin, points = np.zeros((n, m, 3)), np.zeros((n, m, 3)), np.zeros((n, m, 3))
    carried, at = [], 0
    for b in range(7):
        if b in bodies:
            slide[:, at : at + 3] = np.swapaxes(chain.T_base_body[:, b, :3, :3], 1, 2)
            spin[:, at + 3 : at + 6] = np.swapaxes(chain.turn[:, b], 1, 2)
            points[:, at : at + 6] = chain.tip[:, b, None]
            carried += [b + 1] * 6
            at += 6
        if b < 6:
            spin[:, at], points[:, at] = axes[:, b], origin[:, b]
            carried.append(b + 1)
            at += 1
    return Directions(slide, spin, points, tuple(carried))


def point_jacobian(along: Directions, point: Array) -> Array:
    """Return the Jacobian (n, 6, m) of points (n, 3) fixed to the flange: linear, then angular velocity, base axes."""
    linear = along.slide + np.cross(along.spin, point[:, None] - along.origin)
    return np.concatenate([linear, along.spin], axis=-1).transpose(0, 2, 1)


def generalised_forces(along: Directions, forces: Array) -> Array:
    """Return the generalised forces J^T w (n, m) of wrenches w: the load that they put on each coordinate.

    Args:
        forces: (n, 8, 6) force [N] and moment about the base origin [N m] on bodies 0 to 6 and the flange.
    """
    # A coordinate bears what acts on the first body that it moves, and on all after it.
    w = np.cumsum(forces[:, ::-1], axis=1)[:, ::-1][:, list(along.carried)]
    return np.einsum("nmi,nmi->nm", along.line, w)
