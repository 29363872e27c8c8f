"""Targets to add: the text of each follows both ends of its line.

Where an end is a name or an expression, an added target is written with it, so that it goes where the ends go:

    P = (1 - s) S + s E + c

with the start S and the end E as the program calls them, the share s of the way, and the correction c: a constant;
where runs are lines of unlike lengths, what goes with the square of the length (the correction bends evenly); or what
goes with numbers that the statement names. Ends that are numbers give numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction.fewest_targets import Pieces
from postproc.compensate.text.arcs import UNLIKE, ArcRun, all_numbers, arc_run, follow_arc, function_name
from postproc.compensate.text.bends import fit_bend, is_steep, squares_of
from postproc.compensate.text.expressions import Position, position_of
from postproc.compensate.text.insertions import insertion_of, small_zone
from postproc.compensate.text.laws import (
    Allowed,
    OffsetLaw,
    constant_law,
    fit_affine,
    midrange,
    nearest_law,
)
from postproc.compensate.text.requests import Requester, conf_of
from postproc.compensate.text.values import UNCHANGED_MM, Change, Insertion, TargetValue, compliant
from postproc.grouping import grouped
from postproc.motion.path.places import axes_between
from postproc.motion.path.refusals import STILL
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.records import Ax6, RobTarget, Vec3
from postproc.rapid.program.program import Program
from postproc.robot.configuration import confdata

NO_START = "where its line begins has no name here"
OTHER_FRAME = "its line begins in another work object, displacement or tool, or at joint angles"
MAY_HAVE_CHANGED = "where its line begins, or its frame, may have been written since the arm was there"
FUNCTIONS = ("offs", "pow", "distance", "dotprod", "sqrt", "atan2", "cos", "sin")
OWN_FUNCTIONS = "the program has functions of its own by the names of those that a target between its ends needs"
TURNED = 1e-3  # of a quaternion, 0.1 deg: a target that is turned no more than that can be an end displaced
SHARE_DECIMALS = 4
NOTHING = Position(None)

_Set = tuple[list[Insertion], Change | None]  # what is added before a statement, and its circle point where that moves


@dataclass(frozen=True, slots=True)
class _Run:
    """One execution of a divided line or arc.

    Args:
        start, end: what its ends are made of; begins: where, if it begins at numbers, which are no part of ``start``.
        starts_at, ends_at: (3,) where these are, constants left out [mm]; constants: of both ends, as taught.
        added: the targets to add as numbers.
    """

    event: MotionEvent
    start: Position
    end: Position
    begins: object
    starts_at: Array
    ends_at: Array
    constants: tuple[Array, Array]
    end_target: RobTarget
    added: Sequence[Insertion]


@dataclass(frozen=True, slots=True)
class Added:
    """What is added.

    Args:
        refused: moves that cannot be divided, with the reason.
        circle_points: of divided arcs by move: what becomes of the circle point that stands in the statement.
    """

    insertions: Sequence[Insertion]
    refused: Mapping[int, str]
    circle_points: Mapping[int, Change]


class TargetAdder:
    """Adds targets to divided moves.

    Args:
        corrected: what a target is with what is written into its slot.
    """

    def __init__(
        self, requester: Requester, curve: Array, program: Program, corrected: Callable[[Origin, RobTarget], RobTarget]
    ) -> None:
        self.requester, self.curve, self.program, self.corrected = requester, curve, program, corrected
        self.moves, self.samples = requester.motion.moves, requester.motion.samples
        self.function = function_name(program)

    def add(self, pieces: Sequence[Pieces], path_mm: Array) -> Added:
        """Statements to add.

        Args:
            path_mm: (m,) largest deviation along each move [mm].
        """
        divided = {p.move: p for p in pieces if p.goals}
        if not divided:
            return Added([], {}, {})
        runs = grouped((m.event.statement.key, i) for i, m in enumerate(self.moves) if m.again is None)
        found: list[Insertion] = []
        refused: dict[int, str] = {}
        circle_points: dict[int, Change] = {}
        for group in runs.values():
            parts = [divided[i] for i in group if i in divided]
            if not parts:
                continue
            path = float(path_mm[group].min())
            gaps = [self._gap(part) for part in parts]  # the worst is to be halved, no run to be worse than without
            allowed = Allowed(path / 4, [max(path / 2, min(gap, max(gaps) / 2)) for gap in gaps])
            added = self._of_statement(parts, allowed) if len(parts) == len(group) else UNLIKE
            if not isinstance(added, str) and self._own_functions(self.moves[group[0]].event, added[0]):
                added = OWN_FUNCTIONS
            if isinstance(added, str):
                refused.update(dict.fromkeys(group, added))
                continue
            found += added[0]
            if added[1] is not None:
                circle_points.update(dict.fromkeys(group, added[1]))
        return Added(found, refused, circle_points)

    def _of_statement(self, parts: Sequence[Pieces], allowed: Allowed) -> _Set | str:
        """One set of statements for all runs, or why there is none."""
        event, before = self.moves[parts[0].move].event, self.moves[parts[0].move - 1].event
        if event.via is not None and not all_numbers(event, before):
            return self._of_arc(parts, allowed)
        if any(len(part.goals) != len(parts[0].goals) for part in parts):
            return UNLIKE
        goals = np.array([self.samples.u[list(part.goals)] for part in parts])
        shares = np.round(np.median(goals, axis=0), SHARE_DECIMALS).tolist()
        names = {self.moves[part.move].event.start for part in parts}  # what the program calls where they begin
        runs = [self._run(part, shares, names.pop() if len(names) == 1 else None) for part in parts]
        known = [run for run in runs if isinstance(run, _Run)]
        if len(known) < len(runs):
            return next(run for run in runs if isinstance(run, str))
        first = known[0]
        if any((r.start, r.end, r.begins) != (first.start, first.end, first.begins) for r in known):
            return UNLIKE
        found = []
        for k, insertions in enumerate(zip(*(run.added for run in known), strict=True)):
            one = self._added(known, insertions, shares[k], allowed)
            if one is None:
                return UNLIKE
            found.append(one)
        return found, None

    def _own_functions(self, event: MotionEvent, insertions: Sequence[Insertion]) -> bool:
        """Whether functions of the program's own hide those of RAPID by which the targets are written."""
        used = any(i.to.law is not None or i.to.arc is not None for i in insertions)
        return used and any(self.program.routine(name, event.statement.module) is not None for name in FUNCTIONS)

    def _of_arc(self, parts: Sequence[Pieces], allowed: Allowed) -> _Set | str:
        """The same for an arc."""

        def written(origin: Origin, target: RobTarget) -> Array:
            if origin.stands_in_statement:
                return np.array(target.trans)  # the text has these numbers as they were
            root = target if origin.root is None else origin.root.target
            moved = np.subtract(self.corrected(origin, root).trans, root.trans)
            return np.array(target.trans) + moved

        u = self.samples.u
        events = [(self.moves[p.move].event, self.moves[p.move - 1].event) for p in parts]
        runs = [arc_run(p, e, b, u, self.program, written=written) for p, (e, b) in zip(parts, events, strict=True)]
        known = [run for run in runs if isinstance(run, ArcRun)]
        if len(known) < len(runs):
            return next(run for run in runs if isinstance(run, str))
        confs = [conf_of(confdata(self.requester.robot, self.requester.exact.q[[p.vias[-1]]])[0]) for p in parts]
        asked = [(p.move, self.curve[p.vias[-1]], conf) for p, conf in zip(parts, confs, strict=True)]
        last = self.requester.values(asked)
        added = [self._numbers(part.move, part) for part in parts]
        return follow_arc(self.function, known, added, last, allowed) or UNLIKE

    def _run(self, part: Pieces, shares: Sequence[float], name: str | None) -> _Run | str:
        i = part.move
        event, before = self.moves[i].event, self.moves[i - 1].event
        module, argument = event.statement.module, event.statement.argument("to")
        assert argument is not None and isinstance(event.target, RobTarget)
        if event.touched or not _in_one_frame(before, event):
            return MAY_HAVE_CHANGED if event.touched else OTHER_FRAME
        added = self._numbers(i, part, shares)
        end = position_of(argument.text, event.target, self.program, module)
        start = self._start(before, event, name)
        if end is None:
            return "its target is an expression that cannot be taken apart"
        if start is None:
            return NO_START
        begins, ends = self._base(before), self._base(event)
        assert ends is not None
        try:
            places = start.at(begins, dict(before.numbers)), end.at(ends, dict(event.numbers))
        except KeyError:
            return NO_START
        constants = _constant(before, start), _constant(event, end)
        turned = event.target if end.reference is None else replace(event.target, rot=ends.rot)
        numbers = before.target if start.reference is None else None
        return _Run(event, start, end, numbers, *places, constants, turned, added)

    def _base(self, event: MotionEvent) -> RobTarget | None:
        """The target that the expression of an event starts from, as it is written now."""
        if not isinstance(event.target, RobTarget):
            return None
        origin = event.target_origin
        return self.corrected(origin, event.target if origin.root is None else origin.root.target)

    def _start(self, before: MotionEvent, event: MotionEvent, text: str | None) -> Position | None:
        """What the target before is made of, as far as the program can say it here; numbers that stand in it alone."""
        constant = NOTHING if before.target_origin.stands_in_statement else None
        module = event.statement.module
        if text is None or not isinstance(before.target, RobTarget):
            return constant
        return position_of(text, before.target, self.program, module) or constant

    def _numbers(self, i: int, part: Pieces, shares: Sequence[float] | None = None) -> list[Insertion]:
        """The statements to add before one move, their targets as numbers.

        Args:
            shares: of the way at the targets, where these are not those of the samples (of a line).
        """
        event = self.moves[i].event
        goals = list(part.goals)
        T = self.curve[goals].copy()
        if event.via is None and shares is not None:
            ends = self.curve[[self.samples.start[i], self.samples.goal[i]], :3, 3]
            T[:, :3, 3] += np.outer(np.subtract(shares, self.samples.u[goals]), ends[1] - ends[0])
        confs = [conf_of(row) for row in confdata(self.requester.robot, self.requester.exact.q[goals])]
        to = self.requester.values([(i, pose, c) for pose, c in zip(T, confs, strict=True)])
        shares = self.samples.u[goals].tolist()
        to = [
            replace(value, extax=axes_between(self.moves[max(i - 1, 0)].event, event, share))
            for value, share in zip(to, shares, strict=True)
        ]
        vias = self.requester.values([(i, self.curve[v], c) for v, c in zip(part.vias, confs, strict=False)])
        zone, parts = small_zone(self.program, event), np.diff(shares, prepend=0.0).tolist()
        return [insertion_of(event, t, vias[k] if vias else None, zone, parts[k]) for k, t in enumerate(to)]

    def _gap(self, part: Pieces) -> float:
        """Largest distance [mm] between the correction at the targets to add and its linear interpolation.

        The interpolation is between the corrections at start and goal of the move: what the path lacks without added
        targets. ``add`` derives from it how far an added target may be off in each run.
        """
        samples, goals, i = self.samples, list(part.goals), part.move
        shift = self.curve[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
        u = samples.u[goals][:, None]
        gaps: Array = (1 - u) * shift[samples.start[i]] + u * shift[samples.goal[i]] - shift[goals]
        return 1e3 * float(np.linalg.norm(gaps, axis=1).max())

    def _added(
        self, runs: Sequence[_Run], insertions: Sequence[Insertion], share: float, allowed: Allowed
    ) -> Insertion | None:
        """One statement for all runs, None where it would leave a run farther off than is allowed."""
        first, values = runs[0], [i.to for i in insertions]
        if any(not _still(v.extax, values[0].extax) or not compliant(v.robconf, values[0].robconf) for v in values):
            return None
        slopes = _combined(first.start, first.end, share)
        places = np.array([value.pose.trans for value in values])
        rest = places - [(1 - share) * run.starts_at + share * run.ends_at for run in runs]
        law = nearest_law(self._laws(runs, rest, share, allowed.fine), allowed)
        if law is None:
            return None
        alike = all(_turned_alike(v, run.end_target) for v, run in zip(values, runs, strict=True))
        base = first.end.reference if alike else None
        kept = tuple((text, _minus_base(text, direction, base)) for text, direction in slopes)
        if base is not None and f"{base}.trans.x" not in dict(slopes):
            kept = (*kept, *((f"{base}.trans.{a}", _axis(k, -1.0)) for k, a in enumerate("xyz")))
        kept = tuple((text, direction) for text, direction in kept if any(abs(d) > 1e-12 for d in direction))
        whole = OffsetLaw(law.constant, (*_differences(kept), *law.coefficients))
        to = replace(values[0], pose=replace(values[0].pose, trans=whole.constant))
        if base is not None:
            to = replace(to, law=whole)
        elif whole.coefficients:
            to = replace(to, law=replace(whole, constant=(0.0, 0.0, 0.0)))
        return replace(insertions[0], to=to, base=base)

    @staticmethod
    def _laws(runs: Sequence[_Run], rest: Array, share: float, fine: float) -> Iterator[tuple[OffsetLaw, Array]]:
        """What may be added to the share of the way (n, 3) [mm]: a constant, squares of the way, an affine law."""
        yield constant_law(rest)
        start, end = runs[0].start.reference, runs[0].end.reference
        ends = start is not None and end is not None and start != end
        squares: Mapping[str, Array] = {}
        if ends:
            ways = np.array([run.starts_at - run.ends_at for run in runs])
            # What ``Offs`` displaces both ends by is no part of the bend.
            plain = midrange(np.array([(1 - share) * r.constants[0] + share * r.constants[1] for r in runs]))
            lacks = rest - plain
            along = np.sum(lacks * ways, axis=1) / np.maximum(np.sum(ways**2, axis=1), UNCHANGED_MM)
            squares = squares_of(str(start), str(end), ways)
            bend, left = fit_bend(squares, lacks - along[:, None] * ways, fine)  # on the line any place will do
            yield replace(bend, constant=_vec(plain)), left
        for names in [(start, end), ()] if ends else [(start, end)]:
            regressors = [
                {n: v for n, v in run.event.numbers if n.partition(".trans.")[0] not in names} for run in runs
            ]
            if not names:  # ends that are displaced where they are used lack their own corrections, too
                for n, run in enumerate(regressors):
                    run.update((name, float(values[n])) for name, values in squares.items())
            law = fit_affine(regressors, rest, fine)
            if is_steep([slope for name, slope in law.coefficients if name in squares], squares):
                continue  # squares of ways that hardly differ
            yield law, rest - [law.at(run) for run in regressors]


def _constant(event: MotionEvent, position: Position) -> Array:
    """What numbers displace the target of an event by (3,) [mm]; zero where it has no name."""
    if position.reference is None or not isinstance(event.target, RobTarget):
        return np.zeros(3)
    root = event.target_origin.root
    base = event.target if root is None else root.target
    return np.array(event.target.trans) - position.at(base, dict(event.numbers))


def _in_one_frame(before: MotionEvent, event: MotionEvent) -> bool:
    """Whether both ends of a line go along with whatever moves its frame: a work object or a tool that is calibrated
    anew moves a line that begins in another, or at joint angles, to where no text can follow.
    """
    frames = [(e.wobj, e.displacement, e.tool) for e in (before, event)]
    return isinstance(before.target, RobTarget) and frames[0] == frames[1]


def _combined(start: Position, end: Position, share: float) -> list[tuple[str, Vec3]]:
    """What a place after a share of the way is made of: each text once."""
    found: dict[str, Array] = {}
    for position, part in ((start, 1 - share), (end, share)):
        for text, direction in position.all_terms:
            found[text] = found.get(text, np.zeros(3)) + part * np.array(direction)
    return [(text, _vec(direction)) for text, direction in found.items()]


def _minus_base(text: str, direction: Vec3, base: str | None) -> Vec3:
    """What is left of a term beside the target that is displaced."""
    for k, axis in enumerate("xyz"):
        if base is not None and text == f"{base}.trans.{axis}":
            return _vec(np.array(direction) - np.eye(3)[k])
    return direction


def _differences(terms: Sequence[tuple[str, Vec3]]) -> list[tuple[str, Vec3]]:
    """Terms that take each other back are one: ``s*S.trans.x-s*E.trans.x`` is ``s*(S.trans.x-E.trans.x)``."""
    found = list(terms)
    for text, direction in terms:
        axis = text[-1]
        for other, back in terms:
            apart = text != other and other.endswith(f".trans.{axis}") and text.endswith(f".trans.{axis}")
            if apart and direction["xyz".index(axis)] > 0 and np.allclose(np.add(direction, back), 0.0, atol=1e-12):
                found = [pair for pair in found if pair[0] not in (text, other)]
                found.append((f"({text}-{other})", direction))
    return found


def _turned_alike(added: TargetValue, end: RobTarget) -> bool:
    """Whether a target can be an end displaced: not turned, nor in another configuration."""
    turned = 1.0 - abs(float(np.dot(added.pose.rot, end.rot)))
    return turned <= TURNED**2 / 2 and added.robconf == end.robconf and _still(added.extax, end.extax)


def _still(a: Ax6, b: Ax6) -> bool:
    return bool(np.abs(np.subtract(a, b)).max() <= STILL)


def _axis(k: int, size: float) -> Vec3:
    return _vec(size * np.eye(3)[k])


def _vec(values: Array) -> Vec3:
    x, y, z = np.asarray(values).tolist()
    return x, y, z
