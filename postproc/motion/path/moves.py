"""From motion events, in the units of the program, to moves in SI units with joint angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.motion.findings import in_turns, once, place
from postproc.motion.mounts import Mounts
from postproc.motion.path.arrivals import as_they_arrive
from postproc.motion.path.places import UNKNOWN_AXES, unit_of
from postproc.motion.path.postures import goal_joints
from postproc.motion.path.refusals import another_arm, doubt_weights, only_displaced, refuse_events
from postproc.motion.values import Move, WorkFrame, frames_at
from postproc.rapid.data.events import InForce, MotionEvent
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import forgiven
from postproc.rapid.motions.units import MM, object_matrix, pose_matrix, tool_matrix, via_matrix
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_RECORDED = 0.1  # [mm], [deg] beyond its limit an external axis still stands at it: positions are recorded, rounded
LOOSE = "nothing leads here"
UNKNOWN_POSTURE = "in which posture the arm comes here is not known, and what the target states does not exist"
NEAREST_TAKEN = (
    "the posture nearest to the last known one, or to all axes at zero, is taken: begin with a MoveAbsJ to be sure"
)
DISPLACED = "what displaces it in this run puts it there, not what it states"
_LEAST_ACCSET = 20.0  # [%] lower values count as this (ABB RAPID reference manual, AccSet)


def read_moves(
    robot: Robot, events: Sequence[MotionEvent], free_axes: str = "", station: Station | None = None
) -> tuple[list[Move], list[Diagnostic]]:
    """Moves of all events whose target is known, joint angles from one batch of inverse kinematics.

    A motion that is not understood, or has an error, breaks the path: the next move starts a new chain.

    Args:
        free_axes: letters of the external axes that carry neither the robot nor its work.
        station: where the arm stands, what moves it and its work; the events have then passed ``place_events``.

    Returns:
        The moves, and findings: KIN001 unreachable, KIN002 no such configuration, KIN003 joint limit, MOT006 speed,
        MOT007 tool and work object that do not fit together, MOT008 moving external axes, MOT011 and MOT012 weights;
        KIN008 a start posture that is assumed, KIN009 an arm that is hardly that of the program. Moves with an error
        are left out. The error becomes a warning where the arm never gets to the statement, or where a displacement of
        target or work alone puts the target out of reach (see ``only_displaced``).
    """
    known = [
        i
        for i, e in enumerate(events)
        if e.reason is None and e.target is not None and e.statement.interpolation != "none"
    ]
    conditions = {now: _conditions(now) for now in dict.fromkeys([events[i].in_force for i in known])}
    endless = [now for now in conditions if now.speed.v_tcp <= 0.0 or (now.duration is not None and now.duration <= 0)]
    at_goals = [conditions[events[i].in_force] for i in known]
    station = station or Station()
    places = _places([events[i] for i in known], station)
    q, T_work_tcp, failures, supposed = goal_joints(robot, events, known, _mounts(at_goals, places))
    refused = refuse_events(events, free_axes, station)
    beyond = _beyond_limits(events, known, station, places)
    astray = {i for i, _ in beyond}
    failed = [(i, f) for f in failures if (i := known[f.index]) not in astray]
    wrong = [(i, in_turns(f.diagnostic(*place(events[i])), events[i])) for i, f in failed]
    lost = {i: finding.code for i, finding in wrong}
    runs = [(events[i], lost.get(i)) for i in known]
    another = another_arm(robot, runs)
    spared = only_displaced(runs) if not another else ()
    wrong = [(i, _as_warning(d, DISPLACED) if events[i].statement.key in spared else d) for i, d in wrong]
    for i in [i for i in known if endless and events[i].in_force in endless]:
        text = "the programmed speed is zero or negative: the arm would never arrive"
        slow = Diagnostic("MOT006", "error", text, *place(events[i], "speed"), "give a speed above zero")
        wrong.append((i, in_turns(slow, events[i])))
    bad = {i for i, _ in wrong} | astray | {i for i, _ in refused if events[i].unreachable}
    findings = [_as_warning(d, LOOSE) if events[i].unreachable else d for i, d in (*refused, *wrong)]
    findings += [finding for _, finding in beyond]
    findings += doubt_weights(robot, [events[i] for i in known if not events[i].unreachable])
    findings += [
        Diagnostic("KIN008", "warning", UNKNOWN_POSTURE, *place(events[known[k]]), NEAREST_TAKEN) for k in supposed
    ]
    findings += another
    moves: list[Move] = []
    for row, (i, fields) in enumerate(zip(known, at_goals, strict=True)):
        e, (frame, axes), kind = events[i], places[row], events[i].statement.interpolation
        if i in bad or kind == "none":
            continue
        via = via_matrix(e) if kind == "arc" and e.via is not None else None
        goal = T_work_tcp[row] if isinstance(e.target, RobTarget) else None
        moves.append(Move(i, e, kind, q[row], T_work_tcp=goal, T_work_via=via, frame=frame, axes=axes, **fields))
    return as_they_arrive(robot, _chained(events, moves)), once(findings)


def _chained(events: Sequence[MotionEvent], moves: Sequence[Move]) -> list[Move]:
    """The moves, with the first of every chain marked.

    A motion between two moves that is not understood, or has an error, breaks their chain. A move that restates the
    goal of an earlier one (``resumes_from``) becomes that one again; it is left out where that one is.
    """
    chained: list[Move] = []
    of_event: dict[int, int] = {}
    previous = -1
    for move in moves:
        i, e = move.row, move.event
        broken = e.start_unknown or not chained
        if not broken and previous + 1 < i:
            broken = any(e.statement.interpolation != "none" or e.reason is not None for e in events[previous + 1 : i])
        if e.resumes_from is not None:
            if e.resumes_from not in of_event:
                continue  # nothing brings the arm there
            before = of_event[e.resumes_from]
            move = replace(chained[before], row=i, event=e, starts_chain=True, resumes_from=before)
        elif broken:
            move = replace(move, starts_chain=True)
        of_event[i] = len(chained)
        chained.append(move)
        previous = i
    return chained


_Place = tuple[WorkFrame | None, Array]  # what the work stands in, external axes (6,) [m], [rad]


def _places(events: Sequence[MotionEvent], station: Station) -> list[_Place]:
    """For every event the frame that its work stands in (None: a fixed base) and its external axes (6,) [m], [rad]."""
    unit_in = {now: unit_of(now) for now in {e.in_force for e in events}}
    units = [unit_in[e.in_force] for e in events]
    frames = {unit: WorkFrame(station, unit) for unit in dict.fromkeys(units)}
    axes = station.positions(np.array([e.axes or UNKNOWN_AXES for e in events]).reshape(-1, 6))
    fixed = station.in_world
    rows = [np.full(6, np.nan)] * len(units) if np.isnan(axes).all() else axes
    return [(None if fixed and unit is None else frames[unit], row) for unit, row in zip(units, rows, strict=True)]


def _mounts(conditions: Sequence[Mapping[str, Any]], places: Sequence[_Place]) -> Mounts:
    """How tool and work are mounted at the goals of k events.

    Args:
        conditions: what is in force at each event.
        places: frame of the work and external axes at each event.
    """
    tools = np.array([c["T_mount_tcp"] for c in conditions]), np.array([c["stationary"] for c in conditions])
    frames = list(dict.fromkeys([frame for frame, _ in places]))
    if not any(frames):
        return Mounts(*tools)
    which = np.array([frames.index(frame) for frame, _ in places])
    return Mounts(*tools, frames_at(frames, which, np.array([axes for _, axes in places])), which)


def _beyond_limits(
    events: Sequence[MotionEvent], known: Sequence[int], station: Station, places: Sequence[_Place]
) -> list[tuple[int, Diagnostic]]:
    """Index of the event and KIN003, a warning, for each external axis more than 0.1 mm or degree beyond a limit.

    Args:
        events: all of the program.
        known: (k,) indices of the events to look at.
        station: states the limits.
        places: (k,) frame of the work and positions of the external axes there.
    """
    findings = []
    for letter, joint in station.joints.items():
        lower, upper = (
            (-np.inf if joint.lower is None else joint.lower),
            (np.inf if joint.upper is None else joint.upper),
        )
        value = np.array([axes[LETTERS.index(letter)] for _, axes in places])
        scale, unit = (1e3, "mm") if joint.kind == "linear" else (np.degrees(1.0), "deg")
        for row in np.flatnonzero(scale * np.maximum(lower - value, value - upper) > _RECORDED).tolist():
            text = (
                f"eax_{letter} at {scale * value[row]:.1f} {unit}, allowed are {scale * lower:.1f} to"
                f" {scale * upper:.1f} {unit}"
            )
            help_ = "change the target, or the limits that the cell states"
            event = events[known[row]]
            beyond = Diagnostic("KIN003", "warning", text, *place(event), help_)
            findings.append((known[row], in_turns(beyond, event)))
    return findings


def _as_warning(finding: Diagnostic, why: str) -> Diagnostic:
    """An error as a warning that adds why its statement stays uncorrected; other findings unchanged."""
    if finding.severity != "error":
        return finding
    return replace(forgiven(finding), message=f"{finding.message}; it is left as it is: {why}")


def _conditions(e: InForce) -> dict[str, Any]:
    """Fields of a ``Move`` that what is in force at it decides: mount, load, speeds and zone, in SI units.

    Tool load (centre in tool0) and GripLoad (centre in the tool frame) count as one mass. The tool load of a stationary
    tool is that of the gripper which holds the work object, and the centre of GripLoad is then stated in the object
    frame (ABB RAPID reference manual, tooldata and loaddata).
    """
    tool, grip = e.tool, e.gripload
    T_mount_tcp = tool_matrix(tool)
    mass = tool.tload.mass + grip.mass
    tool_center = pose_matrix(tool.tload.cog, _UPRIGHT)[:3, 3]
    T_flange_grip = T_mount_tcp if tool.robhold else object_matrix(e.wobj)
    grip_center = (T_flange_grip @ pose_matrix(grip.cog, _UPRIGHT))[:3, 3]
    center = (tool.tload.mass * tool_center + grip.mass * grip_center) / mass if mass > 0 else np.zeros(3)
    welding = e.weld is not None and e.weld.phase != "start"
    speed = e.speed.v_tcp * e.velocity_override / 100  # VelSet scales it, and sets an upper limit
    speed = speed if e.velocity_limit is None else min(speed, e.velocity_limit)
    speed = e.weld.speed if welding and e.weld is not None and e.weld.speed else speed
    return dict(
        T_mount_tcp=T_mount_tcp,
        stationary=not tool.robhold,
        payload_mass=mass,
        payload_center=center,
        speed=speed * MM,
        rotation_speed=float(np.radians(e.speed.v_ori)) * e.velocity_override / 100,
        duration=e.duration,
        axis_speed={"linear": e.speed.v_leax * MM, "rotary": float(np.radians(e.speed.v_reax))},
        ease=min(max(e.acceleration, _LEAST_ACCSET), 100.0) / 100,
        fine=e.zone.finep,
        zone=e.zone.pzone_tcp * MM,
        zone_rotation=e.zone.pzone_ori * MM,
        zone_angle=float(np.radians(e.zone.zone_ori)),
        welding=welding,
    )
