"""From the motion of a program to the decision what to change: exact corrections, added targets, texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction import Exact, Transition, commanded_curve, invert_model, place_targets
from postproc.compensate.decisions import Decisions, decide_changes
from postproc.compensate.following import carried_on, displaced_on, farther_ways, left_targets
from postproc.compensate.insertions import why_indivisible
from postproc.compensate.motion import Motion
from postproc.compensate.reversals import find_reversals
from postproc.compensate.sharing import Users, shared_shifts
from postproc.compensate.targets import Pieces, divide_moves
from postproc.compensate.values import Displacement, Insertion
from postproc.compensate.wishes import Wishes
from postproc.model.arm import Model
from postproc.rapid.events import MotionEvent, StatementKey
from postproc.rapid.units import object_matrices
from postproc.robot.pose import pose_error


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that will be written, before it is written.

    Args:
        indivisible: moves before which nothing can be added, and why; left: moves whose targets are not corrected for
            themselves; shared: of these, runs of one statement that get the middle of what they need.
        curve: (n, 4, 4) commanded poses at the samples.
    """

    motion: Motion
    exact: Exact
    decisions: Decisions
    insertions: tuple[Insertion, ...]
    pieces: tuple[Pieces, ...]
    transitions: tuple[Transition, ...]
    indivisible: Mapping[int, str]
    left: frozenset[int]
    shared: frozenset[int]
    curve: Array


def plan_changes(
    model: Model,
    motion: Motion,
    events: Sequence[MotionEvent],
    users: Mapping[str, Users],
    zone_name: Callable[[MotionEvent], str],
) -> Plan:
    """Decide what to change so that the real arm follows the programmed curves.

    Args:
        events: all of the program; users: see ``target_users``.
        zone_name: name of a small fly-by zone that means what it says where the event's statement stands.
    """
    samples, moves, tolerance = motion.samples, motion.moves, motion.options.tolerance_m
    t = motion.timeline.at(motion.timeline.t, motion.place)
    settled = motion.steady()
    exact = invert_model(model, motion)
    lengths = samples.curves.length.tolist()
    asked = ((i, why_indivisible(m.event, lengths[i])) for i, m in enumerate(moves))
    indivisible = {i: why for i, why in asked if why is not None}
    refused: dict[StatementKey, str] = {}
    left: dict[int, Array] = {}  # moves whose targets are not where the correction wants them, and where they are
    shared: set[int] = set()  # of these: runs of one statement that differ little and get their middle
    farther: dict[StatementKey, Displacement] = {}
    least = tolerance / 2
    while True:
        written = place_targets(model, samples, exact, left)
        curve, transitions = commanded_curve(model, samples, written, t)
        transitions += find_reversals(model, samples, curve, t, tolerance)
        divisible = [i not in indivisible and (i not in left or i in shared) for i in range(len(moves))]
        pieces = divide_moves(samples, curve, tolerance, divisible, settled)
        values = Wishes(model.robot, motion, written, curve, least)
        wishes = values.wishes([i for i in range(len(moves)) if i not in left or left[i].any()], pieces, shared)
        decisions = decide_changes(events, wishes, users, 1e3 * least)
        insertions, clashing = values.insertions(pieces, zone_name, tolerance)
        now_left = left_targets(motion, exact, wishes, decisions)
        farther = farther_ways(motion, events, exact, now_left, decisions, 1e3 * least) | farther
        now_left |= carried_on(motion, now_left, farther)
        parted = shared & now_left.keys()  # even their middle is another value for each of them
        middles = {i: s for i, s in _middles(motion, exact, decisions, least).items() if i not in shared}
        alike = {moves[i].event.statement.key for i in middles}
        refused |= {key: why for key, why in decisions.refused.items() if key not in alike}
        if now_left.keys() <= left.keys() and not clashing and not parted:
            break
        left = now_left | left | {i: now_left[i] for i in parted} | middles
        shared = (shared | middles.keys()) - parted
        indivisible.update(clashing)
    # What has a text of its own by now, having followed in an earlier round, has the displacement in that.
    displaced = {key: way for key, way in farther.items() if key in decisions.following}
    return Plan(
        motion,
        written,
        replace(decisions, refused=refused, changes=decisions.changes + displaced_on(motion, displaced)),
        tuple(insertions),
        tuple(pieces),
        tuple(transitions),
        indivisible,
        frozenset(left),
        frozenset(shared),
        curve,
    )


def _middles(motion: Motion, exact: Exact, decisions: Decisions, least: float) -> dict[int, Array]:
    """The shift (6,) that all runs of a statement can share, by move, where they differ: of statements that are refused
    for that, or would follow what one ``Offs`` displaces.

    They share it in the axes of the object frame: a routine may run again with its work displaced.
    """
    samples = motion.samples
    runs: dict[StatementKey, list[int]] = {}
    for i, move in enumerate(motion.moves):
        key = move.event.statement.key
        if key in decisions.refused or (key in decisions.following and move.event.target_origin.base is not None):
            runs.setdefault(key, []).append(i)
    alike = {key: _one_text(motion, rows) for key, rows in runs.items()}
    runs = {key: rows for key, rows in runs.items() if key in decisions.refused or alike[key]}
    chosen = [i for rows in runs.values() for i in rows]
    if not chosen:
        return {}
    T_goal, T_corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
    turn = object_matrices([motion.moves[i].event for i in chosen])[:, :3, :3]
    shifts = (pose_error(T_goal[chosen], T_corrected[chosen]).reshape(-1, 2, 3) @ turn).reshape(-1, 6)
    turned = np.array([alike[key] for key, rows in runs.items() for _ in rows])
    shifts[~turned, 3:] = 0.0  # other targets can be displaced, not turned
    numbers = [dict(motion.moves[i].event.numbers) for i in chosen]
    middles = shared_shifts([len(rows) for rows in runs.values()], shifts, numbers, least)
    return {chosen[k]: (turn[k] @ shift.reshape(2, 3, 1)).ravel() for k, shift in middles.items()}


def _one_text(motion: Motion, rows: Sequence[int]) -> bool:
    """Whether all runs of a statement have one target in their object frames, or one that ``Offs`` displaces."""
    first, *others = [motion.moves[i].event for i in rows]
    base = first.target_origin.base
    same = all(event.target == first.target and event.via == first.via for event in others)
    return same or (base is not None and all(event.target_origin.base == base for event in others))
