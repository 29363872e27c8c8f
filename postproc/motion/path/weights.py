"""Weights of tools and payloads that cannot be, or are hard to believe: the correction is worked out from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from postproc.diagnostics import Diagnostic, Severity
from postproc.motion.findings import place
from postproc.rapid.data.events import InForce, MotionEvent
from postproc.rapid.data.records import LoadData, ToolData
from postproc.rapid.evaluation.state import NO_MASS
from postproc.robot.arm import Robot

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
    found = (f"{what} is {mm:.3g} mm away from its origin" for what, mm in apart.items() if 0.0 < mm < METRES_MM)
    return next(found, "")
