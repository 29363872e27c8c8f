"""From the motion of a program to what is changed: exact corrections, what is written where, added targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.circles import arcs_without_start, spoiled_starts
from postproc.compensation.correction.curve import (
    Exact,
    Transition,
    commanded_curve,
    place_targets,
)
from postproc.compensation.correction.fewest_targets import Division, divide_moves
from postproc.compensation.correction.reversals import find_reversals
from postproc.compensation.path.motion import Motion
from postproc.compensation.text.added_targets import TargetAdder
from postproc.compensation.text.insertions import DivisibleMoves
from postproc.compensation.text.requests import Requester
from postproc.compensation.text.values import Change, Insertion, Place
from postproc.compensation.text.writer import Assigned, Writer
from postproc.compensation.tolerances import division_tolerances, in_scope, path_tolerances
from postproc.model.arm import Model
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.program.program import Program

SEARCHED = "a search begins here: with one end of its line corrected it would find another place"
OUT_OF_SCOPE = "it does not weld, and the scope is `welds`"
ON_CONTROLLER = "all that can be is corrected on the controller"


@dataclass(frozen=True, slots=True)
class OnController:
    """What a function beside the program corrects while it runs.

    Args:
        takes: whether the function can correct a statement.
        everything: it corrects all statements that it can, not only those that numbers cannot correct.
    """

    takes: Callable[[StatementKey], bool] = lambda _: False
    everything: bool = False


@dataclass(frozen=True, slots=True)
class CorrectionPlan:
    """Everything that will be written, before it is written.

    Args:
        changes: texts to change.
        places: kind of place in the text where the correction of each statement is written.
        left: statements that stay uncorrected, with the reason.
        unasked: those of them that the scope leaves out.
        on_controller: those of them whose targets a function corrects while the program runs.
        relaxed: moves whose statement gets one correction for runs that need different ones.
        insertions: statements to add; shares: by move that they divide, the fractions of its way at which they are.
        transitions: where the correction jumps.
        refused: moves that need added targets for which there is no text, with the reason.
        why_whole: returns why nothing can be added before a move, empty if something can.
        path_tolerance: (m,) allowed deviation along each move [m].
        division_tolerance: (m,) the same below which no target is added [m].
        expected_m: expected to remain on the arm [m].
        curve: (n, 4, 4) commanded poses at the samples.
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
    shares: Mapping[int, tuple[float, ...]]
    transitions: tuple[Transition, ...]
    refused: Mapping[int, str]
    why_whole: Callable[[int], str]
    path_tolerance: Array
    division_tolerance: Array
    expected_m: float
    curve: Array

    def not_by_numbers(self, program: Program) -> list[StatementKey]:
        """Keys of motion statements not corrected by changed numbers, without those that the scope leaves out."""
        corrected = {move.event.statement.key for move in self.motion.moves} - self.left.keys()
        return [s.key for s in program.statements if s.key not in corrected and s.key not in self.unasked]


def search_starts(events: Sequence[MotionEvent]) -> dict[StatementKey, str]:
    """Motion statements that are executed right before a search instruction, with the reason to leave them uncorrected.

    With one end of its line corrected, the search would find another place.
    """
    return {
        before.statement.key: SEARCHED
        for before, event in pairwise(events)
        if event.statement.signature.results and before.statement.interpolation != "none"
    }


