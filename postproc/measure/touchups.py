"""Targets that a person taught anew between two versions of a program, as rows of a measurement table.

Who touches up a target jogs the arm until the real tool is where the work is. So the joint angles of the touched target
go with the place that the first version states: one measurement of the arm, in a work object that may stand elsewhere.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from itertools import compress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, invert
from postproc.channels.state import State
from postproc.compensation.correction.rigid_shift import fit_rigid
from postproc.diagnostics import Diagnostic, Source
from postproc.grouping import grouped
from postproc.measure.read import columns as names
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.motion.path.moves import read_moves
from postproc.motion.path.places import UNKNOWN_AXES, place_events, unit_of
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import JointTarget, Pose, RobTarget
from postproc.rapid.diff.compare import angle_between, by_statement, pair_statements
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import MM, object_matrix
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.spans import Edit, edited
from postproc.robot.arm import Robot
from postproc.robot.cells.station import Station
from postproc.robot.kinematics import forward
from postproc.robot.pose import transform

TOUCHED_MM, TURNED_DEG = 0.05, 0.05
"""Distance and angle from which a target was touched up: pendants write hundredths of a millimetre."""
FARTHEST_MM = 50.0
"""Distance beyond which a target was programmed anew: no arm is so far off."""
SAME_MM, FEWEST_SHIFTED = 0.005, 3
"""Difference below which two moves are one, and so many of them no chance: a hand jogs no two targets alike."""
UNKNOWN_SHARE = 0.5
"""Standard deviation of the share of the deflection that touch-ups tell, from which they tell little."""
DISPLACED_IN_STATEMENT = "displaced in the statement (`Offs`, `RelTool`): it follows the target that was taught"
SEVERAL_CONDITIONS = "used with several tools, work objects or loads: with which it was taught is not known"
ROBOT_HOLDS = "the robot holds the work: the tool stands still"
TURNED = "turned in place: the point is where it was"
PROGRAMMED_ANEW = f"moved by more than {FARTHEST_MM:g} mm: programmed anew"
JOINTS = "joint angles, which state no place of the work"
POSTURE = "out of reach, or no known posture"


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
        columns = ((m.q, m.T_mount_tcp, m.payload_mass, m.payload_center) for m in moves)
        q, T, mass, center = map(np.array, zip(*columns, strict=True))
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
        for pairs in pair_statements(nominal, touched, first, second).values()
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


def _uses(one: MotionEvent, two: MotionEvent) -> Iterator[tuple[tuple[object, ...], TouchUp | str]]:
    """Yield target and circle point of paired executions: the key of the target, and its two places or why it has none.

    The reason is empty for a target that was not changed.
    """
    points = [("to", one.target, two.target, one.target_origin, two.target_origin)]
    points += [("via", one.via, two.via, one.via_origin or Origin("runtime"), two.via_origin or Origin("runtime"))]
    for role, was, now, origin_was, origin in points:
        key = (origin.declaration, origin.spans) if origin.spans else (*two.statement.key, role)
        if isinstance(was, JointTarget) and isinstance(now, JointTarget):
            yield key, JOINTS if was.robax != now.robax else ""
        replaced = origin.declaration != origin_was.declaration
        if not isinstance(was, RobTarget) or not isinstance(now, RobTarget) or replaced:
            continue
        if two.reason is not None:  # with a tool, frame or load that nobody knows
            yield key, SEVERAL_CONDITIONS if was != now else ""
            continue
        places = (one.displacement, was), (two.displacement, now)
        before, after = (pose_mult(displacement, Pose(x.trans, x.rot)) for displacement, x in places)
        event = two if role == "to" else replace(two, target=now, via=None, start_unknown=True, resumes_from=None)
        nominal = np.array(before.trans)
        use = TouchUp("", event, nominal, np.array(after.trans) - nominal)
        turned = angle_between(before.rot, after.rot) >= TURNED_DEG
        reasons = {
            "": use.distance < TOUCHED_MM and not turned,
            DISPLACED_IN_STATEMENT: origin.root is not None or origin.kind in ("expression", "runtime"),
            ROBOT_HOLDS: two.wobj.robhold or not two.tool.robhold,
            TURNED: use.distance < TOUCHED_MM,
            PROGRAMMED_ANEW: use.distance > FARTHEST_MM,
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
    return SEVERAL_CONDITIONS if len(conditions) > 1 or len(touched) < len(uses) else touched[0]


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


def touchup_table(touchups: TouchUps, sources: Sequence[Source], noise_mm: float, free: bool) -> str:
    """Return the rows of touch-ups as a measurement table (CSV), headed by the programs that they came from.

    Args:
        sources: files of the touched programs. noise_mm: standard deviation of a touch-up per axis.
        free: points are in their work objects, each of which is a session with a place of its own; else in the frame in
            which the work objects stand.
    """
    state = touchups.state
    T_object = np.array([_placed(use, touchups.station) for use in touchups.rows])
    T_point = transform(np.array([use.nominal for use in touchups.rows]) * MM)
    if not free:
        T_object, T_point = np.tile(np.eye(4), (len(state), 1, 1)), T_object @ T_point
    blocks = [
        (names.JOINT_COLUMNS, np.degrees(state.q), ".6f"),
        (names.POSITION, T_point[:, :3, 3] / MM, ".4f"),
        (names.TOOL_POSITION, state.T_flange_tcp[:, :3, 3] / MM, ".4f"),
        (names.TOOL_ORIENTATION, _quaternions(state.T_flange_tcp), ".9f"),
        (names.PAYLOAD_COLUMNS[:1], np.asarray(state.payload_mass)[:, None], ".6g"),
        (names.PAYLOAD_COLUMNS[1:], np.asarray(state.payload_center) / MM, ".3f"),
        (("sigma_mm",), np.full((len(state), 1), noise_mm), "g"),
        (names.EXTERNAL_AXES, np.array([use.event.axes or UNKNOWN_AXES for use in touchups.rows]), ".6g"),
        (names.OBJECT_POSITION, T_object[:, :3, 3] / MM, ".4f"),
        (names.OBJECT_ORIENTATION, _quaternions(T_object), ".9f"),
    ]
    columns = {"pose_id": [use.name for use in touchups.rows]}
    for header, values, form in blocks:
        cells = [[format(x, form) if np.isfinite(x) else "" for x in column] for column in values.T.tolist()]
        columns |= {name: column for name, column in zip(header, cells, strict=True) if any(column)}
    if free:
        columns["session"] = [use.event.wobj.name for use in touchups.rows]
    out = io.StringIO()
    for source in sources:
        out.write(f"# touched-up program: {Path(source.path).name} sha256 {sha256(source.data).hexdigest()}\n")
    csv.writer(out, lineterminator="\n").writerows([columns, *zip(*columns.values(), strict=True)])
    return out.getvalue()


def share_deviation(touchups: TouchUps, model: Model, noise_mm: float, free: bool) -> float:
    """Return the standard deviation of the share of the arm's expected deflection that touch-ups tell.

    With d_i the deflection of the model at a row, less the rigid motion of its work object that fits them best where
    that is free, and s the noise, a factor k of all deflections is known to s / sqrt(sum |d_i|^2).
    """
    state, wobj = touchups.state, np.array([use.event.wobj.name for use in touchups.rows])
    nominal = (forward(model.robot, state.q) @ state.T_flange_tcp)[:, :3, 3]
    deflection = predict(Model(model.robot, model.effects, model.R_world_base), state)[:, :3, 3] - nominal
    for rows in (wobj == name for name in set(wobj.tolist()) if free):
        center, shift, turn = fit_rigid(nominal[rows], deflection[rows])
        deflection[rows] -= shift + np.cross(turn, nominal[rows] - center)
    squares = np.sum(deflection**2)
    return float(noise_mm * MM / np.sqrt(squares)) if squares > 0 else np.inf


def touchup_findings(touchups: TouchUps, deviation: float | None, sources: Sequence[Source]) -> Iterator[Diagnostic]:
    """Yield what touch-ups cannot tell: targets that were moved together (DAT050), too few postures (DAT051).

    DAT052 (error) where no target was touched up.

    Args:
        deviation: of `share_deviation`, None where no model is known. sources: files of the touched programs.
    """
    moves = grouped(((u.event.wobj.name, tuple(np.round(u.moved, 2).tolist())), u) for u in touchups.shifted)
    for (wobj, vector), some in moves.items():
        message = f"{len(some)} targets in `{wobj}` were moved by the same vector {list(vector)} mm: "
        message += "whether the arm or the work was off cannot be told, and they give no rows"
        help_ = "touch up each of these targets by itself, or correct the work object in place of its targets"
        statement = some[0].event.statement
        yield Diagnostic("DAT050", "warning", message, statement.source, statement.span, help_)
    if not touchups.rows and not moves:
        reasons = "; ".join(f"{count} {reason}" for reason, count in touchups.omitted.items())
        message = f"none of {touchups.compared} targets was touched up" + (f": {reasons}" if reasons else "")
        help_ = "name the version before and the one after touching up, in this order; both need the same routines"
        yield Diagnostic("DAT052", "error", message, help=help_)
    if deviation is not None and deviation > UNKNOWN_SHARE:
        message = f"these {len(touchups.rows)} postures hardly tell the arm from the place of its work: how far the "
        message += f"arm yields is known to {100 * min(deviation, 9.99):.0f} % of itself, for a shift of the work does "
        message += "the same"
        help_ = "add targets near and far, high and low; or say `--wobj-fixed` where the place of the work was measured"
        yield Diagnostic("DAT051", "warning", message, next(iter(sources), None), help=help_)


def _placed(use: TouchUp, station: Station) -> Array:
    """Return the work object (4, 4) [m] of a touch-up in the frame of tables: the unit that carries work, or the world.

    Axes that nobody states stand at 0, as for a table without their columns.
    """
    positions = station.positions(np.nan_to_num([use.event.axes or UNKNOWN_AXES]))
    units = unit_of(use.event), station.work
    frame, reference = (np.eye(4) if unit is None else station.world(unit, positions)[0] for unit in units)
    return np.asarray(invert(reference) @ frame @ object_matrix(use.event.wobj))


def _quaternions(T: Array) -> Array:
    """Return the orientations (n, 4) of poses (n, 4, 4), scalar first."""
    return np.asarray(Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True, scalar_first=True))
