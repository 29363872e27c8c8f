"""Motion that is not the arm's alone: tools that stand still, external axes that move."""

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
        MOT007 stationary tool or work object on the robot, MOT008 external axes that move.
    """
    findings: list[Diagnostic] = []
    before: tuple[float, ...] | None = None
    for event in events:
        if event.reason is not None or event.target is None:
            continue
        if not event.tool.robhold or event.wobj.robhold:
            name = event.tool.name if not event.tool.robhold else event.wobj.name
            text = f"`{name}` makes the robot carry the work piece to a stationary tool, which is not compensated"
            role = "tool" if not event.tool.robhold else "\\wobj"
            help_ = "compensate programs in which the robot holds the tool (robhold TRUE)"
            findings.append(Diagnostic("MOT007", "error", text, *place(event, role), help_))
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


def _moves(before: float, now: float) -> bool:
    unused = before >= NO_AXIS and now >= NO_AXIS
    return not unused and abs(now - before) > _STILL
