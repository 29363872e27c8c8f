"""Samples of the programmed curves themselves, corners not cut: where the correction is computed and proved.

Zones cut the corners of the original and of the corrected program alike, so targets are corrected for the curve that
the program states. Every move in space has samples from its start (u = 0) to its goal (u = 1), both included, so that
two moves that meet at a target may have different states there (another tool, the arc just lit).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import Curves, build_curves, joints_and_poses, pose_in_space
from postproc.motion.values import Index, Move, stretches
from postproc.robot.arm import Robot
from postproc.robot.track import track

SPACING = 0.02  # [m]: a correction that bends by 1 mm over 1 m deviates from its chord by 0.4 micrometres in between
TURN = np.radians(3.0)
ARC_STEP = np.radians(6.0)
JOINT_STEP = np.radians(10.0)
STRAIGHT = np.radians(6.0)  # |q5| below which axes 4 and 6 may turn so fast that the way is followed in finer steps
FINER = 16
OTHER_POSTURE = 0.1  # [rad] of one joint at least between two postures of one pose
ASIDE = np.radians(0.3)  # that a tool stands beside an even turn from end to end


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """n samples of m moves.

    Args:
        move, u: (n,) move index and fraction along it.
        T_work_tcp: (n, 4, 4) programmed poses.
        q: (n, 6) nominal joint angles [rad].
        axes: (n, 6) external axes [m], [rad].
        start, goal: (m,) sample index of u = 0 and u = 1; equal for moves whose way is unknown.
        q_reached: (m, 6) joint angles [rad] in which the arm comes to each goal; ``q`` there is what confdata selects.
    """

    moves: tuple[Move, ...]
    curves: Curves
    move: Index
    u: Array
    T_work_tcp: Array
    q: Array
    axes: Array
    start: Index
    goal: Index
    q_reached: Array

    def mounts_at(self, rows: slice | Index) -> Mounts:
        """The mounts of tool and work at samples, chosen by a slice or indices."""
        return self.curves.mounts_at(self.move[rows], self.axes[rows])

    def turned_aside(self) -> Index:
        """Indices of moves with interpolated wrist axes on whose way the tool does not turn evenly from start to goal.

        A target in between would stand beside that way, which the controller alone knows.
        """
        rows = np.flatnonzero(self.curves.wrist[self.move])
        even = pose_in_space(self.curves, self.move[rows], self.u[rows])[:, :3, :3]
        aside = Rotation.from_matrix(even).inv() * Rotation.from_matrix(self.T_work_tcp[rows, :3, :3])
        return np.unique(self.move[rows[aside.magnitude() > ASIDE]])


def sample_moves(robot: Robot, moves: Sequence[Move], intervals: Array) -> Samples:
    """Sample every move at even fractions from its start to its goal.

    Args:
        moves: chains of moves; the first of a chain has its goal only.
        intervals: (m,) least number of intervals of each line or arc; joint moves get as many as they need.
    """
    moves = tuple(moves)
    curves = build_curves(robot, moves)
    first = np.array([move.first for move in moves])
    turn = np.linalg.norm(curves.turn, axis=1)
    count = np.maximum(np.ceil(curves.length / SPACING - 1e-9), np.ceil(turn / TURN - 1e-9))
    count = np.maximum(count, np.ceil(np.abs(curves.axes_change).max(axis=1, initial=0) / SPACING - 1e-9))
    travel = np.ceil(np.abs(curves.q_change).max(axis=1, initial=0) / JOINT_STEP - 1e-9)
    count = np.maximum(np.where(curves.wrist, np.maximum(count, travel), count), 1)
    arcs = np.maximum(np.maximum(count, np.ceil(curves.angle / ARC_STEP)), 4)
    count = np.where(curves.arc, arcs + arcs % 2, count)  # even: the circle point may be the middle sample
    count = np.where(curves.joint, count, np.maximum(count, intervals + intervals % 2))
    travel = np.maximum(travel, np.ceil(np.abs(curves.axes_change).max(axis=1, initial=0) / JOINT_STEP - 1e-9))
    count = np.where(curves.joint, np.maximum(travel, 1), count)
    count = np.where(first, 0, count).astype(int)

    size = count + 1
    goal = np.cumsum(size) - 1
    start = goal - count
    move = np.repeat(np.arange(len(moves)), size)
    u = np.where(count[move] > 0, (np.arange(len(move)) - start[move]) / np.maximum(count[move], 1), 1.0)
    q, T = joints_and_poses(robot, curves, move, u)
    axes = curves.axes_at(move, u)
    known = np.array([m.q for m in moves])
    tracked = np.zeros(len(moves), dtype=bool)
    tracked[move[np.isnan(q[:, 0])]] = True
    for a, b in stretches(tracked & ~first):
        rows = slice(start[a], goal[b - 1] + 1)
        q[rows] = follow(robot, curves, move[rows], u[rows], T[rows], known[a - 1], (goal[a:b] - start[a], known[a:b]))
    reached = q[goal]
    q[goal] = known  # exactly what the confdata says
    return Samples(moves, curves, move, u, T, q, axes, start, goal, reached)


def follow(
    robot: Robot, curves: Curves, move: Index, u: Array, T_work_tcp: Array, q_start: Array, ends: tuple[Index, Array]
) -> Array:
    """Joint angles (n, 6) [rad] in which the arm follows commanded poses, in finer steps where its wrist is straight.

    Between two samples of a move the pose goes evenly from one to the other. Beside a singular wrist steps of any size
    may lead to either wrist: the finer ones count unless they miss more of the known ends.

    Args:
        move, u: (n,) moves and fractions of the samples, in order; T_work_tcp: (n, 4, 4) the poses there.
        q_start: (6,) where the arm comes from [rad].
        ends: samples (k,) at which the joint angles (k, 6) [rad] are known.

    Raises:
        PostprocError: KIN004, a pose cannot be reached in this branch.
    """
    coarse = track(robot, curves.mounts_at(move, curves.axes_at(move, u)).flange(T_work_tcp), q_start)
    if np.abs(np.sin(coarse[:, 4])).min(initial=1.0) > np.sin(STRAIGHT):
        return coarse
    rows = np.arange(len(u))
    before = np.maximum(rows - 1, 0)
    before = np.where(move[before] == move, before, rows)
    a, b, share = np.repeat(before, FINER), np.repeat(rows, FINER), np.tile(np.arange(1, FINER + 1) / FINER, len(u))
    R = Rotation.from_matrix(T_work_tcp[:, :3, :3])
    T = np.tile(np.eye(4), (len(b), 1, 1))
    T[:, :3, 3] = T_work_tcp[a, :3, 3] + share[:, None] * (T_work_tcp[b, :3, 3] - T_work_tcp[a, :3, 3])
    turn = (R[a].inv() * R[b]).as_rotvec()
    T[:, :3, :3] = (R[a] * Rotation.from_rotvec(share[:, None] * turn)).as_matrix()
    axes = curves.axes_at(move[b], u[a] + share * (u[b] - u[a]))
    fine = track(robot, curves.mounts_at(move[b], axes).flange(T), q_start)[FINER - 1 :: FINER]
    missed = [(np.abs(q[ends[0]] - ends[1]).max(axis=1) > OTHER_POSTURE).sum() for q in (coarse, fine)]
    return coarse if missed[0] < missed[1] else fine
