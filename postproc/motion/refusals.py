"""Motion that cannot be understood from the arm alone: tool and work that do not meet, external axes that move."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic
from postproc.motion.findings import place
from postproc.rapid.events import MotionEvent
from postproc.rapid.records import NO_AXIS

_STILL = 1e-3  # [mm] or [deg]: rounding of a taught position


def refuse_events(events: Sequence[MotionEvent]) -> list[Diagnostic]:
    """Findings about motions that cannot be compensated for the arm alone.

    Returns:
        MOT007 tool and work object that do not fit together, MOT008 external axes that move.
    """
    findings: list[Diagnostic] = []
    before: tuple[float, ...] | None = None
    for event in events:
        if event.reason is not None or event.target is None:
            continue
        if event.tool.robhold == event.wobj.robhold:
            findings.append(_unfit(event))
        axes = event.target.extax
        if before is not None:
            moving = [k for k in range(6) if _moves(before[k], axes[k])]
            if moving:
                names = ", ".join(f"eax_{'abcdef'[k]}" for k in moving)
                text = f"external axes move ({names}): where they carry the robot or the work piece is not known"
                help_ = "compensate programs whose external axes stand still, or split the program where they move"
                findings.append(Diagnostic("MOT008", "error", text, *place(event), help_))
        before = axes
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


def _moves(before: float, now: float) -> bool:
    unused = before >= NO_AXIS and now >= NO_AXIS
    return not unused and abs(now - before) > _STILL
