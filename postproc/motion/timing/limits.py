"""Whether the corrected motion still respects the limits of the joints, and what it costs if not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array, blocks, distinct, largest_of_rows
from postproc.motion.timing.jerk_limited import Profile, joint_motion
from postproc.motion.timing.spline import fit_spline
from postproc.robot.arm import Robot


@dataclass(frozen=True, slots=True)
class LimitReport:
    """Use of the joint limits by the corrected motion.

    Args:
        use: (3, 6) largest ratios to the limits of speed, acceleration and jerk, 1 = at the limit.
        cycle_time: [s] as planned.
        slower: [s] if every run were stretched until its worst place keeps the limits.
    """

    use: Array
    cycle_time: float
    slower: float


def check_limits(robot: Robot, profile: Profile, q_corrected: Array) -> LimitReport:
    """Compare the corrected joint motion, on the time law of the programmed one, with the limits of the joints.

    Args:
        profile: of the programmed motion.
        q_corrected: (n, 6) commanded joint angles at the samples of the path [rad].
    """
    worst = np.zeros((3, 6))
    cycle_time = float(profile.start[-1])
    needed = np.ones(max(1, profile.runs.count))
    if profile.runs.count:
        curve = fit_spline(profile.runs.s, q_corrected[profile.runs.sample], profile.runs.run)
        law = profile.law
        begin = profile.start[law.run] + law.t
        moments = distinct(np.concatenate([begin + x * law.window[law.run] for x in (0.0, 0.25, 0.5, 0.75, 1.0)]))
        for part in blocks(len(moments)):
            run, inner = profile.at(moments[part])
            m = joint_motion(profile.runs, law, run, inner, curve)
            jerk = np.abs(m.jerk_bend + m.jerk_slope) / robot.jerk
            ratios = np.abs(m.v) / robot.speed, np.abs(m.a) / robot.acceleration, jerk  # (k, 6) each, 1 at the limit
            for ratio, power in zip(ratios, (1.0, 0.5, 1.0 / 3.0), strict=True):
                np.maximum.at(needed, run, largest_of_rows(ratio) ** power)
            for kind, ratio in enumerate(ratios):
                worst[kind] = np.maximum(worst[kind], ratio.max(axis=0))
    extra = float(np.sum(profile.law.duration * (needed - 1.0))) if profile.runs.count else 0.0
    return LimitReport(worst, cycle_time, cycle_time + extra)


def join_reports(reports: Sequence[LimitReport]) -> LimitReport:
    """One report for parts of a program that follow each other: largest use, sums of the times."""
    use = np.max([r.use for r in reports], axis=0)
    return LimitReport(use, sum(r.cycle_time for r in reports), sum(r.slower for r in reports))
