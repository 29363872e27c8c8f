"""Whether the corrected motion still respects the limits of the joints, and what it costs if not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.motion.spline import fit_spline
from postproc.motion.timing import JointMotion, Profile, joint_motion
from postproc.motion.values import Index, Trajectory
from postproc.robot.arm import Robot

_BLOCK = 100_000  # instants looked at together: keeps the memory of long programs flat


@dataclass(frozen=True, slots=True)
class LimitReport:
    """Use of the joint limits by the corrected motion.

    Args:
        speed, acceleration, jerk: (6,) largest ratios to the limits, 1 = at the limit.
        at: (3,) sample nearest to the largest ratio of each kind.
        stretch: factor by which the motion has to take longer so that all limits hold, 1 if they do.
        cycle_time: [s] as planned; ``stretch * cycle_time`` with the limits kept.
    """

    speed: Array
    acceleration: Array
    jerk: Array
    at: Index
    stretch: float
    cycle_time: float


def check_limits(robot: Robot, trajectory: Trajectory, q_corrected: Array) -> LimitReport:
    """Compare the corrected motion, on the time law of the programmed one, with speed, acceleration and jerk limits.

    Args:
        q_corrected: (n, 6) commanded joint angles at the samples of the path [rad].
    """
    profile: Profile = trajectory.profile
    t = trajectory.t
    worst, at = np.zeros((3, 6)), np.zeros(3, dtype=np.int64)
    cycle_time = float(t[-1]) if len(t) else 0.0
    if profile.runs.count:
        curve = fit_spline(profile.runs.s, q_corrected[profile.runs.sample], profile.runs.run)
        law = profile.law
        begin = profile.start[law.run] + law.t
        moments = np.unique(np.concatenate([begin + x * law.window[law.run] for x in (0.0, 0.25, 0.5, 0.75, 1.0)]))
        for k in range(0, len(moments), _BLOCK):
            part = moments[k : k + _BLOCK]
            ratios = _ratios(robot, joint_motion(profile.runs, law, *profile.at(part), curve=curve))
            for kind, ratio in enumerate(ratios):
                if ratio.max() > worst[kind].max():
                    moment = part[int(np.argmax(ratio.max(axis=1)))]
                    at[kind] = min(int(np.searchsorted(t, moment)), len(t) - 1)
                worst[kind] = np.maximum(worst[kind], ratio.max(axis=0))
    needed = max(worst[0].max(), np.sqrt(worst[1].max()), np.cbrt(worst[2].max()))
    return LimitReport(worst[0], worst[1], worst[2], at, max(1.0, float(needed)), cycle_time)


def _ratios(robot: Robot, m: JointMotion) -> tuple[Array, Array, Array]:
    jerk = np.abs(m.jerk_bend + m.jerk_slope) / robot.jerk
    return np.abs(m.v) / robot.speed, np.abs(m.a) / robot.acceleration, jerk
