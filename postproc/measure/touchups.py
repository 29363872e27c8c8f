"""Targets that a person taught anew between two versions of a program, as rows of a measurement table.

Who touches up a target jogs the arm until the real tool is where the work is. So the joint angles of the touched target
go with the place that the first version states: one measurement of the arm, in a work object that may stand elsewhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Source
from postproc.grouping import grouped
from postproc.motion.path.moves import read_moves
from postproc.motion.path.places import place_events
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import JointTarget, Pose, RobTarget
from postproc.rapid.diff.compare import angle_between, by_statement, pair_statements
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.spans import Edit, edited
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
        moved: (3,) from there to the touched target [mm], in the work object.
        move: joint angles, tool and load there; None where the arm has no known posture.
    """

    name: str
    event: MotionEvent
    nominal: Array
    moved: Array
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

    @property
    def state(self) -> State:
        """States of the arm at the rows, with tool and load."""
        moves = [use.move for use in self.rows if use.move is not None]
        q, T, mass, center = map(
            np.array, zip(*((m.q, m.T_mount_tcp, m.payload_mass, m.payload_center) for m in moves), strict=True)
        )
        return State(q, T_flange_tcp=T, payload_mass=mass, payload_center=center)

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
    uses = grouped(
        use
        for pairs in pair_statements((nominal, first), (touched, second)).values()
        for x, y in pairs
        if x is not None and y is not None
        for one, two in zip(first.get(x.key, []), second.get(y.key, []), strict=False)
        for use in _uses(one, two)
    )
    results = [_one_of(several) for several in uses.values()]
    taught = [use for use in results if isinstance(use, TouchUp)]
    # The chain of the whole program tells the posture where confdata do not; circle points stand behind it.
    chain = list({id(event): event for event in [*every, *(use.event for use in taught)]}.values())
    moves = {id(chain[move.row]): move for move in read_moves(robot, chain, station=station)[0]}
    rows = [replace(use, move=moves[id(use.event)]) for use in taught if id(use.event) in moves]
    omitted = Counter(reason for reason in results if isinstance(reason, str) and reason)
    omitted += Counter({POSTURE: len(taught) - len(rows)})
    together = _shifted(rows)
    single, shifted = tuple(compress(rows, ~together)), tuple(compress(rows, together))
    return TouchUps(single, shifted, omitted, len(uses), station)


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
        places = (one.displacement, was), (two.displacement, now)
        before, after = (pose_mult(displacement, Pose(x.trans, x.rot)) for displacement, x in places)
        event = two if role == "to" else replace(two, target=now, via=None, first=True, resumes_from=None)
        nominal = np.array(before.trans)
        use = TouchUp("", event, nominal, np.array(after.trans) - nominal)
        turned = angle_between(before.rot, after.rot) >= TURNED_DEG
        reasons = {
            "": use.distance < TOUCHED_MM and not turned,
            EXPRESSION: origin.root is not None or origin.kind in ("expression", "runtime"),
            ROBOT_HOLDS: two.wobj.robhold or not two.tool.robhold,
            TURNED: use.distance < TOUCHED_MM,
            ANEW: use.distance > FARTHEST_MM,
        }
        reason = next((reason for reason, applies in reasons.items() if applies), None)
        if reason is None:
            source, span = two.statement.source, two.statement.span_of(role)
            if origin.handed is not None:
                source, span = origin.handed.source, origin.handed.span
            text = source.data[slice(*span)].decode("latin-1").strip()
            use = replace(use, name=text if text[0] not in "[*" else f"line {source.row(span[0])}")
        yield key, use if reason is None else reason


def _one_of(uses: Sequence[TouchUp | str]) -> TouchUp | str:
    """Return the touch-up that the uses of one target have in common, or why there is none; empty if not changed."""
    touched = [use for use in uses if isinstance(use, TouchUp)]
    reason = next((use for use in uses if isinstance(use, str) and use), "")
    if reason or not touched:
        return reason
    conditions = {(u.event.tool, u.event.wobj, u.event.displacement, u.event.gripload) for u in touched}
    return SEVERAL if len(conditions) > 1 or len(touched) < len(uses) else touched[0]


def _shifted(rows: Sequence[TouchUp]) -> NDArray[np.bool_]:
    """Return (n,) whether `FEWEST_SHIFTED` places of its work object were moved by the same vector as a touch-up."""
    wobj = np.array([use.event.wobj.name for use in rows])
    moved, nominal = (np.array(x).reshape(-1, 3) for x in ([u.moved for u in rows], [u.nominal for u in rows]))
    result = np.zeros(len(rows), dtype=bool)
    for k in range(len(rows)):
        same = (np.abs(moved - moved[k]).max(axis=1) < SAME_MM) & (wobj == wobj[k])
        result[k] = len(np.unique(np.round(nominal[same], 3), axis=0)) >= FEWEST_SHIFTED
    return result


def with_kept_originals(program: Program) -> list[Source]:
    """Return the files of a program with every touched-up target as it was before.

    ABB's option Absolute Limit ModPos keeps the original of a target `p50` in the same module, as `o_p50`.
    """
    spans = {d.key: (d.source, d.init) for d in program.declarations if d.init and d.type == "robtarget"}
    edits: dict[str, list[Edit]] = {}
    for key, (source, init) in spans.items():
        scope, _, name = key.rpartition(".")
        original = spans.get(f"{scope}.o_{name}")
        if original is not None:
            text = original[0].data[slice(*original[1])]
            edits.setdefault(source.path, []).append(Edit(*init, text))
    return [replace(s, data=b"".join(edited(s.data, edits.get(s.path, ())))) for s in program.sources]
