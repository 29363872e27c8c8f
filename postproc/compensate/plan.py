"""From a program to the decision what to change: moves, timing, exact corrections, added targets, texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction import (
    Exact,
    Transition,
    changing_moves,
    commanded_curve,
    invert_model,
    place_targets,
)
from postproc.compensate.decisions import Decisions, Wish, decide_changes, same_value
from postproc.compensate.insertions import insertion_of, why_indivisible
from postproc.compensate.options import Options
from postproc.compensate.proof import distance_to_curves
from postproc.compensate.reversals import find_reversals, sample_for
from postproc.compensate.samples import Samples
from postproc.compensate.sharing import Users
from postproc.compensate.states import build_state
from postproc.compensate.targets import Pieces, divide_moves
from postproc.compensate.timeline import SWIFT, Timeline, plan_timeline
from postproc.compensate.values import Insertion, StatementKey, TargetValue, key_of
from postproc.diagnostics import Diagnostic, PostprocError, has_errors
from postproc.effects.contract import State
from postproc.model.arm import Model
from postproc.motion.moves import read_moves
from postproc.motion.values import Move
from postproc.rapid.events import MotionEvent
from postproc.rapid.records import RobTarget
from postproc.rapid.units import target_poses
from postproc.robot.arm import Robot
from postproc.robot.configuration import confdata
from postproc.robot.pose import displace, pose_error

Conf = tuple[int, int, int, int]
TRANSITION_INTERVALS = 64  # samples of a move in which the correction jumps
SWIFT_INTERVALS = 32


@dataclass(frozen=True, slots=True)
class Motion:
    """What a program makes the arm do: moves, their timing, and samples of the programmed curves."""

    moves: tuple[Move, ...]
    timeline: Timeline
    samples: Samples
    state: State


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that will be written, before it is written.

    Args:
        indivisible: moves before which nothing can be added, and why; left: moves whose targets are not corrected for
            themselves; curve: (n, 4, 4) commanded poses at the samples.
    """

    motion: Motion
    exact: Exact
    decisions: Decisions
    insertions: tuple[Insertion, ...]
    pieces: tuple[Pieces, ...]
    transitions: tuple[Transition, ...]
    indivisible: Mapping[int, str]
    left: frozenset[int]
    curve: Array


def read_samples(
    model: Model, events: Sequence[MotionEvent], options: Options, joint_ways: bool = False
) -> tuple[Samples | None, list[Diagnostic]]:
    """Moves of a program and samples of their curves; None where an error makes that impossible."""
    moves, findings = read_moves(model.robot, events)
    if has_errors(findings) or not moves:
        return None, findings
    swift = np.array([options.inertia and m.speed > SWIFT for m in moves])
    dense = np.where(changing_moves(tuple(moves), options), TRANSITION_INTERVALS, np.where(swift, SWIFT_INTERVALS, 0))
    try:
        return sample_for(model, moves, dense, joint_ways), findings
    except PostprocError as error:
        return None, findings + list(error.diagnostics)


