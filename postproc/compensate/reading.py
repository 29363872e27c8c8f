"""From a program to its motion: moves, samples of their curves, timing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.compensate.correction.curve import changing_moves
from postproc.compensate.correction.reversals import sample_for
from postproc.compensate.options import Options
from postproc.compensate.path.motion import Motion, motion_of
from postproc.compensate.path.samples import Samples
from postproc.compensate.path.timeline import SWIFT, plan_timeline
from postproc.diagnostics import Diagnostic, PostprocError, has_errors
from postproc.model.arm import Model
from postproc.motion.path.moves import read_moves
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import forgiven
from postproc.rapid.unknown import Kind, Unknown

IMPOSSIBLE = Unknown(Kind.IMPOSSIBLE)
OUT_OF_REACH = IMPOSSIBLE.reason
TRANSITION_INTERVALS = 64  # samples of a move in which the correction jumps
SWIFT_INTERVALS = 32


def read_samples(
    model: Model, events: Sequence[MotionEvent], options: Options
) -> tuple[Samples | None, list[Diagnostic]]:
    """Moves of a program and samples of their curves; None where an error makes that impossible."""
    moves, findings = read_moves(model.robot, events, options.free_axes, model.station)
    if has_errors(findings) or not moves:
        return None, findings
    swift = np.array([options.inertia and m.speed > SWIFT for m in moves])
    dense = np.where(changing_moves(tuple(moves), options), TRANSITION_INTERVALS, np.where(swift, SWIFT_INTERVALS, 0))
    try:
        return sample_for(model, moves, dense), findings
    except PostprocError as error:
        return None, findings + list(error.diagnostics)


def read_motion(
    model: Model, events: Sequence[MotionEvent], options: Options
) -> tuple[Motion | None, list[Diagnostic]]:
    """Moves, timing and samples of a program; None where an error makes that impossible."""
    samples, findings = read_samples(model, events, options)
    if samples is None:
        return None, findings
    try:
        timeline, more = plan_timeline(model, samples)
    except PostprocError as error:
        return None, findings + list(error.diagnostics)
    findings += more
    if timeline is None:
        return None, findings
    return motion_of(model, samples, timeline, options), findings


def without_impossible(
    events: Sequence[MotionEvent], findings: Sequence[Diagnostic]
) -> tuple[list[MotionEvent], list[Diagnostic]]:
    """Events without the targets of statements that the arm cannot run as they are programmed.

    Args:
        findings: of the motion.

    Returns:
        The events, and the findings as warnings; none where an error speaks of no statement, or no error does.
    """
    errors = [d for d in findings if d.severity == "error"]
    wrong = {(d.source.path, d.span[0]) for d in errors if d.source is not None and d.span is not None}
    bad = {
        e.statement.key
        for e in events
        if any(p == e.statement.source.path and e.statement.span[0] <= at < e.statement.span[1] for p, at in wrong)
    }
    if not bad or any(d.source is None or d.span is None for d in errors):
        return list(events), []
    left = [
        replace(e, target=None, via=None, reason=OUT_OF_REACH, unknowns=(IMPOSSIBLE,)) if e.statement.key in bad else e
        for e in events
    ]
    return left, [forgiven(d) for d in findings]
