"""What is wrong with motions before any of them is computed.

Tool and work that do not meet, and external axes that carry something unknown; weights that cannot be, or are hard to
believe, as the correction is worked out from them; and whose fault it is that targets are out of reach: the target's,
its displacement's, or that of another arm.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence

import numpy as np

from postproc.diagnostics import Diagnostic, Matter, Severity
from postproc.motion.findings import place
from postproc.rapid.data.events import InForce, MotionEvent, StatementKey
from postproc.rapid.data.records import NO_AXES, NO_AXIS, LoadData, Pose, RobTarget, ToolData
from postproc.rapid.evaluation.state import NO_MASS
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station

# [mm] or [deg]: taught positions of one station differ by this much; a robot carried 0.1 deg around an axis 2 m away is
# corrected for a place 3.5 mm from its own, which changes the correction by micrometres.
AXIS_TOLERANCE = 0.1


def refuse_events(events: Sequence[MotionEvent], free_axes: str, station: Station) -> list[tuple[int, Diagnostic]]:
    """Findings about motions that cannot be corrected with a model of the arm alone, each with the row of its event.

    Args:
        free_axes: letters of external axes that carry neither the robot nor its work: they may stand and move anywhere.
        station: its axes are known and not refused either.

    Returns:
        MOT007 where both or neither of tool and work object are held by the robot; MOT008 where an external axis that
        is not known moves, or stands away from zero, by more than 0.1 mm or degree.
    """
    findings: list[tuple[int, Diagnostic]] = []
    carrying = [k for k in range(6) if not station.connected and LETTERS[k] not in {*free_axes, *station.joints}]
    last: list[float] = [NO_AXIS] * 6  # where each axis was last sent; a target may leave that open
    for row, event in enumerate(events):
        if event.reason is not None or event.target is None:
            continue
        if event.tool.robhold == event.wobj.robhold:
            findings.append((row, _unfit(event)))
        if event.target.extax == NO_AXES:
            continue
        axes = [x if x >= NO_AXIS else x + by for x, by in zip(event.target.extax, event.axis_offset, strict=True)]
        known = [k for k in carrying if axes[k] < NO_AXIS]
        moving = [k for k in known if last[k] < NO_AXIS and abs(axes[k] - last[k]) > AXIS_TOLERANCE]
        standing = [k for k in known if last[k] >= NO_AXIS and abs(axes[k]) > AXIS_TOLERANCE]
        if moving or standing:
            findings.append((row, _carrying(event, moving, standing)))
        for k, axis in enumerate(axes):
            if axis < NO_AXIS and (k in moving or last[k] >= NO_AXIS):
                last[k] = axis
    return findings


def _carrying(event: MotionEvent, moving: list[int], standing: list[int]) -> Diagnostic:
    """MOT008, an error: external axes (indices 0 to 5) move or stand away from zero, and what they carry is unknown."""
    assert event.target is not None
    if moving:
        text = f"external axes move ({', '.join(f'eax_{LETTERS[k]}' for k in moving)})"
    else:
        at = ", ".join(f"eax_{LETTERS[k]} at {event.target.extax[k]:g}" for k in standing)
        text = f"external axes stand away from zero ({at})"
    letters = "".join(LETTERS[k] for k in sorted({*moving, *standing}))
    help_ = f"describe them with `--cell FILE`; if they carry neither, say `--free-axes {letters}`"
    text += ": where they carry the robot or the work piece is not known"
    return Diagnostic("MOT008", "error", text, *place(event), help_, Matter.CELL)


def _unfit(event: MotionEvent) -> Diagnostic:
    """MOT007, an error at the tool argument: both or neither of tool and work object are held by the robot."""
    tool, wobj = event.tool.name, event.wobj.name
    if event.tool.robhold:
        text = f"the robot would hold both the tool `{tool}` and the work object `{wobj}`"
    else:
        text = f"neither the tool `{tool}` nor the work object `{wobj}` is held by the robot"
    help_ = (
        "one of tooldata and wobjdata has robhold TRUE; a stationary tool needs \\WObj with a work object on the robot"
    )
    return Diagnostic("MOT007", "error", text, *place(event, "tool"), help_, Matter.CELL)


NOT_DEFINED = "-1 stands for a load that was never identified"
METRES_MM = 10.0
"""A tool or a work object so near to its origin, on an arm that does not reach the targets, is written in metres."""
NO_TOOL_MM = 1.0  # a TCP nearer to the flange than this belongs to no tool
TOO_MUCH = 5.0  # times what the arm carries: no arm lifts that
FAR_MM = 1500.0  # from the flange: no centre of gravity of a tool or of what it grips is farther away


def doubt_weights(robot: Robot, events: Sequence[MotionEvent]) -> list[Diagnostic]:
    """Findings about tool loads and payloads, each at the first motion that uses them.

    Returns:
        MOT011 (error) a negative mass, one far above what the arm carries, a TCP in metres; MOT012 a tool without
        weight (info), a load above what the arm carries, or a centre of gravity in the flange or far from it (warning).
    """
    findings: list[Diagnostic] = []
    weights: set[tuple[ToolData, LoadData]] = set()
    conditions: set[InForce] = set()  # by identity: tool and load are long to compare, and most motions share them
    for event in events:
        if event.in_force in conditions or event.reason is not None or event.target is None:
            continue
        conditions.add(event.in_force)
        if (event.tool, event.gripload) not in weights:
            weights.add((event.tool, event.gripload))
            findings += _doubts(robot, event)
    return findings


def _doubts(robot: Robot, event: MotionEvent) -> Iterator[Diagnostic]:
    """MOT011 and MOT012 about the tool load, the TCP and the payload of one event."""
    tool, grip = event.tool, event.gripload
    name = tool.name or "of this statement"
    where = place(event, "tool")
    if min(tool.tload.mass, grip.mass) < 0:
        what = f"the tool `{name}`" if tool.tload.mass < 0 else "GripLoad"
        text = f"the load of {what} is not defined: its mass is {min(tool.tload.mass, grip.mass):g} kg"
        yield Diagnostic("MOT011", "error", text, *where, f"state the mass and its centre; {NOT_DEFINED}")
        return
    if tool.robhold and 0.0 < np.linalg.norm(tool.tframe.trans) < NO_TOOL_MM:
        text = f"the TCP of `{name}` is {np.linalg.norm(tool.tframe.trans):.3g} mm away from the flange"
        yield Diagnostic("MOT011", "error", text, *where, "RAPID states lengths in mm: are these metres?")
        return
    if tool.robhold and tool.tload.mass <= NO_MASS and np.linalg.norm(tool.tframe.trans) > NO_TOOL_MM:
        text = f"the tool `{name}` weighs nothing ({tool.tload.mass:g} kg), so nothing is corrected for its weight"
        yield Diagnostic("MOT012", "info", text, *where, "identify its load (LoadIdentify), or state what it weighs")
    total = tool.tload.mass + grip.mass
    if robot.payload is not None and total > robot.payload:
        text = f"tool and payload weigh {total:g} kg, `{robot.name}` is made for {robot.payload:g} kg"
        code: str
        severity: Severity
        code, severity = ("MOT011", "error") if total > TOO_MUCH * robot.payload else ("MOT012", "warning")
        yield Diagnostic(code, severity, text, *where, f"look at the mass of `{name}`: it is in kg")
    for load in (tool.tload, grip):
        distance = float(np.linalg.norm(load.cog))
        if load.mass > 1.0 and 0.0 < distance < NO_TOOL_MM:
            text = f"the centre of gravity of {load.mass:g} kg is {distance:.3g} mm away from the flange"
            yield Diagnostic("MOT012", "warning", text, *where, f"look at the load of `{name}`: RAPID states it in mm")
        if load.mass > NO_MASS and distance > FAR_MM:
            text = f"a centre of gravity is {distance / 1000:.3g} m away from the flange"
            yield Diagnostic("MOT012", "warning", text, *where, f"look at the load of `{name}`: RAPID states it in mm")
            return


def in_metres(event: MotionEvent) -> str:
    """Text naming the TCP or work object of a motion that is less than 10 mm from its origin, perhaps in metres.

    It is empty if there is none.
    """
    frames = {f"the TCP of `{event.tool.name}`": event.tool.tframe, f"`{event.wobj.name}`": event.wobj.uframe}
    apart = {what: float(np.linalg.norm(frame.trans)) for what, frame in frames.items()}
    clauses = (f"{what} is {mm:.3g} mm away from its origin" for what, mm in apart.items() if 0.0 < mm < METRES_MM)
    return next(clauses, "")


Reached = Sequence[tuple[MotionEvent, str | None]]
"""Runs of the program, and the code of what keeps the arm from making one."""
FEW = 3
"""Targets that fail before their program is doubted as a whole."""


def only_displaced(runs: Reached) -> frozenset[StatementKey]:
    """Statements that are out of reach only because their target or work is displaced in some or all of their runs.

    They either succeed in another run, or never fail with a written target without displacement. If no statement of the
    program can be run, the set is empty.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
    """
    lost = {e.statement.key for e, code in runs if code is not None}
    if not lost:
        return frozenset()
    run = {e.statement.key for e, code in runs if code is None and isinstance(e.target, RobTarget)}
    written = {  # as numbers or a name, and no program displacement is in force
        e.statement.key
        for e, code in runs
        if code is not None and e.target_origin.kind != "expression" and e.displacement == Pose()
    }
    return frozenset(lost & run | lost - written if run else ())


def another_arm(robot: Robot, runs: Reached) -> list[Diagnostic]:
    """KIN009 if more than half of the targets, and at least three, fail in every run: the program suits another arm.

    Each target counts once, however many statements lead there. If at least half of those that fail do so only by their
    configuration, the finding says that instead, since another arm would not explain it.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
    """
    if not any([code for _, code in runs]):
        return []
    targets: dict[Hashable, set[str | None]] = {}
    for e, code in runs:
        if not e.unreachable:
            targets.setdefault((e.target, e.wobj, e.tool, e.displacement), set()).add(code)
    failed = [codes for codes in targets.values() if None not in codes]
    if len(failed) < FEW or 2 * len(failed) <= len(targets):
        return []
    count = f"{len(failed)} of {len(targets)} targets"
    beyond = sum(codes != {"KIN002"} for codes in failed)
    if 2 * beyond <= len(failed):
        return [_odd_configurations(runs, count)]
    text = f"`{robot.name}` cannot reach {count} as they are"
    tiny = next(filter(None, (in_metres(e) for e, code in runs if code is not None)), "")
    if tiny:
        return [Diagnostic("KIN009", "error", f"{text}: {tiny}", help="RAPID states lengths in mm: are these metres?")]
    help_ = "name the arm with `--robot`: one of `postproc robots list`, or a file or URDF that describes it"
    return [Diagnostic("KIN009", "error", f"{text}: it hardly is their arm", help=help_)]


def _odd_configurations(runs: Reached, count: str) -> Diagnostic:
    """KIN009, an error: the targets can be reached, but not in the configurations that they state.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
        count: "n of m targets", for the message.
    """
    unset = all(isinstance(e.target, RobTarget) and not any(e.target.robconf) for e, code in runs if code is not None)
    if unset:
        text = f"the configurations of {count}, all [0,0,0,0], do not exist"
        help_ = (
            "where they were never set, begin with `ConfL\\Off` and `ConfJ\\Off`: the arm keeps the one it comes with"
        )
    else:
        text = f"{count} can be reached, but not in the configuration that they state"
        help_ = (
            "check where their confdata comes from; `ConfL\\Off` and `ConfJ\\Off` leave the choice to the controller"
        )
    return Diagnostic("KIN009", "error", text, help=help_)
