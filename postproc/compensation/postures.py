"""The confdata of the written program, read against the postures in which the arm comes to its targets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic
from postproc.motion.findings import place
from postproc.motion.path.postures import OTHER_POSTURE
from postproc.motion.path.samples import Samples
from postproc.motion.values import Flags, Index, Move
from postproc.rapid.data.records import RobTarget
from postproc.robot.arm import Robot
from postproc.robot.configuration import confdata, outside_quadrants
from postproc.robot.inverse import COMPLIANT

OTHER_ARM = 0.2  # [rad] of axes 1 to 3 between two shoulders or elbows: no correction turns them that far
BENT_RAD = np.radians(6.0)  # |q5| from which on no correction turns axes 4 and 6 by ``OTHER_WRIST`` [rad]
OTHER_WRIST = 1.0
NEARBY = np.radians(15.0)  # that axes turn between a circle point and the nearest sample


def unfit_confdata(robot: Robot, plan: CorrectionPlan, ran: Samples, owner: Index, added: Flags) -> list[Diagnostic]:
    """CMP022, an error, for each target whose confdata does not select the posture that the program has there.

    On lines and arcs that is the posture in which the arm comes; at every target of the original it is also that of the
    original. Where the confdata of the original does not fit already, nothing is said.

    Args:
        ran: of the written program; owner: (k,) index of the programmed move of each of its k moves.
        added: (k,) moves to targets that were added.
    """
    programmed = plan.motion.samples
    before = programmed.q[programmed.goal[owner]]
    fitted = np.abs(programmed.q_reached[owner] - before).max(axis=1) < OTHER_POSTURE
    comes = ~ran.curves.joint & (ran.goal > ran.start)
    selected = ran.q[ran.goal]
    unfit = comes & (np.abs(ran.q_reached - selected).max(axis=1) > OTHER_POSTURE) & (added | fitted)
    change = np.abs(selected - before)
    bent = np.abs(np.sin(selected[:, 4])) > np.sin(BENT_RAD)
    other = (change[:, :3].max(axis=1) > OTHER_ARM) | (bent & (change[:, 3:].max(axis=1) > OTHER_WRIST))
    unfit |= ~added & other
    moves = [(ran.moves[j], programmed.moves[owner[j]]) for j in np.flatnonzero(unfit)]
    return [_unfit(own, move.event.target) for move, own in moves] + [*_unfit_circle_points(robot, plan, ran, owner)]


def _unfit_circle_points(robot: Robot, plan: CorrectionPlan, ran: Samples, owner: Index) -> Iterator[Diagnostic]:
    """CMP022 for circle points with other confdata than in the original that is not that of the way past them."""
    for j, move in enumerate(ran.moves):
        via, own = move.event.via, plan.motion.samples.moves[owner[j]]
        if via is None or move.T_work_via is None or own.event.via is None or via.robconf == own.event.via.robconf:
            continue
        rows = slice(int(ran.start[j]), int(ran.goal[j]) + 1)
        nearest = np.argmin(np.linalg.norm(ran.T_work_tcp[rows, :3, 3] - move.T_work_via[:3, 3], axis=1))
        q, conf = ran.q[rows][[nearest]], np.array([via.robconf])
        arm = (confdata(robot, q)[:, 3] ^ conf[:, 3]) > 1
        if (arm | (outside_quadrants(q, conf) > COMPLIANT + NEARBY)).any():
            yield _unfit(own, via)


def _unfit(move: Move, target: object) -> Diagnostic:
    """CMP022 for a written target of a programmed move."""
    conf = [*target.robconf] if isinstance(target, RobTarget) else []
    text = f"the confdata {conf} of a written target would mean another posture than the arm has there"
    return Diagnostic("CMP022", "error", text, *place(move.event), "please report this program")
