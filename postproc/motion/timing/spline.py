"""Joints and external axes as a twice differentiable function of a path parameter, in runs from rest to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags, Index, Move
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS, Joint, Kind
from postproc.robot.cells.station import Station

try:
    from scipy.linalg._flapack import dgtsv  # the solver alone: all of scipy.linalg takes 40 ms to import
except ImportError:  # another version of scipy has it elsewhere
    from scipy.linalg.lapack import dgtsv

TURN_ARM = 0.03  # [m/rad] a reorientation counts as travel on this radius,
JOINT_ARM = 0.02  # and so does the turn of a joint: the parameter grows even where the TCP stands
SAME_POINT = 1e-7  # [m] samples closer than this are one place
GAP = 1e-3  # [m] of the parameter between two runs


SPEED = {"linear": 1.0, "rotary": np.pi / 2}
"""[m/s], [rad/s] that an external axis is taken to reach where nothing is stated, in `RISE`."""
RISE, JERK = 0.5, 0.1
"""[s] in which an external axis reaches its speed, and its acceleration, where nothing is stated."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits (c,) of the six joints and the external axes behind them [rad or m per s, s^2, s^3]."""

    speed: Array
    acceleration: Array
    jerk: Array


def _known(column: Array) -> Array:
    """The column (n,) in which each NaN is replaced by the next finite value, or by the last one where none follows."""
    at = np.flatnonzero(np.isfinite(column))
    return np.asarray(column[at[np.minimum(np.searchsorted(at, np.arange(len(column))), len(at) - 1)]])


def limits_of(robot: Robot, axes: Sequence[Joint]) -> Limits:
    """Limits of the arm's six joints, then of the external axes ``axes``, with usual values where an axis states none.

    Usual are 1 m/s or 90 deg/s, reached in 0.5 s, and that acceleration in 0.1 s.
    """
    speed = [joint.speed or SPEED[joint.kind] for joint in axes]
    acceleration = [joint.acceleration or v / RISE for joint, v in zip(axes, speed, strict=True)]
    jerk = [a / JERK for a in acceleration]
    return Limits(*(np.append(of_arm, of_axes) for of_arm, of_axes in zip(
        (robot.speed, robot.acceleration, robot.jerk), (speed, acceleration, jerk), strict=True)))  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cubics:
    """A piecewise cubic curve of c columns: sum of c[3 - j] (s - x)^j in each of the intervals between k places x.

    Args:
        c: (4, k - 1, c) coefficients; x: (k,) ascending.
    """

    c: Array
    x: Array

    def __call__(self, s: Array, order: int = 0) -> Array:
        """The curve (n, c), or its first or second derivative, at parameters s (n,); the end cubics go on outside."""
        i = np.clip(np.searchsorted(self.x, s, side="right") - 1, 0, len(self.x) - 2)
        cubic, square, linear, constant = self.c[:, i]
        h = (s - self.x[i])[:, None]
        values: Array
        if order == 0:
            values = constant + linear * h + square * (h * h) + cubic * (h * h * h)
        else:
            values = linear + square * h * 2.0 + cubic * (h * h) * 3.0 if order == 1 else square * 2.0 + cubic * h * 6.0
        return values

    def derivatives(self, s: Array) -> tuple[Array, Array, Array]:
        """First, second and third derivative (n, c) at parameters s (n,)."""
        i = np.clip(np.searchsorted(self.x, s, side="right") - 1, 0, len(self.x) - 2)
        cubic, square, linear, _ = self.c[:, i]
        h = (s - self.x[i])[:, None]
        third = 6.0 * cubic
        second = third * h
        first = (0.5 * second + 2.0 * square) * h + linear
        return first, second + 2.0 * square, third


@dataclass(frozen=True, slots=True)
class Knots:
    """The samples of a path, divided into runs from standstill to standstill.

    Args:
        sample: (k,) index of the sample at each knot; a stop between two runs stands for two knots.
        run: (k,) index of the run of each knot; count: number of runs.
        s: (k,) path parameter [m], increasing, ``GAP`` between runs.
    """

    sample: Index
    run: Index
    count: int
    s: Array

    @property
    def inside(self) -> Flags:
        """(k - 1,) True for intervals inside a run from standstill to standstill, False for the gaps between runs."""
        return np.diff(self.run) == 0

    @property
    def ends(self) -> Flags:
        """(k,) True at the first and last knot of every run."""
        change = ~self.inside
        return np.append(True, change) | np.append(change, True)


@dataclass(frozen=True, slots=True)
class Runs(Knots):
    """A path divided into runs from standstill to standstill, with splines of joint angles and external axes.

    Args:
        path: the path that is divided.
        travel, turn: (k - 1,) TCP travel [m] and reorientation [rad] from knot to knot, zero between runs.
        slides: (k - 1, c) change of each external axis that moves, from knot to knot [m], [rad]; kinds: (c,) their
            kinds.
        curve: joint angles and then external axes as functions of s [rad], [m].
        axes: indices of these external axes, 0 to 5.
        limits: of the joints and of these axes.
    """

    path: Samples
    travel: Array
    turn: Array
    slides: Array
    kinds: tuple[Kind, ...]
    curve: Cubics
    axes: tuple[int, ...]
    limits: Limits

    def name(self, column: int) -> str:
        """Name, for messages, of a column of the curve: "joint 1" or "eax_a"."""
        return f"joint {column + 1}" if column < 6 else f"eax_{LETTERS[self.axes[column - 6]]}"

    def moves_at(self, s: Array) -> list[Move]:
        """The move to which the path at each parameter (n,) belongs."""
        knot = np.minimum(np.searchsorted(self.s, s), len(self.s) - 1)
        return [self.path.moves[i] for i in self.path.move[self.sample[knot]]]


