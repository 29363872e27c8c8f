"""Where declared data is used: whether editing a declaration in place changes anything else."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from typing import Literal

from postproc.diagnostics import Source, Span
from postproc.rapid.data.events import MotionStatement
from postproc.rapid.data.values import MOST_RECORD_LEVELS, Fields, known_records
from postproc.rapid.program.arguments import paired, read_arguments
from postproc.rapid.program.late_binding import BY_NAME, named_by_text
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement
from postproc.rapid.syntax.tokens import IDENTIFIER, names_at

UseKind = Literal["motion", "expression", "argument", "read", "write", "declaration"]
# After a name: the index of an element, then components.
_INDEX = rb"(?:\{(?:[^{}]|\{[^{}]*\})*\}\s*)?"
_COMPONENTS = re.compile(rb"\s*" + _INDEX + rb"((?:\.\s*(?:" + IDENTIFIER + rb")\s*)+)")
_PLAIN_NAME = re.compile(rb"[\w\x80-\xff]+\s*" + _INDEX + rb"(?:\.\s*(?:" + IDENTIFIER + rb")\s*)*")
_NUMBERS_ONLY = re.compile(rb"[\[\]\d.,eE+\-\s]*")

Records = Mapping[str, Fields]


@dataclass(frozen=True, slots=True)
class Use:
    """One place where data is named.

    Args:
        kind: ``motion``: the whole argument of a motion statement (or an element of it); ``expression``: inside an
            expression of one, such as Offs; ``argument``: passed to a routine or another instruction; ``read``: in any
            other expression; ``write``: assigned or possibly written; ``declaration``: in the value of other data.
        source: the file.
        span: the name.
        routine: name of the routine, empty for declarations of a module.
        statement: the motion statement in which the name stands, else None.
        role: role of the argument there, empty outside of motion statements.
        handed: key of the parameter to which a call passes the data (or a part of it) without calculation; else empty.
    """

    kind: UseKind
    source: Source
    span: Span
    routine: str
    statement: MotionStatement | None = None
    role: str = ""
    handed: str = ""


def declaration_uses(program: Program, changes: WriteEffects) -> Mapping[str, tuple[Use, ...]]:
    """All uses of data that may hold a target and of every parameter, by key; data that is not used is missing.

    Uses of components that have nothing to do with targets (the speed in a record beside one) are left out.

    Args:
        changes: write effects of the program.
    """
    uses_by_key: dict[str, list[Use]] = {}
    records = known_records(program.modules)
    types = {d.type for d in program.declarations}
    holding = {kind for kind in types if _holds_target(kind.lower(), records, 0)}
    declared = {d.name.lower() for d in program.declarations if d.type in holding}
    for declaration in program.declarations:
        for span in (*declaration.dims, *((declaration.init,) if declaration.init else ())):
            if not _numbers_only(declaration.source, span):
                for name, at in names_at(declaration.source, span):
                    used = program.declaration(name, declaration.module, declaration.routine)
                    _add(uses_by_key, used, Use("declaration", declaration.source, at, declaration.routine), records)
    for routine in program.all_routines():
        parameters = {p.name: p for p in routine.parameters}
        names = declared | parameters.keys()
        for statement in statements_of(routine):
            motion = program.motions.get((routine.source.path, statement.span[0]))
            named = _of_statement(program, changes, routine, statement) if motion is None else _of_motion(motion, names)
            for name, use in named:
                parameter = parameters.get(name)
                if parameter is None:
                    _add(uses_by_key, program.declaration(name, routine.module, routine.name), use, records)
                elif _touches_target(use, parameter.type, records):
                    uses_by_key.setdefault(routine.parameter_key(name), []).append(use)
            for meant in named_by_text(statement, routine, program) if statement.word in BY_NAME else ():
                _add(uses_by_key, meant, Use("argument", routine.source, statement.span, routine.name), records)
    return {key: tuple(uses) for key, uses in uses_by_key.items()}


def _add(uses_by_key: dict[str, list[Use]], declaration: Declaration | None, use: Use, records: Records) -> None:
    """Add a use to those of declared data if it may read or write a target; nothing if the declaration is None.

    Args:
        uses_by_key: uses by key of the data. records: fields of each record type.
    """
    if declaration is not None and _touches_target(use, declaration.type, records):
        uses_by_key.setdefault(declaration.key, []).append(use)


def _touches_target(use: Use, kind: str, records: Records) -> bool:
    """Whether a use of data may read or write a robtarget, not only components beside one.

    Args:
        kind: type of the data; records: fields of each record type.
    """
    named = _COMPONENTS.match(use.source.data, use.span[1])
    components = re.findall(IDENTIFIER, named[1]) if named else []
    for component in components:
        if kind.lower() == "robtarget":
            return True
        fields = dict(records.get(kind.lower(), ()))
        name = component.decode("latin-1").lower()
        if name not in fields:
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


def _of_motion(motion: MotionStatement, names: Set[str]) -> list[tuple[str, Use]]:
    """Uses of the given lower-case names in the arguments of a motion statement, as pairs of name and use."""
    source, shape, uses = motion.source, motion.shape, list[tuple[str, Use]]()
    some = len(motion.ends) if shape.words.isdisjoint(names) else len(shape.roles)
    for role, i in zip(shape.roles, range(some), strict=False):
        span = motion.spans(i)[0]
        if _numbers_only(source, span):
            continue
        plain = _is_plain(source.data[slice(*span)])
        for at, (name, place) in enumerate(names_at(source, span)):
            kind: UseKind = "expression" if at or not plain else "motion"
            kind = "write" if at == 0 and role in shape.signature.results else kind
            if name in names:
                uses.append((name, Use(kind, source, place, motion.routine, motion, role)))
    return uses


def _of_statement(
    program: Program, changes: WriteEffects, routine: Routine, statement: Statement
) -> Iterator[tuple[str, Use]]:
    """Uses of data in a statement that is no motion, as pairs of lower-case name and use.

    Args:
        changes: write effects of the program.
    """
    source = routine.source
    parameters = {p.name for p in routine.parameters}
    spans: tuple[Span, ...] = statement.parts
    other: UseKind = "read"
    if statement.kind in ("call", "opaque", "connect"):
        start = statement.span[0] + (len(statement.word) if statement.kind == "call" else 0)
        spans, other = ((start, statement.span[1]),), "argument"
    spans += tuple(condition for branch in statement.branches for condition in branch.conditions)
    written = changes.of([statement], routine) if statement.kind in ("call", "opaque") else set()
    handed = _handed_over(program, routine, statement) if statement.kind == "call" else {}
    for number, span in enumerate(spans):
        for at, (name, where) in enumerate(names_at(source, span)):
            declaration = None if name in parameters else program.declaration(name, routine.module, routine.name)
            key = "%" + name if declaration is None else declaration.key
            if key in written or (statement.kind == "assign" and number == 0 and at == 0):
                yield name, Use("write", source, where, routine.name)
            else:
                yield name, Use(other, source, where, routine.name, handed=handed.get(where[0], ""))


def _handed_over(program: Program, routine: Routine, statement: Statement) -> Mapping[int, str]:
    """Keys of the parameters to which a call passes plain data, by the byte offset of that data in the call."""
    called = program.routine(statement.word, routine.module)
    if called is None:
        return {}
    data = routine.source.data
    pieces = read_arguments(data, statement.span[0] + len(statement.word), statement.span[1])
    return {
        span[0]: called.parameter_key(parameter.name)
        for parameter, span in paired(called.parameters, pieces)
        if _is_plain(data[span[0] : span[1]])
    }


def _is_plain(text: bytes) -> bool:
    """Whether an argument is only a name, with an index or components at most."""
    return _PLAIN_NAME.fullmatch(text.strip()) is not None


def _numbers_only(source: Source, span: Span) -> bool:
    """Whether the text at a span is an aggregate of numbers (``[1,[2,3]]``) in which no name stands."""
    return source.data[span[0] : span[0] + 1] == b"[" and bool(_NUMBERS_ONLY.fullmatch(source.data, *span))
