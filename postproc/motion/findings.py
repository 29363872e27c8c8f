"""Findings of this room, placed at the target of the motion statement that they speak of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.grouping import grouped
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent


def place(event: MotionEvent, role: str = "to") -> tuple[Source, Span]:
    """Source and span of an event's argument of that role ("to", "speed", "tool", ..), or of the whole statement."""
    argument = event.statement.argument(role)
    return event.statement.source, argument.span if argument else event.statement.span


def at_move(move: Move, code: str, severity: Severity, message: str, help: str = "") -> Diagnostic:
    """Diagnostic whose place is the target argument of the statement that the move comes from."""
    return in_turns(Diagnostic(code, severity, message, *place(move.event), help), move.event)


def in_turns(finding: Diagnostic, event: MotionEvent) -> Diagnostic:
    """The finding on an event, which says in which turns of the loops around it that ran."""
    clauses = []
    for turn in reversed(event.turns):
        file = f" of `{Path(turn.source.path).name}`" if turn.source is not event.statement.source else ""
        index = "" if turn.index is None else f" (`{turn.index[0]}` is {turn.index[1]:g})"
        clauses.append(f"in turn {turn.number} of the `{turn.word}` in line {turn.source.row(turn.start)}{file}{index}")
    return replace(finding, message=", ".join([finding.message, *clauses])) if clauses else finding


def once(findings: list[Diagnostic]) -> list[Diagnostic]:
    """The findings, in their order, without those of equal code, file and span as an earlier one.

    A statement in a loop or in a shared routine runs several times but is reported once, as of the first run; where
    what is said differs from run to run, it says in how many more of them something is said.
    """
    groups = grouped(((d.code, d.source.path if d.source else None, d.span), d) for d in findings)
    kept = []
    for first, *others in groups.values():
        further = len({d.message for d in others} - {first.message})
        text = f"{first.message}; likewise in {further} more run{'s' * (further > 1)}"
        kept.append(replace(first, message=text) if further else first)
    return kept
