"""What files beside a program declare: data that it lacks, and data that it shares with other tasks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass
from functools import lru_cache

from postproc.diagnostics import Diagnostic, Matter, Source, Span, has_errors
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.program.program import OtherTaskData, Program, names_of, read_program
from postproc.rapid.program.scopes import is_shared, shared_name
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Declaration, Module
from postproc.rapid.syntax.tokens import names_at

MOST_NAMED = 6  # names in one finding
_RECORD = re.compile(rb"(?ims)^[ \t]*(?:RECORD[ \t]+(\w+)\b.*?^[ \t]*ENDRECORD|ALIAS[ \t]+\w+[ \t]+(\w+)[ \t]*;)")
_END = len(b"ENDMODULE")
Near = Callable[[str], tuple[Sequence[Source], Sequence[Source]]]
"""Files that declare a name (lower case): those that a program's own task may hold, and those of other tasks."""


@dataclass(frozen=True, slots=True)
class _Item:
    """Module data or a record type that a file near the program declares.

    Args:
        span: of the text. declaration: None of a record. written: whether routines of its file may write it.
    """

    module: Module
    name: str
    span: Span
    declaration: Declaration | None = None
    written: bool = False

    @property
    def value(self) -> bytes:
        """The text behind the name without blanks: what two declarations have in common that mean the same."""
        data, declared = self.module.source.data, self.declaration
        if declared is None:
            return b"".join(data[slice(*self.span)].lower().split())
        parts = [data[slice(*span)] for span in (*declared.dims, *([declared.init] if declared.init else []))]
        return b"".join([declared.type.lower().encode("latin-1", "replace"), *parts]).translate(None, b" \t\r\n")


@dataclass(frozen=True, slots=True)
class ReadAlong:
    """Declarations that are read along.

    Args:
        sources: read-only copies of their files, in which all but these is blank, so that offsets stay.
        written: keys of data among these that code outside of the program may write.
        findings: RAP038, which file declares what; RAP039, what is declared with different values.
    """

    sources: tuple[Source, ...] = ()
    written: frozenset[str] = frozenset()
    findings: tuple[Diagnostic, ...] = ()


def read_along(program: Program, near: Near) -> ReadAlong:
    """Find the declarations of what a program names and does not declare, and of what these name in turn.

    Data is taken from a file that the program's task may hold if it is not LOCAL; from another task of the controller
    only if it is global PERS data, which is one object in all tasks. Where two files declare different values, none is
    taken; nor is anything from a file that cannot be parsed, or of which the program holds another version.

    Args:
        near: finds files by what they declare.
    """
    names = frozenset(module.name.lower() for module in program.modules)
    waiting = dict.fromkeys(_lacking(program))
    seen = set(waiting)
    items: dict[tuple[str, Span], _Item] = {}
    differing: dict[tuple[str, ...], list[str]] = {}
    while waiting:
        name, _ = waiting.popitem()
        candidates = _candidates(name, program, near, names)
        if len({item.value for item in candidates}) > 1:
            files = tuple(dict.fromkeys(item.module.source.path for item in candidates))
            differing.setdefault(files, []).append(candidates[0].name)
        elif candidates:
            for item in (candidates[0], *_named_in_module(candidates[0])):
                items[item.module.source.path, item.span] = item
                named = {word for word, _ in names_at(item.module.source, item.span)}
                new = {word for word in named - seen if program.declaration(word) is None and word not in PREDEFINED}
                seen |= new
                waiting |= dict.fromkeys(sorted(new))
    by_file: dict[str, list[_Item]] = {}
    for item in items.values():
        by_file.setdefault(item.module.source.path, []).append(item)
    findings = [_declares(path, by_file[path]) for path in sorted(by_file)]
    findings += [_differ(files, differing[files]) for files in sorted(differing)]
    written = {item.declaration.key for item in items.values() if item.declaration is not None and item.written}
    copies = tuple(
        only(i[0].module.source, [(item.module, item.span) for item in i]) for _, i in sorted(by_file.items())
    )
    return ReadAlong(copies, frozenset(written), tuple(findings))


