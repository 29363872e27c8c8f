"""Targets to add on a line or arc: numbers where its ends are numbers, else a call of a function of both ends.

    P = slerp(S, E, s) + c

with the start S and the end E as the program states them, the share s of the way, and the correction c, constant in the
axes of the work object. Nothing else goes into an added target.

    MoveL ppLinePoint(pStart,pGoal,0.25,0.012,-0.03,0.007),v50,z1,tT;

goes to the point after a quarter of the line, wherever the ends are taught (templates/line_point.j2, arc_point.j2).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, zip_longest

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from postproc.arrays import Array
from postproc.compensation.text.insertions import insertion_of, small_zone
from postproc.compensation.text.laws import midrange
from postproc.compensation.text.requests import Requester, conf_of
from postproc.compensation.text.values import Change, Conf, Form, Insertion, PathPoint, TargetValue, compliant
from postproc.diagnostics import PostprocError
from postproc.grouping import grouped
from postproc.motion.path.curves import circle_through, pose_in_space
from postproc.motion.path.places import axes_between
from postproc.motion.path.postures import any_configuration, follow
from postproc.motion.path.refusals import AXIS_TOLERANCE
from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.records import RobTarget
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.syntax.trees import Call, Star, nodes
from postproc.rapid.unknown import Unknown
from postproc.robot.configuration import confdata
from postproc.robot.pose import displace, pose_error

UNLIKE = "it runs several times on different ways"
NO_PARTS = "a point of its way is an expression that cannot be worked out twice"
OTHER_FRAME = "its line begins in another work object, displacement or tool, or at joint angles"
OTHER_POSTURE = "in its middle the arm has the configuration of neither end"
OTHER_AXES = "its ends do not say how external axes move along it"
HIDDEN = "the program has a name of its own for `{}`, which a target between its ends needs"
SHARE_DECIMALS = 5
LINE_FUNCTION, ARC_FUNCTION = "ppLinePoint", "ppArcPoint"
# What the functions call and declare.
LINE_NAMES = ("Present", "Distance", "ATan2", "Sqrt", "Sin", "robtarget", "confdata", "orient", "pos", "num")
ARC_NAMES = (*LINE_NAMES, "DotProd", "Cos", "Abs")


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


class _Undivided(Exception):
    """A statement stays undivided, for the reason that is the argument."""


@dataclass(frozen=True, slots=True)
class _Run:
    """One execution of a divided line or arc.

    Args:
        event: the motion along it.
        ends: start and goal, for an arc with the circle point between them, as they are written.
        values: the targets that it needs at k fractions of its way.
        lacks_mm: (k,) how far off it is there with the corrections of its ends alone.
    """

    event: MotionEvent
    ends: tuple[RobTarget, ...]
    values: Sequence[TargetValue]
    lacks_mm: Array


class TargetAdder:
    """Makes the statements to add for divided moves.

    Args:
        curve: (n, 4, 4) commanded poses.
        corrected: function of a target's origin and value that returns it with the numbers written into its slot.
        why_undivided: function of a move's index that returns why nothing can be added before it, else empty.
    """

    def __init__(
        self,
        requester: Requester,
        curve: Array,
        program: Program,
        corrected: Callable[[Origin, RobTarget], RobTarget],
        why_undivided: Callable[[int], str],
    ) -> None:
        self.requester, self.curve, self.program = requester, curve, program
        self.corrected, self.why_undivided = corrected, why_undivided
        self.moves, self.samples = requester.motion.moves, requester.motion.samples

    @cached_property
    def _taken(self) -> set[str]:
        """The identifiers of the program, in lower case."""
        return set[str]().union(*(identifiers(source.data) for source in self.program.sources))

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
            except _Undivided as why:
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
            _Undivided: the targets suit no text, or not all runs.
        """
        for why in filter(None, map(self.why_undivided, indices)):
            raise _Undivided(why)
        event, before = self.moves[indices[0]].event, self.moves[indices[0] - 1].event
        texts = self._texts(event, before)
        middles = [] if event.via is None else [(a + b) / 2 for a, b in pairwise([0.0, *goals, 1.0])]
        shares = [*goals, *middles]
        runs = [self._run(i, shares, even=texts is not None and event.via is None) for i in indices]
        if texts is None and any(run.ends != runs[0].ends for run in runs):
            raise _Undivided(UNLIKE)
        targets = [self._target(runs, texts, k, share, within_mm) for k, share in enumerate(shares)]
        to, vias = targets[: len(goals)], targets[len(goals) :]
        if texts is not None:
            to = [_configured(target, runs, k) for k, target in enumerate(to)]
        zone = small_zone(self.program, event)
        added = [insertion_of(event, t, via, zone) for t, via in zip_longest(to, vias[:-1])]
        argument = event.statement.argument("via")
        if event.via is None or argument is None:
            return added, []
        # Its configuration means nothing, and q and -q are one orientation: both stay as they are written.
        form: Form = "numbers" if texts is None else "point"
        rot = vias[-1].pose.rot
        w, x, y, z = rot if np.dot(rot, event.via.rot) >= 0 else [-q for q in rot]
        last = replace(vias[-1], pose=replace(vias[-1].pose, rot=(w, x, y, z)), robconf=event.via.robconf)
        return added, [Change(event.statement.source, argument.span, form, last)]

    def _texts(self, event: MotionEvent, before: MotionEvent) -> tuple[str, ...] | None:
        """Expressions of start and goal, for an arc with the circle point between them; None if all are numbers.

        Args:
            event: the motion along the line or arc.
            before: the motion to its start, whose statement stands directly before.

        Raises:
            _Undivided: one of them cannot be used in a call.
        """
        module = event.statement.module
        arguments = [before.statement.argument("to"), event.statement.argument("via"), event.statement.argument("to")]
        origins = [before.target_origin, event.via_origin, event.target_origin]
        if all(origin is None or (origin.kind == "inline" and origin.handed is None) for origin in origins):
            return None
        names = LINE_NAMES if event.via is None else ARC_NAMES
        hidden = next((HIDDEN.format(name) for name in names if self.program.hides(name, module, "")), None)
        texts = [argument_text(a.text, self.program, module) for a in arguments if a is not None]
        if hidden is not None or None in texts:
            raise _Undivided(hidden or NO_PARTS)
        return tuple(text for text in texts if text is not None)

    def _run(self, i: int, shares: Sequence[float], *, even: bool) -> _Run:
        """The execution that is move i, with the targets that it needs at fractions of its way.

        Args:
            even: the tool turns evenly between the ends, as the function of a line has it.

        Raises:
            _Undivided: its start is not known, or lies in another work object, displacement or tool. A new calibration
                of one of them moves the line in a way that no expression of its ends follows.
        """
        samples, event, before = self.samples, self.moves[i].event, self.moves[i - 1].event
        rows = np.arange(samples.start[i], samples.goal[i] + 1)
        frames = [(e.wobj, e.displacement, e.tool) for e in (before, event)]
        if not isinstance(before.target, RobTarget) or frames[0] != frames[1] or len(rows) < 2:
            raise _Undivided(OTHER_FRAME)
        ends = [
            (before.target_origin, before.target),
            (event.via_origin, event.via),
            (event.target_origin, event.target),
        ]
        written = [self._written(o, t) for o, t in ends if o is not None and isinstance(t, RobTarget)]
        u, s = samples.u[rows], np.array(shares)
        shift = pose_error(samples.T_work_tcp[rows], self.curve[rows])
        needed = np.array([np.interp(s, u, column) for column in shift.T]).T
        chord = shift[0] + s[:, None] * (shift[-1] - shift[0])
        T = pose_in_space(samples.curves, np.full(len(s), i), s)
        T[:, :3, :3] = displace(needed)[:, :3, :3] @ T[:, :3, :3]
        if even:
            T[:, :3, :3] = Slerp([0, 1], Rotation.from_matrix(self.curve[rows[[0, -1]], :3, :3]))(s).as_matrix()
        T[:, :3, 3] += needed[:, :3]
        confs = confdata(self.requester.robot, self._joints(i, s, T))
        values = self.requester.values([(i, pose, conf_of(conf)) for pose, conf in zip(T, confs, strict=True)])
        values = [replace(v, extax=axes_between(before, event, x)) for v, x in zip(values, shares, strict=True)]
        return _Run(event, tuple(written), values, 1e3 * np.linalg.norm((needed - chord)[:, :3], axis=1))

    def _joints(self, i: int, shares: Array, T: Array) -> Array:
        """Joint angles (k, 6) [rad] in which the arm comes to poses (k, 4, 4) at fractions (k,) of move i.

        Near a straight wrist that may be another wrist than the inverse of the model has at a pose alone.
        """
        samples, exact = self.samples, self.requester.exact
        rows = np.arange(samples.start[i], samples.goal[i] + 1)
        others = rows[~np.isclose(samples.u[rows][:, None], shares).any(axis=1)]
        u, poses = np.concatenate([samples.u[others], shares]), np.concatenate([self.curve[others], T])
        order, move = np.argsort(u), np.full(len(u), i)
        end = np.array([len(u) - 1]), exact.q_goal[[i]]
        try:
            q = follow(
                self.requester.robot, samples.curves, move, u[order], poses[order], q_start=exact.q[rows[0]], ends=end
            )
        except PostprocError:  # the proof says where the arm cannot follow
            return np.array([np.interp(shares, samples.u[rows], column) for column in exact.q[rows].T]).T
        return np.asarray(q[np.argsort(order)][len(others) :])

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
        self, runs: Sequence[_Run], texts: tuple[str, ...] | None, k: int, share: float, within_mm: float
    ) -> TargetValue:
        """The k-th target for all runs, at a fraction of their ways, in the middle of what they need.

        Args:
            texts: expressions of the ends; None if they are numbers, as the target then is.
            within_mm: how far [mm] it may be from what each run needs, or half of what the run lacks there.

        Raises:
            _Undivided: the runs need different targets.
        """
        values = [run.values[k] for run in runs]
        places = np.array([value.pose.trans for value in values])
        if texts is not None:
            places -= [point_at(np.array([end.trans for end in run.ends]), share) for run in runs]
        most = [max(within_mm, run.lacks_mm[k] / 2) for run in runs]
        middle, length = midrange(places), 0
        off = np.linalg.norm(places - middle, axis=1)
        if (off > most).any() and texts is not None and len(texts) == 2:
            # What a line lacks goes with the square of its length.
            ends = np.array([[run.ends[0].trans, run.ends[-1].trans] for run in runs])
            lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            length = round(float(lengths.max()))
            bend = (lengths / length)[:, None] ** 2
            middle = (bend * places).sum(axis=0) / (bend**2).sum()
            off = np.linalg.norm(places - bend * middle, axis=1)
        if (off > most).any():
            raise _Undivided(UNLIKE)
        x, y, z = middle.tolist()
        if texts is not None:
            stem = LINE_FUNCTION if len(texts) == 2 else ARC_FUNCTION
            function = next(n for n in (stem, *(f"{stem}{k}" for k in range(2, 1000))) if n.lower() not in self._taken)
            point = PathPoint(function, texts, round(share, SHARE_DECIMALS), (x, y, z), length=length)
            return replace(values[0], point=point)
        if any(not compliant(value.robconf, values[0].robconf) for value in values):
            raise _Undivided(UNLIKE)
        return replace(values[0], pose=replace(values[0].pose, trans=(x, y, z)))


