"""Targets to add: where both ends are numbers as numbers, else by a function of both ends of the line or arc.

    P = slerp(S, E, s) + c

with the start S and the end E as the program calls them, the share s of the way, and the correction c in the axes of
the work object: a constant, or affine in numbers that the statement names (see `path_points`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.compensation.correction.fewest_targets import Pieces
from postproc.compensation.text.insertions import insertion_of, small_zone
from postproc.compensation.text.laws import Allowed, constant_law, nearest_law
from postproc.compensation.text.path_points import (
    ARC_FUNCTIONS,
    LINE_FUNCTIONS,
    UNLIKE,
    PathRun,
    argument_text,
    free_names,
    hidden_name,
    on_arc,
    on_line,
)
from postproc.compensation.text.requests import Requester, conf_of
from postproc.compensation.text.values import Change, Conf, Insertion, TargetValue, compliant
from postproc.diagnostics import PostprocError
from postproc.grouping import grouped
from postproc.motion.path.places import axes_between
from postproc.motion.path.postures import follow
from postproc.motion.path.refusals import STILL
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.records import RobTarget
from postproc.rapid.program.program import Program
from postproc.robot.configuration import confdata

NO_START = "where its line begins has no name here"
NO_PARTS = "a point of its way is an expression that cannot be worked out twice"
OTHER_FRAME = "its line begins in another work object, displacement or tool, or at joint angles"

_Set = tuple[list[Insertion], Change | None]  # what is added before a statement, and its circle point where that moves


@dataclass(frozen=True, slots=True)
class AddedTargets:
    """The statements to add.

    Args:
        insertions: these statements.
        refused: moves that cannot be divided, with the reason.
        circle_points: by move, the change of the circle point in the statement of a divided arc.
    """

    insertions: Sequence[Insertion]
    refused: Mapping[int, str]
    circle_points: Mapping[int, Change]


class TargetAdder:
    """Makes the statements to add for divided moves.

    Args:
        curve: (n, 4, 4) commanded poses.
        corrected: function of a target's origin and value that returns it with the numbers written into its slot.
    """

    def __init__(
        self, requester: Requester, curve: Array, program: Program, corrected: Callable[[Origin, RobTarget], RobTarget]
    ) -> None:
        self.requester, self.curve, self.program, self.corrected = requester, curve, program, corrected
        self.moves, self.samples = requester.motion.moves, requester.motion.samples

    @cached_property
    def functions(self) -> list[str]:
        """Names of the functions of points on a line (six) and on an arc (three), none of which the program has yet."""
        return free_names(self.program, (*LINE_FUNCTIONS, *ARC_FUNCTIONS))

    def add(self, pieces: Sequence[Pieces], tolerance_mm: Array) -> AddedTargets:
        """The statements to add so that divided moves keep their tolerance, one set for all runs of a statement.

        Moves whose runs cannot share one set are refused, with the reason.

        Args:
            pieces: how moves are divided, one for each move that may be.
            tolerance_mm: (m,) allowed deviation [mm] from the commanded curve along each move of the program.
        """
        divided = {p.move: p for p in pieces if p.goals}
        if not divided:
            return AddedTargets([], {}, {})
        runs = grouped((m.event.statement.key, i) for i, m in enumerate(self.moves) if m.resumes_from is None)
        found: list[Insertion] = []
        refused: dict[int, str] = {}
        circle_points: dict[int, Change] = {}
        for group in runs.values():
            parts = [divided[i] for i in group if i in divided]
            if not parts:
                continue
            path = float(tolerance_mm[group].min())
            gaps = [self._gap(part) for part in parts]  # the worst is to be halved, no run to be worse than without
            allowed = Allowed(path / 4, [max(path / 2, min(gap, max(gaps) / 2)) for gap in gaps])
            added = self._of_statement(parts, allowed) if len(parts) == len(group) else UNLIKE
            if isinstance(added, str):
                refused.update(dict.fromkeys(group, added))
                continue
            found += added[0]
            if added[1] is not None:
                circle_points.update(dict.fromkeys(group, added[1]))
        return AddedTargets(found, refused, circle_points)

    def _of_statement(self, parts: Sequence[Pieces], allowed: Allowed) -> _Set | str:
        """One list of added statements for all runs of a statement, or the reason why there is none.

        With it comes the change of the statement's own circle point, None for a line and where it stays.

        Args:
            parts: how each of the runs is divided.
            allowed: how far off [mm] an added target may be in each run.
        """
        event, before = self.moves[parts[0].move].event, self.moves[parts[0].move - 1].event
        if any(len(part.goals) != len(parts[0].goals) for part in parts):
            return UNLIKE
        frames = {self._frames(part.move) for part in parts} - {None}
        if frames:
            return max(str(why) for why in frames)
        if all_numbers(event, before):
            return self._as_numbers(parts, allowed)
        hidden = hidden_name(self.program, event.statement.module, arc=event.via is not None)
        if hidden is not None:
            return hidden
        names = {self.moves[part.move].event.start for part in parts}  # what the program calls where they begin
        runs = [self._run(part, next(iter(names)) if len(names) == 1 else None) for part in parts]
        known = [run for run in runs if isinstance(run, PathRun)]
        if len(known) < len(runs):
            return next(run for run in runs if isinstance(run, str))
        if any(run.texts != known[0].texts for run in known):
            return UNLIKE
        if event.via is None:
            shares = np.median([run.shares for run in known], axis=0)
            added = [self._numbers(part.move, part, shares.tolist()) for part in parts]
            lines = on_line(
                self.functions[: len(LINE_FUNCTIONS)], [replace(run, shares=shares) for run in known], added, allowed
            )
            return lines if isinstance(lines, str) else (lines, None)
        confs = [self._confs(p.move, p.vias[-1:], self.curve[list(p.vias[-1:])])[0] for p in parts]
        asked = [(p.move, self.curve[p.vias[-1]], conf) for p, conf in zip(parts, confs, strict=True)]
        added = [self._numbers(part.move, part) for part in parts]
        arc = self.functions[len(LINE_FUNCTIONS) :]
        return on_arc(arc, known, added, self.requester.values(asked), allowed)

    def _as_numbers(self, parts: Sequence[Pieces], allowed: Allowed) -> _Set | str:
        """Added statements with numbers as targets, between ends that are numbers, or the reason why there are none.

        The positions are half-way between the extremes that the runs require. No circle point is changed.

        Args:
            parts: how each of the runs is divided.
            allowed: how far off [mm] an added target may be in each run.
        """
        moves = [(self.moves[part.move - 1].event.target, self.moves[part.move].event) for part in parts]
        if any((start, e.target, e.via) != (moves[0][0], moves[0][1].target, moves[0][1].via) for start, e in moves):
            return UNLIKE
        found = []
        for insertions in zip(*(self._numbers(part.move, part) for part in parts), strict=True):
            values = [insertion.to for insertion in insertions]
            law = nearest_law([constant_law(np.array([value.pose.trans for value in values]))], allowed)
            if law is None or any(not _in_one_posture(value, values[0]) for value in values):
                return UNLIKE
            pose = replace(values[0].pose, trans=law.constant)
            found.append(replace(insertions[0], to=replace(values[0], pose=pose)))
        return found, None

    def _frames(self, i: int) -> str | None:
        """Why no expression of both ends of move i gives its added targets; None if one does.

        If the line begins in another work object, displacement or tool, or at joint angles, a new calibration of one of
        them moves the line in a way that no expression follows.
        """
        event, before = self.moves[i].event, self.moves[i - 1].event
        frames = [(e.wobj, e.displacement, e.tool) for e in (before, event)]
        return None if isinstance(before.target, RobTarget) and frames[0] == frames[1] else OTHER_FRAME

    def _run(self, part: Pieces, name: str | None) -> PathRun | str:
        """One execution of a move between ends that the text names, or the reason why there is no such text.

        Args:
            part: how it is divided.
            name: expression for its start, None where the program has none.
        """
        event, before = self.moves[part.move].event, self.moves[part.move - 1].event
        to, via = event.statement.argument("to"), event.statement.argument("via")
        literal = before.statement.argument("to")
        assert to is not None and isinstance(event.target, RobTarget) and isinstance(before.target, RobTarget)
        if name is None and literal is not None and _is_number(before.target_origin):
            name = literal.text
        if name is None:
            return NO_START
        ends = [(name, before.target_origin, before.target), (to.text, event.target_origin, event.target)]
        if event.via is not None and event.via_origin is not None and via is not None:
            ends.insert(1, (via.text, event.via_origin, event.via))
        texts = [argument_text(text, self.program, event.statement.module) for text, _, _ in ends]
        written = tuple(text for text in texts if text is not None)
        if len(written) < len(ends):
            return NO_PARTS
        targets = tuple(self._written(origin, target) for _, origin, target in ends)
        u = self.samples.u
        return PathRun(event, written, targets, u[list(part.goals)], u[list(part.vias)])

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

    def _numbers(self, i: int, part: Pieces, shares: Sequence[float] | None = None) -> list[Insertion]:
        """The statements to add before move i, with their targets as numbers.

        Args:
            part: how it is divided.
            shares: fractions of a line at which the targets are put, instead of those of the samples.
        """
        event = self.moves[i].event
        goals = list(part.goals)
        T = self.curve[goals].copy()
        if event.via is None and shares is not None:
            start, goal = self.curve[self.samples.start[i]], self.curve[self.samples.goal[i]]
            T[:, :3, 3] += np.outer(np.subtract(shares, self.samples.u[goals]), goal[:3, 3] - start[:3, 3])
            # The function turns evenly between the ends.
            R = Rotation.from_matrix(start[:3, :3])
            turn = (R.inv() * Rotation.from_matrix(goal[:3, :3])).as_rotvec()
            T[:, :3, :3] = (R * Rotation.from_rotvec(np.outer(shares, turn))).as_matrix()
        confs = self._confs(i, goals, T)
        to = self.requester.values([(i, pose, c) for pose, c in zip(T, confs, strict=True)])
        shares = self.samples.u[goals].tolist()
        to = [
            replace(value, extax=axes_between(self.moves[max(i - 1, 0)].event, event, share))
            for value, share in zip(to, shares, strict=True)
        ]
        of_vias = self._confs(i, part.vias, self.curve[list(part.vias)]) if part.vias else []
        vias = self.requester.values([(i, self.curve[v], c) for v, c in zip(part.vias, of_vias, strict=True)])
        zone = small_zone(self.program, event)
        return [insertion_of(event, t, vias[k] if vias else None, zone) for k, t in enumerate(to)]

    def _confs(self, i: int, rows: Sequence[int], T: Array) -> list[Conf]:
        """Confdata of the postures that the arm has on the commanded curve of move i at some samples.

        Near a straight wrist that may be another wrist than the inverse of the model has at the sample alone.

        Args:
            rows: indices of the samples, with poses T_work_tcp (k, 4, 4) in place of those of the curve.
        """
        samples = self.samples
        every = np.arange(samples.start[i], samples.goal[i] + 1)
        q, poses, chosen = self.requester.exact.q[every], self.curve[every].copy(), np.subtract(rows, every[0])
        poses[chosen] = T
        try:
            end = np.array([len(every) - 1]), self.requester.exact.q_goal[[i]]
            q = follow(self.requester.robot, samples.curves, samples.move[every], samples.u[every], poses, q[0], end)
        except PostprocError:
            pass  # the proof says where the arm cannot follow
        return [conf_of(row) for row in confdata(self.requester.robot, q[chosen])]

    def _gap(self, part: Pieces) -> float:
        """Largest distance [mm] between the correction at the targets to add and its linear interpolation.

        The interpolation is between the corrections at start and goal of the move: what the path lacks without added
        targets. ``add`` derives from it how far an added target may be off in each run.

        Args:
            part: how the move is divided.
        """
        samples, goals, i = self.samples, list(part.goals), part.move
        shift = self.curve[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
        u = samples.u[goals][:, None]
        gaps: Array = (1 - u) * shift[samples.start[i]] + u * shift[samples.goal[i]] - shift[goals]
        return 1e3 * float(np.linalg.norm(gaps, axis=1).max())


def all_numbers(event: MotionEvent, before: MotionEvent) -> bool:
    """Whether both ends of a line, or the three points of an arc, stand in their statements as numbers.

    Args:
        event: the motion along the line or arc.
        before: the motion to its start.
    """
    origins = (before.target_origin, event.target_origin, *([event.via_origin] if event.via is not None else []))
    return all(origin is not None and _is_number(origin) for origin in origins)


def _is_number(origin: Origin) -> bool:
    """Whether a target is written as numbers in its statement, not passed to it by a call."""
    return origin.kind == "inline" and origin.handed is None


def _in_one_posture(a: TargetValue, b: TargetValue) -> bool:
    """Whether one statement can lead to both targets: compatible configurations and equal external axes."""
    return compliant(a.robconf, b.robconf) and bool(np.abs(np.subtract(a.extax, b.extax)).max() <= STILL)
