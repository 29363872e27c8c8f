"""Where external axes stand at every motion, and motions whose base or work cannot be placed.

A target may leave axes open (9E9): they stay where they are. A unit that is not active stays, whatever targets say.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.rapid.data.events import InForce, MotionEvent
from postproc.rapid.data.records import NO_AXES, NO_AXIS, Ax6
from postproc.rapid.unknown import Kind, Unknown
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station

UNKNOWN_AXES: Ax6 = (nan,) * 6


def place_events(events: Iterable[MotionEvent], station: Station) -> list[MotionEvent]:
    """The events, each with the positions of the external axes at its goal where these are known.

    An event whose base or work has no known place also gets the reason, so that it is not corrected.
    """
    now = UNKNOWN_AXES
    placed: list[MotionEvent] = []
    for event in events:
        if event.start_unknown:
            now = UNKNOWN_AXES
        if event.resumes_from is not None:
            now = placed[event.resumes_from].axes or UNKNOWN_AXES
        elif event.target is not None and event.target.extax != NO_AXES:
            now = _reached(now, event, idle_axes(event.units, station))
        elif event.target is None and event.reason is not None:
            now = UNKNOWN_AXES  # wherever that leads
        placed.append(event if now is UNKNOWN_AXES else replace(event, axes=now))
    rows = [i for i, e in enumerate(placed) if e.reason is None and e.target is not None]
    for i, why in zip(rows, _unplaced([placed[i] for i in rows], station), strict=True):
        if why is not None:
            event = placed[i]
            placed[i] = replace(event, reason=why.reason, unknowns=(*event.unknowns, why))
    return placed


def _reached(before: Ax6, event: MotionEvent, idle: str) -> Ax6:
    """Positions of the external axes after an event: those of its target plus the offset in force (EOffs).

    Args:
        before: positions before the event, kept where the target states 9E9.
        idle: letters of axes that do not move, whatever the target says.
    """
    assert event.target is not None
    a, b, c, d, e, f = (
        old if new >= NO_AXIS or letter in idle else new + offset
        for letter, old, new, offset in zip(LETTERS, before, event.target.extax, event.axis_offset, strict=True)
    )
    return a, b, c, d, e, f


def idle_axes(units: tuple[tuple[str, bool], ...] | None, station: Station) -> str:
    """Letters of the external axes that do not move whatever targets say, as their units are not active.

    Args:
        units: units switched by ``ActUnit`` (True) and ``DeactUnit`` (False); others are as at the start. None if
            unknown: then all axes follow the targets.
    """
    switched = dict(units or ())
    task_units = [(name, station.cell.unit(name)) for name in station.units]
    asleep = [unit for name, unit in task_units if units is not None and not switched.get(name.lower(), unit.active)]
    return "".join(joint.axis for unit in asleep for joint in unit.joints if joint.axis is not None)


def resting_place(events: Iterable[MotionEvent]) -> Ax6:
    """Positions at which the external axes of a task stand while it runs, 9E9 for an axis without exactly one position.

    All are 9E9 if some target of the task is not known.

    Args:
        events: all of the task's program.
    """
    goals = [event for event in events if event.resumes_from is None]
    if any(event.target is None for event in goals):
        return (NO_AXIS,) * 6
    stated: list[set[float]] = [set() for _ in LETTERS]
    for event in goals:
        assert event.target is not None
        for axis, offset, positions in zip(event.target.extax, event.axis_offset, stated, strict=True):
            positions |= {axis + offset} if axis < NO_AXIS else set()
    a, b, c, d, e, f = (next(iter(positions)) if len(positions) == 1 else NO_AXIS for positions in stated)
    return a, b, c, d, e, f


def say_resting(events: Sequence[MotionEvent], station: Station) -> list[Diagnostic]:
    """MOT013 (info) for each unit that another task moves and that carries work here: its assumed position.

    The finding is placed at the first motion on that unit.
    """
    units = {now: unit for now in {event.in_force for event in events} if (unit := unit_of(now)) is not None}
    first = {units[event.in_force].lower(): event for event in reversed(events) if event.in_force in units}
    findings = []
    for name, event in first.items():
        axes = station.standing.get(name, (NO_AXIS,) * 6)
        stated = [f"eax_{letter} = {axis:g}" for letter, axis in zip(LETTERS, axes, strict=True) if axis < NO_AXIS]
        if stated and event.reason is None:
            text = f"`{event.wobj.ufmec}`, which another task moves, is taken to stand at {', '.join(stated)}"
            help_ = "its program states no other position; mind that it stands there before this motion begins"
            findings.append(Diagnostic("MOT013", "info", text, event.statement.source, event.statement.span, help_))
    return findings


def axes_between(before: MotionEvent, event: MotionEvent, share: float) -> Ax6:
    """External axes to write into a target placed inside a move, [mm] or [deg]: they move evenly with the arm.

    Axes that stand still, or are not active, are stated as at the goal.

    Args:
        before: the event whose goal the move starts at.
        event: the event of the move.
        share: fraction of the move, 0 at its start and 1 at its goal.
    """
    assert event.target is not None
    way = np.nan_to_num(np.subtract(event.axes or UNKNOWN_AXES, before.axes or UNKNOWN_AXES))
    a, b, c, d, e, f = (
        end if end >= NO_AXIS or not change else round(end - (1 - share) * change, 3)
        for end, change in zip(event.target.extax, way.tolist(), strict=True)
    )
    return a, b, c, d, e, f


def unit_of(event: MotionEvent | InForce) -> str | None:
    """The mechanical unit that moves the work of an event; None where the work stands in the world or on the flange."""
    return None if event.wobj.ufprog or event.wobj.robhold else event.wobj.ufmec


def _unplaced(events: Sequence[MotionEvent], station: Station) -> list[Unknown | None]:
    """Per event, the reason why the place of the base or of the work is not known; None where both are known."""
    known = station.cell.units
    positions = station.positions(np.array([e.axes or UNKNOWN_AXES for e in events]).reshape(-1, 6))
    base = _finite(station.base(positions))
    units = {name for now in {e.in_force for e in events} if (name := unit_of(now)) is not None}
    if not units and all(base):
        return [None] * len(events)
    placed = {name: _finite(station.frame(name, positions)) for name in units if name.lower() in known}
    reasons: list[Unknown | None] = []
    for i, event in enumerate(events):
        unit = unit_of(event)
        if not base[i]:
            carrier = station.cell_arm.unit
            reasons.append(Unknown(Kind.BASE_NOWHERE, carrier or "", _why(station, carrier)))
        elif unit is not None and unit not in placed:
            reasons.append(Unknown(Kind.MOVED_OBJECT, event.wobj.name, unit))
        elif unit is not None and not placed[unit][i]:
            reasons.append(Unknown(Kind.WORK_NOWHERE, event.wobj.name, _why(station, unit)))
        else:
            reasons.append(None)
    return reasons


def _finite(T: Array) -> list[bool]:
    """Per pose (n, 4, 4), whether all its numbers are finite."""
    return list(np.asarray(np.isfinite(T).all(axis=(1, 2))))


def _why(station: Station, name: str | None) -> str:
    """Text that says why the end of a unit has no known place; ``name`` None stands for the base frame.

    The unit cannot be interpreted, another task moves it, or no target says where one of its axes stands.
    """
    if name is None:
        return "its base frame cannot be read"
    unit_end = station.cell.unit(name)
    while name is not None:
        unit = station.cell.unit(name)
        if unit.unknown:
            return f"`{unit.name}`: {unit.unknown}"
        if name.lower() not in {u.lower() for u in station.units}:
            return f"another task moves `{unit.name}`, and its program does not say that it stands at one position"
        name = unit.parent
    axes = [f"eax_{joint.axis}" for joint in unit_end.joints if joint.axis is not None and joint.leader is None]
    if not axes:
        return "the frame in which it stands cannot be read"
    stand = "stands" if len(axes) == 1 else "stand"
    return f"no target on the way here says where {' and '.join(axes)} {stand}, or the unit is not active"
