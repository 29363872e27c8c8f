"""The ``postproc/compensate/1`` document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from postproc import __version__
from postproc.compensation.options import Options
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.results.accuracy import Accuracy
from postproc.compensation.results.figures import PathFigures
from postproc.compensation.results.outcomes import unmeasured, unproved
from postproc.compensation.results.seams import Seam
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic
from postproc.motion.timing.limits import LimitReport
from postproc.rapid.data.events import MotionEvent

SCHEMA = "postproc/compensate/1"


@dataclass(frozen=True, slots=True)
class JudgedProgram:
    """What is known of a corrected program: statements, seams, figures, expected accuracy, use of joint limits.

    If no target of it is known before it runs, only the statements are present, since nothing is measured.
    """

    outcomes: Sequence[StatementOutcome]
    seams: Sequence[Seam] = ()
    figures: PathFigures = PathFigures()
    accuracy: Accuracy | None = None
    limits: LimitReport | None = None


def document(
    robot: str,
    options: Options,
    judged: JudgedProgram,
    findings: Sequence[Diagnostic],
    *,
    plan: CorrectionPlan | None = None,
    events: Sequence[MotionEvent] = (),
) -> dict[str, Any]:
    """The JSON document that ``--json`` prints, as a dictionary; its fields are described in docs/documents.md.

    Args:
        robot: name of the arm.
        judged: statements, seams and figures.
        findings: all diagnostics to print.
        plan, events: of a program that was corrected; without them counts that need them are zero.
    """
    outcomes, figures, accuracy, limits = judged.outcomes, judged.figures, judged.accuracy, judged.limits
    lines = unseen = sum(o.statement.interpolation in ("line", "arc") for o in outcomes)
    air = options.air_tolerance_m
    if plan is not None:
        (unseen, lines), air = unmeasured(outcomes, events, plan), float(plan.path_tolerance.max())
    sure = accuracy and {"sigma_mm": _mm(accuracy.sigma), "within_95_percent_mm": _mm(accuracy.within_95)}
    return {
        "schema": SCHEMA,
        "tool": __version__,
        "robot": robot,
        "statements": [*map(_statement, outcomes)],
        "max_error_before_mm": _mm(figures.before),
        "max_error_after_mm": _mm(figures.after),
        "max_arc_error_before_mm": None if figures.arc_before is None else _mm(figures.arc_before),
        "max_arc_error_after_mm": None if figures.arc is None else _mm(figures.arc),
        "max_transition_mm": _mm(figures.transition),
        "max_transient_mm": _mm(figures.transient),
        "max_joint_move_mm": _mm(figures.joint_move),
        "tolerance_mm": _mm(options.tolerance_m),
        "air_tolerance_mm": _mm(air),
        "scope": options.scope,
        "welds": [*map(_seam, judged.seams)],
        "expected_accuracy": sure,
        "unproved_statements": 0 if plan is None else unproved(outcomes, events, plan),
        "unmeasured_statements": unseen,
        "measured_statements": lines - unseen,
        "added_targets": 0 if plan is None else len(plan.insertions),
        "cycle_time_s": limits and round(limits.slower, 3),
        "cycle_time_before_s": limits and round(limits.cycle_time, 3),
        "diagnostics": [d.as_json() for d in findings],
        "already": list(options.already),
        "worlds": {"count": 0, "differing": 0},
        "expected_remaining_fraction": None,
    }


def refused(findings: Sequence[Diagnostic]) -> dict[str, Any]:
    """The document of a program that is not safe to compensate: the findings alone."""
    return {"schema": SCHEMA, "statements": [], "diagnostics": [d.as_json() for d in findings]}


def _statement(outcome: StatementOutcome) -> dict[str, Any]:
    """The entry of one statement in the document."""
    statement = outcome.statement
    return {
        "path": statement.source.path,
        "line": statement.line,
        "module": statement.module,
        "routine": statement.routine,
        "instruction": statement.instruction,
        "status": outcome.status,
        "reason": outcome.reason,
        "edited": outcome.edited,
        "shift_mm": outcome.shift_mm,
        "residual_mm": outcome.residual_mm,
    }


def _seam(seam: Seam) -> dict[str, Any]:
    """The entry of one seam in the document."""
    first, last = seam.outcomes[0].statement, seam.outcomes[-1].statement
    return {
        "name": seam.name,
        "path": first.source.path,
        "line_from": first.line,
        "line_to": last.line,
        "length_mm": round(seam.length_mm, 1),
        "before_mm": seam.before_mm,
        "after_mm": seam.after_mm,
        "added_targets": seam.added_targets,
        "left": len(seam.left),
    }


def estimated_stiffness(document: Mapping[str, Any]) -> str:
    """A sentence that says how much deflection remains if the stiffness is estimated; empty if it is not.

    Args:
        document: as returned by ``document``.
    """
    between = document.get("expected_remaining_fraction")
    if between is None:
        return ""
    low, high = (f"{100 * x:.0f}" for x in between)
    least, most = (f"{document['max_error_before_mm'] * x:.2f}" for x in between)
    return (
        f"the stiffness of this arm is estimated: {low} to {high} % of its deflection, {least} to {most} mm, is"
        " expected to remain, and `postproc fit` with measurements narrows that"
    )


def _mm(value: float) -> float:
    """Metres in millimetres, rounded to 5 decimals."""
    return round(1e3 * value, 5)