def declares(source: Source, name: str) -> bool:
    """Whether a file gives data of this name (any case) a value, and not for its own module alone."""
    return any(item.name.lower() == name.lower() and _serves(item, None, False) for item in _items(source))


def _lacking(program: Program) -> Iterator[str]:
    """Yield lower-case names that the program uses and gives no meaning, and shared data to which it gives no value."""
    records = {record.name.lower() for module in program.modules for record in module.records}
    for module in program.modules:
        for declared in module.declarations:
            yield from _unknown_at(program, module, "", declared.span, records)
        for routine in module.routines:
            yield from _unknown_at(program, module, routine.name, routine.span, records | names_of(routine))


def _unknown_at(program: Program, module: Module, routine: str, span: Span, known: Set[str]) -> Iterator[str]:
    """Yield the names in a piece of a module's text that mean nothing there, or shared data without a value.

    Args:
        routine: in which the text stands, empty outside. known: names that mean something there besides data.
    """
    for name in dict.fromkeys(name for name, _ in names_at(module.source, span)):
        declared = program.declaration(name, module.name, routine)
        if declared is not None:
            if declared.init is None and is_shared(declared):
                yield name
        elif name not in known and name not in PREDEFINED and program.routine(name, module.name) is None:
            yield name


def _candidates(name: str, program: Program, near: Near, names: frozenset[str]) -> list[_Item]:
    """Items of that name in the files that the program's task may hold; if there is none, those of other tasks.

    Args:
        name: in lower case. names: names of the program's modules in lower case.
    """
    declared = program.declaration(name)
    same_task, other_tasks = near(name)
    for files, shared in ((same_task, declared is not None), (other_tasks, True)):
        items = [item for file in files for item in _items(file) if item.name.lower() == name]
        items = [item for item in items if item.module.name.lower() not in names and _serves(item, declared, shared)]
        if items:
            return items
    return []


def _serves(item: _Item, declared: Declaration | None, shared: bool) -> bool:
    """Whether an item may stand for a name: not LOCAL, with a value; shared PERS data only if it must be.

    Args:
        declared: what the program itself declares without a value. shared: nothing but global PERS data serves.
    """
    data = item.declaration
    if data is None:
        return not shared
    if data.scope == "LOCAL" or (data.init is None and data.storage != "VAR") or (shared and not is_shared(data)):
        return False
    return declared is None or shared_name(declared) == shared_name(data)


@lru_cache(maxsize=256)
def _items(source: Source) -> tuple[_Item, ...]:
    """What a file declares outside of routines; () if it cannot be parsed."""
    program = read_program(source)
    if has_errors(program.diagnostics):
        return ()
    written = WriteEffects(program).everything
    items: list[_Item] = []
    for module in program.modules:
        for data in module.declarations:
            open_ = data.storage == "VAR" or data.key in written  # a VAR has what the program has set before
            items.append(_Item(module, data.name, data.span, data, open_))
        for record in _RECORD.finditer(source.data, *module.span):
            name = (record[1] or record[2]).decode("latin-1")
            items.append(_Item(module, name, record.span()))
    return tuple(items)


def _named_in_module(item: _Item) -> list[_Item]:
    """LOCAL data of its own module that the text of an item names, with what that names in turn."""
    local = {
        i.name.lower(): i
        for i in _items(item.module.source)
        if i.declaration is not None and i.declaration.scope == "LOCAL" and i.module.span == item.module.span
    }
    items, waiting = dict[str, _Item](), [item]
    while waiting:
        at = waiting.pop()
        for name, _ in names_at(at.module.source, at.span):
            if name in local and name not in items:
                items[name] = local[name]
                waiting.append(local[name])
    return list(items.values())


