"""Data that calibration and teach routines of a program set: what waits for it, and the words that make it known."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from postproc.diagnostics import Diagnostic, Matter, Source, Span
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.unknown import Kind, Unknown, set_first

_WHAT: Mapping[str, str] = {"tooldata": "tool", "wobjdata": "work object", "robtarget": "target", "loaddata": "load"}


def say_measured(program: Program, events: Sequence[MotionEvent], entry: str | None = None) -> dict[str, Diagnostic]:
    """Findings RAP023 about PERS data that a motion needs and whose value only the running program knows.

    The help offers ``--taught``, except for data that the program moves, which following it shows.
    For what a search of this arm has found it does not: that holds the error of the arm, except in a work object, for
    which the help offers ``--wobj-taught`` with it.

    Args:
        events: the motions of the program, as followed from ``entry``.
        entry: name of the routine that runs first; main if None.

    Returns:
        One finding for each such data, by its key, at the first motion that needs it.
    """
    waiting: dict[str, tuple[Declaration, MotionEvent, Unknown]] = {}
    for event in events:
        for unknown in event.unknowns if not event.statement.source.read_only else ():
            declaration = _stored_in(unknown, program)
            if declaration is not None:
                waiting.setdefault(declaration.key, (declaration, event, unknown))
    if not waiting:
        return {}
    wanted = {d.name.lower(): d.name for d, _, unknown in waiting.values() if not _holds_error(d, unknown)}
    moved = set(wanted)
    while moved and wanted:  # what is left out may move what else was offered: tried until all of it stands
        tried = walk_program(replace(program, taught=program.taught | wanted.keys()), entry)
        moved = wanted.keys() & {d.name.lower() for d in tried.diagnostics if d.matter is Matter.TAUGHT_MOVED}
        wanted = {key: name for key, name in wanted.items() if key not in moved}
    offered = list(wanted.values())
    return {key: _finding(*case, offered) for key, case in waiting.items()}


def with_advice(
    findings: Iterable[Diagnostic],
    events: Sequence[MotionEvent],
    program: Program,
    measured: Mapping[str, Diagnostic],
) -> list[Diagnostic]:
    """All findings; the help of those about statements left unchanged says how to make the missing data known.

    Args:
        events: the motions of the program; measured: result of ``say_measured``.
    """
    advice: dict[tuple[Source | None, Span | None], str] = {
        (event.statement.source, event.statement.span): measured[declaration.key].help
        for event in events if measured
        for unknown in event.unknowns
        if (declaration := _stored_in(unknown, program)) is not None and declaration.key in measured
    }  # fmt: skip
    return [
        replace(d, help=advice.get((d.source, d.span), d.help)) if d.matter is Matter.SKIPPED else d for d in findings
    ]


def _finding(declaration: Declaration, event: MotionEvent, unknown: Unknown, offered: Sequence[str]) -> Diagnostic:
    """The finding RAP023 that data is not known at a motion.

    Args:
        declaration: of the data; event: the motion; unknown: why the data is not known there.
        offered: names of data for which the help offers ``--taught``.
    """
    name = declaration.name
    if _holds_error(declaration, unknown):
        help_ = "a search of this arm holds its error already: to correct what follows it would double that"
    else:
        help_ = f"set it from a CONST before the first motion, as in `{name}:={name}0;`"
    if name in offered:
        listed = ",".join(dict.fromkeys(offered))
        help_ = f"if the values in the files are what such routines set, say `--taught {listed}`"
        if unknown.root.kind is Kind.SEARCH_RESULT:
            help_ += f" with `--wobj-taught {name}`: a frame that this arm has found holds its error"
        if first := set_first((unknown,)):
            help_ = f"{first}; or {help_}"
    text = f"the {_WHAT.get(declaration.type.lower(), 'data')} `{name}` is not known here: {unknown.reason}"
    statement = event.statement
    return Diagnostic("RAP023", "warning", text, statement.source, statement.span, help_, Matter.MEASURED, name)


def _holds_error(declaration: Declaration, unknown: Unknown) -> bool:
    """Whether data is what a search found and no work object: what follows it holds the error of the arm already."""
    return unknown.root.kind is Kind.SEARCH_RESULT and declaration.type.lower() != "wobjdata"


def _stored_in(unknown: Unknown, program: Program) -> Declaration | None:
    """The PERS data of a module, declared with a value, in which an unknown value was stored last; None if none.

    Data that ``--taught`` names does not count.
    """
    for key in _keys(unknown):
        data = program.names.get(key)
        if data is None or data.storage != "PERS" or data.init is None or data.routine:
            continue
        if data.name.lower() not in program.taught:
            return data
    return None


def _keys(unknown: Unknown) -> Iterator[str]:
    """Keys of the data in which an unknown value was stored (the last first), then of the data that caused it."""
    yield from reversed(unknown.stored_in)
    yield unknown.key
    if isinstance(unknown.cause, Unknown):
        yield from _keys(unknown.cause)
