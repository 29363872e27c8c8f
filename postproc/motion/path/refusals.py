"""Motion that cannot be understood from the arm alone: tool and work that do not meet, external axes not at zero."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic, Matter
from postproc.motion.findings import place
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import NO_AXES, NO_AXIS
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station

# [mm] or [deg]: taught positions of one station differ by this much; a robot carried 0.1 deg around an axis 2 m away is
# corrected for a place 3.5 mm from its own, which changes the correction by micrometres.
STILL = 0.1


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
        moving = [k for k in known if last[k] < NO_AXIS and abs(axes[k] - last[k]) > STILL]
        standing = [k for k in known if last[k] >= NO_AXIS and abs(axes[k]) > STILL]
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
