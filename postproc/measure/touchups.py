"""Targets that a person taught anew between two versions of a program, as rows of a measurement table.

Who touches up a target jogs the arm until the real tool is where the work is. So the joint angles of the touched target
go with the place that the first version states: one measurement of the arm, in a work object that may stand elsewhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Source, Span
from postproc.motion.path.moves import read_moves
from postproc.motion.path.places import place_events
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import JointTarget, Pose, RobTarget
from postproc.rapid.diff.compare import angle_between, by_statement, pair_statements
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Program
from postproc.robot.arm import Robot
from postproc.robot.cells.station import Station

TOUCHED_MM, TURNED_DEG = 0.05, 0.05
"""Distance and angle from which a target was touched up: pendants write hundredths of a millimetre."""
FARTHEST_MM = 50.0
"""Distance beyond which a target was programmed anew: no arm is so far off."""
SAME_MM, FEWEST_SHIFTED = 0.005, 3
"""Difference below which two moves are one, and so many of them no chance: a hand jogs no two targets alike."""
EXPRESSION = "displaced in the statement (`Offs`, `RelTool`): it follows the target that was taught"
SEVERAL = "used with several tools, work objects or loads: with which it was taught is not known"
ROBOT_HOLDS = "the robot holds the work: the tool stands still"
TURNED = "turned in place: the point is where it was"
ANEW = f"moved by more than {FARTHEST_MM:g} mm: programmed anew"
JOINTS = "joint angles, which state no place of the work"
POSTURE = "out of reach, or no known posture"

Key = tuple[object, ...]


@dataclass(frozen=True, slots=True, eq=False)
class TouchUp:
    """One target that was taught anew.

    Args:
        name: as the motion statement has it. event: of the touched program, to that target.
        nominal: (3,) where the nominal program says that the work is, in the work object [mm].
        moved: (3,) from there to the touched target [mm], in the work object. turned: angle between both [deg].
        move: joint angles, tool and load there; None where the arm has no known posture.
    """

    name: str
    event: MotionEvent
    nominal: Array
    moved: Array
    turned: float
    move: Move | None = None

    @property
    def distance(self) -> float:
        """Distance [mm] by which the target was moved."""
        return float(np.linalg.norm(self.moved))


@dataclass(frozen=True)
class TouchUps:
    """What two versions of a program tell of an arm.

    Args:
        rows: targets that were taught anew, each once.
        shifted: those that were moved by one vector, together with others of their work object.
        omitted: how many targets were changed and give no row, by reason.
        compared: targets that both versions have. station: the arm in its cell.
    """

    rows: tuple[TouchUp, ...] = ()
    shifted: tuple[TouchUp, ...] = ()
    omitted: Counter[str] = field(default_factory=Counter)
    compared: int = 0
    station: Station = Station()

    def __add__(self, other: TouchUps) -> TouchUps:
        """Return what this and another pair of programs tell together."""
        rows, shifted = self.rows + other.rows, self.shifted + other.shifted
        return TouchUps(rows, shifted, self.omitted + other.omitted, self.compared + other.compared, other.station)


def find_touchups(nominal: Program, touched: Program, robot: Robot, station: Station) -> TouchUps:
    """Return the targets that were taught anew from one version of a program to the other.

    Statements are paired as `diff` pairs them. A target counts once, by the place where its numbers stand; its joint
    angles are those of the touched program, with tool, work object and configuration that are in force there.
    """
    first, every = by_statement(walk(nominal)), place_events(walk(touched), station)
    second = by_statement(every)
    uses: dict[Key, list[TouchUp | str]] = {}
    for routine in pair_statements((nominal, first), (touched, second)).values():
        for x, y in routine:
            if x is not None and y is not None:
                for one, two in zip(first.get(x.key, []), second.get(y.key, []), strict=False):
                    for key, use in _uses(one, two):
                        uses.setdefault(key, []).append(use)
    omitted, taught = Counter[str](), list[TouchUp]()
    for several in uses.values():
        only = _one_of(several)
        if isinstance(only, str):
            omitted[only] += 1
        elif only is not None:
            taught.append(only)
    # The chain of the whole program tells the posture where confdata do not.
    index = {id(event): i for i, event in enumerate(every)}
    some = [use.event for use in taught]
    circle_points = [event for event in some if id(event) not in index]
    index |= {id(event): len(every) + i for i, event in enumerate(circle_points)}
    moves = {move.row: move for move in read_moves(robot, [*every, *circle_points], station=station)[0]}
    placed = [replace(use, move=moves.get(index[id(use.event)])) for use in taught]
    omitted += Counter({POSTURE: sum(use.move is None for use in placed)})
    rows = [use for use in placed if use.move is not None]
    pairs = list(zip(rows, _shifted(rows), strict=True))
    single, together = (tuple(use for use, along in pairs if along is so) for so in (False, True))
    return TouchUps(single, together, omitted, len(uses), station)


def _uses(one: MotionEvent, two: MotionEvent) -> Iterator[tuple[Key, TouchUp | str]]:
    """Yield target and circle point of paired executions: the key of the target, and its two places or why it has none.

    The reason is empty for a target that was not changed.
    """
    points = [("to", one.target, two.target, one.target_origin, two.target_origin)]
    points += [("via", one.via, two.via, one.via_origin or Origin("runtime"), two.via_origin or Origin("runtime"))]
    for role, was, now, origin_was, origin in points:
        key: Key = (origin.declaration, origin.spans) if origin.spans else (*two.statement.key, role)
        if isinstance(was, JointTarget) and isinstance(now, JointTarget):
            yield key, JOINTS if was.robax != now.robax else ""
        if not isinstance(was, RobTarget) or not isinstance(now, RobTarget) or two.reason is not None:
            continue
        if origin.declaration != origin_was.declaration:
            continue  # another target took its place
        change = _change(one, two, was, now)
        if max(change.distance / TOUCHED_MM, change.turned / TURNED_DEG) < 1:
            yield key, ""
        elif origin.root is not None or origin.kind in ("expression", "runtime"):
            yield (*key, "displaced"), EXPRESSION
        elif two.wobj.robhold or not two.tool.robhold:
            yield key, ROBOT_HOLDS
        elif change.distance < TOUCHED_MM:
            yield key, TURNED
        elif change.distance > FARTHEST_MM:
            yield key, ANEW
        else:
            event = two if role == "to" else replace(two, target=now, via=None, first=True, resumes_from=None)
            span = two.statement.span_of(role)
            source = two.statement.source if origin.handed is None else origin.handed.source
            text = source.data[slice(*(span if origin.handed is None else origin.handed.span))].decode("latin-1")
            name = text.strip() if text.strip()[0] not in "[*" else f"line {source.row(span[0])}"
            yield key, replace(change, name=name, event=event)


def _change(one: MotionEvent, two: MotionEvent, was: RobTarget, now: RobTarget) -> TouchUp:
    """Return both places of a target in its work object, program displacements included, without a name."""
    before = pose_mult(one.displacement, Pose(was.trans, was.rot))
    after = pose_mult(two.displacement, Pose(now.trans, now.rot))
    nominal = np.array(before.trans)
    return TouchUp("", two, nominal, np.array(after.trans) - nominal, angle_between(before.rot, after.rot))


def _one_of(uses: Sequence[TouchUp | str]) -> TouchUp | str | None:
    """Return the touch-up that the uses of one target have in common, or why there is none; None if not changed."""
    changed = [use for use in uses if use]
    if not changed:
        return None
    reason = next((use for use in changed if isinstance(use, str)), None)
    if reason is not None:
        return reason
    touched = [use for use in changed if isinstance(use, TouchUp)]
    conditions = {(u.event.tool, u.event.wobj, u.event.displacement, u.event.gripload) for u in touched}
    return SEVERAL if len(conditions) > 1 or len(changed) < len(uses) else touched[0]


def _shifted(rows: Sequence[TouchUp]) -> list[bool]:
    """Return for each touch-up whether `FEWEST_SHIFTED` places of its work object were moved by the same vector."""
    wobj = np.array([use.event.wobj.name for use in rows])
    moved, nominal = (np.array(x).reshape(-1, 3) for x in ([u.moved for u in rows], [u.nominal for u in rows]))
    result = []
    for k in range(len(rows)):
        same = (np.abs(moved - moved[k]).max(axis=1) < SAME_MM) & (wobj == wobj[k])
        result.append(len(np.unique(np.round(nominal[same], 3), axis=0)) >= FEWEST_SHIFTED)
    return result


def with_kept_originals(program: Program) -> list[Source]:
    """Return the files of a program with every touched-up target as it was before.

    ABB's option Absolute Limit ModPos keeps the original of a target `p50` beside it, as `o_p50`.
    """
    names = {d.key: d for d in program.declarations if d.init and d.type == "robtarget"}
    edits: dict[str, list[tuple[Span, bytes]]] = {}
    for key, original in names.items():
        scope, _, name = key.rpartition(".")
        touched = names.get(f"{scope}.{name.removeprefix('o_')}") if name.startswith("o_") else None
        if touched is not None and touched.init and original.init:
            text = original.source.data[slice(*original.init)]
            edits.setdefault(touched.source.path, []).append((touched.init, text))
    return [replace(source, data=_edited(source.data, edits.get(source.path, ()))) for source in program.sources]


def _edited(data: bytes, edits: Sequence[tuple[Span, bytes]]) -> bytes:
    """Return the bytes with each span replaced by a text."""
    for (start, end), text in sorted(edits, reverse=True):
        data = data[:start] + text + data[end:]
    return data
