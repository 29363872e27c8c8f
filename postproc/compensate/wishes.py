"""What the correction asks for: targets as the program would write them."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.circles import circle_point
from postproc.compensate.correction import NO_JUMP, Exact
from postproc.compensate.motion import Motion
from postproc.compensate.proof import distance_to_curves
from postproc.compensate.sharing import straight
from postproc.compensate.targets import Pieces
from postproc.compensate.values import TargetValue, Wish
from postproc.grouping import grouped
from postproc.motion.postures import any_configuration
from postproc.rapid.motions.units import target_poses
from postproc.rapid.program.events import MotionEvent
from postproc.rapid.program.records import Pose, RobTarget
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
                    conf = conf_of(confdata(self.robot, self.written.q[[parts.vias[-1]]])[0])
                asked.append((i, "via", self._via(i, parts), conf))
        values = self.values([(i, T, conf) for i, _, T, conf in asked])
        vias = ((row, i) for row, (i, role, _, _) in enumerate(asked) if role == "via" and i in shared)
        for rows in grouped((self.motion.moves[i].event.statement.key, row) for row, i in vias).values():
            runs = [self.motion.moves[asked[row][0]].event for row in rows]
            for row, value in zip(rows, _alike([values[row] for row in rows], runs, self.least), strict=True):
                values[row] = value
        return [Wish(self.motion.moves[i], role, value) for (i, role, _, _), value in zip(asked, values, strict=True)]

    def _goal_conf(self, i: int, taught: Conf) -> Conf:
        """The confdata as it was taught, while the corrected joints stand where it says."""
        # A target may be taught a little outside its quadrants: the correction must not carry it over the bound.
        kept = within(self.robot, self.written.q_goal[i], np.array(taught), BOUNDARY / 2)
        return taught if kept and not self.crossed[i] else conf_of(self.conf_after[i])

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
            return self.curve[pieces.vias[-1]]
        samples, move = self.motion.samples, self.motion.moves[i]
        assert move.T_work_via is not None
        _, u = distance_to_curves(samples.curves, np.array([i]), move.T_work_via[None, :3, 3])
        rows = slice(int(samples.start[i]), int(samples.goal[i]) + 1)
        shifts = pose_error(samples.T_work_tcp[rows], self.curve[rows])
        shift = np.array([np.interp(u[0], samples.u[rows], column) for column in shifts.T])
        T = move.T_work_via.copy()
        turned = displace(np.concatenate([np.zeros(3), shift[3:]]))[:3, :3] @ T[:3, :3]
        lacks = self.curve[rows][[0, -1], :3, 3] - self.written.T_work_tcp[rows][[0, -1], :3, 3]
        beside = samples.goal[i] > samples.start[i] and np.abs(lacks).max() > NO_JUMP
        T[:3, 3] = circle_point(samples, self.written, i, float(u[0])) if beside else T[:3, 3] + shift[:3]
        T[:3, :3] = turned
        return T


def middle_value(values: Sequence[TargetValue]) -> TargetValue:
    """The value in the middle of some that lie close together; confdata of the first."""
    numbers = np.array([(*value.pose.trans, *value.pose.rot) for value in values])
    x, y, z, *rot = ((numbers.min(axis=0) + numbers.max(axis=0)) / 2).tolist()
    q1, q2, q3, q4 = (np.array(rot) / np.linalg.norm(rot)).tolist()
    return replace(values[0], pose=Pose((x, y, z), (q1, q2, q3, q4)))


def _alike(values: Sequence[TargetValue], runs: Sequence[MotionEvent], least: float) -> list[TargetValue]:
    """Circle points that are displaced alike, and turned only where they are one point."""
    taught = [event.via for event in runs if event.via is not None]
    shifts = np.array([np.subtract(v.pose.trans, via.trans) for v, via in zip(values, taught, strict=True)])
    numbers = [dict(event.numbers) for event in runs]
    way, middle = straight(numbers, shifts, least), middle_value(values)
    one = all(via == taught[0] for via in taught)
    found = []
    for value, via, named in zip(values, taught, numbers, strict=True):
        x, y, z = np.add(via.trans, way.at(named)).tolist()
        rot, conf = (middle.pose.rot, middle.robconf) if one else (via.rot, value.robconf)
        found.append(replace(value, pose=Pose((x, y, z), rot), robconf=conf))
    return found


def conf_of(row: Array) -> Conf:
    """Confdata (4,) as the program writes it."""
    return int(row[0]), int(row[1]), int(row[2]), int(row[3])
