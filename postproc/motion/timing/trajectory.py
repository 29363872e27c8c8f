"""A path with time: speeds and accelerations at every sample, on the jerk-limited profile.

A long program is timed in legs that begin and end at rest, so that working memory grows with the longest leg.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array, blocks, gravity_in, invert
from postproc.motion.inertia import point_velocity
from postproc.motion.path.samples import Samples
from postproc.motion.timing.jerk_limited import Profile, joint_motion, limited_law, slope_acceleration
from postproc.motion.timing.spline import cut_runs
from postproc.motion.timing.sustained import sustained
from postproc.motion.timing.timelaw import times_at
from postproc.motion.values import Flags, Index, Move, frames_at, payloads
from postproc.robot.arm import Robot
from postproc.robot.cells.station import INSTANT, Station
from postproc.robot.kinematics import body_poses

FLOOR = gravity_in(np.eye(3))  # of an arm that stands on the floor
SHORTEST_PERIOD = 0.02  # [s] a stiffer (or rigid) arm follows every acceleration that the time law knows
STEADY = 1e-3  # relative change of the TCP speed between samples that counts as constant speed
STANDSTILL = 1e-9  # [m/s]
NEGLIGIBLE = 1e-4  # [rad/s^2], [m/s^2]: no arm bends by a hundredth of a micrometre under so little
LONGEST_LEG = 10_000  # samples after which the next stop ends a leg
FIRST_PERIOD = 0.1  # [s] where no model says better: 10 Hz, usual for arms of this size


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A path with time, on the jerk-limited profile.

    Args:
        path: samples that the arrays below belong to.
        t: (n,) time [s].
        v, a: (n, 6) joint speeds and accelerations [rad/s, rad/s^2].
        a_sustained: (n, 6) accelerations that last longer than the first natural period: what compensation uses.
        tcp_speed: (n,) on the work [m/s].
        profile: the path as a function of its parameter and the time law along it.
        axes_v, axes_a_sustained: (n, 6) speeds and lasting accelerations of the external axes [m or rad per s, s^2].
    """

    path: Samples
    t: Array
    v: Array
    a: Array
    a_sustained: Array
    tcp_speed: Array
    profile: Profile
    axes_v: Array
    axes_a_sustained: Array


def cut_legs(moves: tuple[Move, ...], size: Index, most: int = LONGEST_LEG) -> Iterator[tuple[int, tuple[Move, ...]]]:
    """Divide a program at stops, once ``most`` samples are reached, into legs of consecutive moves.

    Each leg comes as the index of its first move, and its moves; a leg that starts where the arm has stopped begins
    with the move to that stop. A program without a stop is one leg, however long it is.

    Args:
        size: (m,) approximate number of samples of each move.
        most: samples after which the next stop ends a leg.
    """
    begin, load = 0, 0
    for i in range(1, len(moves) + 1):
        load += int(size[i - 1])
        ends = i == len(moves) or (load >= most and (moves[i].starts_chain or moves[i - 1].fine))
        if not ends:
            continue
        if begin == 0 or moves[begin].starts_chain:
            yield begin, moves[begin:i]
        else:
            yield begin - 1, (replace(moves[begin - 1], starts_chain=True), *moves[begin:i])
        begin, load = i, 0


