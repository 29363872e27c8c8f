"""From motion events, in the units of the program, to moves in SI units with joint angles."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.motion.findings import once, place
from postproc.motion.mounts import Mounts
from postproc.motion.refusals import refuse_events
from postproc.motion.values import Move
from postproc.motion.weights import doubt_weights, in_metres
from postproc.rapid.events import MotionEvent
from postproc.rapid.records import JointTarget, LoadData, RobTarget, ToolData, WobjData
from postproc.rapid.units import MM, object_matrix, pose_matrix, target_matrices, tool_matrix, via_matrix
from postproc.rapid.walk import forgiven
from postproc.robot.arm import Robot
from postproc.robot.inverse import Failure, joint_solution, nearest_solution
from postproc.robot.track import track

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_LEAST_ACCSET = 20.0  # [%] lower values count as this (ABB RAPID reference manual, AccSet)


@dataclass(frozen=True, slots=True)
class _Held:
    """Mount of the tool and load on the flange: T_mount_tcp (4, 4), mass [kg], center (3,) [m] in tool0."""

    T_mount_tcp: Array
    stationary: bool
    mass: float
    center: Array


def read_moves(robot: Robot, events: Sequence[MotionEvent], free_axes: str = "") -> tuple[list[Move], list[Diagnostic]]:
    """Moves of all events whose target is known, joint angles from one batch of inverse kinematics.

    An event without target, or left alone for another reason, breaks the path: the next move starts a chain.

    Args:
        free_axes: see ``refuse_events``.

    Returns:
        The moves, and findings: KIN001 unreachable, KIN002 no such configuration, KIN003 joint limit, MOT006 speed,
        MOT007 tool and work object that do not fit together, MOT008 moving external axes, MOT011 and MOT012 weights;
        KIN008 a start that is supposed, KIN009 an arm that hardly is the one of the program.
        Moves with an error are left out, and the chain breaks there; where nothing leads to them it is a warning.
    """
    known = [i for i, e in enumerate(events) if e.reason is None and e.target is not None and _moves_arm(e)]
    held: dict[tuple[ToolData, LoadData, WobjData], _Held] = {}
    loads = []
    for i in known:
        key = (events[i].tool, events[i].gripload, events[i].wobj)
        if key not in held:
            held[key] = _on_flange(*key)
        loads.append(held[key])
    q, T_work_tcp, failures, supposed = _solve(robot, events, known, loads)
    refused = refuse_events(events, free_axes)
    wrong = [(known[f.index], f.diagnostic(*place(events[known[f.index]]))) for f in failures]
    wrong += [(i, _never_arrives(events[i])) for i in known if not _arrives(events[i])]
    bad = {i for i, _ in wrong} | {i for i, _ in refused if events[i].loose}
    findings = [forgiven(finding) if events[i].loose else finding for i, finding in (*refused, *wrong)]
    findings += doubt_weights(robot, [events[i] for i in known if not events[i].loose])
    findings += [_supposed(*place(events[known[row]])) for row in supposed]
    codes = {i: finding.code for i, finding in wrong}
    findings += _another_arm(robot, [(events[i], codes.get(i)) for i in known])

    moves: list[Move] = []
    of_event: dict[int, int] = {}
    previous = -1
    for row, (i, load) in enumerate(zip(known, loads, strict=True)):
        e = events[i]
        if i in bad:
            continue
        broken = e.first or not moves or any(_moves_arm(x) for x in events[previous + 1 : i])
        move = _move(i, e, load, q[row], T_work_tcp[row], broken)
        if e.again is not None:
            if e.again not in of_event:
                continue  # nothing brings the arm there
            move = replace(moves[of_event[e.again]], row=i, event=e, first=True, again=of_event[e.again])
        of_event[i] = len(moves)
        moves.append(move)
        previous = i
    return moves, once(findings)


def _arrives(e: MotionEvent) -> bool:
    return e.speed.v_tcp > 0.0 and (e.duration is None or e.duration > 0.0)


def _never_arrives(e: MotionEvent) -> Diagnostic:
    text = "the programmed speed is zero or negative: the arm would never arrive"
    return Diagnostic("MOT006", "error", text, *place(e, "speed"), "give a speed above zero")


def _moves_arm(event: MotionEvent) -> bool:
    return event.statement.interpolation != "none" or event.reason is not None


def _on_flange(tool: ToolData, grip: LoadData, wobj: WobjData) -> _Held:
    """Tool load (centre in tool0) and GripLoad (centre in the tool frame) as one mass.

    The load of a stationary tool is that of the gripper which holds the work object, and the centre of GripLoad is then
    given in the object frame (ABB RAPID reference manual, tooldata and loaddata).
    """
    T_mount_tcp = tool_matrix(tool)
    mass = tool.tload.mass + grip.mass
    tool_center = pose_matrix(tool.tload.cog, _UPRIGHT)[:3, 3]
    T_flange_grip = T_mount_tcp if tool.robhold else object_matrix(wobj)
    grip_center = (T_flange_grip @ pose_matrix(grip.cog, _UPRIGHT))[:3, 3]
    center = (tool.tload.mass * tool_center + grip.mass * grip_center) / mass if mass > 0 else np.zeros(3)
    return _Held(T_mount_tcp, not tool.robhold, mass, center)


def _mounts(loads: Sequence[_Held]) -> Mounts:
    return Mounts(np.array([load.T_mount_tcp for load in loads]), np.array([load.stationary for load in loads]))


def _solve(
    robot: Robot, events: Sequence[MotionEvent], known: list[int], loads: list[_Held]
) -> tuple[Array, Array, list[Failure], list[int]]:
    """Joint angles (k, 6) and T_work_tcp (k, 4, 4; NaN for joint targets) of the known events; rows as in `_follow`."""
    q = np.full((len(known), 6), np.nan)
    T = np.full((len(known), 4, 4), np.nan)
    conf = np.zeros((len(known), 4), dtype=np.int64)
    for row, i in enumerate(known):
        target = events[i].target
        if isinstance(target, JointTarget):
            q[row] = np.radians(target.robax)
        elif isinstance(target, RobTarget):
            conf[row] = target.robconf
    failures = _beyond_limits(robot, q)
    posed = np.flatnonzero(np.isnan(q[:, 0]))
    if len(posed) == 0:
        return q, T, failures, []
    T[posed] = target_matrices([events[known[row]] for row in posed])
    T_base_flange = np.full_like(T, np.nan)
    T_base_flange[posed] = _mounts(loads)[posed].flange(T[posed])
    solution = joint_solution(robot, T_base_flange[posed], conf[posed])
    q[posed] = solution.q
    free = np.array([any_configuration(events[i]) for i in known])
    failures += [
        replace(f, index=int(posed[f.index]))
        for f in solution.failures
        if f.reason == "unreachable" or not free[posed[f.index]]
    ]
    free[np.isnan(T[:, 0, 0])] = False
    free[[f.index for f in failures]] = False
    row_of = {i: row for row, i in enumerate(known)}
    again = {row: row_of[end] for row, i in enumerate(known) if (end := events[i].again) is not None}
    free[list(again)] = False
    more, supposed = _follow(robot, T_base_flange, q, free, again)
    return q, T, sorted([*failures, *more], key=lambda f: f.index), supposed


def any_configuration(event: MotionEvent) -> bool:
    """ConfL or ConfJ is off: the arm keeps the configuration it comes with, whatever the target says."""
    name = "conf_j" if event.statement.interpolation == "joint" else "conf_l"
    return event.options.get(name) is False


def _follow(
    robot: Robot, T_base_flange: Array, q: Array, free: Array, again: Mapping[int, int]
) -> tuple[list[Failure], list[int]]:
    """Fill in, in place, the goals that are reached in the configuration of the goal before them.

    Args:
        again: rows at which the arm stands where another row has brought it.

    Returns:
        Failures, and the rows at which the arm is supposed to start in the posture nearest to all axes at zero: nothing
        brings it there, and what the target states does not exist.
    """
    failures: list[Failure] = []
    supposed: list[int] = []
    edges = np.diff(np.concatenate([[False], free, [False]]).astype(int))
    for a, b in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        from_where = again.get(int(a) - 1, int(a) - 1)
        before = q[from_where] if a > 0 and np.isfinite(q[from_where]).all() else q[a]
        if np.isnan(before).any():
            before = nearest_solution(robot, T_base_flange[a], np.zeros(6))
            supposed += [int(a)] if np.isfinite(before).all() else []
        if np.isfinite(before).all():
            reached = _followed(robot, T_base_flange[a:b], before)
            q[a : a + len(reached)] = reached
            if len(reached) < b - a:
                text = f"`{robot.name}` cannot get here in the configuration in which it comes"
                help_ = "pass the point with a MoveAbsJ, or switch the monitoring of the configuration on"
                failures.append(Failure(int(a) + len(reached), "configuration", text, help_))
        failures += [replace(f, index=f.index + int(a)) for f in _beyond_limits(robot, q[a:b])]
        lost = {f.index for f in failures}
        failures += [
            Failure(int(row), "configuration", "the configuration in which the arm starts here is not known",
                    "start with a MoveAbsJ, or with ConfJ\\On")
            for row in range(a, b) if np.isnan(q[row]).any() and row not in lost
        ]  # fmt: skip
    return failures, supposed


def _followed(robot: Robot, T_base_flange: Array, before: Array) -> Array:
    """Joint angles (k, 6) of as many poses as the arm can follow in the configuration of ``before``."""

    def fails(count: int) -> bool:
        try:
            track(robot, T_base_flange[:count], before)
        except PostprocError:
            return True
        return False

    try:
        return track(robot, T_base_flange, before)
    except PostprocError:
        first = bisect_left(range(1, len(T_base_flange) + 1), True, key=fails)
        return track(robot, T_base_flange[:first], before)


def _supposed(source: Source, span: Span | None) -> Diagnostic:
    text = "in which posture the arm comes here is not known, and what the target states does not exist"
    help_ = "the posture nearest to all axes at zero is taken: begin with a MoveAbsJ to be sure"
    return Diagnostic("KIN008", "warning", text, source, span, help_)


def _another_arm(robot: Robot, events: Sequence[tuple[MotionEvent, str | None]]) -> list[Diagnostic]:
    """Where many targets do not suit the arm (code of the finding), the program is hardly made for it."""
    places = {(e.statement.source.path, e.statement.span): code is not None for e, code in events if not e.loose}
    failed = sum(places.values())
    if failed < 3 or 10 * failed < len(places):
        return []
    unset = (isinstance(e.target, RobTarget) and not any(e.target.robconf) for e, code in events if code is not None)
    if all(unset) and {code for _, code in events} <= {"KIN002", None}:
        text = f"the configurations of {failed} of {len(places)} statements, all [0,0,0,0], do not exist"
        help_ = (
            "where they were never set, begin with `ConfL\\Off` and `ConfJ\\Off`: the arm keeps the one it comes with"
        )
        return [Diagnostic("KIN009", "error", text, help=help_)]
    text = f"`{robot.name}` cannot run {failed} of {len(places)} statements as they are"
    tiny = next(filter(None, (in_metres(e) for e, code in events if code is not None)), "")
    if tiny:
        return [Diagnostic("KIN009", "error", f"{text}: {tiny}", help="RAPID states lengths in mm: are these metres?")]
    help_ = "name the arm with `--robot`: one of `postproc robots list`, or a file or URDF that describes it"
    return [Diagnostic("KIN009", "error", f"{text}: it hardly is their arm", help=help_)]


def _beyond_limits(robot: Robot, q: Array) -> list[Failure]:
    excess = np.maximum(robot.lower - q, q - robot.upper)
    failures = []
    for row in np.flatnonzero(excess.max(axis=1, initial=0.0) > 1e-9):
        j = int(np.argmax(excess[row]))
        limit = float(robot.lower[j] if q[row, j] < robot.lower[j] else robot.upper[j])
        text = f"joint {j + 1} would stand at {np.degrees(q[row, j]):.1f} deg, its limit is {np.degrees(limit):.0f} deg"
        failures.append(
            Failure(int(row), "limit", text, "stay inside the limits", None, j + 1, float(q[row, j]), limit)
        )
    return failures


def _programmed_speed(e: MotionEvent) -> float:
    """Speed of the TCP [mm/s] with VelSet: a share of every programmed speed, and a highest one."""
    speed = e.speed.v_tcp * e.velocity_override / 100
    return speed if e.velocity_limit is None else min(speed, e.velocity_limit)


def _move(row: int, e: MotionEvent, load: _Held, q: Array, T_work_tcp: Array, first: bool) -> Move:
    kind = e.statement.interpolation
    assert kind != "none"
    welding = e.weld is not None and e.weld.phase != "start"
    speed = e.weld.speed if welding and e.weld is not None and e.weld.speed else _programmed_speed(e)
    T_work_via = via_matrix(e) if kind == "arc" and e.via is not None else None
    return Move(
        row=row,
        event=e,
        kind=kind,
        q=q,
        T_mount_tcp=load.T_mount_tcp,
        stationary=load.stationary,
        T_work_tcp=None if np.isnan(T_work_tcp[0, 0]) else T_work_tcp,
        T_work_via=T_work_via,
        confdata=e.target.robconf if isinstance(e.target, RobTarget) else (0, 0, 0, 0),
        payload_mass=load.mass,
        payload_center=load.center,
        speed=speed * MM,
        rotation_speed=float(np.radians(e.speed.v_ori)) * e.velocity_override / 100,
        duration=e.duration,
        ease=min(max(e.acceleration, _LEAST_ACCSET), 100.0) / 100,
        fine=e.zone.finep,
        zone=e.zone.pzone_tcp * MM,
        zone_rotation=e.zone.pzone_ori * MM,
        zone_angle=float(np.radians(e.zone.zone_ori)),
        welding=welding,
        first=first,
    )
