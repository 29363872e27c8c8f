"""What happened to every motion statement, and what the user has to know about it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.curve import BEFORE_TARGET
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.correction.fewest_targets import Division, error_with_targets
from postproc.compensation.judgement.figures import (
    changing_files,
    finding,
    in_transition,
    transient_finding,
    transition_findings,
)
from postproc.compensation.options import TOLERANCE_M
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.reading import why_no_move
from postproc.compensation.text.values import UNCHANGED_MM, UNCHANGED_RAD, StatementOutcome, Status
from postproc.compensation.tolerances import goal_tolerances
from postproc.diagnostics import Diagnostic, Matter
from postproc.grouping import grouped
from postproc.motion.values import Move
from postproc.numbers import above
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey, executions_of
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import set_first
from postproc.robot.pose import pose_error

UNKNOWN_START = "where the arm comes from is not known: it is corrected at its target alone"
SOMETIMES = "where the arm comes from is not known in some of its runs: there it is corrected at its target alone"
SHARED = "its runs need different corrections and get the middle of them"
FINER_ZONE = "a finer zone or a shorter move leaves room for added targets"
INERTIA = "`--inertia off` shows what acceleration makes of it"
LENT_START = (
    "the arm comes from a target of a file that is only read along and stays as it is: convert both together"
    " (`postproc batch`)"
)
STAYING_START = "the arm comes from a target that stays as it is: see the finding there"
CHECK_AROUND = "what is corrected beside it begins or ends here: check the path around this statement"
DERIVED = "it follows the target that it is derived from"
JOINT_TARGET = "a joint target states joint angles, not a place: it is left as it is"
NO_ARM_MOTION = "it does not move the arm"
ENDS = "its ends are corrected on the controller, and the way between them follows those"


def judge_statements(
    program: Program,
    events: Sequence[MotionEvent],
    plan: CorrectionPlan,
    after: Deviation,
    on_controller: Set[StatementKey] = frozenset(),
) -> tuple[list[StatementOutcome], list[Diagnostic]]:
    """One outcome per motion statement of files that may change, in text order, and findings about them.

    Findings are CMP005 where a statement stays uncorrected, CMP006 where it stays beyond its tolerance, CMP017 and
    CMP018, and those about transitions.

    Args:
        events: all of the program.
        after: deviation of the written program, by sample and by move.
        on_controller: statements that a function corrects while the program runs: ``run_time`` in place of ``skipped``.
    """
    moves = {move.row: i for i, move in enumerate(plan.motion.moves)}
    runs = executions_of(events)
    changing, passing = changing_files(plan), in_transition(plan, after, plan.transitions)
    worst = after.largest_of_moves(after.space & after.steady & ~passing)
    samples = plan.motion.samples
    T_corrected = samples.curves.mounts.work(plan.exact.T_base_flange)
    correction = pose_error(samples.T_work_tcp[samples.goal], T_corrected)
    lengths = np.linalg.norm(correction.reshape(-1, 2, 3), axis=2)
    at_goals = after.goal_across, np.abs(after.goal_along)
    sizes = np.column_stack([*at_goals, lengths]).tolist()
    # Such targets are corrected for the state in which the next move starts, not for their own.
    for_next = [t.move for t in plan.transitions if t.where == BEFORE_TARGET and t.of_load]
    for_current = ~np.isin(np.arange(len(plan.motion.moves)), for_next)
    at_goal = np.where(after.goal_steady & for_current, after.goal_distance, 0.0)
    tolerances = plan.path_tolerance, goal_tolerances(plan.motion.moves, plan.motion.options)
    beyond = (changing & ((worst > tolerances[0]) | (at_goal > tolerances[1]))).tolist()
    outcomes: list[StatementOutcome] = []
    findings: list[Diagnostic] = []
    for statement in program.statements:
        executions = [events[row] for row in runs.get(statement.key, [])]
        rows = [moves[row] for row in runs.get(statement.key, []) if row in moves]
        if not statement.source.read_only:
            outcome = _outcome(statement, executions, rows, plan, sizes)
            if outcome.status == "skipped" and statement.key in on_controller:
                outcome = replace(outcome, status="run_time", shift_mm=None, edited="function")
            outcomes.append(outcome)
            if outcome.status == "skipped" and statement.key not in plan.seam_mates:
                findings += _uncorrected(outcome, executions)
            if outcome.status == "skipped" or statement.interpolation == "absjoint":
                continue
        over = [i for i in rows if beyond[i]]
        if over:
            findings.append(_beyond_tolerance(plan, over, (worst, at_goal, *at_goals), tolerances, on_controller))
    unseen, lines = unmeasured(outcomes, events, plan)
    if 0 < unseen == lines:
        text = "no line or arc could be measured: where they begin or end, or the load, is known only at run time"
        help_ = "`postproc inspect` names what is not known"
        findings.append(Diagnostic("CMP017", "warning", text, program.sources[0], help=help_))
    findings += _searched_findings(outcomes, events) + transition_findings(plan, after)
    findings += transient_finding(plan, after, changing[after.owner] & ~passing)
    return outcomes, findings


def _uncorrected(outcome: StatementOutcome, runs: Sequence[MotionEvent] = ()) -> list[Diagnostic]:
    """CMP005, a warning: a statement that moves the arm stays uncorrected.

    Args:
        runs: its executions; data that nothing sets before one of them is the advice.
    """
    if outcome.statement.interpolation == "none":
        return []
    advice = next((set_first(event.unknowns) for event in runs if event.reason), None) or CHECK_AROUND
    text = f"left as it is: {outcome.reason}"
    return [finding("CMP005", "warning", outcome.statement, text, advice, matter=Matter.SKIPPED)]


def _beyond_tolerance(
    plan: CorrectionPlan,
    rows: Sequence[int],
    off: tuple[Array, Array, Array, Array],
    tolerances: tuple[Array, Array],
    on_controller: Set[StatementKey],
) -> Diagnostic:
    """CMP006, a warning: a statement stays beyond its tolerance, by how much, and why.

    Args:
        rows: its moves that do.
        off: (m,) deviation of every move on its way, at its goal, and there across and along the path [m]; the last is
            NaN behind a joint move.
        tolerances: (m,) what is allowed on the way and at the goal [m].
        on_controller: statements that a function corrects while the program runs.
    """
    i = max(rows, key=lambda i: max(off[0][i], off[1][i]))
    on_the_way = bool(off[0][i] > tolerances[0][i] and off[0][i] > off[1][i])
    what = "the path to this target" if on_the_way else "this target itself"
    remaining, most = (1e3 * float(values[0 if on_the_way else 1][i]) for values in (off, tolerances))
    across, along = (1e3 * float(values[i]) for values in off[2:])
    parts = "" if on_the_way or math.isnan(along) else f" ({across:.3f} mm across the path, {along:.3f} mm along it)"
    text = f"{what} stays {above(remaining, most, 3)} mm off{parts}, tolerance {most:g} mm"
    statement = plan.motion.moves[i].event.statement
    why = ENDS if statement.key in on_controller else _why(plan, rows, i, on_the_way, on_controller)
    return finding("CMP006", "warning", statement, text, why, matter=Matter.OFF, size=remaining)


def _why(
    plan: CorrectionPlan, rows: Sequence[int], farthest: int, on_the_way: bool, on_controller: Set[StatementKey]
) -> str:
    """Advice that says what keeps a statement from its tolerance.

    Args:
        rows: the moves that it makes.
        farthest: the one of them that is farthest off.
        on_the_way: it is farther off on the way than at its goal.
        on_controller: statements that a function corrects while the program runs.
    """
    moves = plan.motion.moves
    start = moves[farthest - 1] if farthest and not moves[farthest].starts_chain else moves[farthest]
    if plan.places.get(moves[farthest].event.statement.key) == "derived":
        return DERIVED
    if not on_the_way and not plan.relaxed.isdisjoint(rows):
        return SHARED
    key = start.event.statement.key
    if on_the_way and start.event.statement.source.read_only and key not in plan.places:
        return LENT_START
    if on_the_way and key in plan.uncorrected and key not in on_controller:
        return STAYING_START
    undivided = next((why for i in rows if (why := plan.why_undivided(i))), None)
    if undivided is not None:
        return f"no target was added: {undivided}"
    path, least = float(plan.path_tolerance[farthest]), float(plan.division_tolerance[farthest])
    if on_the_way and least > path:
        division = Division.of(plan.motion.samples, plan.path_tolerance, plan.motion.steady())
        count, remaining = error_with_targets(division, farthest, plan.curve)
        if count:
            targets, them = ("an added target", "it") if count == 1 else (f"{count} added targets", "them")
            return (
                f"{targets} would leave {1e3 * remaining:.2f} mm, and {1e3 * plan.expected_m:.2f} mm are expected to"
                f" remain on the arm anyway; a `--tolerance` below {1e3 * TOLERANCE_M:g} mm adds {them} all the same"
            )
    return f"{FINER_ZONE}; {INERTIA}" if plan.motion.options.inertia else FINER_ZONE


def _outcome(
    statement: MotionStatement,
    runs: Sequence[MotionEvent],
    rows: Sequence[int],
    plan: CorrectionPlan,
    sizes: Sequence[Sequence[float]],
) -> StatementOutcome:
    """What has become of a statement: status, reason, size of the correction and remaining error [mm].

    Args:
        runs: its executions.
        rows: indices of the moves that they make.
        sizes: (m, 4) at the goals of all moves: what remains across and along the path [m], the correction [m], [rad].
    """
    if statement.interpolation == "none":
        return StatementOutcome(statement, "skipped", NO_ARM_MOTION)
    uncorrected = plan.uncorrected.get(statement.key)
    if not rows:
        return StatementOutcome(statement, "skipped", uncorrected or why_no_move(runs))
    reasons = [event.reason for event in runs if event.reason]
    reason = reasons[0] if reasons else None
    across, along, shift, angle = np.fmax.reduce([sizes[i] for i in rows]).tolist()
    shift *= 1e3
    remains = round(1e3 * across, 5), None if math.isnan(along) else round(1e3 * along, 5)
    if statement.interpolation == "absjoint":
        return StatementOutcome(statement, "unchanged", JOINT_TARGET, 0.0, *remains)
    if uncorrected is not None:
        status: Status = "unchanged" if statement.key in plan.unasked else "skipped"
        why = f"{uncorrected}: in one of its runs {reason}" if reason and status == "skipped" else uncorrected
        return StatementOutcome(statement, status, why, 0.0, *remains)
    if shift < UNCHANGED_MM and angle < UNCHANGED_RAD:
        why = "the correction is below the last decimal"
        return StatementOutcome(statement, "unchanged", why, round(shift, 5), *remains)
    edited = plan.places.get(statement.key)
    begun = [_begins_anywhere(plan.motion.moves[i]) for i in rows]
    if edited == "derived":
        reason = DERIVED
    elif not plan.relaxed.isdisjoint(rows):
        reason = SHARED
    elif any(begun):
        reason = reason or (UNKNOWN_START if all(begun) else SOMETIMES)
    return StatementOutcome(statement, "compensated", reason, round(shift, 4), *remains, edited)


def unknown_outcomes(
    program: Program, events: Sequence[MotionEvent], on_controller: Set[StatementKey]
) -> tuple[list[StatementOutcome], list[Diagnostic]]:
    """Outcomes and findings, like ``judge_statements``, for a program without any target known before it runs.

    Args:
        events: all of the program.
        on_controller: statements that a function corrects while the program runs.
    """
    runs = executions_of(events)
    outcomes: list[StatementOutcome] = []
    findings: list[Diagnostic] = []
    for statement in (s for s in program.statements if not s.source.read_only):
        executions = [events[row] for row in runs.get(statement.key, [])]
        if statement.key in on_controller:
            reason = next((event.reason for event in executions if event.reason), None)
            outcomes.append(StatementOutcome(statement, "run_time", reason, edited="function"))
        elif statement.interpolation == "absjoint":
            outcomes.append(StatementOutcome(statement, "unchanged", JOINT_TARGET))
        else:
            why = NO_ARM_MOTION if statement.interpolation == "none" else why_no_move(executions)
            outcomes.append(StatementOutcome(statement, "skipped", why))
            findings += _uncorrected(outcomes[-1])
    return outcomes, findings


def unproved(outcomes: Sequence[StatementOutcome], events: Sequence[MotionEvent], plan: CorrectionPlan) -> int:
    """Number of corrected statements of which not all runs could be followed or measured.

    Their deviation in such a run is in no figure: targets, start or load are not known there.
    """
    moves = plan.motion.moves
    followed = {move.row for move in moves}
    astray = {e.statement.key for row, e in enumerate(events) if e.has_unresolved_runs or row not in followed}
    astray |= {m.event.statement.key for m in moves if _begins_anywhere(m)} & _measured(plan)
    return sum(o.status == "compensated" and o.statement.key in astray for o in outcomes)


def _begins_anywhere(move: Move) -> bool:
    """Whether the move is a line or arc whose start is not known."""
    return move.starts_chain and move.resumes_from is None and move.kind in ("line", "arc")


def unmeasured(
    outcomes: Sequence[StatementOutcome], events: Sequence[MotionEvent], plan: CorrectionPlan
) -> tuple[int, int]:
    """Number of lines and arcs whose deviation is in no figure, as an end is unknown, and number of all of them."""
    run = {e.statement.key for e in events if e.statement.interpolation in ("line", "arc")}
    moves = itertools.compress(plan.motion.moves, changing_files(plan))
    changing = run & ({o.statement.key for o in outcomes} | {move.event.statement.key for move in moves})
    return len(changing - _measured(plan)), len(changing)


def _measured(plan: CorrectionPlan) -> set[StatementKey]:
    """Statements with at least one execution whose start is known, so that the way to its goal is measured."""
    return {move.event.statement.key for move in plan.motion.moves if not move.starts_chain}


def _searched_findings(outcomes: Sequence[StatementOutcome], events: Sequence[MotionEvent]) -> list[Diagnostic]:
    """CMP018, a warning, for each routine with corrected statements that also run displaced by a search result."""
    searched = {e.statement.key for e in events if e.searched}
    corrected = (o for o in outcomes if o.status == "compensated" and o.statement.key in searched)
    findings = []
    for group in grouped(((o.statement.module, o.statement.routine), o) for o in corrected).values():
        most = max(outcome.shift_mm or 0.0 for outcome in group)
        text = (
            f"`{group[0].statement.routine}` is corrected, by up to {most:.3f} mm, and also runs displaced by what a"
            " search has found: measured from a stated position, that holds the error of the arm and is corrected twice"
        )
        help_ = "give the runs that go with the search a routine of their own, or find both positions by searches"
        findings.append(finding("CMP018", "warning", group[0].statement, text, help_, size=most))
    return findings
