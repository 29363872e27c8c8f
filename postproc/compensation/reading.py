"""From a program to its motion: moves, samples of their curves, timing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.compensation.correction.curve import changing_moves
from postproc.compensation.correction.inverse import command, controller_pose, rigid
from postproc.compensation.correction.jumps import sample_for
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion, motion_of
from postproc.compensation.path.timeline import SWIFT, plan_timeline
from postproc.compensation.seams import seam_mates
from postproc.diagnostics import Diagnostic, Matter, PostprocError, has_errors
from postproc.model.arm import Model
from postproc.motion.findings import once
from postproc.motion.path.moves import read_moves
from postproc.motion.path.samples import Samples
from postproc.motion.values import Move, goal_axes
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import forgiven
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import Kind, Unknown, set_first

IMPOSSIBLE = Unknown(Kind.IMPOSSIBLE)
OUT_OF_REACH = IMPOSSIBLE.reason
IN_SEAM = Unknown(Kind.IN_SEAM)
UNREACHABLE = "what stands in the files for its target cannot be run"
TRANSITION_INTERVALS = 64  # samples of a move in which the correction jumps
SWIFT_INTERVALS = 32
MOST_UNFOLLOWED = 0.05  # share of a program's motions that are left for that; of more it is hardly this arm's program


def read_samples(
    model: Model, events: Sequence[MotionEvent], options: Options
) -> tuple[Samples | None, list[Diagnostic]]:
    """Samples of the curves of a program's moves (None if an error makes them impossible), and findings."""
    moves, findings = read_moves(model.robot, events, options.free_axes, model.station)
    if has_errors(findings) or not moves:
        return None, findings
    moves = joints_of_controller(model, moves, options)
    swift = np.array([options.inertia and m.speed > SWIFT for m in moves])
    intervals = np.where(
        changing_moves(tuple(moves), options), TRANSITION_INTERVALS, np.where(swift, SWIFT_INTERVALS, 0)
    )
    try:
        return sample_for(model, moves, intervals), findings
    except PostprocError as error:
        return None, findings + list(error.diagnostics)


def joints_of_controller(model: Model, moves: list[Move], options: Options) -> list[Move]:
    """The moves as a controller that corrects by itself sees them; unchanged if it does not correct.

    It assigns to the joint angles of a MoveAbsJ the pose of its own model, at which a line that follows begins. Such
    moves get the nominal joint angles of that pose.
    """
    rows = [i for i, move in enumerate(moves) if move.kind == "absjoint"]
    if model.controller is None or not rows:
        return moves
    some = [moves[i] for i in rows]
    loaded = np.array([options.force_on == "all" or move.welding for move in some])
    state = model.state(
        np.array([move.q for move in some]),
        payload_mass=np.array([move.payload_mass for move in some]),
        payload_center=np.array([move.payload_center for move in some]),
        wrench=np.where(loaded[:, None], [*options.force, *options.moment], 0.0),
        T_flange_tcp=np.eye(4),
    )
    station, axes = model.station, goal_axes(some)
    gravity = station.gravity(axes) if station is not None and station.carried else None
    state = state if gravity is None else state.with_(gravity=gravity)
    nominal = command(rigid(model), state, controller_pose(model, state)).q
    changed = list(moves)
    for i, q in zip(rows, nominal, strict=True):
        changed[i] = replace(moves[i], q=q)
    return changed


def read_motion(
    model: Model, events: Sequence[MotionEvent], options: Options
) -> tuple[Motion | None, list[Diagnostic]]:
    """Moves, timing and samples of a program (None if an error makes them impossible), and findings."""
    samples, findings = read_samples(model, events, options)
    if samples is None:
        return None, findings
    try:
        timeline, further = plan_timeline(model, samples)
    except PostprocError as error:
        return None, findings + list(error.diagnostics)
    findings += further
    if timeline is None:
        return None, findings
    return motion_of(model, samples, timeline, options), findings


def read_runnable(
    model: Model, events: list[MotionEvent], options: Options, unsure: Set[StatementKey] = frozenset()
) -> tuple[list[MotionEvent], Motion | None, list[Diagnostic]]:
    """The motion of a program, read again without the targets that it cannot run as long as some may be left out.

    Args:
        unsure: statements whose targets count as unknown where the arm cannot run them.

    Returns:
        The events with a target, their motion (None if an error makes it impossible), and all findings, each once.
    """
    (motion, findings), warnings = read_motion(model, events, options), list[Diagnostic]()
    while has_errors(findings):  # without an error the reading goes further, and may meet another
        fewer, forgiven_errors = _without_unsure(events, findings, unsure), list[Diagnostic]()
        if fewer is events and (options.allow_partial or few_ways(events, findings)):
            fewer, forgiven_errors = without_impossible(events, findings)
        if fewer is events:
            break
        events, warnings = fewer, [*warnings, *forgiven_errors]
        motion, findings = read_motion(model, events, options)
    findings = once([*findings, *warnings])
    return events, motion, findings if options.allow_partial else with_way_out(events, findings)


def _without_unsure(
    events: list[MotionEvent], findings: Sequence[Diagnostic], unsure: Set[StatementKey]
) -> list[MotionEvent]:
    """Events without targets of which the files state what no run may have, where the arm cannot run that.

    Args:
        findings: of the motion; an error in the text of a statement means that its target cannot be run, unless it is
            one about the cell, which no other target would mend.
        unsure: statements of such targets.

    Returns:
        The same events where there is no such statement.
    """
    wrong = [d for d in findings if d.severity == "error" and d.matter is not Matter.CELL]
    bad = _statements_at(wrong, [e for e in events if e.reason is None and e.statement.key in unsure])
    return [hidden(e, UNREACHABLE) if e.statement.key in bad else e for e in events] if bad else events


