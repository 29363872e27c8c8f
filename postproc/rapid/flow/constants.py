"""Conditions and bounds that constants of the text decide; all others are open."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.diagnostics import Span
from postproc.rapid.data.values import Data, Fields, Value, as_type, single
from postproc.rapid.evaluation.declared import DeclaredValues
from postproc.rapid.evaluation.evaluate import Scope, evaluate
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.nodes import Declaration, Routine
from postproc.rapid.syntax.trees import Call, Name
from postproc.rapid.unknown import Kind, Unknown

CLOSED_TYPES = ("num", "dnum", "bool", "string")  # places are touched up on the pendant, those of constants too
MAX_TURNS = 10_000  # of one loop; a loop with more is treated as one that runs nobody knows how often


class Constants:
    """Values of expressions that contain nothing but constants of the text."""

    def __init__(self, program: Program) -> None:
        """Take constants and record types from a program."""
        self.program = program
        self.declared = DeclaredValues(program)

    def value(self, routine: Routine, span: Span, hidden: frozenset[str]) -> Data | None:
        """Value of the expression at a span in a routine; None if it contains anything but constants of the text.

        Args:
            hidden: lower-case names of the counters of loops around it, which are no constants.
        """
        hidden |= {parameter.name for parameter in routine.parameters}
        scope = _Scope(self.program, self.declared, (routine.module, routine.name), hidden)
        try:
            return evaluate(read_whole_expression(routine.source.data, *span), scope).data
        except Unknown:
            return None

    def truth(self, routine: Routine, span: Span, hidden: frozenset[str]) -> bool | None:
        """Whether the condition at a span holds; None if more than constants decides it.

        Args:
            hidden: lower-case names of the counters of loops around it, which are no constants.
        """
        value = self.value(routine, span, hidden)
        return value if isinstance(value, bool) else None

    def is_case(self, routine: Routine, subject: Span, cases: tuple[Span, ...], hidden: frozenset[str]) -> bool | None:
        """Whether the TEST expression equals one of the values of a CASE; None if more than constants decides it.

        Args:
            subject: span of the expression. cases: spans of the values.
            hidden: lower-case names of the counters of loops around it, which are no constants.
        """
        value, verdict = self.value(routine, subject, hidden), False
        for case in cases:
            other = self.value(routine, case, hidden)
            if value is None or other is None:
                return None
            verdict |= as_type(value, "num") == as_type(other, "num")
        return verdict


class _Scope(Scope):
    """The scope of an expression in which only constants have a value; everything else raises Unknown."""

    def __init__(
        self, program: Program, declared: DeclaredValues, place: tuple[str, str], hidden: frozenset[str] = frozenset()
    ) -> None:
        """Make the scope of an expression.

        Args:
            declared: values of the constants; place: names of module and routine.
            hidden: lower-case names that are no constants.
        """
        self.program, self.declared, self.place, self.hidden = program, declared, place, hidden
        self.reads: list[Unknown] = []
        self.noted: list[Unknown] = []

    @property
    def records(self) -> Mapping[str, Fields]:
        """Fields (name, type) of each record type, by lower-case type name."""
        return self.declared.records

    def lookup(self, name: Name) -> Value:
        """The value of a constant of a plain type (number, truth value, text).

        Raises:
            Unknown: the name means anything else.
        """
        found = None if name.name in self.hidden else self.program.declaration(name.name, *self.place)
        closed = found is not None and found.storage == "CONST" and found.type.lower() in CLOSED_TYPES
        if found is None or not closed or found.init is None or found.dims:
            raise Unknown(Kind.UNDECIDED)
        return self.declared.value(found, self._home)

    def _home(self, declaration: Declaration) -> _Scope:
        """The scope in which the value of a declaration is evaluated: that of its own module and routine."""
        return _Scope(self.program, self.declared, (declaration.module, declaration.routine))

    def call(self, call: Call) -> Value | None:
        """Return None for a built-in function, so that it is evaluated.

        Raises:
            Unknown: the function is one of the program's.
        """
        if self.program.routine(call.name, self.place[0]) is not None:
            raise Unknown(Kind.UNDECIDED)
        return None


def counted(first: float, last: float, step: float | None = None) -> list[float] | None:
    """Values of the index of a FOR loop, counted in single precision; None if there are more than ``MAX_TURNS``.

    Args:
        step: by default 1, or -1 if ``last`` is less than ``first``.
    """
    first, last = single(first), single(last)
    step = single(step) if step is not None else 1.0 if last >= first else -1.0
    turns: list[float] = []
    while first <= last if step >= 0 else first >= last:
        if len(turns) == MAX_TURNS:
            return None
        turns.append(first)
        first = single(first + step)
    return turns
