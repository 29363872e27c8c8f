"""From the motion of a program to what is changed: exact corrections, what is written where, added targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.curve import Exact, Transition, commanded_curve, place_targets
from postproc.compensation.correction.fewest_targets import Division, circle_gaps, divide_moves
from postproc.compensation.correction.jumps import find_reversals
from postproc.compensation.path.motion import Motion
from postproc.compensation.reading import why_no_move
from postproc.compensation.seams import seam_mates
from postproc.compensation.text.added_targets import TargetAdder
from postproc.compensation.text.assignment import Assignment
from postproc.compensation.text.insertions import DivisibleMoves
from postproc.compensation.text.requests import Requester, ends_of
from postproc.compensation.text.values import Change, Insertion, Place
from postproc.compensation.text.writer import Writer, corrected
from postproc.compensation.tolerances import division_tolerances, in_scope, path_tolerances
from postproc.model.arm import Model
from postproc.rapid.data.events import MotionEvent, StatementKey, executions_of
from postproc.rapid.program.program import Program

SEARCHED = "a search begins here: with one end of its line corrected it would find another place"
OUT_OF_SCOPE = "it does not weld, and the scope is `welds`"
BEHIND = "its circle begins where the arm stays as it is, nobody knows where: corrected points would make another one"
BEFORE = "the arc behind it stays as it is, and with a corrected start it would be another one"
WORSE_CIRCLE = 1.25
"""How much farther off an arc may be with a corrected start: a circle point in the middle makes 1.125 of it."""


@dataclass(frozen=True, slots=True)
class CorrectionPlan:
    """Everything that will be written, before it is written.

    Args:
        changes: texts to change.
        places: kind of place in the text where the correction of each statement is written.
        uncorrected: statements that stay uncorrected, with the reason.
        unasked: those of them that the scope leaves out.
        seam_mates: those of them that stay since another statement of their seam cannot be corrected.
        relaxed: moves whose statement gets one correction for runs that need different ones.
        insertions: statements to add; shares: by move that they divide, the fractions of its way at which they are.
        transitions: where the correction jumps.
        why_undivided: returns why nothing can be added before a move, or no text suits what it needs; empty if it can.
        path_tolerance: (m,) allowed deviation along each move [m].
        division_tolerance: (m,) the same below which no target is added [m].
        expected_m: expected to remain on the arm [m].
        curve: (n, 4, 4) commanded poses at the samples.
    """

    motion: Motion
    exact: Exact
    changes: tuple[Change, ...]
    places: Mapping[StatementKey, Place]
    uncorrected: Mapping[StatementKey, str]
    unasked: frozenset[StatementKey]
    seam_mates: frozenset[StatementKey]
    relaxed: frozenset[int]
    insertions: tuple[Insertion, ...]
    shares: Mapping[int, tuple[float, ...]]
    transitions: tuple[Transition, ...]
    why_undivided: Callable[[int], str]
    path_tolerance: Array
    division_tolerance: Array
    expected_m: float
    curve: Array


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
        excluded: statements that stay uncorrected, with the reason.
        served: statements that another pass corrects where this one does not: their targets count as corrected.
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
        excluded: Mapping[StatementKey, str] = {},
        served: Set[StatementKey] = frozenset(),
    ) -> None:
        self.expected_m, self.excluded, self.served = expected_m, excluded, served
        self.model, self.motion, self.program = model, motion, program
        self.samples, self.moves = motion.samples, motion.moves
        self.keys = [move.event.statement.key for move in motion.moves]
        self.exact = exact
        self.tolerance = path_tolerances(self.moves, motion.options)
        least = division_tolerances(self.tolerance, motion.options, expected_m)
        self.division = Division.of(self.samples, least, motion.steady())
        self.requester = Requester(model.robot, motion, self.exact)
        self.writer = Writer(program, events, motion)
        self.divisible = DivisibleMoves(program, self.samples, self.writer.effects)
        self.events = events
        scope = in_scope(self.moves, motion.options)
        within = {key for key, inside in zip(self.keys, scope, strict=True) if inside}
        self.unasked = frozenset(self.keys) - within

    def plan(self) -> CorrectionPlan:
        """Decide which texts get which corrections and which statements are added."""
        # Which statements stay uncorrected is settled before anything is placed.
        staying, mates, goals = self._settle()
        stays = {key for key in staying if key in mates or not self._taken(key)}
        chosen = self._chosen(staying)

        # The commanded curves lead through the targets as they are written; further targets divide them.
        placed = self.writer.placed(goals, self.exact)
        placed |= {i: np.zeros(6) for i, key in enumerate(self.keys) if key in stays}
        written = place_targets(self.model, self.samples, self.exact, placed)
        time = self.motion.timeline.at(self.motion.timeline.t, self.motion.place)
        curve, transitions = commanded_curve(self.model, self.samples, self.exact, written, time)

        # Circle points come next, then the added targets: these are expressions of the targets as they are written.
        vias = self.writer.assign(self.requester.vias(chosen, written, curve), goals, anyway=True)
        adder = TargetAdder(self.requester, curve, self.program, corrected([goals, vias]), self.divisible.why_not)
        shares = divide_moves(
            self.division, curve, lambda i: self.keys[i] not in staying and not self.divisible.why_not(i)
        )
        added = adder.add(shares, 1e3 * self.division.tolerance)
        # A divided arc states the circle point of its last part, worked out from the one of the whole arc.
        changes, places = self.writer.changes([goals, vias], {(self.keys[i], "via") for i in added.shares})

        least = self.motion.options.tolerance_m / 2
        transitions += find_reversals(self.model, self.samples, curve, time, least)
        relaxed = goals.relaxed | vias.relaxed
        refused, divisible = added.refused, self.divisible  # the plan keeps these alive, not the planner
        return CorrectionPlan(
            motion=self.motion,
            exact=written,
            changes=(*changes, *added.circle_points),
            places=places,
            uncorrected=staying,
            unasked=self.unasked,
            seam_mates=mates,
            relaxed=frozenset(i for i, key in enumerate(self.keys) if key in relaxed),
            insertions=tuple(added.insertions),
            shares=added.shares,
            transitions=tuple(transitions),
            why_undivided=lambda i: refused.get(i) or divisible.why_not(i),
            path_tolerance=self.tolerance,
            division_tolerance=self.division.tolerance,
            expected_m=self.expected_m,
            curve=curve,
        )

    def _settle(self) -> tuple[dict[StatementKey, str], frozenset[StatementKey], Assignment]:
        """Statements that stay uncorrected, with the reason; those that stay with their seam; what goals are written.

        Numbers that a statement which stays shares with others must not change, its seam stays with it, and so may the
        start of an arc. That is followed until nothing more stays; without such a statement nothing is done twice.
        """
        staying = {key: self.excluded[key] for key in self.keys if key in self.excluded}
        staying |= {**dict.fromkeys(self.unasked, OUT_OF_SCOPE), **search_starts(self.events)}
        # The goal of the motion before such an arc, where it begins, is not known.
        staying |= {
            move.event.statement.key: BEHIND
            for move in self.moves
            if move.kind == "arc" and move.starts_chain and not move.event.start_unknown and move.resumes_from is None
        }
        mates: dict[StatementKey, str] = {}
        while True:
            if not self.motion.options.allow_partial:
                mates |= self._seam_mates({key: why for key, why in staying.items() if key not in mates})
                staying |= mates
            chosen = self._chosen(staying)
            goals = self.writer.assign(self.requester.goals(chosen))
            vias = self.writer.assign(self.requester.vias(chosen, self.exact, self.exact.T_work_tcp), goals)
            stays = {i for i, key in enumerate(self.keys) if key in mates or (key in staying and not self._taken(key))}
            further = {**self._spoiled_starts(stays), **vias.refused, **goals.refused}
            if further.keys() <= staying.keys():
                return staying, frozenset(mates), goals
            staying |= further

    def _spoiled_starts(self, stays: Set[int]) -> dict[StatementKey, str]:
        """Statements to leave uncorrected, with the reason: an arc that stays as it is begins at their target.

        A start that lacks its correction c, a tenth of the way before a corrected circle point, carries the arc twice c
        beyond its curve; nearer to it, any distance. Such statements are left if their correction takes the arc more
        than 25 % farther off its commanded curve.

        Args:
            stays: indices of the moves that stay uncorrected.
        """
        samples = self.samples
        spoiled: dict[StatementKey, str] = {}
        for i in sorted(i for i in stays if samples.curves.arc[i] and i - 1 not in stays):
            via = self.moves[i].T_work_via
            if via is None or self.moves[i].starts_chain:
                continue
            wanted = self.exact.T_work_tcp[samples.start[i] : samples.goal[i] + 1, :3, 3]
            goal = samples.T_work_tcp[samples.goal[i], :3, 3]
            starts = ends_of(samples, self.exact, i)[0], samples.curves.start[i]
            now, before = (circle_gaps(wanted, start, via[:3, 3], goal).max() for start in starts)
            if now > WORSE_CIRCLE * before:
                spoiled[self.keys[i - 1]] = BEFORE
        return spoiled

    def _seam_mates(self, staying: Mapping[StatementKey, str]) -> dict[StatementKey, str]:
        """Weld statements that stay since another one of their seam is in ``staying``, or its target is not known."""
        moving, runs = {*self.keys}, executions_of(self.events)
        lost = {key: why for key, why in staying.items() if key not in self.unasked and not self._taken(key)}
        statements = [s for s in self.program.statements if not s.source.read_only]
        for s in statements:
            if s.signature.phase and s.key not in moving and not self._taken(s.key):
                lost[s.key] = why_no_move([self.events[row] for row in runs.get(s.key, ())])
        return seam_mates(lost, statements)

    def _chosen(self, staying: Mapping[StatementKey, str]) -> list[int]:
        """Indices of the moves whose statements are not in ``staying``."""
        return [i for i, key in enumerate(self.keys) if key not in staying]

    def _taken(self, key: StatementKey) -> bool:
        """Whether another pass corrects a statement, and the scope includes it."""
        return key in self.served and key not in self.unasked
