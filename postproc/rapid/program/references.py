"""Where declared data is used: whether editing a declaration in place changes anything else."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.data.values import MOST_RECORD_LEVELS, Fields, known_records
from postproc.rapid.program.arguments import paired, read_arguments
from postproc.rapid.program.late_binding import BY_NAME, named_by_text
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import IDENTIFIER, names_at

# After a name: the index of an element, then components.
_INDEX = rb"(?:\{(?:[^{}]|\{[^{}]*\})*\}\s*)?"
_COMPONENTS = re.compile(rb"\s*" + _INDEX + rb"((?:\.\s*(?:" + IDENTIFIER + rb")\s*)+)")
_PLAIN_NAME = re.compile(rb"[\w\x80-\xff]+\s*" + _INDEX + rb"(?:\.\s*(?:" + IDENTIFIER + rb")\s*)*")
_NUMBERS_ONLY = re.compile(rb"[\[\]\d.,eE+\-\s]*")

Records = Mapping[str, Fields]


@dataclass(frozen=True, slots=True)
class Use:
    """One place where data is named; without arguments any that is neither a target nor passed to a routine.

    Args:
        statement: the motion statement whose target or circle point the data is, or an element of it.
        displaced: it stands in an expression there, such as Offs.
        parameter: key of the parameter to which a call passes the data (or a part of it) without calculation.
    """

    statement: StatementKey | None = None
    displaced: bool = False
    parameter: str = ""


OTHER_USE = Use()


def declaration_uses(program: Program) -> Mapping[str, tuple[Use, ...]]:
    """All uses of data that may hold a target and of every parameter, by key; data that is not used is missing.

    Uses of components that have nothing to do with targets (the speed in a record beside one) are left out.
    """
    uses_by_key: dict[str, list[Use]] = {}
    records = known_records(program.modules)
    holding = {kind for kind in {d.type for d in program.declarations} if _holds_target(kind.lower(), records, 0)}
    declared = {d.name.lower() for d in program.declarations if d.type in holding}

    def add(name: str, scope: tuple[str, str], use: Use, source: Source, end: int) -> None:
        """Add a use of the declared data that a name means in a module and routine (``scope``) and that ends there."""
        used = program.declaration(name, *scope)
        if used is not None and _touches_target(source.data, end, used.type, records):
            uses_by_key.setdefault(used.key, []).append(use)

    for declaration in program.declarations:
        source, scope = declaration.source, (declaration.module, declaration.routine)
        for span in (*declaration.dims, *((declaration.init,) if declaration.init else ())):
            for name, at in names_at(source, span) if not _numbers_only(source, span) else ():
                add(name, scope, OTHER_USE, source, at[1])
    for routine in program.all_routines():
        source, scope = routine.source, (routine.module, routine.name)
        parameters = {p.name: p for p in routine.parameters}
        names = declared | parameters.keys()
        for statement in statements_of(routine):
            motion = program.motions.get((source.path, statement.span[0]))
            uses = _of_statement(program, routine, statement) if motion is None else _of_motion(motion, names)
            for name, end, use in uses:
                if name not in parameters:
                    add(name, scope, use, source, end)
                elif _touches_target(source.data, end, parameters[name].type, records):
                    uses_by_key.setdefault(routine.parameter_key(name), []).append(use)
            for meant in named_by_text(statement, routine, program) if statement.word in BY_NAME else ():
                if meant.type in holding:
                    uses_by_key.setdefault(meant.key, []).append(OTHER_USE)
    return {key: tuple(uses) for key, uses in uses_by_key.items()}


def _touches_target(data: bytes, end: int, kind: str, records: Records) -> bool:
    """Whether a use of data may read or write a robtarget, not only components beside one.

    Args:
        data: bytes of the file; end: of the name in it; kind: type of the data; records: fields of each record type.
    """
    named = _COMPONENTS.match(data, end)
    for component in re.findall(IDENTIFIER, named[1]) if named else []:
        fields = dict(records.get(kind.lower(), ()))
        name = component.decode("latin-1").lower()
        if kind.lower() == "robtarget" or name not in fields:
            return True
        kind = fields[name]
    return _holds_target(kind.lower(), records, 0)


def _holds_target(kind: str, records: Records, depth: int) -> bool:
    """Whether a type is ``robtarget`` or a record that contains one; too deeply nested records count as such.

    Args:
        kind: type in lower case; records: fields of each record type; depth: in how many records it is nested.
    """
    inside = (_holds_target(part.lower(), records, depth + 1) for _, part in records.get(kind, ()))
    return kind == "robtarget" or depth > MOST_RECORD_LEVELS or any(inside)


def _of_motion(motion: MotionStatement, names: Set[str]) -> Iterator[tuple[str, int, Use]]:
    """Uses of the given lower-case names in the arguments of a motion statement: name, end of the name, use."""
    source, shape = motion.source, motion.shape
    count = len(motion.ends) if shape.words.isdisjoint(names) else len(shape.roles)
    for role, i in zip(shape.roles, range(count), strict=False):
        span = motion.spans(i)[0]
        if _numbers_only(source, span):
            continue
        plain = _is_plain(source.data[slice(*span)])
        for number, (name, place) in enumerate(names_at(source, span)):
            if name in names:
                target = Use(motion.key, displaced=number > 0 or not plain)
                yield name, place[1], target if role in ("to", "via") else OTHER_USE


def _of_statement(program: Program, routine: Routine, statement: Statement) -> Iterator[tuple[str, int, Use]]:
    """Uses of data in a statement that is no motion: lower-case name, end of the name, use."""
    data, spans = routine.source.data, statement.parts
    passed: dict[int, Use] = {}
    if statement.kind in ("call", "opaque", "connect"):
        start = statement.span[0] + (len(statement.word) if statement.kind == "call" else 0)
        spans = ((start, statement.span[1]),)
        called = program.routine(statement.word, routine.module) if statement.kind == "call" else None
        if called is not None:
            for parameter, span in paired(called.parameters, read_arguments(data, *spans[0])):
                if _is_plain(data[slice(*span)]):
                    passed[span[0]] = Use(parameter=called.parameter_key(parameter.name))
    for span in (*spans, *(condition for branch in statement.branches for condition in branch.conditions)):
        for name, place in names_at(routine.source, span):
            yield name, place[1], passed.get(place[0], OTHER_USE)


def _is_plain(text: bytes) -> bool:
    """Whether an argument is only a name, with an index or components at most."""
    return _PLAIN_NAME.fullmatch(text.strip()) is not None


def _numbers_only(source: Source, span: Span) -> bool:
    """Whether the text at a span is an aggregate of numbers (``[1,[2,3]]``) in which no name stands."""
    return source.data[span[0] : span[0] + 1] == b"[" and bool(_NUMBERS_ONLY.fullmatch(source.data, *span))