def only(source: Source, parts: Iterable[tuple[Module, Span]]) -> Source:
    """A read-only copy of a file in which all but these parts of its modules is blank: offsets and lines stay."""
    blank = bytearray(re.sub(rb"[^\r\n]", b" ", source.data))
    for module, part in parts:
        for begin, end in (module.head, part, (module.span[1] - _END, module.span[1])):
            blank[begin:end] = source.data[begin:end]
    return Source(source.path, bytes(blank), read_only=True)


def _declares(path: str, items: Sequence[_Item]) -> Diagnostic:
    """RAP038: what of a file is read along."""
    text = f"`{path}` near it is read along: it declares {_named(item.name for item in items)}"
    help_ = "it stays as it is; `--alone` reads no file that is not named"
    return Diagnostic("RAP038", "info", text, help=help_, matter=Matter.READ_ALONG)


def _differ(files: Sequence[str], names: Iterable[str]) -> Diagnostic:
    """RAP039: data that files near the program declare differently, so that none of them is read along."""
    where = " and ".join(f"`{path}`" for path in files[:3])
    text = f"{where} near it declare different values of {_named(names)}: none is taken"
    return Diagnostic("RAP039", "warning", text, help=f"say which file is meant, as in `--with {files[0]}`")


def _named(names: Iterable[str]) -> str:
    """Names in backticks, sorted; of many the first and how many more there are."""
    every = sorted(set(names), key=str.lower)
    shown = ", ".join(f"`{name}`" for name in every[:MOST_NAMED])
    return shown + (f" and {len(every) - MOST_NAMED} more" if len(every) > MOST_NAMED else "")


_OPEN = re.compile(rb"(?i)\bPERS\s[^:;]{0,500}+;")  # a declaration without a value
Values = dict[tuple[str, str], set[bytes]]
"""The values that declarations give data, by name and type: their text without blanks."""


def data_of_other_tasks(sources: Sequence[Source], others: Iterable[tuple[Source, ...]]) -> OtherTaskData:
    """Which of a task's global PERS data other tasks of the controller declare too, and which of it they may change.

    It counts as changed if another task may write it, or if their declared values differ.

    Args:
        sources: all files of the task; others: for each other task, background tasks included, all its files.
    """
    local_values = _values(sources)
    shared, written = set[tuple[str, str]](), set[tuple[str, str]]()
    for files in others if local_values else ():
        values, changed = _shared_by(files)
        common = local_values.keys() & values.keys()
        shared |= common
        written |= common & changed
        written |= {name for name in common if len(local_values[name] | values[name]) > 1}
    return OtherTaskData(frozenset(shared), frozenset(written))


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
    other_tasks = program.other_tasks
    for statement in program.statements if other_tasks.written or other_tasks.read_along else ():
        for name, span in names_at(statement.source, statement.span):
            declared = program.declaration(name, statement.module, statement.routine)
            if declared is None or declared.name.lower() in program.taught:
                continue
            if is_shared(declared) and shared_name(declared) in other_tasks.written:
                text = f"another task of the controller writes `{declared.name}`, or declares it with another value"
                help_ = "the value in this file is assumed; where each arm needs its own, declare it `TASK PERS`"
            elif declared.key in other_tasks.read_along:
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
    requested = [d for source in sources for _, d in _shared(source)]
    lacking = {shared_name(d) for d in requested} - {shared_name(d) for d in requested if d.init is not None}
    values = []
    for source in others() if lacking else ():
        initial = [(module, d) for module, d in _shared(source) if d.init is not None and shared_name(d) in lacking]
        lacking -= {shared_name(declared) for _, declared in initial}
        if initial:
            values.append(only(source, [(module, declared.span) for module, declared in initial]))
    return values


def _shared(source: Source) -> Iterator[tuple[Module, Declaration]]:
    """Module and declaration of all global PERS data in a file."""
    for module in parse(source)[0]:
        yield from ((module, d) for d in module.declarations if is_shared(d))
