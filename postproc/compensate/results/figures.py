"""How far the torch is off, before and after: the figures of a conversion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.compensate.correction.deviation import Deviation
from postproc.compensate.plan import Plan
from postproc.compensate.results.transitions import in_transition, own_moves
from postproc.motion.values import Flags


@dataclass(frozen=True, slots=True)
class Figures:
    """Largest deviations [m] along the motions of the files that may change.

    Args:
        before, after: along lines and arcs, at steady speed; transient: while the speed changes.
        arc_before, arc: of those along which the arc burns, before and after; None where it never does.
        transition: where the correction jumps; joint_move: of joint moves.
    """

    before: float
    after: float
    arc_before: float | None
    arc: float | None
    transient: float
    transition: float
    joint_move: float


def figures_of(plan: Plan, before: Deviation, after: Deviation) -> Figures:
    """The largest deviations along a program as it was and as it is written."""
    own = own_moves(plan)
    mine = own[after.owner]
    passing = in_transition(plan, after)
    settled = _counted(after.space & mine & ~passing, after.steady)
    welding = np.array([move.welding for move in plan.motion.moves]) & own
    burning, lit = welding[after.owner] & after.space, welding[before.owner]
    return Figures(
        before.largest(_counted(before.space & own[before.owner], before.steady)),
        after.largest(settled),
        before.largest(_counted(lit & before.space, before.steady)) if burning.any() else None,
        after.largest(burning & settled) if burning.any() else None,
        after.largest(after.space & mine & ~after.steady & ~passing),
        after.largest(passing & mine),
        after.largest(~after.space & mine),
    )


def _counted(space: Flags, steady: Flags) -> Flags:
    """Samples whose deviation is the result: at steady speed, or all of them where the speed is never steady."""
    return space & steady if (space & steady).any() else space
