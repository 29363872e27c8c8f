"""What the correction asks for: targets as the program would write them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.correction.curve import NO_JUMP, Exact
from postproc.compensation.correction.deviation import away_from_curves
from postproc.compensation.path.motion import Motion
from postproc.compensation.text.values import Conf, TargetRequest, TargetValue
from postproc.compensation.tolerances import goal_tolerances
from postproc.motion.path.curves import circle_through
from postproc.motion.path.postures import any_configuration
from postproc.motion.path.samples import Samples
from postproc.rapid.data.records import RobTarget
from postproc.rapid.motions.units import target_poses
from postproc.robot.arm import Robot
from postproc.robot.configuration import confdata
from postproc.robot.inverse import selects
from postproc.robot.pose import displace, pose_error

SLACK = 0.5  # share of the tolerance that a target may take; the rest is for the way between targets

CorrectedPose = tuple[int, str, Array, Conf]  # move, role, (4, 4) corrected pose, configuration


class Requester:
    """Makes the requests of a program's moves: the corrected targets as the program would write them.

    Args:
        exact: the inverse of the model, from ``invert_model``.
    """

    def __init__(self, robot: Robot, motion: Motion, exact: Exact) -> None:
        self.robot, self.motion, self.exact, self.moves = robot, motion, exact, motion.moves
        self.conf_after = confdata(robot, exact.q_goal)
        taught = np.array([getattr(m.event.target, "robconf", None) or (0, 0, 0, 0) for m in motion.moves])
        # At a wrist so straight that both signs of axis 5 count, the sign stays the programmer's own.
        other = confdata(robot, np.array([m.q for m in motion.moves]))[:, 3] != taught[:, 3]
        self.kept = selects(robot, taught, exact.q_goal) & (other | (self.conf_after[:, 3] == taught[:, 3]))
        self.T_goal = motion.samples.curves.mounts.work(exact.T_base_flange)
        self.within_mm = (1e3 * SLACK * goal_tolerances(motion.moves, motion.options)).tolist()

    def goals(self, chosen: Iterable[int]) -> list[TargetRequest]:
        """Requests for the goals of the chosen moves (indices), except joint targets and goals only restated."""
        poses: list[CorrectedPose] = []
        for i in chosen:
            move = self.moves[i]
            target = move.event.target
            if isinstance(target, RobTarget) and move.resumes_from is None:
                # The confdata as it was taught, wherever it selects the corrected posture.
                keeps = self.kept[i] or any_configuration(move.event)
                poses.append((i, "to", self.T_goal[i], target.robconf if keeps else conf_of(self.conf_after[i])))
        return self._requests(poses)

    def vias(self, chosen: Iterable[int], written: Exact, curve: Array) -> list[TargetRequest]:
        """Requests for the circle points of those among the chosen moves (indices) that are arcs.

        Args:
            written: the correction with the goals that the text has, from ``place_targets``.
            curve: (n, 4, 4) commanded poses through them.
        """
        arcs = [(i, self.moves[i].event.via) for i in chosen if self.moves[i].resumes_from is None]
        return self._requests(
            [(i, "via", self._via(i, written, curve), via.robconf) for i, via in arcs if via is not None]
        )

    def _requests(self, poses: Sequence[CorrectedPose]) -> list[TargetRequest]:
        """The requests for corrected poses, in their order."""
        if not poses:
            return []
        events = [self.moves[i].event for i, *_ in poses]
        values = self.values([(i, T, conf) for i, _, T, conf in poses])
        targets = [(e.target if role == "to" else e.via) for e, (_, role, *_) in zip(events, poses, strict=True)]
        before = np.array([target.rot for target in targets if isinstance(target, RobTarget)])
        after = np.array([value.pose.rot for value in values])
        # q and -q are one orientation: the sign stays that of the target.
        after *= np.where((before * after).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        R_before, R_after = (Rotation.from_quat(rots, scalar_first=True) for rots in (before, after))
        turns = (R_after * R_before.inv()).as_rotvec()
        requests = []
        for k, ((w, a, b, c), (x, y, z)) in enumerate(zip(after.tolist(), turns.tolist(), strict=True)):
            value = replace(values[k], pose=replace(values[k].pose, rot=(w, a, b, c)))
            i, role, *_ = poses[k]
            requests.append(TargetRequest(i, events[k], role, value, (x, y, z), self.within_mm[i]))
        return requests

    def values(self, corrected: Sequence[tuple[int, Array, Conf]]) -> list[TargetValue]:
        """Targets as the program writes them, in their work objects and with the external axes of the move's goal.

        Args:
            corrected: index of the move, T_work_tcp (4, 4) and confdata of each.
        """
        events = [self.moves[i].event for i, _, _ in corrected]
        poses = target_poses(events, np.array([T for _, T, _ in corrected]).reshape(-1, 4, 4))
        values = []
        for event, pose, (_, _, conf) in zip(events, poses, corrected, strict=True):
            assert isinstance(event.target, RobTarget)
            values.append(TargetValue(pose, conf, event.target.extax))
        return values

    def _via(self, i: int, written: Exact, curve: Array) -> Array:
        """Corrected pose (4, 4) of the circle point of arc i, where the user put it.

        If a written end differs from the corrected curve, it lies on the circle through the written ends and the
        corrected middle.

        Args:
            written: the correction with the goals that the text has.
            curve: (n, 4, 4) commanded poses at all samples.
        """
        samples, move = self.motion.samples, self.moves[i]
        assert move.T_work_via is not None
        _, u = away_from_curves(samples.curves, np.array([i]), move.T_work_via[None, :3, 3])
        rows = slice(int(samples.start[i]), int(samples.goal[i]) + 1)
        shifts = pose_error(samples.T_work_tcp[rows], curve[rows])
        shift = np.array([np.interp(u[0], samples.u[rows], column) for column in shifts.T])
        T = move.T_work_via.copy()
        turned = displace(np.concatenate([np.zeros(3), shift[3:]]))[:3, :3] @ T[:3, :3]
        lacks = curve[rows][[0, -1], :3, 3] - written.T_work_tcp[rows][[0, -1], :3, 3]
        displaced = samples.goal[i] > samples.start[i] and np.abs(lacks).max() > NO_JUMP
        T[:3, :3] = turned
        if not displaced:
            T[:3, 3] += shift[:3]
            return T
        ends = ends_of(samples, written, i)
        middle = written.T_work_tcp[(samples.start[i] + samples.goal[i]) // 2, :3, 3]
        center, radial, tangent, angle, _, _ = circle_through(*(point[None] for point in (ends[0], middle, ends[1])))
        T[:3, 3] = (center + np.cos(u[0] * angle) * radial + np.sin(u[0] * angle) * tangent)[0]
        return T


def ends_of(samples: Samples, written: Exact, i: int) -> Array:
    """Start and goal (2, 3) [m] of move i in its own work frame, with the targets as they are written.

    Args:
        written: the correction with the targets that the text can have, from ``place_targets``.
    """
    ends = np.array([samples.start[i], samples.goal[i]])
    return samples.mounts_at(ends).work(written.T_base_flange[[i - 1, i]])[:, :3, 3]


def conf_of(row: Array) -> Conf:
    """Confdata (4,) as a tuple of integers."""
    return int(row[0]), int(row[1]), int(row[2]), int(row[3])
