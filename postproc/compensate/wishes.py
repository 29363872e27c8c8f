"""What the correction asks for: targets as the program would write them, and statements to add."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction import Exact
from postproc.compensate.decisions import SAME_MM, same_value
from postproc.compensate.insertions import insertion_of
from postproc.compensate.motion import Motion
from postproc.compensate.proof import distance_to_curves
from postproc.compensate.sharing import straight
from postproc.compensate.targets import Pieces
from postproc.compensate.values import Insertion, TargetValue, Wish
from postproc.motion.postures import any_configuration
from postproc.motion.refusals import STILL
from postproc.rapid.events import MotionEvent, StatementKey
from postproc.rapid.records import NO_AXIS, Ax6, Pose, RobTarget
from postproc.rapid.units import target_poses
from postproc.robot.arm import Robot
from postproc.robot.configuration import confdata, within
from postproc.robot.inverse import BOUNDARY
from postproc.robot.pose import displace, pose_error

Conf = tuple[int, int, int, int]


class Wishes:
    """Corrected targets of one round, as the program writes them."""

    def __init__(self, robot: Robot, motion: Motion, written: Exact, curve: Array, least: float) -> None:
        self.robot, self.motion, self.written, self.curve = robot, motion, written, curve
        self.least = 1e3 * least  # [mm] see ``straight``
        nominal = np.array([m.q for m in motion.moves])
        self.conf_after = confdata(robot, written.q_goal)
        self.crossed = (confdata(robot, nominal) != self.conf_after).any(axis=1)
        self.T_goal = motion.samples.curves.mounts.work(written.T_base_flange)

    def wishes(self, chosen: Sequence[int], pieces: Sequence[Pieces], shared: Set[int]) -> list[Wish]:
        """Corrected goals and circle points of the chosen moves; the shared ones are runs that have one text."""
        divided = {p.move: p for p in pieces}
        asked: list[tuple[int, str, Array, Conf]] = []
        for i in chosen:
            move = self.motion.moves[i]
            event = move.event
            if not isinstance(event.target, RobTarget) or move.again is not None:
                continue
            conf = event.target.robconf if any_configuration(event) else self._goal_conf(i, event.target.robconf)
            asked.append((i, "to", self.T_goal[i], conf))
            if event.via is not None:
                parts = divided.get(i)
                conf = event.via.robconf
                if parts is not None and parts.goals:  # it is moved to the middle of the last part
                    conf = _conf(confdata(self.robot, self.written.q[[parts.vias[-1]]])[0])
                asked.append((i, "via", self._via(i, parts), conf))
        values = self.values([(i, T, conf) for i, _, T, conf in asked])
        vias: dict[StatementKey, list[int]] = {}
        for row, (i, role, _, _) in enumerate(asked):
            if role == "via" and i in shared:
                vias.setdefault(self.motion.moves[i].event.statement.key, []).append(row)
        for rows in vias.values():
            runs = [self.motion.moves[asked[row][0]].event for row in rows]
            for row, value in zip(rows, _alike([values[row] for row in rows], runs, self.least), strict=True):
                values[row] = value
        return [Wish(self.motion.moves[i], role, value) for (i, role, _, _), value in zip(asked, values, strict=True)]

    def _goal_conf(self, i: int, taught: Conf) -> Conf:
        """The confdata as it was taught, while the corrected joints stand where it says."""
        # A target may be taught a little outside its quadrants: the correction must not carry it over the bound.
        kept = within(self.robot, self.written.q_goal[i], np.array(taught), BOUNDARY / 2)
        return taught if kept and not self.crossed[i] else _conf(self.conf_after[i])

    def values(self, asked: Sequence[tuple[int, Array, Conf]]) -> list[TargetValue]:
        """Poses (move, T_work_tcp, confdata) as the program writes them, in their work objects."""
        events = [self.motion.moves[i].event for i, _, _ in asked]
        poses = target_poses(events, np.array([T for _, T, _ in asked]).reshape(-1, 4, 4))
        result = []
        for event, pose, (_, _, conf) in zip(events, poses, asked, strict=True):
            assert isinstance(event.target, RobTarget)
            result.append(TargetValue(pose, conf, event.target.extax))
        return result

    def _via(self, i: int, pieces: Pieces | None) -> Array:
        """Circle point: where the user put it, corrected; of a divided arc, in the middle of its last part.

        Of an arc that begins nobody knows where it goes with the goal.
        """
        if pieces is not None and pieces.goals:
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
        event = self.motion.moves[i].event
        goals = list(part.goals)
        confs = [_conf(row) for row in confdata(self.robot, self.written.q[goals])]
        to = self.values([(i, self.curve[g], c) for g, c in zip(goals, confs, strict=True)])
        shares = self.motion.samples.u[goals].tolist()
        to = [replace(value, extax=self._axes(i, share)) for value, share in zip(to, shares, strict=True)]
        vias = self.values([(i, self.curve[v], c) for v, c in zip(part.vias, confs, strict=False)])
        zone, parts = zone_name(event), np.diff(shares, prepend=0.0).tolist()
        return [insertion_of(event, t, vias[k] if vias else None, zone, parts[k]) for k, t in enumerate(to)]

    def _axes(self, i: int, share: float) -> Ax6:
        """Where the external axes are after a share of a move: they move evenly with it."""
        before, target = (self.motion.moves[j].event.target for j in (max(i - 1, 0), i))
        assert before is not None and target is not None
        a, b, c, d, e, f = (
            end if max(begin, end) >= NO_AXIS else round(begin + share * (end - begin), 3)
            for begin, end in zip(before.extax, target.extax, strict=True)
        )
        return a, b, c, d, e, f

    def insertions(
        self, pieces: Sequence[Pieces], zone_name: Callable[[MotionEvent], str], tolerance: float
    ) -> tuple[list[Insertion], dict[int, str]]:
        """Statements to add; moves whose statement runs several times and would need different ones.

        Different is what differs by more than half of the tolerance [m].
        """
        same = max(SAME_MM, 500.0 * tolerance)
        by_statement: dict[tuple[str, int], list[tuple[int, list[Insertion]]]] = {}
        divided = {p.move: p for p in pieces if p.goals}
        runs: dict[tuple[str, int], list[int]] = {}
        for i, move in enumerate(self.motion.moves):
            if move.again is None:
                runs.setdefault(move.event.statement.key, []).append(i)
        for key, group in runs.items():
            if not any(i in divided for i in group):
                continue
            by_statement[key] = [(i, self._added(i, divided.get(i), zone_name)) for i in group]
        found: list[Insertion] = []
        clashing: dict[int, str] = {}
        for runs_of in by_statement.values():
            _, first = runs_of[0]
            if all(_same_insertions(first, other, same) for _, other in runs_of[1:]):
                found += first
            else:
                clashing.update({i: "it runs several times on different ways" for i, _ in runs_of})
        return found, clashing


def middle_value(values: Sequence[TargetValue]) -> TargetValue:
    """The value in the middle of some that lie close together; confdata of the first."""
    numbers = np.array([(*value.pose.trans, *value.pose.rot) for value in values])
    x, y, z, *rot = ((numbers.min(axis=0) + numbers.max(axis=0)) / 2).tolist()
    q1, q2, q3, q4 = (np.array(rot) / np.linalg.norm(rot)).tolist()
    return replace(values[0], pose=Pose((x, y, z), (q1, q2, q3, q4)))


def _alike(values: Sequence[TargetValue], runs: Sequence[MotionEvent], least: float) -> list[TargetValue]:
    """One value for one circle point; other points, another one in each run, are displaced alike and not turned."""
    taught = [event.via for event in runs if event.via is not None]
    if all(via == taught[0] for via in taught):
        return [middle_value(values)] * len(values)
    shifts = np.array([np.subtract(v.pose.trans, via.trans) for v, via in zip(values, taught, strict=True)])
    numbers = [dict(event.numbers) for event in runs]
    way = straight(numbers, shifts, least)
    found = []
    for value, via, named in zip(values, taught, numbers, strict=True):
        x, y, z = np.add(via.trans, way.at(named)).tolist()
        found.append(replace(value, pose=Pose((x, y, z), via.rot)))
    return found


def _conf(row: Array) -> Conf:
    return int(row[0]), int(row[1]), int(row[2]), int(row[3])


def _same_insertions(a: Sequence[Insertion], b: Sequence[Insertion], within_mm: float) -> bool:
    if len(a) != len(b):
        return False
    for x, y in zip(a, b, strict=True):
        if not same_value(x.to, y.to, within_mm) or (x.via is None) != (y.via is None) or x.duration != y.duration:
            return False
        if np.abs(np.subtract(x.to.extax, y.to.extax)).max() > STILL:
            return False
        if x.via is not None and y.via is not None and not same_value(x.via, y.via, within_mm):
            return False
    return True
