"""Seams: the weld statements of a program that belong together, and how far off each seam is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.curve import BEFORE_TARGET
from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.judgement.figures import at_work, finding, in_transition
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.seams import seam_names, seams_of
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic
from postproc.grouping import grouped
from postproc.motion.values import Flags
from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey


@dataclass(frozen=True, slots=True)
class SeamDeviation:
    """Largest deviations in the coordinates of a seam [mm] (`in_seam_axes`).

    Args:
        along: at the targets, where the seam begins, ends, and its data change.
        sideways, stick_out: at and between the targets. arc: of these two together.
    """

    along: float
    sideways: float
    stick_out: float
    arc: float


@dataclass(frozen=True, slots=True)
class Seam:
    """Consecutive weld statements of one routine, from the start of the arc to its end.

    Args:
        name: of its routine, and its line where that holds several (`seam_names`).
        outcomes: of its statements, in the order of the text.
        length_mm: of the way while the arc burns, in one run; runs: how often it runs.
        before_mm, after_mm: largest deviation there, along the seam, sideways, along the stick-out, and of the latter
            two together, which is what the arc sees; None where nothing could be measured.
        kept: the whole deviation is within the tolerance after correction.
        added_targets: number of statements added in it.
    """

    name: str
    outcomes: tuple[StatementOutcome, ...]
    length_mm: float
    runs: int
    before_mm: SeamDeviation | None
    after_mm: SeamDeviation | None
    kept: bool
    added_targets: int

    @property
    def uncorrected(self) -> list[StatementOutcome]:
        """Statements that stay uncorrected."""
        return [o for o in self.outcomes if o.status == "skipped"]


def find_seams(
    outcomes: Sequence[StatementOutcome], plan: CorrectionPlan, before: Deviation, after: Deviation
) -> list[Seam]:
    """The seams of a program in the order of the text, with their deviations before and after the correction.

    Args:
        outcomes: of all motion statements, in the order of the text.
    """
    moves, samples = plan.motion.moves, plan.motion.samples
    rows = grouped((m.event.statement.key, i) for i, m in enumerate(moves) if m.welding and m.resumes_from is None)
    passing = in_transition(plan, after, [t for t in plan.transitions if not at_work(plan, t)])
    in_figures = before.space & before.steady, after.space & after.steady & ~passing
    # Such targets are corrected for the state in which the next move starts, not for their own.
    mask = ~np.isin(np.arange(len(moves)), [t.move for t in plan.transitions if t.where == BEFORE_TARGET and t.of_load])
    sizes = [_by_move(d, rows, mask) for d, rows in zip((before, after), in_figures, strict=True)]
    largest = after.largest_of_moves(in_figures[1])
    added = grouped((insertion.statement.key, insertion) for insertion in plan.insertions)
    seams = []
    by_key = {o.statement.key: o for o in outcomes}
    for statements in seams_of(o.statement for o in outcomes):
        keys = [statement.key for statement in statements]
        burning = [i for key in keys for i in rows.get(key, ())]
        known = [i for i in burning if not moves[i].starts_chain]
        length = sum(float(samples.curves.length[rows[key][0]]) for key in keys if key in rows)
        was, stays = (_largest(of_moves[known]) if known else None for of_moves in sizes)
        kept = bool(known) and bool((largest[known] <= plan.path_tolerance[known]).all())
        runs = max((len(rows.get(key, ())) for key in keys), default=0)
        count = sum(len(added.get(key, ())) for key in keys[1:])
        group = tuple(by_key[key] for key in keys)
        if length == 0.0 and all(o.status != "skipped" for o in group):  # the arc goes nowhere
            continue
        seams.append(Seam("", group, 1e3 * length, runs, was, stays, kept, count))
    names = seam_names([seam.outcomes[0].statement for seam in seams])
    return [replace(seam, name=name) for seam, name in zip(seams, names, strict=True)]


def _by_move(deviation: Deviation, rows: Flags, goals: Flags) -> Array:
    """(m, 4) largest deviation of each move along the path, sideways, along the stick-out, and of these two [m].

    Args:
        rows: (n,) samples to look at. goals: (m,) moves whose targets count along the path.
    """
    along = np.abs(np.nan_to_num(deviation.goal_along)) * (goals & deviation.goal_steady)
    parts = np.abs(deviation.parts)
    across = [deviation.largest_of_moves(rows, size) for size in (parts[:, 1], parts[:, 2], deviation.across)]
    return np.column_stack([along, *across])


def _largest(of_moves: Array) -> SeamDeviation:
    """The largest deviations [mm] of moves (k, 4) [m]."""
    return SeamDeviation(*(round(1e3 * float(size), 5) for size in of_moves.max(axis=0)))


def uncorrected_seams(seams: Sequence[Seam], plan: CorrectionPlan) -> list[Diagnostic]:
    """CMP020, a warning, at weld statements that cannot be corrected while others of their seam can.

    The whole seam then stays as it is, unless parts of seams may be corrected: that makes a step.
    """
    findings = []
    for seam in seams:
        mates = sum(o.statement.key in plan.seam_mates for o in seam.outcomes)
        partly = any(o.status in ("compensated", "run_time") for o in seam.outcomes)
        for outcome in (o for o in seam.uncorrected if o.statement.key not in plan.seam_mates):
            if partly:
                text, help_ = "this weld statement stays uncorrected in a corrected seam", ""
            elif mates:
                text = "this weld statement cannot be corrected, so its whole seam stays as it is"
                help_ = "mend what is said, or take a step at both ends of this statement: `--allow-partial`"
            else:
                continue
            findings.append(finding("CMP020", "warning", outcome.statement, f"{text}: {outcome.reason}", help_))
    return findings


def unfinished_seams(events: Sequence[MotionEvent]) -> list[Diagnostic]:
    """CMP021, a warning, at seams that are not ended and at weld statements without a start before them.

    Statements are followed in the order of execution. Where the arm may come by several ways, or on a condition that is
    not known, nothing is said about what was before.
    """
    findings: dict[StatementKey, Diagnostic] = {}
    start: MotionStatement | None = None
    known = False  # whether the arc burns

    def report(statement: MotionStatement, text: str) -> None:
        """Add CMP021 at a statement that may change, once."""
        help_ = "look for an instruction that was mistyped: what burns, and so what is measured, hangs on it"
        if not statement.source.read_only:
            findings.setdefault(statement.key, finding("CMP021", "warning", statement, text, help_))

    for event in events:
        statement, interpolation = event.statement, event.statement.interpolation
        if event.detached or event.conditional or event.unreachable or event.resumes_from is not None:
            start, known = None, False
        if event.resumes_from is not None or interpolation == "none":
            continue
        phase = event.weld.phase if event.weld is not None and statement.instruction.startswith("Arc") else ""
        if start is not None and phase in ("", "start"):
            report(start, "the seam that begins here is not ended before the arm moves on without it")
        if known and start is None and phase in ("weld", "end"):
            report(statement, "it welds, and nothing on the way here starts the arc")
        known = True
        start = statement if phase == "start" else start if phase == "weld" else None
    if start is not None:
        report(start, "the seam that begins here is not ended")
    return list(findings.values())
