"""How far each statement may be corrected, whatever its data is when the program runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from postproc.arrays import Array
from postproc.compensation.judgement.outcomes import correction_sizes
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.text.slots import data_keys
from postproc.compensation.text.values import StatementOutcome
from postproc.compensation.tolerances import goal_tolerances
from postproc.grouping import grouped
from postproc.rapid.data.events import StatementKey
from postproc.rapid.data.records import RobTarget, Vec3

ALIKE = 0.1  # share of the largest correction by which one that follows run-time data may differ from what it is here


@dataclass(frozen=True, slots=True)
class Bound:
    """The largest correction of a statement.

    Args:
        mm: at the goals of its runs [mm].
        rad: rotation [rad].
        way: on the ways to these goals, where a circle point stands [mm].
        goals: (k, 3) the goals of its runs [mm], object axes.
        slope: change of the correction per distance between goals [mm/mm]: a correction that is affine in numbers of
            the program continues beyond the goals.
    """

    mm: float = 0.0
    rad: float = 0.0
    way: float = 0.0
    goals: Array = field(default_factory=lambda: np.zeros((0, 3)))
    slope: float = 0.0

    def at(self, place: Vec3) -> float:
        """The largest correction [mm] at a goal ``place`` [mm] in object axes.

        It grows by ``slope`` with the distance from the nearest goal of the statement's runs.
        """
        if not self.slope:
            return self.mm
        return self.mm + self.slope * float(np.linalg.norm(self.goals - place, axis=1).min())


def largest_corrections(outcomes: Sequence[StatementOutcome], plan: CorrectionPlan) -> dict[StatementKey, Bound]:
    """The bound of every statement that may be corrected, except those that a function on the controller corrects.

    It holds the corrections of its runs and of statements whose targets use the same data, plus the tolerance of its
    goal and 10 % of the largest correction of the program. Where a rigid shift is left out, the correction is what
    differs from it, and at places that run-time data gives it may differ by as much: that is added, too. A statement
    that stays uncorrected, or stands in a file that is only read along, may follow data that is corrected elsewhere, so
    it gets the largest correction.
    """
    moves = plan.motion.moves
    samples = plan.motion.samples
    along = 1e3 * np.linalg.norm(plan.curve[:, :3, 3] - samples.T_work_tcp[:, :3, 3], axis=1)
    way = np.maximum.reduceat(along, samples.start)
    largest = max(float(along.max(initial=0.0)), *(o.shift_mm or 0.0 for o in outcomes))
    shifts = {o.statement.key: o.shift_mm for o in outcomes}
    through = {o.statement.key for o in outcomes if o.status == "run_time"}  # their targets stay as they are
    goal = goal_tolerances(moves, plan.motion.options)
    meant = plan.motion.wanted.T_work_tcp[samples.goal, :3, 3] - samples.T_work_tcp[samples.goal, :3, 3]
    omitted = 1e3 * float(np.linalg.norm(meant, axis=1).max(initial=0.0))
    turned = (1.0 + ALIKE) * float(correction_sizes(plan)[:, 1].max(initial=0.0))
    runs = grouped((move.event.statement.key, i) for i, move in enumerate(moves))
    names = {key: set().union(*(data_keys(moves[i].event.target_origin) for i in rows)) for key, rows in runs.items()}
    users = grouped((name, shifts.get(key) or 0.0) for key, used in names.items() for name in used)
    bounds: dict[StatementKey, Bound] = {}
    for key in (shifts.keys() | runs.keys()) - through:
        rows = runs.get(key, [])
        slack = 1e3 * float(goal[rows].max(initial=0.0)) + ALIKE * largest + omitted
        places = _slope(plan, rows) if plan.places.get(key) == "argument" and len(rows) > 1 else ()
        most = float(way[rows].max(initial=0.0))
        shared = max((max(users[name]) for name in names.get(key, ())), default=0.0)
        bounds[key] = Bound(max(shifts.get(key) or largest, shared) + slack, turned, most + slack, *places)
    return bounds


def _slope(plan: CorrectionPlan, rows: Sequence[int]) -> tuple[Array, float]:
    """Goals (k, 3) [mm] of a statement's runs, and the range of its corrections over that of the goals [mm/mm].

    Args:
        rows: indices of the moves of its runs.
    """
    samples, targets = plan.motion.samples, [plan.motion.moves[i].event.target for i in rows]
    goals = np.array([target.trans for target in targets if isinstance(target, RobTarget)]).reshape(-1, 3)
    at = samples.goal[list(rows)]
    spread = 1e3 * np.ptp(plan.curve[at, :3, 3] - samples.T_work_tcp[at, :3, 3], axis=0)
    return goals, float(np.linalg.norm(spread)) / max(float(np.linalg.norm(np.ptp(goals, axis=0))), 1.0)