def retime(
    robot: Robot,
    path: Samples,
    period: Array | None = None,
    gravity: Array = FLOOR,
    station: Station | None = None,
) -> Trajectory:
    """Time, speed and acceleration of the samples under joint limits and programmed speeds, at rest at every stop.

    toppra finds the fastest speed along the path, a moving average makes it jerk-limited (see ``timelaw``), and where
    the averaged motion would pass a limit the speed is lowered and solved again.

    Args:
        period: (n,) first natural period of the arm at each sample [s], 0 for a rigid one; None: 0.1 s.
        gravity: (3,) in base axes [m/s^2]; counts where the robot has torque limits.
        station: whose external axes keep their limits, too.

    Raises:
        PostprocError: MOT010, no speed along the path keeps the limits of a joint.
    """
    n = len(path.q)
    runs = cut_runs(robot, path, station)
    law = limited_law(robot, runs, gravity)
    start = np.concatenate([[0.0], np.cumsum(law.duration)])
    profile = Profile(runs, law, start, payloads(runs.moves_at(runs.s)))

    t, (v, a, slope) = np.full(n, np.nan), np.zeros((3, n, 6 + len(runs.axes)))
    if runs.count:
        base = runs.s[np.flatnonzero(np.diff(runs.run, prepend=-1))]
        inner = times_at(law, runs.run, runs.s - base[runs.run])
        t[runs.sample] = start[runs.run] + inner
        motion = joint_motion(runs, law, runs.run, inner, runs.curve)
        v[runs.sample], a[runs.sample], slope[runs.sample] = motion.v, motion.a, motion.a_slope
    # Samples outside all runs stand where the last run ended.
    t = np.maximum.accumulate(np.where(np.isnan(t), 0.0, t))

    axes_v, axes_kept = np.zeros((2, n, 6))
    axes_v[:, runs.axes] = v[:, 6:]
    tcp_speed = np.empty(n)
    for part in blocks(n):
        # The work goes past a stationary tool as fast as the tool goes over the work.
        point = path.mounts_at(part).base_tcp(path.T_work_tcp[part])[:, :3, 3]
        velocity = point_velocity(robot, body_poses(robot, path.q[part]), v[part, :6], point)
        velocity -= _frame_velocity(path, part, axes_v[part], point)
        tcp_speed[part] = np.linalg.norm(velocity, axis=1)
    T1 = np.full(n, FIRST_PERIOD) if period is None else np.maximum(period, SHORTEST_PERIOD)
    a_sustained = a
    if runs.count:
        rows = (np.abs(slope) > NEGLIGIBLE).any(axis=1)  # where nothing acts nothing lasts
        kept = np.zeros_like(slope)
        kept[rows] = sustained(
            lambda x: slope_acceleration(runs, law, *profile.at(x)), float(start[-1]), t[rows], T1[rows]
        )
        kept = np.clip(kept, np.minimum(slope, 0.0), np.maximum(slope, 0.0))
        in_space = np.array([m.kind in ("line", "arc") for m in path.moves])[path.move]
        a_sustained = _bridged(a - slope + kept, path.blend, in_space & ~changes_speed(tcp_speed))
    axes_kept[:, runs.axes] = a_sustained[:, 6:]
    return Trajectory(path, t, v[:, :6], a[:, :6], a_sustained[:, :6], tcp_speed, profile, axes_v, axes_kept)


def _frame_velocity(path: Samples, part: slice, axes_v: Array, point: Array) -> Array:
    """Velocities (k, 3) [m/s] in the base of points fixed in the frame of the work or of the stationary tool.

    Args:
        part: the k samples.
        axes_v: (k, 6) speeds of the external axes [m/s], [rad/s].
        point: (k, 3) positions in the base [m].
    """
    mounts = path.mounts_at(part)
    if mounts.T_base_frame is None or mounts.frame is None or not axes_v.any():
        return np.zeros_like(point)
    frames = list(dict.fromkeys(m.frame for m in path.moves))
    axes, p = (
        path.axes[part],
        (invert(mounts.T_base_frame) @ np.append(point, np.ones((len(point), 1)), axis=1)[..., None]),
    )
    before, after = (frames_at(frames, mounts.frame, axes + sign * INSTANT * axes_v) @ p for sign in (-1.0, 1.0))
    return np.asarray((after - before)[:, :3, 0] / (2 * INSTANT))


def changes_speed(tcp_speed: Array) -> Flags:
    """(n,) whether the TCP moves and its speed [m/s] changes by more than 0.1 % to a neighbouring sample."""
    change = np.abs(np.diff(tcp_speed, prepend=tcp_speed[:1], append=tcp_speed[-1:]))
    return (np.maximum(change[:-1], change[1:]) > STEADY * tcp_speed) & (tcp_speed > STANDSTILL)


def _bridged(a: Array, blend: Flags, kept: Flags) -> Array:
    """Accelerations (n, c), interpolated inside zone corners between the values at both ends of the corner.

    The arm does not pass the target in a corner, and correcting that target for the load in the corner would bend the
    lines on both sides. If only one side is a line or arc at constant speed, the corner has the value at its end.

    Args:
        a: (n, c) accelerations of the joints and of external axes [rad or m per s^2].
        blend: (n,) samples inside a zone corner.
        kept: (n,) samples of a line or an arc at constant speed.
    """
    if blend.all() or not blend.any():
        return a
    free = np.flatnonzero(~blend)
    inside = np.flatnonzero(blend)
    at = np.searchsorted(free, inside)
    before, after = free[np.maximum(at - 1, 0)], free[np.minimum(at, len(free) - 1)]
    share = (inside - before) / np.maximum(after - before, 1)
    share = np.where(kept[before] == kept[after], share, kept[after])
    result = a.copy()
    result[inside] = a[before] + np.clip(share, 0.0, 1.0)[:, None] * (a[after] - a[before])
    return result
