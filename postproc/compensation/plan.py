"""From the motion of a program to what is changed: exact corrections, what is written where, added targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.circles import behind_the_unknown, spoiled_starts
from postproc.compensation.correction.curve import (
    Exact,
    RampKey,
    Transition,
    commanded_curve,
    invert_model,
    place_targets,
)
from postproc.compensation.correction.fewest_targets import Division, Pieces, divide_moves, divided_alike
from postproc.compensation.correction.reversals import find_reversals
from postproc.compensation.path.motion import Motion
from postproc.compensation.text.added_targets import MAY_HAVE_CHANGED, TargetAdder, all_numbers
from postproc.compensation.text.insertions import ASTRAY, RESUMED, TURNED_ASIDE, runs_astray, why_indivisible
from postproc.compensation.text.requests import Requester
from postproc.compensation.text.values import Change, Insertion, Place
from postproc.compensation.text.writer import Assigned, Writer
from postproc.compensation.tolerances import in_scope, path_tolerances
from postproc.model.arm import Model
from postproc.motion.smoothing import Ramp
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.flow.arrivals import Arrivals, only
from postproc.rapid.program.error_recovery import resumed_behind_errors
from postproc.rapid.program.program import Program

SEARCHED = "a search begins here: with one end of its line corrected it would find another place"
OUT_OF_SCOPE = "it does not weld, and the scope is `welds`"
FRUITLESS = "its correction would take away less than a tenth of its error"
ON_CONTROLLER = "all that can be is corrected on the controller"
FROM_ELSEWHERE = "the arm may come here from elsewhere than on the way that is followed"
FRAMES = ("tool", "\\wobj")  # roles of arguments


@dataclass(frozen=True, slots=True)
class OnController:
    """What a function beside the program corrects while it runs.

    Args:
        takes: whether it can correct a statement. everything: it corrects all that it can, not only what is left.
        left: statements that are left as they are whatever could correct them, with the reason.
    """

    takes: Callable[[StatementKey], bool] = lambda _: False
    everything: bool = False
    left: Mapping[StatementKey, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CorrectionPlan:
    """Everything that will be written, before it is written.

    Args:
        changes: texts to change; places: where the correction of each statement is written.
        left: statements that stay uncorrected, with the reason; unasked: those of them that the scope leaves out.
        relaxed: moves whose statement gets one correction for runs that ask for different ones.
        indivisible: moves before which nothing can be added, and why.
        on_controller: statements among those that are left whose targets a function corrects while the program runs.
        path_tolerance: (m,) largest deviation along each move [m].
        curve: (n, 4, 4) commanded poses at the samples.
        arrivals: after which motions each may run.
    """

    motion: Motion
    exact: Exact
    changes: tuple[Change, ...]
    places: Mapping[StatementKey, Place]
    left: Mapping[StatementKey, str]
    unasked: frozenset[StatementKey]
    on_controller: frozenset[StatementKey]
    relaxed: frozenset[int]
    insertions: tuple[Insertion, ...]
    pieces: tuple[Pieces, ...]
    transitions: tuple[Transition, ...]
    indivisible: Mapping[int, str]
    path_tolerance: Array
    curve: Array
    arrivals: Arrivals

    def not_by_numbers(self, program: Program) -> list[StatementKey]:
        """Motion statements of the text that no numbers correct, but for those that nobody asked for."""
        corrected = {move.event.statement.key for move in self.motion.moves} - self.left.keys()
        return [s.key for s in program.statements if s.key not in corrected and s.key not in self.unasked]


def search_starts(events: Sequence[MotionEvent]) -> dict[StatementKey, str]:
    """Statements that lead to where a search begins: with one end of its line corrected it would find another place."""
    return {
        before.statement.key: SEARCHED
        for before, event in pairwise(events)
        if event.statement.instruction.startswith("Search") and before.statement.interpolation != "none"
    }


@dataclass(frozen=True, slots=True)
class _Round:
    """What is settled so far; both only grow, so the rounds end.

    Args:
        left: statements that stay uncorrected; indivisible: moves before which nothing is added.
    """

    left: Mapping[StatementKey, str]
    indivisible: Mapping[int, str]


class Planner:
    """Decides what to change so that the real arm follows the programmed curves.

    Args:
        events: all of the program.
    """

    def __init__(
        self,
        model: Model,
        motion: Motion,
        events: Sequence[MotionEvent],
        program: Program,
        on_controller: OnController = OnController(),
    ) -> None:
        self.on_controller = on_controller
        self.model, self.motion, self.program = model, motion, program
        self.samples, self.moves = motion.samples, motion.moves
        self.time = motion.timeline.at(motion.timeline.t, motion.place)
        self.settled = motion.steady()
        self.exact = invert_model(model, motion)
        self.tolerance = path_tolerances(self.moves, motion.options)
        self.requester = Requester(model.robot, motion, self.exact)
        self.writer = Writer(program, events, motion)
        self.arrivals = Arrivals(program, self.writer.effects)
        self.events = events
        self.unasked: Mapping[StatementKey, str] = {}
        # Most moves are in a round as in the one before.
        self.ramps, self.division = dict[RampKey, Ramp](), Division.of(self.samples, self.tolerance, self.settled)

    def plan(self) -> CorrectionPlan:
        """Rounds until nothing more has to be left or kept whole."""
        scope = in_scope(self.moves, self.motion.options)
        outside = {
            m.event.statement.key: OUT_OF_SCOPE for m, inside in zip(self.moves, scope, strict=True) if not inside
        }
        within = {m.event.statement.key for m, inside in zip(self.moves, scope, strict=True) if inside}
        self.unasked = {key: why for key, why in outside.items() if key not in within}
        left = {**self.unasked, **search_starts(self.events), **self.on_controller.left}
        left |= behind_the_unknown(self.motion)
        if self.on_controller.everything:
            left |= {key: ON_CONTROLLER for key in within if key not in left and self.on_controller.takes(key)}
        now = _Round(left, self._indivisible())
        while True:
            found = self._round(now)
            if not isinstance(found, _Round):
                return found
            now = found

    def _round(self, now: _Round) -> CorrectionPlan | _Round:
        """The plan, or what has to be settled before there is one."""
        chosen = [i for i, move in enumerate(self.moves) if move.event.statement.key not in now.left]
        goals = self.writer.assign(self.requester.goals(chosen))
        left = {**now.left, **goals.left}
        placed = self._placed(left, goals)
        written = place_targets(self.model, self.samples, self.exact, placed)
        curve, transitions = commanded_curve(self.model, self.samples, self.exact, written, self.time, ramps=self.ramps)
        least = self.motion.options.tolerance_m / 2
        transitions += find_reversals(self.model, self.samples, curve, self.time, least)
        divisible = [i not in now.indivisible and m.event.statement.key not in left for i, m in enumerate(self.moves)]
        pieces = divide_moves(self.division, curve, divisible)
        pieces = divided_alike(self.samples, pieces, divisible)
        chosen = [i for i in chosen if self.moves[i].event.statement.key not in left]
        # Where a function works out the points of a divided arc, its circle point stays with that.
        following = {p.move for p in pieces if p.goals and self._follows_arc(p.move)}
        parts = [p for p in pieces if p.move not in following]
        vias = self.writer.assign(self.requester.vias(chosen, written, curve, parts), goals)
        keys = {self.moves[i].event.statement.key for i in following}
        if vias.left.keys() - keys:
            return replace(now, left={**now.left, **{k: why for k, why in vias.left.items() if k not in keys}})
        adder = TargetAdder(self.requester, curve, self.program, self.writer.corrected([goals, vias]))
        added = adder.add(pieces, 1e3 * self.tolerance)
        spoiled = spoiled_starts(self.motion, self.exact, written, {i: s for i, s in placed.items() if not s.any()})
        if added.refused or spoiled:
            return _Round({**now.left, **spoiled}, {**now.indivisible, **added.refused})
        changes, places = self.writer.changes([goals, vias.without({(key, "via") for key in keys})])
        changes += tuple({change.span: change for change in added.circle_points.values()}.values())
        relaxed = goals.relaxed | vias.relaxed
        return CorrectionPlan(
            self.motion,
            written,
            changes,
            places,
            left,
            frozenset(self.unasked),
            frozenset(key for key in left if self._taken(key)),
            frozenset(i for i, move in enumerate(self.moves) if move.event.statement.key in relaxed),
            tuple(added.insertions),
            tuple(pieces),
            tuple(transitions),
            now.indivisible,
            self.tolerance,
            curve,
            self.arrivals,
        )

    def _follows_arc(self, i: int) -> bool:
        """Whether the points to add to an arc follow its three points, which are not all numbers."""
        event = self.moves[i].event
        return event.via is not None and not all_numbers(event, self.moves[i - 1].event)

    def _placed(self, left: Mapping[StatementKey, str], goals: Assigned) -> dict[int, Array]:
        """Moves whose targets are not where the correction wants them, with the shift (6,) that they get, work axes."""
        placed = self.writer.placed(goals, self.exact)
        stays = {key for key in left if not self._taken(key)}
        return placed | {i: np.zeros(6) for i, m in enumerate(self.moves) if m.event.statement.key in stays}

    def _taken(self, key: StatementKey) -> bool:
        """Whether the function corrects a statement that is left."""
        return key not in self.unasked and self.on_controller.takes(key)

    def _indivisible(self) -> dict[int, str]:
        """Moves before which nothing can be added, whatever they need, and why."""
        asked = ((i, why_indivisible(m.event)) for i, m in enumerate(self.moves))
        found = {i: why for i, why in asked if why is not None}
        found |= dict.fromkeys(self.samples.turned_aside().tolist(), TURNED_ASIDE)
        resumed = resumed_behind_errors(self.program)
        places = [(m.event.statement.module, m.event.statement.routine) for m in self.moves]
        found |= {i: RESUMED for i, (module, routine) in enumerate(places) if f"{module}.{routine}".lower() in resumed}
        found |= {i: why for i in range(len(self.moves)) if (why := self._not_from_one(i))}
        astray = runs_astray(self.events, (move.row for move in self.moves if not move.first))
        return found | {i: ASTRAY for i, move in enumerate(self.moves) if move.event.statement.key in astray}

    def _not_from_one(self, i: int) -> str:
        """Why the start of a move is not a place that its statement can rely on; empty where it is."""
        event = self.moves[i].event
        if i == 0 or event.statement.interpolation not in ("line", "arc"):
            return ""
        if only(self.arrivals.before(event.statement.key)) != self.moves[i - 1].event.statement.key:
            return FROM_ELSEWHERE
        given = (event.statement.argument(role) for role in FRAMES)
        named = [event.start or "", *(argument.text for argument in given if argument is not None)]
        return "" if self.arrivals.keeps(event.statement, " ".join(named)) else MAY_HAVE_CHANGED


def plan_changes(
    model: Model,
    motion: Motion,
    events: Sequence[MotionEvent],
    program: Program,
    on_controller: OnController = OnController(),
) -> CorrectionPlan:
    """Decide what to change so that the real arm follows the programmed curves.

    Args:
        events: all of the program.
    """
    return Planner(model, motion, events, program, on_controller).plan()
