"""Which data and which state a piece of program may change, found without running it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from postproc.diagnostics import Source, Span
from postproc.rapid.motion import read_arguments
from postproc.rapid.program import Program, bodies, statements_in
from postproc.rapid.syntax import Parameter, Routine, Statement

# State that instructions change, by instruction.
STATE: Mapping[str, str] = {
    "gripload": "@gripload", "pdispset": "@pdisp", "pdispon": "@pdisp", "pdispoff": "@pdisp",
    "eoffsset": "@eoffs", "eoffson": "@eoffs", "eoffsoff": "@eoffs", "confl": "@conf_l", "confj": "@conf_j",
    "singarea": "@singarea", "velset": "@velset", "accset": "@accset",
}  # fmt: skip
# Instructions that only read their arguments. Any other instruction may write the data it is given by name.
READ_ONLY = frozenset(
    re.findall(
        r"\w+",
        """
    accset activateparam actunit alarm bookerrno break cirpathmode clearpath clkreset clkstart clkstop close confj
    confl corrclear corrwrite deactunit eoffsoff eoffson eoffsset errlog errraise errwrite exit exitcycle gripload
    idelete invertdo isignaldi isignaldo isleep itimer iwatch load mechunitload motionsup pathacclim pdispoff pdispon
    pdispset procerrrecovery pulsedo reset restopath set setao setdo setgo settpspeed singarea softact softdeact
    speedrefresh spyoff startload startmove stop stopmove storepath syncmoveoff syncmoveon syncmoveresume
    syncmovesuspend systemstopaction tperase tpshow tpwrite triggequip triggint triggio triggspeed tunereset
    tuneservo uimsgbox uishow unload velset waitai waitdi waitdo waitgi waitgo waitload waitrob waitsynctask waittime
    waituntil worldacclim write writebin writestrbin wzdosetst wzlimsup
    """,
    )
)
_REFERENCE = re.compile(rb"\s*([A-Za-z_\x80-\xff][\w\x80-\xff]*)\s*(?:[.{].*)?", re.DOTALL)


def argument_name(data: bytes, span: Span) -> str:
    """The data an argument names if it is a plain reference (with index or component), else nothing."""
    found = _REFERENCE.fullmatch(data, *span)
    return found[1].decode("latin-1").lower() if found else ""


def paired(
    parameters: Sequence[Parameter], pieces: Iterable[tuple[str, Span, Span]]
) -> Iterator[tuple[Parameter, Span]]:
    """Parameters with the argument each gets in a call."""
    by_name = {p.name: p for p in parameters if p.optional}
    required = iter(p for p in parameters if not p.optional)
    for option, span, _ in pieces:
        parameter = by_name.get(option[1:]) if option else next(required, None)
        if parameter is not None:
            yield parameter, span


class Changes:
    """What every routine of a program may change: keys of declarations, ``@`` state, its own parameters by name."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._kept: dict[tuple[str, Span], frozenset[str]] = {}
        routines = list(program.all_routines())
        self.of_routine: dict[str, frozenset[str]] = {r.key: frozenset() for r in routines}
        pending = {r.key for r in routines}
        callers: dict[str, set[str]] = {}
        by_key = {r.key: r for r in routines}
        for routine in routines:
            for called in self._called(routine):
                callers.setdefault(called, set()).add(routine.key)
        while pending:
            key = pending.pop()
            routine = by_key[key]
            found = frozenset(c for body in bodies(routine) for c in self.of(body, routine))
            if found != self.of_routine[key]:
                self.of_routine[key] = found
                pending |= callers.get(key, set())
        self.everything = frozenset(k for keys in self.of_routine.values() for k in keys if not k.startswith("%"))
        # What a trap changes may change at any moment.
        self.volatile = frozenset(
            k for r in routines if r.kind == "TRAP" for k in self.of_routine[r.key] if not k.startswith("%")
        )

    def _called(self, routine: Routine) -> Iterator[str]:
        for body in bodies(routine):
            for statement in statements_in(body):
                if statement.kind == "call":
                    called = self.program.routine(statement.word, routine.module)
                    if called is not None:
                        yield called.key

    def of_one(self, statement: Statement, routine: Routine) -> frozenset[str]:
        """As ``of`` for one statement, kept for the next time it is executed."""
        key = (routine.source.path, statement.span)
        if key not in self._kept:
            self._kept[key] = frozenset(self.of([statement], routine))
        return self._kept[key]

    def of(self, body: Sequence[Statement], routine: Routine) -> set[str]:
        """Keys that the statements may change; ``%name`` is the routine's own parameter."""
        changed: set[str] = set()
        for statement in statements_in(body):
            if statement.kind == "assign":
                self._add(statement.word, routine, changed)
            elif statement.kind == "call":
                self._of_call(statement, routine, changed)
            elif statement.kind == "opaque":
                for name in _assigned_in(routine.source, statement.span):
                    self._add(name, routine, changed)
        return changed

    def _add(self, name: str, routine: Routine, changed: set[str]) -> None:
        if any(p.name == name for p in routine.parameters):
            changed.add("%" + name)
            return
        declaration = self.program.declaration(name, routine.module, routine.name)
        if declaration is not None and declaration.storage != "CONST":
            changed.add(declaration.key)

    def _of_call(self, statement: Statement, routine: Routine, changed: set[str]) -> None:
        data = routine.source.data
        motion = self.program.motion(routine.source, statement)
        if motion is not None:
            changed.add("@moves")
            for argument in motion.arguments:
                if argument.role == "found":
                    self._add(argument_name(data, argument.span), routine, changed)
            return
        if statement.word in STATE:
            changed.add(STATE[statement.word])
            return
        if statement.word in READ_ONLY:
            return
        end = statement.span[1] - (data[statement.span[1] - 1 : statement.span[1]] == b";")
        pieces = read_arguments(data, statement.span[0] + len(statement.word), end)
        called = self.program.routine(statement.word, routine.module)
        if called is None:
            for _, span, _ in pieces:
                self._add(argument_name(data, span), routine, changed)
            return
        below = self.of_routine.get(called.key, frozenset())
        changed |= {k for k in below if not k.startswith("%")}
        for parameter, span in paired(called.parameters, pieces):
            if parameter.mode in ("VAR", "PERS", "INOUT") and "%" + parameter.name in below:
                self._add(argument_name(data, span), routine, changed)


def _assigned_in(source: Source, span: Span) -> Iterator[str]:
    """Names before ``:=`` in text that is not understood."""
    for found in re.finditer(rb"([A-Za-z_\x80-\xff][\w\x80-\xff]*)\s*:=", source.data[span[0] : span[1]]):
        yield found[1].decode("latin-1").lower()
