"""What a RAPID file consists of: modules, declarations, routines, statements. Every part keeps its byte span."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.diagnostics import Source, Span


@dataclass(frozen=True, slots=True)
class Statement:
    """One statement; blocks carry their branches.

    Args:
        kind: ``call``, ``assign``, ``label``, ``goto``, ``return``, ``leave`` (RAISE, RETRY, TRYNEXT, EXIT, ExitCycle),
            ``connect``, ``placeholder``, ``opaque``, ``if``, ``for``, ``while``, ``test``.
        span: first byte to the byte after the last (``;`` included).
        word: the name called, assigned, jumped to or declared, lower case; loop variable of ``for``.
        parts: spans of expressions: value of ``return``; start, end and step of ``for``; condition of ``while``;
            expression of ``test``; name and value of ``assign``.
        branches: ``if``: one per condition; ``test``: one per CASE; loops: one.
    """

    kind: str
    span: Span
    word: str = ""
    parts: tuple[Span, ...] = ()
    branches: tuple[Branch, ...] = ()


@dataclass(frozen=True, slots=True)
class Branch:
    """Statements that run when a condition holds; no conditions means ELSE or DEFAULT."""

    conditions: tuple[Span, ...]
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Declaration:
    """A data declaration; ``init`` spans the expression after ``:=``, ``dims`` the expressions between braces.

    ``key`` is its canonical name: ``module.routine.name`` or ``module..name``, lower case.
    """

    source: Source
    span: Span
    module: str
    routine: str
    scope: str  # LOCAL, TASK or nothing
    storage: str  # CONST, PERS or VAR
    type: str
    name: str
    dims: tuple[Span, ...] = ()
    init: Span | None = None
    key: str = field(init=False)

    def __post_init__(self) -> None:
        """Set ``key`` to ``module.routine.name`` in lower case; the routine is empty for data of a module."""
        object.__setattr__(self, "key", f"{self.module}.{self.routine}.{self.name}".lower())


@dataclass(frozen=True, slots=True)
class RoutineParameter:
    """A parameter; ``mode`` is VAR, PERS, INOUT, SWITCH or nothing (by value)."""

    name: str
    type: str
    mode: str = ""
    optional: bool = False
    rank: int = 0


@dataclass(frozen=True, slots=True)
class Routine:
    """PROC, FUNC or TRAP; ``handlers`` are the bodies of BACKWARD, ERROR and UNDO.

    ``key`` is its canonical name: ``module.routine``, lower case.
    ``scopes`` are how the keys of the data begin that it sees: its own, the module's, the task's.
    """

    source: Source
    span: Span
    module: str
    kind: str
    name: str
    local: bool
    type: str
    parameters: tuple[RoutineParameter, ...]
    declarations: tuple[Declaration, ...]
    body: tuple[Statement, ...]
    handlers: tuple[tuple[Statement, ...], ...] = ()
    key: str = field(init=False)
    scopes: tuple[str, str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Set ``key`` and ``scopes`` from the names of module and routine, in lower case."""
        module, name = self.module.lower(), self.name.lower()
        object.__setattr__(self, "key", f"{module}.{name}")
        object.__setattr__(self, "scopes", (f"{module}.{name}.", f"{module}..", ".."))

    def parameter_key(self, name: str) -> str:
        """Canonical name of a parameter: ``module.routine.%name``, lower case."""
        return f"{self.key}.%{name}".lower()


@dataclass(frozen=True, slots=True)
class Record:
    """A user's RECORD (fields as name and type) or ALIAS (one field without name)."""

    name: str
    fields: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Module:
    """A module; ``head`` spans ``MODULE name(attributes)``, ``span`` reaches to the byte after ENDMODULE.

    ``head`` is empty in a file that holds routines or data without a MODULE line.
    """

    source: Source
    span: Span
    head: Span
    name: str
    attributes: tuple[str, ...] = ()
    records: tuple[Record, ...] = ()
    declarations: tuple[Declaration, ...] = ()
    routines: tuple[Routine, ...] = ()
