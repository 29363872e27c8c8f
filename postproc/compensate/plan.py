"""From the motion of a program to the decision what to change: exact corrections, added targets, texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.added import added_statements
from postproc.compensate.circles import behind_the_unknown, spoiled_starts
from postproc.compensate.correction import Exact, RampKey, Transition, commanded_curve, invert_model, place_targets
from postproc.compensate.decisions import Decisions, decide_changes
from postproc.compensate.following import carried_on, displaced_on, farther_ways, left_targets
from postproc.compensate.insertions import ASTRAY, runs_astray, why_indivisible
from postproc.compensate.motion import Motion
from postproc.compensate.reversals import find_reversals
from postproc.compensate.sharing import possible_runs, shared_shifts, target_users
from postproc.compensate.targets import Pieces, PiecesKey, divide_moves, divided_alike
from postproc.compensate.texts import PlaceKey, numbers_of
from postproc.compensate.values import Displacement, Insertion
from postproc.compensate.wishes import Wishes
from postproc.grouping import grouped
from postproc.model.arm import Model
from postproc.motion.smoothing import Ramp
from postproc.rapid.motions.units import object_matrices
from postproc.rapid.program.events import MotionEvent, StatementKey
from postproc.rapid.program.program import Program
from postproc.robot.pose import pose_error


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that will be written, before it is written.

    Args:
        indivisible: moves before which nothing can be added, and why; shared: runs of one statement that get the middle
            of what they need.
        curve: (n, 4, 4) commanded poses at the samples.
    """

    motion: Motion
    exact: Exact
    decisions: Decisions
    insertions: tuple[Insertion, ...]
    pieces: tuple[Pieces, ...]
    transitions: tuple[Transition, ...]
    indivisible: Mapping[int, str]
    shared: frozenset[int]
    curve: Array


def plan_changes(model: Model, motion: Motion, events: Sequence[MotionEvent], program: Program) -> Plan:
    """Decide what to change so that the real arm follows the programmed curves.

    Args:
        events: all of the program.
    """
    users = target_users(program)
    samples, moves, tolerance = motion.samples, motion.moves, motion.options.tolerance_m
    t = motion.timeline.at(motion.timeline.t, motion.place)
    settled = motion.steady()
    exact = invert_model(model, motion)
    indivisible = _indivisible(motion, events)
    refused = behind_the_unknown(motion)
    # Moves whose targets are not where the correction wants them, and where they are.
    left = {i: np.zeros(6) for i, move in enumerate(moves) if move.event.statement.key in refused}
    shared: set[int] = set()  # of these: runs that differ little and get their middle
    whole: set[int] = set()  # runs that share one with all runs of their statement, not with those to their target
    spent: set[int] = set()  # runs for which that was tried, too
    farther: dict[StatementKey, Displacement] = {}
    least = tolerance / 2
    runs = possible_runs(events, {move.row for move in moves})
    ramps, divided = dict[RampKey, Ramp](), dict[PiecesKey, Pieces]()  # most moves are in a round as in the one before
    while True:
        written = place_targets(model, samples, exact, left)
        curve, transitions = commanded_curve(model, samples, exact, written, t, ramps)
        transitions += find_reversals(model, samples, curve, t, tolerance)
        divisible = [i not in indivisible and (i not in left or i in shared) for i in range(len(moves))]
        pieces = divide_moves(samples, curve, tolerance, divisible, settled, divided)
        pieces = divided_alike(samples, pieces, divisible)
        values = Wishes(model.robot, motion, written, curve, least)
        wishes = values.wishes([i for i in range(len(moves)) if i not in left or left[i].any()], pieces, shared)
        decisions = decide_changes(runs, wishes, users, 1e3 * least)
        insertions, clashing = added_statements(values, pieces, decisions.edited, program, tolerance)
        now_left = left_targets(motion, exact, wishes, decisions)
        farther = farther_ways(motion, runs, exact, now_left, decisions, 1e3 * least) | farther
        now_left |= carried_on(motion, now_left, farther)
        broken = {moves[i].event.statement.key for i in shared & now_left.keys()}
        parted = {i for i, m in enumerate(moves) if m.event.statement.key in broken}  # even the middle differs by run
        again = {i for i in parted - whole if moves[i].event.statement.key in decisions.refused}
        spent |= parted & whole
        whole |= parted
        middles = {i: s for i, s in _middles(motion, exact, decisions, whole, least).items() if i not in shared | spent}
        alike = {moves[i].event.statement.key for i in middles.keys() | again}
        refused |= {key: why for key, why in decisions.refused.items() if key not in alike}
        if now_left.keys() <= left.keys() and not clashing and not parted:
            spoiled = spoiled_starts(motion, exact, written, left)
            if not spoiled:
                break
            refused |= spoiled
            left |= {i: np.zeros(6) for i, move in enumerate(moves) if move.event.statement.key in spoiled}
            shared -= left.keys()
            continue
        left = now_left | left | {i: now_left[i] for i in parted} | middles
        left = {i: shift for i, shift in left.items() if i not in again}
        shared = (shared | middles.keys()) - parted
        indivisible.update(clashing)
    # What has a text of its own by now, having followed in an earlier round, has the displacement in that.
    displaced = {key: way for key, way in farther.items() if key in decisions.following}
    decisions = replace(decisions, refused=refused, changes=decisions.changes + displaced_on(motion, displaced))
    parts = tuple(insertions), tuple(pieces), tuple(transitions)
    return Plan(motion, written, decisions, *parts, indivisible, frozenset(shared), curve)