class Planner:
    """Decides what to change so that the real arm follows the programmed curves.

    Args:
        exact: the inverse of the model along the motion, from ``invert_model``.
        events: all of the program.
        expected_m: expected to remain on the arm [m].
        on_controller: which statements a function corrects while the program runs.
    """

    def __init__(
        self,
        model: Model,
        motion: Motion,
        exact: Exact,
        events: Sequence[MotionEvent],
        program: Program,
        *,
        expected_m: float = 0.0,
        on_controller: OnController = OnController(),
    ) -> None:
        self.expected_m, self.on_controller = expected_m, on_controller
        self.model, self.motion, self.program = model, motion, program
        self.samples, self.moves = motion.samples, motion.moves
        self.keys = [move.event.statement.key for move in motion.moves]
        self.time = motion.timeline.at(motion.timeline.t, motion.place)
        self.exact = exact
        self.tolerance = path_tolerances(self.moves, motion.options)
        least = division_tolerances(self.tolerance, motion.options, expected_m)
        self.division = Division.of(self.samples, least, motion.steady())
        self.requester = Requester(model.robot, motion, self.exact)
        self.writer = Writer(program, events, motion)
        self.divisible = DivisibleMoves(program, self.samples, self.writer.effects)
        self.events = events
        self.unasked: Mapping[StatementKey, str] = {}

    def plan(self) -> CorrectionPlan:
        """Decide which texts get which corrections and which statements are added.

        That repeats as long as further statements have to stay uncorrected; they only become more, so it ends.
        """
        left = self._left_by_choice()
        while True:
            goals = self.writer.assign(self.requester.goals(self._chosen(left)))
            if goals.left:
                left |= goals.left
                continue
            placed = self._placed(left, goals)
            written = place_targets(self.model, self.samples, self.exact, placed)
            curve, transitions = commanded_curve(self.model, self.samples, self.exact, written, self.time)
            shares = self._divided(curve, left)
            vias = self.writer.assign(self.requester.vias(self._chosen(left), written, curve), goals)
            corrected = self.writer.corrected([goals, vias])
            adder = TargetAdder(self.requester, curve, self.program, corrected, self.divisible.why_not)
            added = adder.add(shares, 1e3 * self.division.tolerance)
            # A divided arc states the circle point of its last part, worked out from the one of the whole arc.
            divided = {self.keys[i] for i in added.shares}
            changes, places = self.writer.changes([goals, vias.without({(key, "via") for key in divided})])
            stays = {i: shift for i, shift in placed.items() if not shift.any()}
            must_stay = {key: why for key, why in vias.left.items() if key not in divided}
            must_stay |= spoiled_starts(self.motion, self.exact, written, stays)
            if must_stay.keys() <= left.keys():
                break
            left |= must_stay
        least = self.motion.options.tolerance_m / 2
        transitions += find_reversals(self.model, self.samples, curve, self.time, least)
        changes += tuple(added.circle_points)
        relaxed = goals.relaxed | vias.relaxed
        return CorrectionPlan(
            self.motion,
            written,
            changes,
            places,
            left,
            frozenset(self.unasked),
            frozenset(key for key in left if self._taken(key)),
            frozenset(i for i, key in enumerate(self.keys) if key in relaxed),
            tuple(added.insertions),
            added.shares,
            tuple(transitions),
            added.refused,
            self.divisible.why_not,
            self.tolerance,
            self.division.tolerance,
            self.expected_m,
            curve,
        )

    def _left_by_choice(self) -> dict[StatementKey, str]:
        """Statements that stay uncorrected whatever their correction is, with the reason.

        They are out of scope, come before a search, are arcs with an unknown start, or are left to a function on the
        controller.
        """
        scope = in_scope(self.moves, self.motion.options)
        within = {key for key, inside in zip(self.keys, scope, strict=True) if inside}
        self.unasked = {key: OUT_OF_SCOPE for key in self.keys if key not in within}
        left = {**self.unasked, **search_starts(self.events), **arcs_without_start(self.motion)}
        if self.on_controller.everything:
            left |= {key: ON_CONTROLLER for key in within if key not in left and self.on_controller.takes(key)}
        return left

    def _chosen(self, left: Mapping[StatementKey, str]) -> list[int]:
        """Indices of the moves whose statements are not in ``left``."""
        return [i for i, key in enumerate(self.keys) if key not in left]

    def _divided(self, curve: Array, left: Mapping[StatementKey, str]) -> dict[int, tuple[float, ...]]:
        """By move that needs added targets, the fractions of its way at which it needs them.

        Args:
            curve: (n, 4, 4) commanded poses.
            left: statements that stay uncorrected; nothing is added before them.
        """

        def divisible(i: int) -> bool:
            """Whether move i may be divided."""
            return self.keys[i] not in left and not self.divisible.why_not(i)

        return divide_moves(self.division, curve, divisible)

    def _placed(self, left: Mapping[StatementKey, str], goals: Assigned) -> dict[int, Array]:
        """By move, the shift (6,) [m], [rad] of targets that are not where the correction wants them, in work axes.

        It is zero for statements that stay uncorrected, but not for those that a function on the controller corrects.

        Args:
            left: statements that are not corrected by changed numbers.
            goals: what is written for the goals.
        """
        stays = {key for key in left if not self._taken(key)}
        placed = self.writer.placed(goals, self.exact)
        return placed | {i: np.zeros(6) for i, key in enumerate(self.keys) if key in stays}

    def _taken(self, key: StatementKey) -> bool:
        """Whether a function on the controller can correct a statement, and the scope includes it."""
        return key not in self.unasked and self.on_controller.takes(key)
