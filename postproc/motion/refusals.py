"""Motion that cannot be understood from the arm alone: tool and work that do not meet, external axes that move."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic
from postproc.motion.findings import place
from postproc.rapid.program.events import MotionEvent
from postproc.rapid.program.records import NO_AXIS

# [mm] or [deg]: taught positions of one station differ by this much; a robot carried 0.1 deg around an axis 2 m away is
# corrected for a place 3.5 mm from its own, which changes the correction by micrometres.
STILL = 0.1


def refuse_events(events: Sequence[MotionEvent], free_axes: str = "") -> list[tuple[int, Diagnostic]]:
    """Findings about motions that cannot be compensated for the arm alone, with the row of the event.

    Args:
        free_axes: letters of external axes that carry neither the robot nor its work: they may move.

    Returns:
        MOT007 tool and work object that do not fit together, MOT008 external axes that move.
    """
    findings: list[tuple[int, Diagnostic]] = []
    carrying = [k for k in range(6) if "abcdef"[k] not in free_axes]
    station: list[float] = [NO_AXIS] * 6  # where each axis was last sent; a target may leave that open
    for row, event in enumerate(events):
        if event.reason is not None or event.target is None:
            continue
        if event.tool.robhold == event.wobj.robhold:
            findings.append((row, _unfit(event)))
        axes = event.target.extax
        both = [k for k in carrying if max(station[k], axes[k]) < NO_AXIS]
        moving = [k for k in both if abs(axes[k] - station[k]) > STILL]
        if moving:
            names = ", ".join(f"eax_{'abcdef'[k]}" for k in moving)
            text = f"external axes move ({names}): where they carry the robot or the work piece is not known"
            letters = "".join("abcdef"[k] for k in moving)
            help_ = f"if they carry neither, say `--free-axes {letters}`; else split the program where they move"
            findings.append((row, Diagnostic("MOT008", "error", text, *place(event), help_)))
        for k, axis in enumerate(axes):
            if axis < NO_AXIS and (k in moving or station[k] >= NO_AXIS):
                station[k] = axis
    return findings


def _unfit(event: MotionEvent) -> Diagnostic:
    tool, wobj = event.tool.name, event.wobj.name
    if event.tool.robhold:
        text = f"the robot would hold both the tool `{tool}` and the work object `{wobj}`"
    else:
        text = f"neither the tool `{tool}` nor the work object `{wobj}` is held by the robot"
    help_ = (
        "one of tooldata and wobjdata has robhold TRUE; a stationary tool needs \\WObj with a work object on the robot"
    )
    return Diagnostic("MOT007", "error", text, *place(event, "tool"), help_)
