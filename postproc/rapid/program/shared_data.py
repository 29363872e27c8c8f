"""What the tasks of one controller share: PERS data of one name and type is one object in all of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache

from postproc.diagnostics import Diagnostic, Source
from postproc.rapid.program.program import Elsewhere, Program, read_program
from postproc.rapid.program.read_along import only
from postproc.rapid.program.scopes import is_shared, shared_name
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Declaration, Module
from postproc.rapid.syntax.tokens import names_at

_OPEN = re.compile(rb"(?i)\bPERS\s[^:;]{0,500}+;")  # a declaration without a value
Values = dict[tuple[str, str], set[bytes]]
"""The values that declarations give data, by name and type: their text without blanks."""


def data_elsewhere(sources: Sequence[Source], others: Iterable[tuple[Source, ...]]) -> Elsewhere:
    """Which of a task's global PERS data other tasks of the controller declare too, and which of it they may change.

    It counts as changed if another task may write it, or if their declared values differ.

    Args:
        sources: all files of the task; others: for each other task, background tasks included, all its files.
    """
    own_values = _values(sources)
    shared, written = set[tuple[str, str]](), set[tuple[str, str]]()
    for files in others if own_values else ():
        values, changed = _shared_by(files)
        common = own_values.keys() & values.keys()
        shared |= common
        written |= common & changed
        written |= {name for name in common if len(own_values[name] | values[name]) > 1}
    return Elsewhere(frozenset(shared), frozenset(written))


@lru_cache(maxsize=16)
def _shared_by(files: tuple[Source, ...]) -> tuple[Values, frozenset[tuple[str, str]]]:
    """What a task does to global PERS data: the values that it declares, and (name, type) of what it may write.

    Args:
        files: all files of the task.
    """
    values = _values(files)
    if not values:
        return values, frozenset()
    program = read_program(files)
    keys = WriteEffects(program).may_be_written
    return values, frozenset(shared_name(d) for d in program.declarations if is_shared(d) and d.key in keys)


def _values(sources: Iterable[Source]) -> Values:
    """All values that files give global PERS data, as text without blanks, by lower-case (name, type)."""
    values: Values = {}
    for source in sources:
        for _, declared in _shared(source):
            text = b"" if declared.init is None else source.data[slice(*declared.init)]
            values.setdefault(shared_name(declared), set()).update([b"".join(text.split())] if text else [])
    return values


def say_written_elsewhere(program: Program) -> list[Diagnostic]:
    """Findings RAP037: data that motion statements name and code outside of them may change, at the first of them."""
    findings: dict[str, Diagnostic] = {}
    elsewhere = program.elsewhere
    for statement in program.statements if elsewhere.written or elsewhere.read_along else ():
        for name, span in names_at(statement.source, statement.span):
            declared = program.declaration(name, statement.module, statement.routine)
            if declared is None or declared.name.lower() in program.taught:
                continue
            if is_shared(declared) and shared_name(declared) in elsewhere.written:
                text = f"another task of the controller writes `{declared.name}`, or declares it with another value"
                help_ = "the value in this file is assumed; where each arm needs its own, declare it `TASK PERS`"
            elif declared.key in elsewhere.read_along:
                text = f"code that is not converted may write `{declared.name}`, which is read along"
                help_ = f"the value in `{declared.source.path}` is assumed"
            else:
                continue
            findings.setdefault(declared.key, Diagnostic("RAP037", "warning", text, statement.source, span, help_))
    return list(findings.values())


def lent_values(sources: Sequence[Source], others: Callable[[], Iterable[Source]]) -> list[Source]:
    """Declarations of other tasks that give a value to global PERS data which this task declares without one.

    Args:
        sources: all files of the task.
        others: reads the files of the other tasks; it is called only if data without a value is declared.

    Returns:
        Read-only copies of the other tasks' files; all but these declarations is blank, so that offsets stay.
    """
    if not any(_OPEN.search(source.data) for source in sources):
        return []
    own = [d for source in sources for _, d in _shared(source)]
    lacking = {shared_name(d) for d in own} - {shared_name(d) for d in own if d.init is not None}
    values = []
    for source in others() if lacking else ():
        lent = [(module, d) for module, d in _shared(source) if d.init is not None and shared_name(d) in lacking]
        lacking -= {shared_name(declared) for _, declared in lent}
        if lent:
            values.append(only(source, [(module, declared.span) for module, declared in lent]))
    return values


def _shared(source: Source) -> Iterator[tuple[Module, Declaration]]:
    """Module and declaration of all global PERS data in a file."""
    for module in parse(source)[0]:
        yield from ((module, d) for d in module.declarations if is_shared(d))
