"""The commanded curve of every move: exact correction at the samples, one value per target, transitions where it jumps.

Two moves that meet at a target may want different corrections there (the arc has just been lit, another tool, a target
that stays as it is). The target has one value: that of the move that welds. The other move then starts or ends beside
its exact correction and passes over in a jerk-limited transition (ruckig), finished before the arc.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, blocks
from postproc.compensation.correction.inverse import command
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.model.arm import Model
from postproc.motion.path.samples import Samples
from postproc.motion.smoothing import transition
from postproc.motion.values import Move
from postproc.robot.kinematics import forward
from postproc.robot.pose import pose_error

BEFORE_TARGET, FROM_START = "before its target", "from its start"
NO_JUMP = 1e-8  # [m], [rad]: rounding between two evaluations of the same state


@dataclass(frozen=True, slots=True)
class Exact:
    """The inverse of the model at every sample.

    Args:
        T_work_tcp: (n, 4, 4) commanded poses.
        q: (n, 6) commanded joint angles [rad].
        T_base_flange: (m, 4, 4) commanded flange at every goal, after deciding between the moves that meet there.
        q_goal: (m, 6) commanded joint angles there [rad].
    """

    T_work_tcp: Array
    q: Array
    T_base_flange: Array
    q_goal: Array


@dataclass(frozen=True, slots=True)
class Transition:
    """A jump of the correction inside or beside one move, made jerk-limited.

    Args:
        move: index of the move.
        where: "before its target" or "from its start".
        target: index of the move whose goal is the target at that place.
        size_m: distance that the correction jumps [m].
        duration: of the transition [s].
        samples: (a, b) the samples it covers.
        of_load: the load (or lost motion) jumps there; otherwise a target is not where the correction wants it.
    """

    move: int
    where: str
    target: int
    size_m: float
    duration: float
    samples: tuple[int, int]
    of_load: bool


def changing_moves(moves: tuple[Move, ...], options: Options) -> Array:
    """(m,) bool: the load on the arm changes at the start or goal of the move, or the move there is a MoveAbsJ.

    The load changes with tool, payload, and with the arc if the process force acts only while it burns.
    """
    changing = [False] * len(moves)
    for i, (a, b) in enumerate(pairwise(moves)):
        other = a.payload_mass != b.payload_mass or a.stationary != b.stationary
        other = other or (a.T_mount_tcp is not b.T_mount_tcp and not np.array_equal(a.T_mount_tcp, b.T_mount_tcp))
        switched = options.force_on == "arc" and a.welding != b.welding
        if other or switched or a.kind == "absjoint" or b.kind == "absjoint":
            changing[i : i + 2] = True, True
    return np.array(changing)


def invert_model(model: Model, motion: Motion) -> Exact:
    """Commanded poses for which the real arm reaches the wanted ones, and one commanded flange pose per goal.

    At a goal where a weld begins, that is the pose for the start of the weld; a MoveAbsJ keeps its joint angles. A move
    that only restates an earlier goal, from which the program resumes, has the values of that goal.
    """
    samples = motion.samples
    T_work_tcp, q = np.empty_like(samples.T_work_tcp), np.empty_like(samples.q)
    for rows in motion.blocks():
        once, repeated = motion.distinct(rows)
        mounts, wanted = samples.mounts_at(once), motion.wanted.T_work_tcp[once]
        state = motion.at(once)
        if motion.meant is not None:
            state = state.with_(T_flange_tcp=mounts.flange_tcp(wanted))
        commanded = command(model, state, mounts.base_tcp(wanted))
        T_work_tcp[rows], q[rows] = mounts.seen(commanded.T_base_tcp, wanted)[repeated], commanded.q[repeated]
    T_flange = samples.curves.mounts.flange(T_work_tcp[samples.goal])
    q_goal = q[samples.goal]
    welding = np.array([m.welding for m in samples.moves])
    first = np.array([m.starts_chain for m in samples.moves])
    lit = np.flatnonzero(welding[1:] & ~welding[:-1] & ~first[1:])
    if len(lit):
        begin = samples.start[lit + 1]
        T_flange[lit], q_goal[lit] = samples.mounts_at(begin).flange(T_work_tcp[begin]), q[begin]
    for i, move in enumerate(samples.moves):
        if move.kind == "absjoint":
            T_flange[i], q_goal[i] = forward(model.robot, move.q[None])[0], move.q
    _copy_resumed_goals(samples, T_flange, q_goal)
    return Exact(T_work_tcp, q, T_flange, q_goal)


def _copy_resumed_goals(samples: Samples, T_flange: Array, q_goal: Array) -> None:
    """Give each move that only restates an earlier goal, from which the program resumes, that goal's values, in place.

    Args:
        T_flange: (m, 4, 4); q_goal: (m, 6); both are changed.
    """
    for i, move in enumerate(samples.moves):
        if move.resumes_from is not None:
            T_flange[i], q_goal[i] = T_flange[move.resumes_from], q_goal[move.resumes_from]


def place_targets(model: Model, samples: Samples, exact: Exact, shifts: Mapping[int, Array]) -> Exact:
    """The correction in which the targets of some moves are where the text can state them; ``exact`` is not changed.

    Args:
        shifts: by move, the shift (6,) of its target from the programmed pose [m], [rad] in work axes.
    """
    if not shifts:
        return exact
    T_flange, q_goal = exact.T_base_flange.copy(), exact.q_goal.copy()
    for i, shift in shifts.items():
        move = samples.moves[i]
        mount = samples.curves.mounts[[i]]
        T_target = mount.work(forward(model.robot, move.q[None]))
        T_flange[i] = mount.flange(shifted(T_target, shift[None]))[0]
        q_goal[i] = move.q
    _copy_resumed_goals(samples, T_flange, q_goal)
    return Exact(exact.T_work_tcp, exact.q, T_flange, q_goal)


def commanded_curve(
    model: Model, samples: Samples, exact: Exact, written: Exact, t: Array
) -> tuple[Array, list[Transition]]:
    """Commanded poses (n, 4, 4) that pass through the targets as they are written, and their transitions.

    Where the correction of a line or arc differs from the written target at its start or goal, a transition leads from
    one to the other; without such jumps the poses are those of ``written``.

    Args:
        exact: correction at every sample, with all targets corrected.
        written: the correction with the targets that the text can have, from ``place_targets``.
        t: (n,) time at the samples [s].
    """
    first = np.array([m.starts_chain for m in samples.moves])
    space = ~samples.curves.joint & ~first
    T = written.T_work_tcp
    transitions: list[Transition] = []
    wanted = _jumps(samples, exact)
    placed = wanted if written is exact else _jumps(samples, written)
    for jumps, of_load, is_goal in zip(placed, wanted, (False, True), strict=True):
        gap = np.linalg.norm((jumps - of_load)[:, :3], axis=1)
        for i in np.flatnonzero(space & (np.abs(jumps).max(axis=1) > NO_JUMP)):
            rows = np.arange(samples.start[i], samples.goal[i] + 1)
            time = t[rows] - t[rows[0]]
            turns = samples.mounts_at(rows).joints_by_shift(model.robot, samples.q[rows], samples.T_work_tcp[rows])
            ramp = transition(model.robot, jumps[i], turns, available=float(time[-1]))
            passed = ramp.at(time[-1] - time) if is_goal else ramp.at(time)
            T = T if transitions else T.copy()
            T[rows] = shifted(T[rows], jumps[i] - passed)
            inside = rows[time >= time[-1] - ramp.duration] if is_goal else rows[time <= ramp.duration]
            size = float(np.linalg.norm(jumps[i, :3]))
            ends_at = (int(inside[0]), int(inside[-1]))
            target = int(i) if is_goal else int(i) - 1
            where = BEFORE_TARGET if is_goal else FROM_START
            transitions.append(
                Transition(int(i), where, target, size, ramp.duration, ends_at, bool(gap[i] <= size / 2))
            )
    return T, transitions


def _jumps(samples: Samples, exact: Exact) -> tuple[Array, Array]:
    """Pose differences (m, 6) [m], [rad] at the start and at the goal of each move, zero where nothing jumps.

    They lead from the corrected curve of the move to the corrected target where it starts, and to that of its goal.

    Args:
        exact: the correction with all targets corrected, or with those that the text can have.
    """
    m = len(samples.moves)
    before = np.maximum(np.arange(m) - 1, 0)
    at_start, at_goal = np.empty((2, m, 6))
    for rows in blocks(m):
        start, goal = samples.start[rows], samples.goal[rows]
        begins = samples.mounts_at(start).work(exact.T_base_flange[before[rows]])
        at_start[rows] = pose_error(exact.T_work_tcp[start], begins)
        ends = samples.curves.mounts[rows].work(exact.T_base_flange[rows])
        at_goal[rows] = pose_error(exact.T_work_tcp[goal], ends)
    return at_start, at_goal


def shifted(T: Array, twist: Array) -> Array:
    """Poses (n, 4, 4) displaced by translations and rotation vectors (n, 6) [m], [rad] in the reference axes."""
    result = T.copy()
    result[:, :3, 3] += twist[:, :3]
    result[:, :3, :3] = Rotation.from_rotvec(twist[:, 3:]).as_matrix() @ T[:, :3, :3]
    return result
