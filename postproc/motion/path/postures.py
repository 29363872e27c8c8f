"""Joint angles: at the goals what confdata means, or the configuration that is kept; in which an arm follows poses."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import Curves
from postproc.motion.values import Flags, Index, stretches
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget
from postproc.rapid.motions.units import target_matrices
from postproc.robot.arm import Robot
from postproc.robot.inverse import UnreachedPose, beyond_limits, joint_solution, nearest_solution
from postproc.robot.track import track

STRAIGHT = np.radians(6.0)  # |q5| below which axes 4 and 6 may turn so fast that the way is followed in finer steps
FINER = 16
SAME_POSE = 1e-12  # [m] and in the rotation matrix
POSTURE_DISTANCE = 0.1  # [rad] of one joint at least between two postures of one pose


def goal_joints(
    robot: Robot, events: Sequence[MotionEvent], known: list[int], mounts: Mounts
) -> tuple[Array, Array, list[UnreachedPose], list[int]]:
    """Joint angles of the goals of k events, in the configuration that they state or in which the arm comes.

    Args:
        events: all of the program.
        known: (k,) indices of the events whose target is known.
        mounts: of tool and work at these goals.

    Returns:
        q (k, 6) [rad], NaN where none was found; T_work_tcp (k, 4, 4), NaN for joint targets; failures, sorted, whose
        index counts within ``known``; rows at which the posture of the arm is only assumed.
    """
    q = np.full((len(known), 6), np.nan)
    T = np.full((len(known), 4, 4), np.nan)
    conf = np.zeros((len(known), 4), dtype=np.int64)
    targets = [events[i].target for i in known]
    for row, target in enumerate(targets):
        if isinstance(target, JointTarget):
            q[row] = np.radians(target.robax)
        else:
            assert target is not None
            conf[row] = target.robconf
    failures = beyond_limits(robot, q)
    posed = np.flatnonzero(np.isnan(q[:, 0]))
    if len(posed) == 0:
        return q, T, failures, []
    T[posed] = target_matrices([events[known[row]] for row in posed])
    T_base_flange = np.full_like(T, np.nan)
    T_base_flange[posed] = mounts[posed].flange(T[posed])
    solution = joint_solution(robot, T_base_flange[posed], conf[posed])
    q[posed] = solution.q
    free = np.array([any_configuration(events[i]) for i in known])
    failures += [
        replace(f, index=int(posed[f.index]))
        for f in solution.failures
        if f.reason == "unreachable" or not free[posed[f.index]]
    ]
    free[np.isnan(T[:, 0, 0])] = False
    free[[f.index for f in failures]] = False
    row_of = {i: row for row, i in enumerate(known)}
    resumed = {row: row_of[end] for row, i in enumerate(known) if (end := events[i].resumes_from) is not None}
    free[list(resumed)] = False
    further, supposed = _follow(robot, T_base_flange, q, free, resumed)
    return q, T, sorted([*failures, *further], key=lambda f: f.index), supposed


def any_configuration(event: MotionEvent) -> bool:
    """Whether the configuration of a target is not monitored: ConfJ is off for a joint move, ConfL for others.

    The arm then keeps the configuration in which it comes.
    """
    name = "conf_j" if event.statement.interpolation == "joint" else "conf_l"
    return event.options.get(name) is False


def _follow(
    robot: Robot, T_base_flange: Array, q: Array, free: Flags, resumed: Mapping[int, int]
) -> tuple[list[UnreachedPose], list[int]]:
    """Fill in, in place, the joint angles of goals that are reached in the configuration of the goal before them.

    Args:
        T_base_flange: (k, 4, 4) of the goals.
        q: (k, 6) [rad], which is changed.
        free: (k,) goals whose own configuration does not count.
        resumed: from rows at which the arm resumes to the row whose goal it resumes from.

    Returns:
        Failures, and the rows at which the start posture is only assumed: it is not known and the configuration of the
        target does not exist, so the solution nearest to the last known joint angles, or to zero, is taken.
    """
    failures: list[UnreachedPose] = []
    supposed: list[int] = []
    for a, b in stretches(free):
        from_where = resumed.get(a - 1, a - 1)
        before = q[from_where] if a > 0 and np.isfinite(q[from_where]).all() else q[a]
        if np.isnan(before).any():
            known = np.flatnonzero(np.isfinite(q[:a]).all(axis=1))  # a controller goes on from where the arm was last
            before = nearest_solution(robot, T_base_flange[a], q[known[-1]] if len(known) else np.zeros(6))
            supposed += [a] if np.isfinite(before).all() else []
        if np.isfinite(before).all():
            reached = _followed(robot, T_base_flange[a:b], before)
            q[a : a + len(reached)] = reached
            if len(reached) < b - a:
                text = f"`{robot.name}` cannot get here in the configuration in which it comes"
                help_ = "pass the point with a MoveAbsJ, or switch the monitoring of the configuration on"
                failures.append(UnreachedPose(a + len(reached), "configuration", text, help_))
        failures += [replace(f, index=f.index + a) for f in beyond_limits(robot, q[a:b])]
        lost = {f.index for f in failures}
        failures += [
            UnreachedPose(int(row), "configuration", "the configuration in which the arm starts here is not known",
                    "start with a MoveAbsJ, or with ConfJ\\On")
            for row in range(a, b) if np.isnan(q[row]).any() and row not in lost
        ]  # fmt: skip
    return failures, supposed


def _followed(robot: Robot, T_base_flange: Array, before: Array) -> Array:
    """Joint angles (j, 6) of the first j <= k poses (k, 4, 4) that the arm can follow from joint angles (6,).

    Args:
        before: (6,) joint angles in which it starts [rad].
    """

    def fails(count: int) -> bool:
        """Whether the arm cannot follow the first ``count`` poses."""
        try:
            track(robot, T_base_flange[:count], before)
        except PostprocError:
            return True
        return False

    try:
        return track(robot, T_base_flange, before)
    except PostprocError:
        first = bisect_left(range(1, len(T_base_flange) + 1), True, key=fails)
        return track(robot, T_base_flange[:first], before)


def follow(
    robot: Robot, curves: Curves, move: Index, u: Array, T_work_tcp: Array, *, q_start: Array, ends: tuple[Index, Array]
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
    T_base_flange = curves.mounts_at(move, curves.axes_at(move, u)).flange(T_work_tcp)
    # A move mostly begins in the pose in which the one before it ends.
    other = np.append(True, np.abs(np.diff(T_base_flange, axis=0)).max(axis=(1, 2)) > SAME_POSE)
    coarse = track(robot, T_base_flange[other], q_start)[np.cumsum(other) - 1]
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
    missed = [(np.abs(q[ends[0]] - ends[1]).max(axis=1) > POSTURE_DISTANCE).sum() for q in (coarse, fine)]
    return coarse if missed[0] < missed[1] else fine
