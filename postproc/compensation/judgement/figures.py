"""How far the torch is off, before and after: the figures of a conversion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.judgement.transitions import in_transition, own_moves
from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic, Source
from postproc.motion.values import Flags

WORSE_RATIO = 2.0  # between targets that are corrected and others that cannot be, a line may end a little farther off


@dataclass(frozen=True, slots=True)
class PathFigures:
    """Largest deviations [m] along the motions of the files that may change.

    Args:
        before, after: along lines and arcs at steady speed.
        arc_before, arc: where the welding arc burns, before and after; None where it never does.
        transient: while the speed changes.
        transition: where the correction jumps.
        joint_move: of joint moves.
    """

    before: float = 0.0
    after: float = 0.0
    arc_before: float | None = None
    arc: float | None = None
    transient: float = 0.0
    transition: float = 0.0
    joint_move: float = 0.0


def figures_of(plan: CorrectionPlan, before: Deviation, after: Deviation) -> PathFigures:
    """The largest deviations along a program, before and after its correction."""
    own = own_moves(plan)
    of_owner = own[after.owner]
    passing = in_transition(plan, after)
    settled = _counted(after.space & of_owner & ~passing, after.steady)
    welding = np.array([move.welding for move in plan.motion.moves]) & own
    burning, lit = welding[after.owner] & after.space, welding[before.owner]
    return PathFigures(
        before.largest(_counted(before.space & own[before.owner], before.steady)),
        after.largest(settled),
        before.largest(_counted(lit & before.space, before.steady)) if burning.any() else None,
        after.largest(burning & settled) if burning.any() else None,
        after.largest(after.space & of_owner & ~after.steady & ~passing),
        after.largest(passing & of_owner),
        after.largest(~after.space & of_owner),
    )


def _counted(space: Flags, steady: Flags) -> Flags:
    """(n,) samples whose deviation is reported: those at steady speed, or all in ``space`` if there are none."""
    return space & steady if (space & steady).any() else space


def worsened(figures: PathFigures, plan: CorrectionPlan, source: Source) -> list[Diagnostic]:
    """CMP013, an error, if the corrected program deviates by more than the tolerance and twice the original."""
    burning = (figures.arc_before, figures.arc, plan.motion.options.tolerance_m)
    findings = []
    for before, after, tolerance in (burning, (figures.before, figures.after, float(plan.path_tolerance.max()))):
        if before is not None and after is not None and after > max(tolerance, WORSE_RATIO * before):
            text = f"the corrected program would be {1e3 * after:.5g} mm off, the original is {1e3 * before:.5g} mm"
            help_ = "nothing is written; please report this program"
            findings.append(Diagnostic("CMP013", "error", text, source, help=help_))
    return findings