def read_motion(
    model: Model, events: Sequence[MotionEvent], options: Options
) -> tuple[Motion | None, list[Diagnostic]]:
    """Moves, timing and samples of a program; None where an error makes that impossible."""
    samples, findings = read_samples(model, events, options, joint_ways=True)
    if samples is None:
        return None, findings
    try:
        timeline, more = plan_timeline(model, samples, events)
    except PostprocError as error:
        return None, findings + list(error.diagnostics)
    findings += more
    if timeline is None:
        return None, findings
    state = build_state(model, samples, timeline, options)
    return Motion(samples.moves, timeline, samples, state), findings


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
    place = samples.move + samples.u
    t = motion.timeline.at(motion.timeline.t, place)
    settled = motion.timeline.steady(options, place)
    exact = invert_model(model, samples, motion.state)
    lengths = samples.curves.length.tolist()
    asked = ((i, why_indivisible(events[m.event], lengths[i])) for i, m in enumerate(moves))
    indivisible = {i: why for i, why in asked if why is not None}
    refused: dict[StatementKey, str] = {}
    left: dict[int, Array] = {}  # moves whose targets are not where the correction wants them, and where they are
    while True:
        written = place_targets(model, samples, exact, left)
        curve, transitions = commanded_curve(model, samples, written, t)
        transitions += find_reversals(model, samples, curve, t, options.tolerance_m)
        divisible = [i not in indivisible and i not in left for i in range(len(moves))]
        pieces = divide_moves(samples, curve, options.tolerance_m, divisible, settled)
        values = _Values(model.robot, motion, events, written, curve)
        wishes = values.wishes([i for i in range(len(moves)) if i not in left or left[i].any()], pieces)
        decisions = decide_changes(events, wishes, users)
        refused |= decisions.refused
        insertions, clashing = values.insertions(pieces, zone_name)
        now_left = _left_targets(motion, events, exact, wishes, decisions)
        if now_left.keys() <= left.keys() and not clashing:
            break
        left = now_left | left
        indivisible.update(clashing)
    return Plan(
        motion,
        written,
        replace(decisions, refused=refused),
        tuple(insertions),
        tuple(pieces),
        tuple(transitions),
        indivisible,
        frozenset(left),
        curve,
    )


def _left_targets(
    motion: Motion, events: Sequence[MotionEvent], exact: Exact, wishes: Sequence[Wish], decisions: Decisions
) -> dict[int, Array]:
    """Moves whose targets are not written as wished, with the shift (6,) that they get: none, or that of the target
    which they are derived from. Of the targets in an array that is the nearest one.
    """
    samples = motion.samples
    wanted = samples.T_work_tcp[samples.goal]
    shifts = pose_error(wanted, samples.curves.mounts.work(exact.T_base_flange))
    index = {move.event: i for i, move in enumerate(motion.moves)}
    bases: dict[str, list[int]] = {}
    for wish in wishes:
        if wish.role == "to" and wish.origin.declaration is not None:
            bases.setdefault(wish.origin.declaration, []).append(index[wish.event])
    left: dict[int, Array] = {}
    for i, move in enumerate(motion.moves):
        key = key_of(events[move.event].statement)
        if key in decisions.refused:
            left[i] = np.zeros(6)
        elif key in decisions.following:
            rows = [row for name in decisions.following[key] for row in bases[name]]
            away = np.linalg.norm(wanted[rows, :3, 3] - wanted[i, :3, 3], axis=1)
            left[i] = shifts[rows[int(np.argmin(away))]]
    return left