def hidden(event: MotionEvent, reason: str) -> MotionEvent:
    """The event without its target and circle point, as one whose target is known only at run time, for that reason."""
    return replace(event, target=None, via=None, reason=reason)


def without_impossible(
    events: list[MotionEvent], findings: Sequence[Diagnostic]
) -> tuple[list[MotionEvent], list[Diagnostic]]:
    """Events without the targets of statements that the arm cannot run as they are programmed, nor of their seams.

    Args:
        findings: of the motion; the places of their errors lie in these statements.

    Returns:
        The events, and the findings with errors as warnings. If there is no error, or one of them has no place in a
        statement that has a target, the events are unchanged and there are no findings.
    """
    errors = [d for d in findings if d.severity == "error"]
    bad = _statements_at(errors, [e for e in events if IMPOSSIBLE not in e.unknowns])
    if not bad or any(d.source is None or d.span is None for d in errors):
        return events, []
    in_text = sorted({e.statement.key: e.statement for e in events}.values(), key=lambda s: (s.source.path, s.span))
    mates = seam_mates(dict.fromkeys(bad, OUT_OF_REACH), in_text)
    fewer = [_without_target(e, IMPOSSIBLE) if e.statement.key in bad else e for e in events]
    fewer = [_without_target(e, IN_SEAM) if e.statement.key in mates and e.reason is None else e for e in fewer]
    return fewer, [forgiven(d) for d in findings]


def _statements_at(findings: Sequence[Diagnostic], events: Sequence[MotionEvent]) -> set[StatementKey]:
    """Keys of those statements of events in whose text findings have their place."""
    places = {(d.source.path, d.span[0]) for d in findings if d.source is not None and d.span is not None}
    spans = {e.statement.key: (e.statement.source.path, e.statement.span) for e in events} if places else {}
    return {key for key, (path, (a, b)) in spans.items() if any(p == path and a <= at < b for p, at in places)}


def _without_target(event: MotionEvent, why: Unknown) -> MotionEvent:
    """The event without its target, for that reason."""
    return replace(hidden(event, why.reason), unknowns=(why,))


def few_ways(events: Sequence[MotionEvent], findings: Sequence[Diagnostic]) -> bool:
    """Whether all errors are ways to targets that the arm cannot follow, and these are few.

    Such a way is a line through a wrist singularity, or a goal in another configuration than the line leads to. Few
    means at most 5 % of the program's motion statements, counted with those already left out as impossible.
    """
    errors = [d for d in findings if d.severity == "error"]
    impossible = {e.statement.key for e in events if IMPOSSIBLE in e.unknowns}
    few = MOST_UNFOLLOWED * len({e.statement.key for e in events})
    places = {(d.source, d.span) for d in errors}
    return all(d.matter is Matter.UNFOLLOWABLE for d in errors) and len(impossible) + len(places) <= few


def with_way_out(events: list[MotionEvent], findings: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The findings, in which the first error also advises ``--allow-partial`` if that leaves anything to correct."""
    fewer, warnings = without_impossible(events, findings)
    if not warnings or not any(e.reason is None and e.target is not None for e in fewer):
        return list(findings)
    first = next(i for i, d in enumerate(findings) if d.severity == "error")
    help_ = f"{findings[first].help}; or correct all but such statements: `--allow-partial`"
    return [*findings[:first], replace(findings[first], help=help_), *findings[first + 1 :]]


def no_known_target(
    program: Program, events: Sequence[MotionEvent], findings: Sequence[Diagnostic], remedy: str = ""
) -> Diagnostic:
    """CMP003, an error: no target can be corrected; with the commonest reason and one remedy.

    Args:
        events: all of the program.
        findings: of the program so far, from which reason and remedy are taken.
        remedy: what would correct targets that are known only at run time, in words.
    """
    moving = [e for e in events if not e.statement.source.read_only and e.statement.interpolation != "none"]
    known = next((e for e in moving if e.reason is None and isinstance(e.target, RobTarget)), None)
    if known is not None and (why_not := _of_statement(known, findings)) is not None:
        text = f"the arm can run none of the motions whose places are known: {why_not.message}"
        return Diagnostic("CMP003", "error", text, why_not.source, why_not.span, why_not.help)
    text = "no motion statement leads to a place that is known before the program runs"
    reasons = Counter(e.reason for e in moving if e.reason is not None)
    most = reasons.most_common(1)[0][0] if reasons else ""
    why = f"most often: {most}; " if reasons else ""
    # A tool or frame that the program measures.
    measured = next((d.help for d in findings if d.matter is Matter.MEASURED), None)
    sets = next((set_first(e.unknowns) for e in moving if e.reason == most), None)
    help_ = measured or remedy or sets or "`postproc inspect` has the reason of every statement"
    source, span = (moving[0].statement.source, moving[0].statement.span) if moving else (program.sources[0], None)
    return Diagnostic("CMP003", "error", text, source, span, why + help_)


def why_no_move(runs: Sequence[MotionEvent]) -> str:
    """Why a statement with these executions makes no move of the arm whose target is known."""
    reason = next((event.reason for event in runs if event.reason), None)
    return reason or (OUT_OF_REACH if runs else "the program never gets here")


def _of_statement(event: MotionEvent, findings: Sequence[Diagnostic]) -> Diagnostic | None:
    """The first warning or error placed inside the statement of an event, or None."""
    source, (begin, end) = event.statement.source, event.statement.span
    placed = (d for d in findings if d.severity != "info" and d.source == source and d.span is not None)
    return next((d for d in placed if d.span is not None and begin <= d.span[0] < end), None)
