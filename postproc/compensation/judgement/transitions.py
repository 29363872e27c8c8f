"""Where the correction passes over from one state to another, or the speed changes: which samples, and what is said."""

from __future__ import annotations

import numpy as np

from postproc.compensation.correction.curve import BEFORE_TARGET, Transition
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.text.values import UNCHANGED_MM
from postproc.diagnostics import Diagnostic, Matter, Severity
from postproc.motion.values import Flags
from postproc.rapid.data.events import MotionStatement, StatementKey


def own_moves(plan: CorrectionPlan) -> Flags:
    """(m,) moves of files that may change, and moves of other files whose start and goal are both corrected."""
    moves = plan.motion.moves
    mine = np.array([not move.event.statement.source.read_only for move in moves])
    known = mine | [move.event.statement.key in plan.places for move in moves]
    first = np.array([move.first for move in moves])
    return mine | (known & np.append(False, known[:-1]) & ~first)


def in_transition(plan: CorrectionPlan, after: Deviation) -> np.ndarray:
    """(n,) samples at which the correction passes from one state to another since the load or lost motion jumps.

    Args:
        after: deviation at the n samples of the written program.
    """
    samples = plan.motion.samples
    inside = np.zeros(len(after.distance), dtype=bool)
    order = np.argsort(after.owner, kind="stable")
    first = np.searchsorted(after.owner[order], np.arange(len(samples.goal) + 1))
    for t in plan.transitions:
        if not t.of_load:
            continue
        low, high = samples.u[t.samples[0]], samples.u[t.samples[1]]
        margin = 1.0 / max(1, int(samples.goal[t.move] - samples.start[t.move]))
        rows = order[first[t.move] : first[t.move + 1]]
        inside[rows] |= (after.u[rows] >= low - margin) & (after.u[rows] <= high + margin)
    return inside


def for_the_next(plan: CorrectionPlan) -> Flags:
    """(m,) moves whose targets are corrected for the state in which the next move starts, not for their own."""
    result = np.zeros(len(plan.motion.moves), dtype=bool)
    result[[t.move for t in plan.transitions if t.where == BEFORE_TARGET and t.of_load]] = True
    return result


def transition_findings(plan: CorrectionPlan) -> list[Diagnostic]:
    """The largest jump of the correction per statement: CMP008 (warning) while the arc burns, else CMP007 (info)."""
    largest: dict[StatementKey, Transition] = {}
    own = own_moves(plan)
    for t in plan.transitions:
        key = plan.motion.moves[t.move].event.statement.key
        if own[t.move] and t.of_load and (key not in largest or largest[key].size_m < t.size_m):
            largest[key] = t
    findings = []
    for t in largest.values():
        if 1e3 * t.size_m < UNCHANGED_MM:
            continue
        move = plan.motion.moves[t.move]
        text = f"the correction changes by {1e3 * t.size_m:.3f} mm {t.where}, within {t.duration:.2f} s"
        if move.welding:
            action = "start and end the seam with a stop"
            if plan.motion.sides is not None:
                action = "no target undoes lost motion: turn the torch or the work so that the joint goes on one way"
            elif plan.motion.options.force_on == "arc":
                action += ", or let the force act on the whole program"
            text += ", while the arc burns"
            size = 1e3 * t.size_m
            findings.append(finding("CMP008", "warning", move.event.statement, text, action, length_mm=size))
        else:
            findings.append(finding("CMP007", "info", move.event.statement, text))
    return findings


def transient_finding(plan: CorrectionPlan, after: Deviation, counted: Flags) -> list[Diagnostic]:
    """CMP009 (info) with the largest deviation while the arm speeds up or slows down, if it is above the tolerance.

    Args:
        after: deviation at the n samples of the written program.
        counted: (n,) samples to look at.
    """
    rows = np.flatnonzero(counted & after.space & ~after.steady)
    if not len(rows) or after.distance[rows].max() <= plan.motion.options.tolerance_m:
        return []
    worst = rows[int(np.argmax(after.distance[rows]))]
    move = plan.motion.moves[int(after.owner[worst])]
    off = 1e3 * after.distance[worst]
    text = f"while the arm speeds up or slows down it is up to {off:.3f} mm off, most on the way to here"
    return [finding("CMP009", "info", move.event.statement, text)]


def finding(
    code: str,
    severity: Severity,
    statement: MotionStatement,
    text: str,
    help_: str = "",
    *,
    matter: Matter | None = None,
    length_mm: float = 0.0,
) -> Diagnostic:
    """A diagnostic placed at a whole motion statement; ``help_`` says what the user can do."""
    source, span = statement.source, statement.span
    return Diagnostic(code, severity, text, source, span, help_, matter, length_mm=length_mm)
