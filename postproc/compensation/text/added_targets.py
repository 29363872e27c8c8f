"""Targets to add on a line or arc: numbers where its ends are numbers, else a call of a function of both ends.

    P = slerp(S, E, s) + c

with the start S and the end E as the program states them, the share s of the way, and the correction c, constant in the
axes of the work object. Nothing else goes into an added target.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.path.samples import follow
from postproc.compensation.text.insertions import insertion_of, small_zone
from postproc.compensation.text.laws import midrange
from postproc.compensation.text.path_points import (
    ARC_FUNCTION,
    LINE_FUNCTION,
    SHARE_DECIMALS,
    argument_text,
    free_name,
    hidden_name,
    point_at,
    quarter_turns,
)
from postproc.compensation.text.requests import Requester, conf_of
from postproc.compensation.text.values import Change, Conf, Insertion, PathPoint, TargetValue, compliant
from postproc.diagnostics import PostprocError
from postproc.grouping import grouped
from postproc.motion.path.curves import pose_in_space
from postproc.motion.path.places import axes_between
from postproc.motion.path.postures import any_configuration
from postproc.motion.path.refusals import STILL
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.records import RobTarget
from postproc.rapid.program.program import Program
from postproc.robot.configuration import confdata
from postproc.robot.pose import displace, pose_error

UNLIKE = "it runs several times on different ways"
NO_PARTS = "a point of its way is an expression that cannot be worked out twice"
OTHER_FRAME = "its line begins in another work object, displacement or tool, or at joint angles"
OTHER_POSTURE = "in its middle the arm has the configuration of neither end"
OTHER_AXES = "its ends do not say how external axes move along it"


@dataclass(frozen=True, slots=True)
class AddedTargets:
    """The statements to add.

    Args:
        insertions: these statements.
        shares: by move that they divide, the fractions of its way at which they are.
        circle_points: changes of the circle points in the statements of divided arcs.
        refused: moves that cannot be divided, with the reason.
    """

    insertions: Sequence[Insertion]
    shares: Mapping[int, tuple[float, ...]]
    circle_points: Sequence[Change]
    refused: Mapping[int, str]


class _Whole(Exception):
    """A statement stays undivided, for the reason that is the argument."""


@dataclass(frozen=True, slots=True)
class _Run:
    """One execution of a divided line or arc.

    Args:
        move: its index; before, event: the motions to its start and along it.
        ends: start and goal, for an arc with the circle point between them, as they are written.
        u: (k,) fractions of its samples; shift: (k, 6) corrections there [m, rad]; q: (k, 6) joint angles [rad].
    """

    move: int
    before: MotionEvent
    event: MotionEvent
    ends: tuple[RobTarget, ...]
    u: Array
    shift: Array
    q: Array

    def lacks(self, share: float) -> Array:
        """(3,) what the correction at a fraction of the way differs from its chord [m]."""
        at = np.array([np.interp(share, self.u, column) for column in self.shift[:, :3].T])
        lacks: Array = at - self.shift[0, :3] - share * (self.shift[-1, :3] - self.shift[0, :3])
        return lacks


class TargetAdder:
    """Makes the statements to add for divided moves.

    Args:
        curve: (n, 4, 4) commanded poses.
        corrected: function of a target's origin and value that returns it with the numbers written into its slot.
        why_whole: function of a move's index that returns why nothing can be added before it, empty if something can.
    """

    def __init__(
        self,
        requester: Requester,
        curve: Array,
        program: Program,
        corrected: Callable[[Origin, RobTarget], RobTarget],
        why_whole: Callable[[int], str],
    ) -> None:
        self.requester, self.curve, self.program = requester, curve, program
        self.corrected, self.why_whole = corrected, why_whole
        self.moves, self.samples = requester.motion.moves, requester.motion.samples

    def add(self, shares: Mapping[int, tuple[float, ...]], tolerance_mm: Array) -> AddedTargets:
        """The statements to add so that divided moves keep their tolerance, one set for all runs of a statement.

        All runs are divided as the one that needs most targets; statements whose runs need different targets are
        refused.

        Args:
            shares: by move, the fractions of its way at which it needs a target.
            tolerance_mm: (m,) allowed deviation [mm] from the commanded curve along each move of the program.
        """
        runs = grouped((m.event.statement.key, i) for i, m in enumerate(self.moves) if m.resumes_from is None)
        needed = grouped((self.moves[i].event.statement.key, i) for i in shares)
        insertions: list[Insertion] = []
        divided: dict[int, tuple[float, ...]] = {}
        circle_points: list[Change] = []
        refused: dict[int, str] = {}
        for key, some in needed.items():
            goals = max((shares[i] for i in some), key=len)
            try:
                added, circle_point = self._of_statement(runs[key], goals, float(tolerance_mm[runs[key]].min()) / 2)
            except _Whole as why:
                refused |= dict.fromkeys(runs[key], str(why))
                continue
            insertions += added
            circle_points += circle_point
            divided |= dict.fromkeys(runs[key], goals)
        return AddedTargets(insertions, divided, circle_points, refused)

    def _of_statement(
        self, indices: Sequence[int], goals: Sequence[float], within_mm: float
    ) -> tuple[list[Insertion], list[Change]]:
        """The statements to add before one statement and, of an arc, the change of the circle point that it states.

        Args:
            indices: of its moves.
            goals: fractions of the way at the targets to add.
            within_mm: how far off [mm] an added target may be in each run.

        Raises:
            _Whole: the targets suit no text, or not all runs.
        """
        for why in filter(None, map(self.why_whole, indices)):
            raise _Whole(why)
        event, before = self.moves[indices[0]].event, self.moves[indices[0] - 1].event
        texts = self._texts(event, before)
        runs = [self._run(i) for i in indices]
        if texts is None and any(run.ends != runs[0].ends for run in runs):
            raise _Whole(UNLIKE)
        to = [self._target(runs, texts, share, within_mm) for share in goals]
        zone = small_zone(self.program, event)
        if event.via is None:
            return [insertion_of(event, target, None, zone) for target in to], []
        middles = [(a + b) / 2 for a, b in pairwise([0.0, *goals, 1.0])]
        *vias, last = [self._target(runs, texts, share, within_mm, circle_point=True) for share in middles]
        added = [insertion_of(event, target, via, zone) for target, via in zip(to, vias, strict=True)]
        argument = event.statement.argument("via")
        assert argument is not None
        return added, [
            Change(event.statement.source, argument.span, "point" if last.point is not None else "numbers", last)
        ]

    def _texts(self, event: MotionEvent, before: MotionEvent) -> tuple[str, ...] | None:
        """Expressions of start and goal, for an arc with the circle point between them; None if all are numbers.

        Args:
            event: the motion along the line or arc.
            before: the motion to its start, whose statement stands directly before.

        Raises:
            _Whole: one of them cannot be used in a call.
        """
        module = event.statement.module
        arguments = [before.statement.argument("to"), event.statement.argument("via"), event.statement.argument("to")]
        origins = [before.target_origin, event.via_origin, event.target_origin]
        if all(origin is None or (origin.kind == "inline" and origin.handed is None) for origin in origins):
            return None
        hidden = hidden_name(self.program, module, arc=event.via is not None)
        texts = [argument_text(a.text, self.program, module) for a in arguments if a is not None]
        if hidden is not None or None in texts:
            raise _Whole(hidden or NO_PARTS)
        return tuple(text for text in texts if text is not None)

    def _run(self, i: int) -> _Run:
        """The execution that is move i.

        Raises:
            _Whole: its start is not known, or lies in another work object, displacement or tool. A new calibration of
                one of them moves the line in a way that no expression of its ends follows.
        """
        samples, event, before = self.samples, self.moves[i].event, self.moves[i - 1].event
        rows = np.arange(samples.start[i], samples.goal[i] + 1)
        frames = [(e.wobj, e.displacement, e.tool) for e in (before, event)]
        if not isinstance(before.target, RobTarget) or frames[0] != frames[1] or len(rows) < 2:
            raise _Whole(OTHER_FRAME)
        ends = [
            (before.target_origin, before.target),
            (event.via_origin, event.via),
            (event.target_origin, event.target),
        ]
        written = [self._written(o, t) for o, t in ends if o is not None and isinstance(t, RobTarget)]
        curve, q = self.curve[rows], self.requester.exact.q[rows]
        try:
            # Near a straight wrist that may be another wrist than the inverse of the model has at a sample alone.
            end = np.array([len(rows) - 1]), self.requester.exact.q_goal[[i]]
            q = follow(self.requester.robot, samples.curves, samples.move[rows], samples.u[rows], curve, q[0], end)
        except PostprocError:
            pass  # the proof says where the arm cannot follow
        shift = pose_error(samples.T_work_tcp[rows], curve)
        return _Run(i, before, event, tuple(written), samples.u[rows], shift, q)

    def _written(self, origin: Origin, target: RobTarget) -> RobTarget:
        """The value of a target expression once the numbers that it comes from are corrected.

        Numbers that stand in the statement itself are not corrected: added statements repeat them as they were.

        Args:
            origin: where these numbers stand in the text.
            target: the present value of the expression.
        """
        root = origin.root
        base = target if root is None else root.target
        now = base if origin.stands_in_statement else self.corrected(origin, base)
        if root is None or now == base:
            return now if root is None else target
        turn = Rotation.from_quat(now.rot, scalar_first=True) * Rotation.from_quat(base.rot, scalar_first=True).inv()
        moved = np.subtract(now.trans, base.trans) + turn.apply(root.lever) - np.array(root.lever)
        x, y, z = np.add(target.trans, moved).tolist()
        w, a, b, c = (turn * Rotation.from_quat(target.rot, scalar_first=True)).as_quat(scalar_first=True).tolist()
        return replace(target, trans=(x, y, z), rot=(w, a, b, c), robconf=now.robconf)

    def _target(
        self,
        runs: Sequence[_Run],
        texts: tuple[str, ...] | None,
        share: float,
        within_mm: float,
        *,
        circle_point: bool = False,
    ) -> TargetValue:
        """One target for all runs at a fraction of their ways, in the middle of what they need.

        Args:
            texts: expressions of the ends; None if they are numbers, as the target then is.
            within_mm: how far [mm] it may be from what each run needs.
            circle_point: its configuration means nothing.

        Raises:
            _Whole: the runs need different targets.
        """
        values = [self._value(run, share) for run in runs]
        places = np.array([value.pose.trans for value in values])
        if texts is not None:
            places -= [point_at(np.array([end.trans for end in run.ends]), share) for run in runs]
        middle = midrange(places)
        off = np.linalg.norm(places - middle, axis=1)
        if any(off > [max(within_mm, 500 * np.linalg.norm(run.lacks(share))) for run in runs]):
            raise _Whole(UNLIKE)
        x, y, z = middle.tolist()
        if texts is None:
            if any(not compliant(value.robconf, values[0].robconf) for value in values):
                raise _Whole(UNLIKE)
            return replace(values[0], pose=replace(values[0].pose, trans=(x, y, z)))
        share = round(share, SHARE_DECIMALS)
        turns = None if circle_point else _turns(runs, values, share)
        function = free_name(self.program, LINE_FUNCTION if len(texts) == 2 else ARC_FUNCTION)
        return replace(values[0], point=PathPoint(function, texts, share, (x, y, z), turns))

    def _value(self, run: _Run, share: float) -> TargetValue:
        """The target that one run needs at a fraction of its way, in the posture in which the arm comes there."""
        T = pose_in_space(self.samples.curves, np.array([run.move]), np.array([share]))[0]
        shift, q = (np.array([np.interp(share, run.u, c) for c in columns.T]) for columns in (run.shift, run.q))
        T[:3, :3] = displace(np.concatenate([np.zeros(3), shift[3:]]))[:3, :3] @ T[:3, :3]
        T[:3, 3] += shift[:3]
        conf = conf_of(confdata(self.requester.robot, q[None])[0])
        value = self.requester.values([(run.move, T, conf)])[0]
        return replace(value, extax=axes_between(run.before, run.event, share))


def _turns(runs: Sequence[_Run], values: Sequence[TargetValue], share: float) -> Conf | None:
    """Quarter turns, the same for all runs, from the configuration of the nearer end to that of an added target.

    None where it has the configuration of the nearer end, or one that the controller accepts for that.

    Args:
        values: the target of each run.
        share: fraction of the way at it.

    Raises:
        _Whole: the runs need different ones, or external axes do not move evenly between the ends.
    """
    near = [run.ends[0 if share < 0.5 else -1].robconf for run in runs]
    for run, value in zip(runs, values, strict=True):
        start, goal = (np.array(end.extax) for end in (run.ends[0], run.ends[-1]))
        if (np.abs(start + share * (goal - start) - value.extax) > STILL).any():
            raise _Whole(OTHER_AXES)
    turns = {quarter_turns(conf, value.robconf) for conf, value in zip(near, values, strict=True)}
    if len(turns) == 1 and None not in turns:
        common = turns.pop()
        return common if common is not None and any(common) else None
    pairs = zip(runs, near, values, strict=True)
    if not all(any_configuration(run.event) or compliant(value.robconf, conf) for run, conf, value in pairs):
        raise _Whole(OTHER_POSTURE)
    return None
