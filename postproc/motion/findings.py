"""Findings of this room, placed at the target of the motion statement that they speak of."""

from __future__ import annotations

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent


def place(event: MotionEvent, role: str = "to") -> tuple[Source, Span]:
    """Source and span of an event's argument of that role ("to", "speed", "tool", ..), or of the whole statement."""
    argument = event.statement.argument(role)
    return event.statement.source, argument.span if argument else event.statement.span


def at_move(move: Move, code: str, severity: Severity, message: str, help: str = "") -> Diagnostic:
    """Diagnostic whose place is the target argument of the statement that the move comes from."""
    source, span = place(move.event)
    return Diagnostic(code, severity, message, source, span, help)


def once(findings: list[Diagnostic]) -> list[Diagnostic]:
    """The findings, in their order, without those of equal code, file and span as an earlier one.

    A statement in a loop or in a shared routine runs several times but is reported once.
    """
    seen: dict[tuple[str, str | None, Span | None], Diagnostic] = {}
    for d in findings:
        seen.setdefault((d.code, d.source.path if d.source else None, d.span), d)
    return list(seen.values())
