"""Whether the joints can run the corrected motion, and what that costs in cycle time."""

from __future__ import annotations

import numpy as np

from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic, Source
from postproc.motion.findings import at_move
from postproc.motion.timing.limits import LimitReport, check_limits, join_reports
from postproc.robot.arm import Robot
from postproc.robot.pose import pose_error

LIMIT_KINDS = ("speed", "acceleration", "jerk")
_LONGER = 1.002  # factor on the cycle time worth a word
_SLOW = 3600.0  # [s] that no single motion is meant to take


def check_corrected(robot: Robot, plan: CorrectionPlan, source: Source) -> tuple[LimitReport, list[Diagnostic]]:
    """Use of the speed, acceleration and jerk limits by the corrected joint motion, timed like the programmed one.

    Returns:
        The report; CMP025 (warning) at the slowest motion if it takes more than an hour as it is programmed, and CMP012
        (info) if the motion has to take longer by more than 0.2 %.
    """
    samples, timeline = plan.motion.samples, plan.motion.timeline
    shift = plan.exact.q - samples.q
    for t in plan.transitions:
        rows = np.arange(samples.start[t.move], samples.goal[t.move] + 1)
        wanted = samples.T_work_tcp[rows]
        joints_by_shift = samples.mounts_at(rows).joints_by_shift(robot, samples.q[rows], wanted)
        shift[rows] = (joints_by_shift @ pose_error(wanted, plan.curve[rows])[:, :, None])[:, :, 0]
    place, first = np.unique(samples.move + samples.u, return_index=True)
    reports = []
    for part, profile in timeline.legs:
        shifts = [np.interp(timeline.place[part], place, column[first]) for column in shift.T]
        reports.append(check_limits(robot, profile, timeline.q[part] + np.stack(shifts, axis=1)))
    report = join_reports(reports)
    slow = _slowest(plan)
    if report.slower <= _LONGER * report.cycle_time:
        return report, slow
    kind, joint = np.unravel_index(int(np.argmax(report.use)), report.use.shape)
    text = (
        f"the corrected motion asks for {100 * report.use.max():.0f} % of the {LIMIT_KINDS[kind]} "
        f"limit of joint {joint + 1}:"
        f" the controller will slow down, by at most {report.slower - report.cycle_time:.1f} s over the program"
    )
    return report, [*slow, Diagnostic("CMP012", "info", text, source)]


def _slowest(plan: CorrectionPlan) -> list[Diagnostic]:
    """CMP025, a warning, at the motion that takes longest as it is programmed, if that is more than an hour."""
    motion, samples = plan.motion, plan.motion.samples
    ends = motion.timeline.at(motion.timeline.t, np.stack([motion.place[samples.start], motion.place[samples.goal]]))
    taken = ends[1] - ends[0]
    slowest = int(np.argmax(taken))
    if taken[slowest] <= _SLOW:
        return []
    move = plan.motion.moves[slowest]
    text = f"this motion alone takes more than an hour, programmed at {1e3 * move.speed:g} mm/s"
    help_ = "check its speeddata, all four numbers of it: the cycle time of the program counts it"
    return [at_move(move, "CMP025", "warning", text, help_)]
