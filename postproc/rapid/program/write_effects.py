"""Which data and which state a piece of program may change, found without running it."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence, Set
from functools import cached_property

from postproc.diagnostics import Source, Span
from postproc.grouping import grouped
from postproc.rapid.program.arguments import Piece, read_arguments
from postproc.rapid.program.function_effects import (
    BY_REFERENCE,
    acting_functions,
    called_in,
    measured_places,
    writing_functions,
)
from postproc.rapid.program.instructions import KNOWN, LASTING, READ_ONLY
from postproc.rapid.program.late_binding import Template, late_call, may_be, text_template
from postproc.rapid.program.program import Program, is_shared, named, statements_in, statements_of
from postproc.rapid.program.signatures import SIGNATURES
from postproc.rapid.syntax.nodes import Declaration, Routine, RoutineParameter, Statement

# State that instructions change, by instruction.
STATE: Mapping[str, str] = {
    "gripload": "@gripload", "pdispset": "@pdisp", "pdispon": "@pdisp", "pdispoff": "@pdisp",
    "eoffsset": "@eoffs", "eoffson": "@eoffs", "eoffsoff": "@eoffs", "confl": "@conf_l", "confj": "@conf_j",
    "singarea": "@singarea", "velset": "@velset", "accset": "@accset", "actunit": "@units", "deactunit": "@units",
    "softact": "@soft", "softdeact": "@soft",
}  # fmt: skip
# And what to call it.
SETTERS: Mapping[str, str] = {
    "@gripload": "GripLoad", "@pdisp": "PDispSet or PDispOn", "@eoffs": "EOffsSet or EOffsOn", "@conf_l": "ConfL",
    "@conf_j": "ConfJ", "@singarea": "SingArea", "@velset": "VelSet", "@accset": "AccSet",
    "@units": "ActUnit or DeactUnit", "@soft": "SoftAct",
}  # fmt: skip
# Arguments that instructions of ``READ_ONLY`` write.
WRITTEN = ("\\timeflag", "\\valueattimeout", "\\result", "\\breakflag", "\\instanceid")
LATE = "a routine that is chosen at run time"
UNSEEN = "@unseen"  # what a routine that is in none of the files may write (see ``WriteEffects.exposed``)
# Instructions that read or write the data whose name is in their first argument, a text.
BY_NAME = ("getdataval", "setdataval", "setalldataval")
_REFERENCE = re.compile(rb"\s*+([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+(?:[.{].*)?", re.DOTALL)


def argument_name(data: bytes, span: Span) -> str:
    """Lower-case name of the data that an argument is, or is a part of; empty for other expressions."""
    found = _REFERENCE.fullmatch(data, *span)
    return found[1].decode("latin-1").lower() if found else ""


def component_path(data: bytes, span: Span) -> tuple[str, ...]:
    """The component names of a reference (``b``, ``c`` of ``a.b.c``) in lower case; empty for anything else."""
    name, *fields = (word.strip() for word in data[slice(*span)].decode("latin-1").lower().split("."))
    return tuple(fields) if name.isidentifier() and all(field.isidentifier() for field in fields) else ()


def paired(parameters: Sequence[RoutineParameter], pieces: Iterable[Piece]) -> Iterator[tuple[RoutineParameter, Span]]:
    """Each parameter that a call passes, with the span of its argument: optional ones by name, others in order."""
    by_name = {p.name: p for p in parameters if p.optional}
    required = iter(p for p in parameters if not p.optional)
    for option, span, _ in pieces:
        parameter = by_name.get(option[1:]) if option else next(required, None)
        if parameter is not None:
            yield parameter, span


def named_by_text(statement: Statement, routine: Routine, program: Program) -> Iterator[Declaration]:
    """Module data whose name fits the first argument of GetDataVal, SetDataVal or SetAllDataVal and that has the type
    of the data passed (any if unknown), as in ``SetDataVal "p"+ValToStr(n),pNew``; nothing for other statements.
    """
    if statement.kind != "call" or statement.word not in BY_NAME or program.routine(statement.word, routine.module):
        return
    data = routine.source.data
    pieces = [span for _, span, _ in read_arguments(data, statement.span[0] + len(statement.word), statement.span[1])]
    plain = data[slice(*pieces[0])] if pieces else b""
    template, kind = text_template(plain), ""
    if statement.word == "setalldataval":
        template, kind = (None,), plain.decode("latin-1").strip(' "').lower()
    elif len(pieces) > 1 and not component_path(data, pieces[-1]):
        passed = program.declaration(argument_name(data, pieces[-1]), routine.module, routine.name)
        kind = passed.type.lower() if passed is not None else ""
    for declaration in program.declarations:
        if not declaration.routine and kind in ("", declaration.type.lower()) and may_be(template, declaration.name):
            yield program.names.get(declaration.key, declaration)


def holds_word(source: Source, body: Sequence[Statement], *words: bytes) -> bool:
    """Whether a body contains, blocks included, a statement that begins with one of these lower-case words."""
    return any(source.data[slice(*statement.span)].lower().startswith(words) for statement in statements_in(body))


# A call of a routine of the program: its key, and for every parameter by reference the data passed.
CalledWith = tuple[str, tuple[tuple[str, str], ...]]


class WriteEffects:
    """What every routine of a program may change: keys of declarations, ``@`` state, its parameters as ``%name``.

    ``UNSEEN`` among them stands for all that a routine in none of the files may write.
    """

    def __init__(self, program: Program) -> None:
        """Work out what each routine of the program may change, calls included."""
        self.program = program
        self._kept: dict[tuple[str, Span], frozenset[str]] = {}
        # The components that are written of each declaration; what is written as a whole has an empty path.
        self.paths: dict[str, set[tuple[str, ...]]] = {}
        # Who writes each declaration: an instruction that is in no file, or nothing where the program itself does.
        self.writers: dict[str, set[str]] = {}
        # By statement: what functions that are in no file may write of what they are given, and the name of one of
        # them; calls of the program's own functions.
        self.by_unknown: dict[tuple[str, Span], tuple[set[str], str]] = {}
        self.by_own: dict[tuple[str, Span], set[CalledWith]] = {}
        self.unseen: set[str] = set()  # names of routines in none of the files
        self.lasting: set[str] = set()  # data that an instruction goes on writing
        self.sync: set[str] = set()  # routines that a motion starts: nobody knows when they run
        self._writing: dict[str, tuple[re.Pattern[bytes], Sequence[int]]] = {}  # and where these are called
        for source in program.sources:
            if (writing := writing_functions(source, program)) is not None:
                self._writing[source.path] = writing, [found.start() for found in writing.finditer(source.data)]
        routines = {r.key: r for r in program.all_routines()}
        calls: dict[str, set[CalledWith]] = {key: set() for key in routines}
        found: dict[str, set[str]] = {key: set() for key in routines}
        callers: dict[str, set[str]] = {}
        for key, routine in routines.items():
            for statement in statements_of(routine):
                self._of_statement(statement, routine, found[key], calls[key])
            for called, _ in calls[key]:
                callers.setdefault(called, set()).add(key)
        pending = dict.fromkeys(routines)  # each routine waits once
        while pending:
            key, _ = pending.popitem()
            before = len(found[key])
            for called, passed in calls[key]:
                self._through_call(found[called], passed, routines[key], found[key])
            if len(found[key]) != before:
                pending |= dict.fromkeys(callers.get(key, ()))
        self.of_routine = {key: frozenset(keys) for key, keys in found.items()}
        self.everything = frozenset(k for keys in found.values() for k in keys if not k.startswith("%"))
        self.acting = acting_functions(routines, self.of_routine, calls)
        # What a trap changes may change at any moment, what a handler changes that goes on wherever an error may come.
        self.shared = _shared_keys(program, program.elsewhere.shared)
        self.elsewhere = _shared_keys(program, program.elsewhere.written)
        traps = [found[key] for key, routine in routines.items() if routine.kind == "TRAP" or key in self.sync]
        handlers = [
            self.of(body, routine)
            for routine in routines.values()
            for body in routine.handlers
            if holds_word(routine.source, body, b"retry", b"trynext", b"return")
        ]
        found_here = (k for keys in (*traps, *handlers, self.lasting) for k in keys if k[0] not in "%@")
        self.volatile = self.elsewhere.union(found_here)
        self.unseen_any_time = any(UNSEEN in keys for keys in (*traps, *handlers))

    @cached_property
    def exposed(self) -> frozenset[str]:
        """Keys of all that code in none of the files may write: module data that is not LOCAL, data written by
        routines that it may call (all but main and LOCAL ones), and all state.
        """
        data = {d.key for d in self.program.declarations if _is_exposed(d)}
        called = {r.key for r in self.program.all_routines() if not r.local and r.name.lower() != "main"}
        within = {k for key in called for k in self.of_routine[key] if k[0] not in "%@"}
        return frozenset(data | within | SETTERS.keys())

    def may_be_written_any_time(self, key: str) -> bool:
        """Whether a trap, a handler, a procedure that a motion starts or another task may write data at any moment."""
        return key in self.volatile or (self.unseen_any_time and key in self.exposed)

    @cached_property
    def measured(self) -> frozenset[str]:
        """Keys of data that may hold where the arm stands: by CRobT and the like, by a search, or by copying."""
        return measured_places(self.program)

    @cached_property
    def may_be_written(self) -> frozenset[str]:
        """Keys of declarations that anything, in these files or not, may write while the program runs.

        Operators write PERS data, too: where no task's files write it, that is not counted.
        """
        written = {k for k in self.everything if k[0] != "@"} | self.elsewhere
        if UNSEEN in self.everything:
            written |= {k for k in self.exposed if k[0] != "@"}
        return frozenset(written)

    def of_one(self, statement: Statement, routine: Routine) -> frozenset[str]:
        """Keys that one statement, with those inside it, may change; kept for the next time it is executed."""
        key = (routine.source.path, statement.span)
        if key not in self._kept:
            self._kept[key] = frozenset(self.of([statement], routine))
        return self._kept[key]

    def of(self, body: Sequence[Statement], routine: Routine) -> set[str]:
        """Keys of data, state and parameters that these statements of a routine, and what they call, may change."""
        changed: set[str] = set()
        calls: set[CalledWith] = set()
        for statement in statements_in(body):
            self._of_statement(statement, routine, changed, calls)
        for called, passed in calls:
            self._through_call(self.of_routine[called], passed, routine, changed)
        return changed

    def called(self, statement: Statement, routine: Routine) -> tuple[set[str], bool]:
        """Keys of the routines that a call may run, and whether it may run one that is in none of the files."""
        changed: set[str] = set()
        calls: set[CalledWith] = set()
        self._of_call(statement, routine, changed, calls)
        return {key for key, _ in calls}, UNSEEN in changed

    def _of_statement(self, statement: Statement, routine: Routine, changed: set[str], calls: set[CalledWith]) -> None:
        """Add the keys that a statement may change to ``changed``, the routines that it calls to ``calls``."""
        if routine.source.path in self._writing:
            writing, places = self._writing[routine.source.path]
            if bisect_left(places, statement.span[0]) < bisect_left(places, statement.span[1]):
                self._of_functions(writing, statement, routine, changed, calls)
        if statement.kind == "assign":
            self._add(statement.word, routine, changed, component_path(routine.source.data, statement.parts[0]))
        elif statement.kind == "call":
            self._of_call(statement, routine, changed, calls)
        elif statement.kind == "opaque":
            for name in _assigned_in(routine.source, statement.span):
                self._add(name, routine, changed)

    def _through_call(
        self, below: Set[str], passed: Iterable[tuple[str, str]], routine: Routine, changed: set[str]
    ) -> None:
        """Add what a called routine changes (``below``), its parameters by reference as the data ``passed``."""
        changed |= {k for k in below - changed if not k.startswith("%")}
        for parameter, name in passed:
            if "%" + parameter in below:
                self._add(name, routine, changed)

    def _add(
        self, name: str, routine: Routine, changed: set[str], path: tuple[str, ...] = (), writer: str = ""
    ) -> None:
        """Add to ``changed`` what a name means in a routine, data or parameter, and note who writes it."""
        if any(p.name == name for p in routine.parameters):
            changed.add("%" + name)
            return
        self._add_data(self.program.declaration(name, routine.module, routine.name), changed, path, writer)

    def _add_data(
        self, declaration: Declaration | None, changed: set[str], path: tuple[str, ...] = (), writer: str = ""
    ) -> None:
        """Add declared data to ``changed`` unless it is CONST, and note who writes which of its components."""
        if declaration is not None and declaration.storage != "CONST":
            changed.add(declaration.key)
            self.paths.setdefault(declaration.key, set()).add(path)
            self.writers.setdefault(declaration.key, set()).add(writer)

    def _of_call(self, statement: Statement, routine: Routine, changed: set[str], calls: set[CalledWith]) -> None:
        """Add the keys that a call or motion may change to ``changed``, the routines that it may run to ``calls``."""
        data = routine.source.data
        motion = self.program.motions.get((routine.source.path, statement.span[0]))
        if motion is not None:
            changed.add("@moves")
            if "found" in motion.roles:
                self._add(argument_name(data, motion.span_of("found")), routine, changed)
            if "procedure" in motion.roles:
                started: set[CalledWith] = set()
                named = text_template(data[slice(*motion.span_of("procedure"))])
                self._of_late_call(named, (), routine, changed, started)
                self.sync |= {key for key, _ in started}
                calls |= started
            return
        late = late_call(statement, data, self.program, routine.module)
        if late is not None:
            self._of_late_call(late.template, late.pieces, routine, changed, calls)
            return
        called = self.program.routine(statement.word, routine.module)
        if called is None and statement.word in STATE:
            changed.add(STATE[statement.word])
            return
        reads = called is None and statement.word in READ_ONLY
        if reads and b":=" not in data[slice(*statement.span)]:
            return
        start = statement.span[0] + len(statement.word)
        pieces = read_arguments(data, start, statement.span[1])
        writer = data[statement.span[0] : start].decode("latin-1")
        if reads:
            pieces = tuple(piece for piece in pieces if piece[0] in WRITTEN)
        if called is None and statement.word in BY_NAME and statement.word != "getdataval":
            for declaration in named_by_text(statement, routine, self.program):
                self._add_data(declaration, changed, writer=writer)
            return
        if called is None and statement.word not in KNOWN and statement.word not in SIGNATURES:
            changed.add(UNSEEN)
            self.unseen.add(writer)
        written: set[str] = set()
        self._hand_over(called, pieces, routine, written, calls, writer=writer)
        changed |= written
        if called is None and statement.word in LASTING:
            self.lasting |= written

    def _of_late_call(
        self,
        template: Template,
        pieces: Sequence[Piece],
        routine: Routine,
        changed: set[str],
        calls: set[CalledWith],
    ) -> None:
        """Add what a call by name may write and run: every procedure whose name fits the template."""
        found = self._procedures(template)
        for called in found:
            self._hand_over(called, pieces, routine, changed, calls)
        if not found or None in template:
            changed.add(UNSEEN)  # perhaps one that is in none of the files
            self.unseen.add(LATE)
            self._hand_over(None, pieces, routine, changed, calls, writer=LATE)

    def _procedures(self, template: Template) -> Sequence[Routine]:
        """Procedures whose name fits the template of a text."""
        if len(template) == 1 and template[0] is not None:
            return self._by_name.get(template[0], [])
        return [r for procedures in self._by_name.values() for r in procedures if may_be(template, r.name)]

    @cached_property
    def _by_name(self) -> dict[str, list[Routine]]:
        """All procedures by lower-case name."""
        return grouped((r.name.lower(), r) for r in self.program.all_routines() if r.kind == "PROC")

    def _of_functions(
        self,
        writing: re.Pattern[bytes],
        statement: Statement,
        routine: Routine,
        changed: set[str],
        calls: set[CalledWith],
    ) -> None:
        """Add what the functions that match ``writing`` may write where the statement's expressions call them."""
        for name, span in called_in(writing, statement, routine.source.data):
            pieces = read_arguments(routine.source.data, *span)
            called = self.program.routine(name, routine.module)
            written: set[str] = set()
            through: set[CalledWith] = set()
            self._hand_over(called, pieces, routine, written, through, writer=name)
            if called is None:
                written.add(UNSEEN)
                self.unseen.add(name)
            place = (routine.source.path, statement.span)
            if written:
                self.by_unknown[place] = (self.by_unknown.get(place, (set[str](), ""))[0] | written, name)
            if through:
                self.by_own.setdefault(place, set()).update(through)
            changed |= written
            calls |= through

    def of_functions(self, statement: Statement, routine: Routine) -> set[str]:
        """Keys that the program's own functions change when a statement's own expressions call them."""
        changed: set[str] = set()
        for called, passed in self.by_own.get((routine.source.path, statement.span), ()):
            self._through_call(self.of_routine[called], passed, routine, changed)
        return changed

    def _hand_over(
        self,
        called: Routine | None,
        pieces: Sequence[Piece],
        routine: Routine,
        changed: set[str],
        calls: set[CalledWith],
        *,
        writer: str = "",
    ) -> None:
        """Add a called routine to ``calls``; of one in no file (None) all data in its arguments to ``changed``."""
        data = routine.source.data
        if called is None:
            for _, span, _ in pieces:
                self._add(argument_name(data, span), routine, changed, writer=writer)
            return
        by_reference = [(p.name, span) for p, span in paired(called.parameters, pieces) if p.mode in BY_REFERENCE]
        passed = tuple((name, argument_name(data, span)) for name, span in by_reference)
        calls.add((called.key, passed))


def named_writers(writers: Iterable[str]) -> str:
    """The first two names, sorted and in backticks, joined by "and", for messages."""
    return " and ".join(name if name == LATE else f"`{name}`" for name in sorted(writers)[:2])


def _shared_keys(program: Program, names: Collection[tuple[str, str]]) -> frozenset[str]:
    """Keys of the program's declarations of global PERS data whose lower-case (name, type) is in ``names``."""
    return frozenset({d.key for d in program.declarations if named(d) in names and is_shared(d)} if names else ())


def _is_exposed(declaration: Declaration) -> bool:
    """Whether code in none of the files may write data: module data that is neither LOCAL nor CONST."""
    return not declaration.routine and declaration.scope != "LOCAL" and declaration.storage != "CONST"


def _assigned_in(source: Source, span: Span) -> Iterator[str]:
    """Lower-case names that stand before ``:=`` in text that could not be read."""
    for found in re.finditer(
        rb"(?<![\w\x80-\xff])([A-Za-z_\x80-\xff][\w\x80-\xff]*+)\s*+:=", source.data[span[0] : span[1]]
    ):
        yield found[1].decode("latin-1").lower()
