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
from postproc.compensate.options import Options
from postproc.compensate.reading import Motion
from postproc.compensate.reversals import find_reversals
from postproc.compensate.sharing import Users, shared_shifts
from postproc.compensate.targets import Pieces, divide_moves
from postproc.compensate.values import Displacement, Insertion, StatementKey, key_of
from postproc.compensate.wishes import Wishes
from postproc.model.arm import Model
from postproc.rapid.events import MotionEvent
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
    options: Options,
    users: Mapping[str, Users],
    zone_name: Callable[[MotionEvent], str],
) -> Plan:
    """Decide what to change so that the real arm follows the programmed curves.

    Args:
        users: see ``target_users``.
        zone_name: name of a small fly-by zone that means what it says where the event's statement stands.
    """
    samples, moves = motion.samples, motion.moves
    t = motion.timeline.at(motion.timeline.t, motion.states.place)
    settled = motion.states.steady()
    exact = invert_model(model, samples, motion.states)
    lengths = samples.curves.length.tolist()
    asked = ((i, why_indivisible(events[m.event], lengths[i])) for i, m in enumerate(moves))
    indivisible = {i: why for i, why in asked if why is not None}
    refused: dict[StatementKey, str] = {}
    left: dict[int, Array] = {}  # moves whose targets are not where the correction wants them, and where they are
    shared: set[int] = set()  # of these: runs of one statement that differ little and get their middle
    farther: dict[StatementKey, Displacement] = {}
    least = options.tolerance_m / 2
    while True:
        written = place_targets(model, samples, exact, left)
        curve, transitions = commanded_curve(model, samples, written, t)
        transitions += find_reversals(model, samples, curve, t, options.tolerance_m)
        divisible = [i not in indivisible and (i not in left or i in shared) for i in range(len(moves))]
        pieces = divide_moves(samples, curve, options.tolerance_m, divisible, settled)
        values = Wishes(model.robot, motion, events, written, curve, least)
        wishes = values.wishes([i for i in range(len(moves)) if i not in left or left[i].any()], pieces, shared)
        decisions = decide_changes(events, wishes, users, 1e3 * least)
        insertions, clashing = values.insertions(pieces, zone_name, options.tolerance_m)
        now_left = left_targets(motion, events, exact, wishes, decisions)
        farther = farther_ways(motion, events, exact, now_left, decisions, 1e3 * least) | farther
        now_left |= carried_on(motion, events, now_left, farther)
        parted = shared & now_left.keys()  # even their middle is another value for each of them
        middles = {i: s for i, s in _middles(motion, events, exact, decisions, least).items() if i not in shared}
        alike = {key_of(events[moves[i].event].statement) for i in middles}
        refused |= {key: why for key, why in decisions.refused.items() if key not in alike}
        if now_left.keys() <= left.keys() and not clashing and not parted:
            break
        left = now_left | left | {i: now_left[i] for i in parted} | middles
        shared = (shared | middles.keys()) - parted
        indivisible.update(clashing)
    return Plan(
        motion,
        written,
        replace(decisions, refused=refused, changes=decisions.changes + displaced_on(motion, events, farther)),
        tuple(insertions),
        tuple(pieces),
        tuple(transitions),
        indivisible,
        frozenset(left),
        frozenset(shared),
        curve,
    )


def _middles(
    motion: Motion, events: Sequence[MotionEvent], exact: Exact, decisions: Decisions, least: float
) -> dict[int, Array]:
    """The shift (6,) that all runs of a statement can share, by move, where they differ: of statements that are refused
    for that, or would follow what one ``Offs`` displaces.

    They share it in the axes of the object frame: a routine may run again with its work displaced.
    """
    samples = motion.samples
    runs: dict[StatementKey, list[int]] = {}
    for i, move in enumerate(motion.moves):
        event = events[move.event]
        key = key_of(event.statement)
        if key in decisions.refused or (key in decisions.following and event.target_origin.base is not None):
            runs.setdefault(key, []).append(i)
    runs = {key: rows for key, rows in runs.items() if key in decisions.refused or _one_text(events, motion, rows)}
    chosen = [i for rows in runs.values() for i in rows]
    if not chosen:
        return {}
    T_goal, T_corrected = samples.T_work_tcp[samples.goal], samples.curves.mounts.work(exact.T_base_flange)
    turn = object_matrices([events[motion.moves[i].event] for i in chosen])[:, :3, :3]
    shifts = (pose_error(T_goal[chosen], T_corrected[chosen]).reshape(-1, 2, 3) @ turn).reshape(-1, 6)
    turned = np.repeat(
        [_one_text(events, motion, rows) for rows in runs.values()], [len(rows) for rows in runs.values()]
    )
    shifts[~turned, 3:] = 0.0  # other targets can be displaced, not turned
    numbers = [dict(events[motion.moves[i].event].numbers) for i in chosen]
    middles = shared_shifts([len(rows) for rows in runs.values()], shifts, numbers, least)
    return {chosen[k]: (turn[k] @ shift.reshape(2, 3, 1)).ravel() for k, shift in middles.items()}


def _one_text(events: Sequence[MotionEvent], motion: Motion, rows: Sequence[int]) -> bool:
    """Whether all runs of a statement have one target in their object frames, or one that ``Offs`` displaces."""
    first, *others = [events[motion.moves[i].event] for i in rows]
    base = first.target_origin.base
    same = all(event.target == first.target and event.via == first.via for event in others)
    return same or (base is not None and all(event.target_origin.base == base for event in others))