class _Values:
    """Corrected targets of one round, as the program writes them."""

    def __init__(
        self, robot: Robot, motion: Motion, events: Sequence[MotionEvent], written: Exact, curve: Array
    ) -> None:
        self.robot, self.motion, self.events, self.written, self.curve = robot, motion, events, written, curve
        nominal = np.array([m.q for m in motion.moves])
        self.conf_before = confdata(robot, nominal)
        self.conf_after = confdata(robot, written.q_goal)
        self.T_goal = motion.samples.curves.mounts.work(written.T_base_flange)

    def wishes(self, chosen: Sequence[int], pieces: Sequence[Pieces]) -> list[Wish]:
        """Corrected goals and circle points of the chosen moves."""
        divided = {p.move: p for p in pieces}
        asked: list[tuple[int, str, Array, Conf]] = []
        for i in chosen:
            move = self.motion.moves[i]
            event = self.events[move.event]
            if not isinstance(event.target, RobTarget):
                continue
            crossed = not np.array_equal(self.conf_before[i], self.conf_after[i])
            asked.append((i, "to", self.T_goal[i], _conf(self.conf_after[i]) if crossed else event.target.robconf))
            if event.via is not None and not move.first:
                asked.append((i, "via", self._via(i, divided[i]), event.via.robconf))
        values = self.values([(i, T, conf) for i, _, T, conf in asked])
        found = []
        for (i, role, _, _), value in zip(asked, values, strict=True):
            event = self.events[self.motion.moves[i].event]
            origin = event.target_origin if role == "to" else event.via_origin
            assert origin is not None
            found.append(Wish(self.motion.moves[i].event, role, origin, value))
        return found

    def values(self, asked: Sequence[tuple[int, Array, Conf]]) -> list[TargetValue]:
        """Poses (move, T_work_tcp, confdata) as the program writes them, in their work objects."""
        events = [self.events[self.motion.moves[i].event] for i, _, _ in asked]
        poses = target_poses(events, np.array([T for _, T, _ in asked]).reshape(-1, 4, 4))
        result = []
        for event, pose, (_, _, conf) in zip(events, poses, asked, strict=True):
            assert isinstance(event.target, RobTarget)
            result.append(TargetValue(pose, conf, event.target.extax))
        return result

    def _via(self, i: int, pieces: Pieces) -> Array:
        """Circle point: where the user put it, corrected; of a divided arc, in the middle of its last part."""
        if pieces.goals:
            middle: Array = self.curve[pieces.vias[-1]]
            return middle
        samples, move = self.motion.samples, self.motion.moves[i]
        assert move.T_work_via is not None
        _, u = distance_to_curves(samples.curves, np.array([i]), move.T_work_via[None, :3, 3])
        rows = slice(int(samples.start[i]), int(samples.goal[i]) + 1)
        shifts = pose_error(samples.T_work_tcp[rows], self.curve[rows])
        shift = np.array([np.interp(u[0], samples.u[rows], column) for column in shifts.T])
        T = move.T_work_via.copy()
        turned = displace(np.concatenate([np.zeros(3), shift[3:]]))[:3, :3] @ T[:3, :3]
        T[:3, :3], T[:3, 3] = turned, T[:3, 3] + shift[:3]
        return T

    def _added(self, i: int, part: Pieces | None, zone_name: Callable[[MotionEvent], str]) -> list[Insertion]:
        """The statements to add before one move."""
        if part is None:
            return []
        event = self.events[self.motion.moves[i].event]
        goals = list(part.goals)
        confs = [_conf(row) for row in confdata(self.robot, self.written.q[goals])]
        to = self.values([(i, self.curve[g], c) for g, c in zip(goals, confs, strict=True)])
        vias = self.values([(i, self.curve[v], c) for v, c in zip(part.vias, confs, strict=False)])
        zone, shares = zone_name(event), np.diff(self.motion.samples.u[goals], prepend=0.0).tolist()
        return [insertion_of(event, t, vias[k] if vias else None, zone, shares[k]) for k, t in enumerate(to)]

    def insertions(
        self, pieces: Sequence[Pieces], zone_name: Callable[[MotionEvent], str]
    ) -> tuple[list[Insertion], dict[int, str]]:
        """Statements to add; moves whose statement runs several times and would need different ones."""
        by_statement: dict[tuple[str, int], list[tuple[int, list[Insertion]]]] = {}
        divided = {p.move: p for p in pieces if p.goals}
        runs: dict[tuple[str, int], list[int]] = {}
        for i, move in enumerate(self.motion.moves):
            runs.setdefault(key_of(self.events[move.event].statement), []).append(i)
        for key, group in runs.items():
            if not any(i in divided for i in group):
                continue
            by_statement[key] = [(i, self._added(i, divided.get(i), zone_name)) for i in group]
        found: list[Insertion] = []
        clashing: dict[int, str] = {}
        for runs_of in by_statement.values():
            _, first = runs_of[0]
            if all(_same_insertions(first, other) for _, other in runs_of[1:]):
                found += first
            else:
                clashing.update({i: "it runs several times on different ways" for i, _ in runs_of})
        return found, clashing


def _conf(row: Array) -> Conf:
    return int(row[0]), int(row[1]), int(row[2]), int(row[3])


def _same_insertions(a: Sequence[Insertion], b: Sequence[Insertion]) -> bool:
    if len(a) != len(b):
        return False
    for x, y in zip(a, b, strict=True):
        if not same_value(x.to, y.to) or (x.via is None) != (y.via is None) or x.duration != y.duration:
            return False
        if x.via is not None and y.via is not None and not same_value(x.via, y.via):
            return False
    return True
