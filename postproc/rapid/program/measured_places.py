"""Data that a program sets to where its arm stands: what the controller reads there holds the correction already."""

from __future__ import annotations

import re

from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import identifiers

_READS_POSITION = re.compile(rb"(?i)(?<![\w.])c(?:robt|pos|jointt)\s*\(")


def measured_places(program: Program) -> frozenset[str]:
    """Keys of data that is assigned what CRobT, CPos or CJointT give or what a search finds, or from such data.

    A routine that reads the position may hand it on: to what it is called with, and where its value is assigned.
    """
    routines = list(program.all_routines())
    words = {r.name.lower(): identifiers(r.source.data[slice(*r.span)]) for r in routines}
    reading = {r.name.lower() for r in routines if _READS_POSITION.search(r.source.data, *r.span)}
    while more := {name for name, own in words.items() if own & reading} - reading:
        reading |= more
    found: set[str] = set()
    copies: list[tuple[set[str], set[str]]] = []
    for routine in routines:
        for statement in statements_of(routine):
            written, value = _written(statement, routine, program)
            names = identifiers(value)
            if _READS_POSITION.search(value) or names & reading:
                found |= _keys(written, routine, program)
            else:
                copies.append((_keys(written, routine, program), _keys(names, routine, program)))
            motion = program.motion(routine.source, statement) if statement.kind == "call" else None
            if motion is not None and (place := motion.argument("found")) is not None:
                found |= _keys(identifiers(place.text.encode("latin-1")), routine, program)
    before = -1
    while before != len(found):
        before = len(found)
        found |= {key for keys, names in copies if names & found for key in keys}
    return frozenset(found)


def _written(statement: Statement, routine: Routine, program: Program) -> tuple[set[str], bytes]:
    """Names of the data that a statement may write, and the text that its value comes from."""
    data = routine.source.data
    if statement.kind == "assign":
        return {statement.word}, data[slice(*statement.parts[1])]
    if statement.kind == "call" and program.routine(statement.word, routine.module) is not None:
        text = data[slice(*statement.span)]
        return identifiers(text) - {statement.word}, text
    return set(), b""


def _keys(names: set[str], routine: Routine, program: Program) -> set[str]:
    """Keys of the data that names mean in a routine."""
    declared = (program.declaration(name, routine.module, routine.name) for name in names)
    return {declaration.key for declaration in declared if declaration is not None}