def _configured(target: TargetValue, runs: Sequence[_Run], k: int) -> TargetValue:
    """The k-th target as a point with quarter turns, the same for all runs, from the configuration of the nearer end.

    Without any where it has that configuration, or one that the controller accepts for that.

    Raises:
        _Undivided: the runs need different ones, or external axes do not move evenly between the ends.
    """
    assert target.point is not None
    share = target.point.share
    for run in runs:
        start, goal = (np.array(end.extax) for end in (run.ends[0], run.ends[-1]))
        if (np.abs(start + share * (goal - start) - run.values[k].extax) > AXIS_TOLERANCE).any():
            raise _Undivided(OTHER_AXES)
    pairs = [(run.ends[0 if share < 0.5 else -1].robconf, run.values[k].robconf) for run in runs]
    turns = {quarter_turns(end, conf) for end, conf in pairs}
    if len(turns) == 1 and (common := turns.pop()) is not None:
        return replace(target, point=replace(target.point, turns=common)) if any(common) else target
    accepted = (
        any_configuration(run.event) or compliant(conf, end) for run, (end, conf) in zip(runs, pairs, strict=True)
    )
    if not all(accepted):
        raise _Undivided(OTHER_POSTURE)
    return target


def argument_text(text: str, program: Program, module: str) -> str | None:
    """A target expression on one line for use in a call; None if evaluating it several times could have an effect.

    Args:
        text: the expression as it stands in the module.
    """
    text = " ".join(text.split())
    data = text.encode("latin-1")
    try:
        tree = read_full_expression(data, 0, len(data)) if "!" not in text else None
    except Unknown:
        return None
    if tree is None or any(isinstance(part, Star) for part in nodes(tree)):
        return None
    called = [part.name for part in nodes(tree) if isinstance(part, Call)]
    pure = all(name in FUNCTIONS and program.routine(name, module) is None for name in called)
    return text if pure else None


def quarter_turns(start: Conf, conf: Conf) -> Conf | None:
    """Quarter turns of axes 1, 4 and 6 from one confdata to another, and 1 where axis 5 has the other sign.

    None where shoulder or elbow differ. They are the same for targets taught anew with the other wrist: axes 4 and 6 of
    the whole line are then half a turn on.
    """
    other = start[3] ^ conf[3]
    return (conf[0] - start[0], conf[1] - start[1], conf[2] - start[2], other) if other < 2 else None


def point_at(points: Array, share: float) -> Array:
    """(3,) point at a fraction of the line between two points (2, 3), or of the arc through three (3, 3)."""
    if len(points) < 3:
        along: Array = points[0] + share * (points[1] - points[0])
        return along
    start, via, goal = points[:, None]
    center, radial, tangent, angle, _, _ = circle_through(start, via, goal)
    along = (center + np.cos(share * angle) * radial + np.sin(share * angle) * tangent)[0]
    return along