def cut_runs(robot: Robot, path: Samples, station: Station | None = None) -> Runs:
    """Divide a path at its stops and lay splines of the joint angles over the travel in each run.

    The parameter grows by the root of the sum of squares of TCP travel, reorientation (at a radius of 30 mm), joint
    travel (at 20 mm) and travel of the external axes (linear axes count in full), so it stays smooth where one of them
    takes over.

    Args:
        station: states the external axes that move along with the joints.
    """
    n = len(path.q)
    travel = np.diff(path.way())
    R = path.T_work_tcp[:, :3, :3]
    R = np.swapaxes(R[:-1], 1, 2) @ R[1:]  # from sample to sample; the arc tangent is accurate where they are small
    axis = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    turn = np.arctan2(np.linalg.norm(axis, axis=1), np.trace(R, axis1=1, axis2=2) - 1.0)
    # A change of tool turns the TCP frame, not the arm.
    mounts = path.mounts_at(slice(None))
    turn = np.where(mounts[:-1].same(mounts[1:]), turn, 0.0)
    joints_of_axes = {LETTERS.index(x): joint for x, joint in (station.joints if station else {}).items()}
    known = {k: path.axes[np.isfinite(path.axes[:, k]), k] for k in joints_of_axes}
    moving = {k: joints_of_axes[k] for k in sorted(known) if len(known[k]) and np.ptp(known[k]) > SAME_POINT}
    share = np.where([joint.kind == "linear" for joint in moving.values()], 1.0, JOINT_ARM)
    axes = np.reshape([_known(path.axes[:, k]) for k in moving], (len(moving), n)).T
    slides = np.abs(np.diff(axes, axis=0))
    joints = np.linalg.norm(np.diff(path.q, axis=0), axis=1)
    step = np.sqrt(
        travel**2 + (TURN_ARM * turn) ** 2 + (JOINT_ARM * joints) ** 2 + np.sum((share * slides) ** 2, axis=1)
    )
    stops = np.zeros(n, dtype=bool)
    stops[path.goal[path.stop]] = True
    live = (step > SAME_POINT) & ~path.starts_chain()[1:]
    begins = live & (stops[:-1] | ~np.append(False, live[:-1]))
    intervals = np.flatnonzero(live)
    of_run = np.cumsum(begins[intervals]) - 1
    count = int(of_run[-1]) + 1 if len(intervals) else 0
    k = len(intervals) + count
    at = np.arange(len(intervals)) + of_run
    sample, run = np.zeros(k, dtype=np.int64), np.zeros(k, dtype=np.int64)
    sample[at], run[at], sample[at + 1], run[at + 1] = intervals, of_run, intervals + 1, of_run
    steps, travels, turns = np.full(max(k - 1, 0), GAP), np.zeros(max(k - 1, 0)), np.zeros(max(k - 1, 0))
    steps[at], travels[at], turns[at] = step[intervals], travel[intervals], turn[intervals]
    changes = np.zeros((max(k - 1, 0), len(moving)))
    changes[at] = slides[intervals]
    s = np.concatenate([[0.0], np.cumsum(steps)])[:k]
    curve, limits = fit_spline(s, np.hstack([path.q, axes])[sample], run), limits_of(robot, list(moving.values()))
    kinds = tuple(joint.kind for joint in moving.values())
    return Runs(sample, run, count, s, path, travels, turns, changes, kinds, curve, tuple(moving), limits)


def fit_spline(s: Array, q: Array, run: Index) -> Cubics:
    """Cubic splines through q (k, c) at s (k,), twice differentiable inside each run (k,), independent between runs.

    The slopes d solve h_i d_(i-1) + 2 (h_(i-1) + h_i) d_i + h_(i-1) d_(i+1) = 3 (h_i m_(i-1) + h_(i-1) m_i) with chord
    slopes m; the outermost intervals are parabolas (d_0 + d_1 = 2 m_0). One banded system serves all runs.
    """
    k, columns = q.shape
    if k < 2:
        return Cubics(np.zeros((4, 1, columns)), np.array([0.0, 1.0]))
    h = np.diff(s)
    inside = np.diff(run) == 0
    slope = np.where(inside[:, None], np.diff(q, axis=0) / h[:, None], 0.0)
    head, tail = np.append(True, ~inside), np.append(~inside, True)
    lone = np.zeros(k, dtype=bool)
    lone[:-1] = head[:-1] & tail[1:]  # a run of one interval: a straight line
    lower, diagonal, upper, right = np.zeros(k), np.ones(k), np.zeros(k), np.zeros((k, columns))
    i = np.flatnonzero(~head & ~tail)
    lower[i], diagonal[i], upper[i] = h[i], 2 * (h[i - 1] + h[i]), h[i - 1]
    right[i] = 3 * (h[i, None] * slope[i - 1] + h[i - 1, None] * slope[i])
    i = np.flatnonzero(head)
    diagonal[i], upper[i], right[i] = np.where(lone[i], 2.0, 1.0), 1.0, np.where(lone[i], 3.0, 2.0)[:, None] * slope[i]
    i = np.flatnonzero(tail)
    lower[i], right[i] = 1.0, 2 * slope[i - 1]
    d = dgtsv(lower[1:], diagonal, upper[:-1], right)[3]
    d0, d1, width = np.where(inside[:, None], d[:-1], 0.0), np.where(inside[:, None], d[1:], 0.0), h[:, None]
    cubic = (d0 + d1 - 2 * slope) / width**2
    square = (3 * slope - 2 * d0 - d1) / width
    return Cubics(np.stack([cubic, square, d0, q[:-1]]), s)
