"""Functions that are called in expressions: which of them may write data, which do more than calculate, and which data
holds where the arm stands: what the controller reads there holds the correction already.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Set
from itertools import chain

from postproc.diagnostics import Source, Span
from postproc.grouping import closure, grouped
from postproc.rapid.data.builtins import FUNCTIONS, RUN_TIME
from postproc.rapid.program.arguments import BY_REFERENCE
from postproc.rapid.program.instructions import COUNTING
from postproc.rapid.program.late_binding import TEXT
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import identifiers, word_set

# Functions that only read their arguments, beside those that are worked out here (``FUNCTIONS``) and known at run time,
# of which GetNextSym writes.
READING = word_set("""
    absdnum and argname atandnum bitand bitanddnum bitcheck bitcheckdnum bitlsh bitlshdnum bitneg bitnegdnum bitor
    bitordnum bitrsh bitrshdnum bitxor bitxordnum bytetostr calcjointt calcrobt calcrotaxframez calcrotaxisframe
    corrread cosdnum crossprod cspeedoverride dectohex defaccframe div dnumtostr eventtype exechandler execlevel
    filesize filetime fssize getmaxnumberofcyclicbool getmecunitname getmodalpayloadmode getserviceinfo getsysinfo
    gettaskname ginputdnum goutputdnum hextodec indinpos indspeed iounitstate isfile isleadthrough ismechunitactive
    ispers isstopmoveact isstopstateevent issyncmoveon issysid isvar max maxextlinearspeed
    maxextreorientspeed maxrobreorientspeed maxrobspeed min mirpos mod modexist modtime modtimednum motionplannerno
    nonmotionmode not opmode or paridposvalid paridrobvalid pathlengthget pathlevel
    pathrecvalidbwd pathrecvalidfwd pfrestart powdnum ppmovedinmanmode present progmemfree rawbyteslen readbin
    readmotor readnum readstr readstrbin readvar remainingretries rmqgetslotname robname robos rounddnum runmode
    sindnum socketgetstatus socketpeek sqrtdnum stcalcforce stcalctorque stiscalib stisclosed stisindgun stisopen
    strdigcalc strdigcmp strfind strmap strmatch strmemb strorder strtobyte tandnum taskisactive taskisexecuting
    taskrunmec taskrunrob tasksinsync testsignread textget texttabfreetouse texttabget truncdnum type uialphaentry
    uiclientexist uidnumentry uidnumtune uilistview uimessagebox uinumentry uinumtune validio xor
    """).union(FUNCTIONS, RUN_TIME) - {"getnextsym"}
# The look-behind keeps the search from starting again at every letter of a long word.
_CALLED = re.compile(rb"(?<![\w\x80-\xff])([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+\(")

_READS_POSITION = re.compile(rb"(?i)(?<![\w.])c(?:robt|pos|jointt)\s*\(")
_NO_PLACE = re.compile(rb"(?i)\.\s*(?:extax|robconf)\b")


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
        text = TEXT.sub(lambda quoted: b" " * len(quoted[0]), data[start:end])
        closing = _closings(text)
        for found in functions.finditer(text):
            yield found[1].decode("latin-1"), (start + found.end(), start + closing.get(found.end() - 1, len(text)))


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
    found: dict[int, int] = {}
    opened: list[int] = []
    for mark in re.finditer(rb"[()]", text):
        if mark[0] == b"(":
            opened.append(mark.start())
        elif opened:
            found[opened.pop()] = mark.start()
    return found


def measured_places(program: Program) -> frozenset[str]:
    """Keys of data that may hold where the arm stands: from CRobT, CPos, CJointT or a search, or copied from such.

    A routine that reads the position may pass it on: to the data in its call, and to where its value is assigned.
    """
    routines = list(program.all_routines())
    reading = {r.name.lower() for r in routines if _READS_POSITION.search(r.source.data, *r.span)}
    if not reading and not any(["found" in motion.roles for motion in program.statements]):
        return frozenset()
    naming = grouped((word, r.name.lower()) for r in routines for word in identifiers(r.source.data[slice(*r.span)]))
    reading = closure(reading, lambda name: naming.get(name, ()))
    found: set[str] = set()
    copied: dict[str, list[set[str]]] = {}  # by key of data, those of data that it may be copied to
    for routine in routines:
        for statement in statements_of(routine):
            written, value = _written(statement, routine, program)
            names = identifiers(value)
            if _READS_POSITION.search(value) or names & reading:
                found |= _keys(written, routine, program)
            elif written:
                keys = _keys(written, routine, program)
                for key in _keys(names, routine, program):
                    copied.setdefault(key, []).append(keys)
            motion = program.motion(routine.source, statement) if statement.kind == "call" else None
            if motion is not None and (place := motion.argument("found")) is not None:
                found |= _keys(identifiers(place.text.encode("latin-1")), routine, program)
    return frozenset(closure(found, lambda key: chain.from_iterable(copied.get(key, ()))))


def _written(statement: Statement, routine: Routine, program: Program) -> tuple[set[str], bytes]:
    """Lower-case names of the data that a statement may write, and the text from which the written value comes.

    Both are empty for an assignment to ``extax`` or ``robconf``, and for statements other than assignments and calls of
    the program's routines.
    """
    data = routine.source.data
    if statement.kind == "assign":
        if _NO_PLACE.search(data, *statement.parts[0]):
            return set(), b""
        return {statement.word}, data[slice(*statement.parts[1])]
    if statement.kind == "call" and program.routine(statement.word, routine.module) is not None:
        text = data[slice(*statement.span)]
        return identifiers(text) - {statement.word}, text
    return set(), b""


def _keys(names: set[str], routine: Routine, program: Program) -> set[str]:
    """Keys of the declared data that lower-case names mean inside a routine; undeclared names are dropped."""
    declared = (program.declaration(name, routine.module, routine.name) for name in names)
    return {declaration.key for declaration in declared if declaration is not None}
