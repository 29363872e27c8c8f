"""Where a program goes on after an error."""

from __future__ import annotations

from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.program.references import names_at
from postproc.rapid.program.write_effects import holds_word
from postproc.rapid.syntax.nodes import Routine


def resumed_behind_errors(program: Program) -> frozenset[str]:
    """Keys of routines in which a statement that fails may be passed over: a handler of their own, or of a routine to
    which their errors come, holds ``TRYNEXT``.
    """
    pending = [routine for routine in program.all_routines() if _handles_by(routine, b"trynext")]
    found = {routine.key for routine in pending}
    while pending:
        for called in _mentioned(pending.pop(), program):
            if called.key not in found and (not called.handlers or _handles_by(called, b"raise")):
                found.add(called.key)
                pending.append(called)
    return frozenset(found)


def _handles_by(routine: Routine, word: bytes) -> bool:
    """Whether a handler of a routine holds a statement of that word."""
    return any(holds_word(routine.source, body, word) for body in routine.handlers)


def _mentioned(routine: Routine, program: Program) -> list[Routine]:
    """Routines that a routine may call: those that its text names, all where it calls by a text."""
    source = routine.source
    called = (program.routine(name, routine.module) for name, _ in names_at(source, routine.span))
    by_text = any(
        source.data[s.span[0] : s.span[0] + 1] == b"%" or s.word == "callbyvar" for s in statements_of(routine)
    )
    everything = program.all_routines() if by_text else ()
    return [*(other for other in called if other is not None), *everything]
