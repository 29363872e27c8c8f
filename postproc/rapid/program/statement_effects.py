"""What one statement may write and which routines it may run; which functions do more than calculate."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass

from postproc.diagnostics import Source, Span
from postproc.grouping import closure, grouped
from postproc.rapid.data.builtins import FUNCTIONS, RUN_TIME
from postproc.rapid.data.events import MotionStatement
from postproc.rapid.program.arguments import BY_REFERENCE, Piece, argument_name, component_path, paired, read_arguments
from postproc.rapid.program.late_binding import (
    BY_NAME,
    LATE,
    STRING_LITERAL,
    Template,
    late_call,
    may_be,
    named_by_text,
    text_template,
)
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.program.signatures import (
    COUNTING,
    KNOWN_INSTRUCTIONS,
    LASTING,
    READ_ONLY,
    SIGNATURES,
    STATE_OF_INSTRUCTION,
    WRITTEN,
)
from postproc.rapid.syntax.nodes import Declaration, Routine, Statement
from postproc.rapid.syntax.tokens import word_set

UNSEEN = "@unseen"  # all that code in none of the files may write (see ``WriteEffects.exposed``)

# A call of a routine of the program: its key, and for every parameter by reference the data passed.
CalledWith = tuple[str, tuple[tuple[str, str], ...]]


@dataclass(frozen=True, slots=True)
class StatementEffect:
    """What a statement, or the functions in its expressions, may write and run.

    Args:
        keys: of what is written: declarations, ``@`` state, parameters of the routine as ``%name``, ``UNSEEN``.
        calls: keys of the program's routines that may run, with (parameter, data) passed by reference.
        unseen: names of routines that may run and are in none of the files.
    """

    keys: frozenset[str] = frozenset()
    calls: frozenset[CalledWith] = frozenset()
    unseen: tuple[str, ...] = ()


NO_EFFECT = StatementEffect()
_MOVES = StatementEffect(frozenset({"@moves"}))
_ASSIGNED = re.compile(rb"(?<![\w\x80-\xff])([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+:=")


class EffectReader:
    """Reads the effects of statements of a program, and records from all of them what is written by what.

    Args:
        paths: by key of data, the components of it that are written, such as ("trans", "x"); an empty path for all.
        writers: by key of data, names of instructions and unknown routines that write it; empty: the program itself.
        lasting: keys of data that an instruction goes on writing at any later moment.
        started: keys of routines that a motion starts; ``UNSEEN`` if one is in none of the files.
    """

    def __init__(self, program: Program) -> None:
        """Start with no statement read."""
        self.program = program
        self.paths: dict[str, set[tuple[str, ...]]] = {}
        self.writers: dict[str, set[str]] = {}
        self.lasting: set[str] = set()
        self.started: set[str] = set()
        self.calling: dict[str, tuple[re.Pattern[bytes], Sequence[int]]] = {}
        """By file: what matches calls of functions that may write, and where these stand."""
        for source in program.sources:
            if (writing := writing_functions(source, program)) is not None:
                self.calling[source.path] = writing, [match.start() for match in writing.finditer(source.data)]
        self._procedures = grouped((r.name.lower(), r) for r in program.all_routines() if r.kind == "PROC")
        self._functions: dict[tuple[str, Span], StatementEffect] = {}

    def of_statement(self, statement: Statement, routine: Routine) -> StatementEffect:
        """Effect of a motion, call, assignment or unreadable text, without the functions in its expressions.

        Other statements have none.

        Args:
            routine: in which it stands.
        """
        if statement.kind not in ("assign", "call", "opaque"):
            return NO_EFFECT
        motion = self.program.motions.get((routine.source.path, statement.span[0]))
        if motion is not None:
            return self._of_motion(motion, routine)
        data, reading = routine.source.data, _Reading(self, routine)
        if statement.kind == "assign":
            reading.add(statement.word, component_path(data, statement.parts[0]))
        elif statement.kind == "call":
            reading.call(statement)
        else:
            for match in _ASSIGNED.finditer(data[slice(*statement.span)]):  # in text that could not be read
                reading.add(match[1].decode("latin-1").lower())
        return reading.effect()

    def _of_motion(self, motion: MotionStatement, routine: Routine) -> StatementEffect:
        """The effect of a motion: it moves the arm, a search writes what it finds, and a procedure may be started."""
        data, roles = routine.source.data, motion.roles
        if not motion.signature.results and "procedure" not in roles:  # as nearly all
            return _MOVES
        reading = _Reading(self, routine)
        reading.keys.add("@moves")
        for result in motion.results:
            reading.add(argument_name(data, result.span))
        if "procedure" in roles:
            reading.late_call(text_template(data[slice(*motion.span_of("procedure"))]), ())
            self.started |= {key for key, _ in reading.calls} | (reading.keys & {UNSEEN})
        return reading.effect()

    def functions(self, statement: Statement, routine: Routine) -> StatementEffect:
        """Effect of the functions that a statement's own expressions call, except the controller's that only read.

        Args:
            routine: in which the statement stands.
        """
        path = routine.source.path
        if path not in self.calling:
            return NO_EFFECT
        functions, places = self.calling[path]
        at = bisect_left(places, statement.span[0])
        if at == len(places) or places[at] >= statement.span[1]:
            return NO_EFFECT
        effects = self._functions.get((path, statement.span))
        if effects is None:
            reading = _Reading(self, routine)
            for name, span in called_in(functions, statement, routine.source.data):
                called = self.program.routine(name, routine.module)
                if called is None:
                    reading.unseen_code(name)
                reading.add_arguments(called, read_arguments(routine.source.data, *span), name)
            effects = self._functions[path, statement.span] = reading.effect()
        return effects

    def key_of(self, name: str, routine: Routine, path: tuple[str, ...] = (), writer: str = "") -> str | None:
        """Record that a routine writes to the data or parameter of this name, and return its key.

        Args:
            name: in lower case; path: components of the data that are written, empty for all of it.
            writer: name of the instruction or unknown routine that writes it; empty for the program itself.

        Returns:
            None for constants and names without declaration.
        """
        if any(p.name == name for p in routine.parameters):
            return "%" + name
        return self.written(self.program.declaration(name, routine.module, routine.name), path, writer)

    def written(self, declaration: Declaration | None, path: tuple[str, ...] = (), writer: str = "") -> str | None:
        """Record that declared data is written, and return its key; None for constants and without a declaration.

        Args:
            path: components of the data that are written, empty for all of it.
            writer: name of the instruction or unknown routine that writes it; empty for the program itself.
        """
        if declaration is None or declaration.storage == "CONST":
            return None
        self.paths.setdefault(declaration.key, set()).add(path)
        self.writers.setdefault(declaration.key, set()).add(writer)
        return declaration.key

    def fitting(self, template: Template) -> Sequence[Routine]:
        """Procedures of the program whose name fits the template of a string expression."""
        if len(template) == 1 and template[0] is not None:
            return self._procedures.get(template[0], [])
        return [r for procedures in self._procedures.values() for r in procedures if may_be(template, r.name)]


class _Reading:
    """Collects the effect of one statement of a routine."""

    def __init__(self, reader: EffectReader, routine: Routine) -> None:
        """Start without any effect."""
        self.reader, self.routine = reader, routine
        self.keys: set[str] = set()
        self.calls: set[CalledWith] = set()
        self.unseen: list[str] = []

    def effect(self) -> StatementEffect:
        """The effect of all that was added."""
        if not self.keys and not self.calls:
            return NO_EFFECT
        return StatementEffect(frozenset(self.keys), frozenset(self.calls), tuple(self.unseen))

    def add(self, name: str, path: tuple[str, ...] = (), writer: str = "") -> None:
        """Add that the data or parameter of a name is written.

        Args:
            path: components of the data that are written, empty for all of it.
            writer: name of the instruction or unknown routine that writes it; empty for the program itself.
        """
        key = self.reader.key_of(name, self.routine, path, writer)
        if key is not None:
            self.keys.add(key)

    def unseen_code(self, name: str) -> None:
        """Add that a routine of this name runs that is in none of the files."""
        self.keys.add(UNSEEN)
        self.unseen.append(name)

    def add_arguments(self, called: Routine | None, pieces: Sequence[Piece], writer: str) -> None:
        """Add that a call may write its arguments: a routine those that it gets by reference, other code all.

        Args:
            called: the routine; None for an instruction and for a routine in none of the files.
            pieces: the arguments; writer: name of what is called, used if ``called`` is None.
        """
        data = self.routine.source.data
        if called is None:
            for _, span, _ in pieces:
                self.add(argument_name(data, span), writer=writer)
            return
        by_reference = [(p.name, span) for p, span in paired(called.parameters, pieces) if p.mode in BY_REFERENCE]
        self.calls.add((called.key, tuple((name, argument_name(data, span)) for name, span in by_reference)))

    def late_call(self, template: Template, pieces: Sequence[Piece]) -> None:
        """Add a call by a text: of every procedure whose name fits the template, and perhaps of one in no file.

        Args:
            template: of the name, as ``text_template`` gives it; pieces: arguments of the call.
        """
        routines = self.reader.fitting(template)
        for called in routines:
            self.add_arguments(called, pieces, "")
        if not routines or None in template:
            self.unseen_code(LATE)
            self.add_arguments(None, pieces, LATE)

    def call(self, statement: Statement) -> None:
        """Add a call that is no motion: of a routine, of an instruction, or of what is in none of the files."""
        program, routine, word = self.reader.program, self.routine, statement.word
        data = routine.source.data
        late = late_call(statement, data, program, routine.module)
        if late is not None:
            self.late_call(late.template, late.pieces)
            return
        start = statement.span[0] + len(word)
        writer = data[statement.span[0] : start].decode("latin-1")
        called = program.routine(word, routine.module)
        if called is not None:
            self.add_arguments(called, read_arguments(data, start, statement.span[1]), writer)
        elif word in STATE_OF_INSTRUCTION:
            self.keys.add(STATE_OF_INSTRUCTION[word])
        elif word in READ_ONLY:
            if b":=" in data[slice(*statement.span)]:
                pieces = read_arguments(data, start, statement.span[1])
                self.add_arguments(None, [piece for piece in pieces if piece[0] in WRITTEN], writer)
        elif word in BY_NAME and word != "getdataval":
            keys = (self.reader.written(d, writer=writer) for d in named_by_text(statement, routine, program))
            self.keys.update(key for key in keys if key is not None)
        else:
            if word not in KNOWN_INSTRUCTIONS and word not in SIGNATURES:
                self.unseen_code(writer)
            self.add_arguments(None, read_arguments(data, start, statement.span[1]), writer)
            if word in LASTING:
                self.reader.lasting |= self.keys


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