def _indivisible(motion: Motion, events: Sequence[MotionEvent]) -> dict[int, str]:
    """Moves before which nothing can be added, whatever they need, and why."""
    moves, lengths = motion.moves, motion.samples.curves.length.tolist()
    asked = ((i, why_indivisible(m.event, lengths[i])) for i, m in enumerate(moves))
    found = {i: why for i, why in asked if why is not None}
    astray = runs_astray(events, (move.row for move in moves if not move.first))
    return found | {i: ASTRAY for i, move in enumerate(moves) if move.event.statement.key in astray}


def _sharing(motion: Motion, decisions: Decisions, whole: Set[int]) -> list[tuple[list[int], bool]]:
    """Moves that one shift may serve, where they ask for different ones, and whether it may turn them.

    They are all runs of a statement that is refused for that, or would follow what one ``Offs`` displaces. Where a
    refused statement goes to another target in each run (an array, targets that calls hand over), those moves share
    that go to the same one: its numbers are edited.

    Args:
        whole: moves for which that has been tried.
    """
    runs: dict[StatementKey, list[int]] = {}
    places: dict[int, PlaceKey] = {}  # of the numbers to which lines and joint moves go
    for i, move in enumerate(motion.moves):
        key, origin = move.event.statement.key, move.event.target_origin
        if key in decisions.refused or (key in decisions.following and origin.base is not None):
            runs.setdefault(key, []).append(i)
        place = numbers_of(origin)
        lone = move.event.via is None and move.again is None and i not in whole
        if place is not None and place in decisions.serving and lone:
            places[i] = place
    alike = {key: _one_text(motion, rows) for key, rows in runs.items()}
    apart = {places[i] for key, rows in runs.items() if not alike[key] and places.keys() >= {*rows} for i in rows}
    to = grouped((place, i) for i, place in places.items() if place in apart)
    of_statements = (
        (rows, alike[key])
        for key, rows in runs.items()
        if (key in decisions.refused or alike[key]) and not any(places.get(i) in apart for i in rows)
    )
    return [*((rows, True) for rows in to.values()), *of_statements]


def _middles(motion: Motion, exact: Exact, decisions: Decisions, whole: Set[int], least: float) -> dict[int, Array]:
    """The shift (6,) that moves can share, by move (see ``_sharing``).

    They share it in the axes of the object frame: a routine may run again with its work displaced.
    """
    samples = motion.samples
    groups = _sharing(motion, decisions, whole)
    chosen = [i for rows, _ in groups for i in rows]
    if not chosen:
        return {}
    T_goal, T_corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
    turn = object_matrices([motion.moves[i].event for i in chosen])[:, :3, :3]
    shifts = (pose_error(T_goal[chosen], T_corrected[chosen]).reshape(-1, 2, 3) @ turn).reshape(-1, 6)
    turned = np.array([one for rows, one in groups for _ in rows])
    shifts[~turned, 3:] = 0.0  # other targets can be displaced, not turned
    numbers = [dict(motion.moves[i].event.numbers) for i in chosen]
    middles = shared_shifts([len(rows) for rows, _ in groups], shifts, numbers, least)
    return {chosen[k]: (turn[k] @ shift.reshape(2, 3, 1)).ravel() for k, shift in middles.items()}


def _one_text(motion: Motion, rows: Sequence[int]) -> bool:
    """Whether all runs of a statement have one target in their object frames, or one that ``Offs`` displaces."""
    first, *others = [motion.moves[i].event for i in rows]
    base = first.target_origin.base
    same = all(event.target == first.target and event.via == first.via for event in others)
    named = all(event.target_origin.named == first.target_origin.named for event in others)
    return (same and named) or (base is not None and all(event.target_origin.base == base for event in others))
