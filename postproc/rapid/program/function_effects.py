"""Functions that are called in expressions: which of them may write data, and which do more than calculate."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Set

from postproc.diagnostics import Source, Span
from postproc.grouping import closure
from postproc.rapid.data.builtins import FUNCTIONS, RUN_TIME
from postproc.rapid.program.arguments import BY_REFERENCE
from postproc.rapid.program.instructions import COUNTING
from postproc.rapid.program.late_binding import STRING_LITERAL
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import word_set

# Functions that only read their arguments, beside those that are worked out here (``FUNCTIONS``) and known at run time,
# of which GetNextSym writes.
READING = word_set("""
    absdnum and argname atandnum bitand bitanddnum bitcheck bitcheckdnum bitlsh bitlshdnum bitneg bitnegdnum
    bitor bitordnum bitrsh bitrshdnum bitxor bitxordnum bytetostr calcjointt calcrobt calcrotaxframez
    calcrotaxisframe cosdnum crossprod dectohex defaccframe div dnumtostr hextodec ispers isvar max min mirpos
    mod modtime modtimednum not or powdnum present rawbyteslen rounddnum sindnum sqrtdnum strdigcalc strdigcmp
    strfind strmap strmatch strmemb strorder strtobyte tandnum truncdnum type xor
    """).union(FUNCTIONS, RUN_TIME) - {"getnextsym"}
# The look-behind keeps the search from starting again at every letter of a long word.
_CALLED = re.compile(rb"(?<![\w\x80-\xff])([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+\(")


def writing_functions(source: Source, program: Program) -> re.Pattern[bytes] | None:
    """A pattern that matches calls in this file of functions that may write data; None if there is none.

    They are the program's own functions and those in none of the files, except the controller's that only read.
    """
    names = {name.lower() for name in _CALLED.findall(source.data)} - {name.encode() for name in READING}
    kinds = {r.name.lower().encode("latin-1"): r.kind for r in program.all_routines()}
    return _calls_of({name for name in names if kinds.get(name, "FUNC") == "FUNC"})


def called_in(functions: re.Pattern[bytes], statement: Statement, data: bytes) -> Iterator[tuple[str, Span]]:
    """Name and span of the arguments of each call, in a statement's own expressions, that the pattern matches.

    Args:
        functions: a pattern of ``writing_functions``; data: bytes of the statement's file.
    """
    for start, end in _expressions(statement):
        if not functions.search(data, start, end):
            continue
        text = STRING_LITERAL.sub(lambda quoted: b" " * len(quoted[0]), data[start:end])
        closing = _closings(text)
        for match in functions.finditer(text):
            yield match[1].decode("latin-1"), (start + match.end(), start + closing.get(match.end() - 1, len(text)))


def acting_functions(
    routines: Mapping[str, Routine], changed: Mapping[str, Set[str]], callers: Mapping[str, Iterable[str]]
) -> re.Pattern[bytes] | None:
    """A pattern that matches calls of the program's functions that do more than calculate; None if there is none.

    They wait, set a signal, move the arm or write lasting data, or call a routine that does.

    Args:
        routines: by key; changed: by key of a routine, keys of the data that it changes; callers: by key of a routine,
            keys of the routines that call it.
    """
    names = {routine.name.lower() for routine in routines.values()}.union(COUNTING)
    direct = set()
    for key, routine in routines.items():
        referred = {"%" + p.name for p in routine.parameters if p.mode in BY_REFERENCE}
        lasting = any(k in referred or ("%" not in k and k.split(".")[1:2] in ([], [""])) for k in changed[key])
        if lasting or any(s.kind == "call" and s.word not in names for s in statements_of(routine)):
            direct.add(key)
    acting = closure(direct, lambda key: callers.get(key, ()))
    return _calls_of({routines[k].name.lower().encode("latin-1") for k in acting if routines[k].kind == "FUNC"})


def _calls_of(names: Set[bytes]) -> re.Pattern[bytes] | None:
    """A pattern of a call of one of these functions up to its parenthesis, whatever the case; None without names.

    Group 1 of a match is the name.
    """
    words = b"|".join(map(re.escape, sorted(names)))
    return re.compile(rb"(?<![\w\x80-\xff.])(" + words + rb")\s*\(", re.IGNORECASE) if names else None


def _expressions(statement: Statement) -> Iterator[Span]:
    """Spans of a statement's own expressions; of a call everything behind its name."""
    if statement.kind == "call":
        yield statement.span[0] + len(statement.word), statement.span[1]
    yield from statement.parts
    for branch in statement.branches:
        yield from branch.conditions


def _closings(text: bytes) -> dict[int, int]:
    """Offset of the closing parenthesis by the offset of its opening one; those that are not closed are missing."""
    closings: dict[int, int] = {}
    opened: list[int] = []
    for mark in re.finditer(rb"[()]", text):
        if mark[0] == b"(":
            opened.append(mark.start())
        elif opened:
            closings[opened.pop()] = mark.start()
    return closings
