"""What declarations say: their values and the parts of these, read from the text."""

from __future__ import annotations

from collections.abc import Callable

from postproc.diagnostics import Span
from postproc.rapid.data.values import Data, Value, as_type, known_records, zero
from postproc.rapid.evaluation.evaluate import Scope, evaluate, whole
from postproc.rapid.evaluation.literals import read_literal_numbers
from postproc.rapid.program.program import Program
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.unknown import Kind, Unknown

MAX_ELEMENTS = 1_000_000

Home = Callable[[Declaration], Scope]


class DeclaredValues:
    """Values that declarations give, each read once; ``home`` is the scope in which one is read."""

    def __init__(self, program: Program) -> None:
        """Start with no values read; the program gives the record types."""
        self.values: dict[str, Value | Unknown] = {}
        self.elements: dict[tuple[str, tuple[int, ...]], tuple[Span, ...]] = {}
        self.zeros: dict[str, Data] = {}  # by type
        self.records = known_records(program.modules)
        self.chosen = program.chosen

    def value(self, declaration: Declaration, home: Home) -> Value:
        """The value that the declaration itself gives, evaluated once and kept.

        Args:
            home: gives the scope in which the expression of a declaration is evaluated.

        Raises:
            Unknown: it gives none.
        """
        key = declaration.key
        known = self.values.get(key)
        if known is None:
            self.values[key] = Unknown(Kind.CIRCULAR, declaration.name)
            try:
                known = self.initial(declaration, declaration.init, home)
            except Unknown as error:
                known = error.kept()
            self.values[key] = known
        if isinstance(known, Unknown):
            raise known.kept()
        return known

    def initial(self, declaration: Declaration, span: Span | None, home: Home) -> Value:
        """The value that a span of a declaration's text gives; without span 0, FALSE or the empty string in every
        part.

        Raises:
            Unknown: the text gives none, or PERS data has no span.
        """
        rank = len(declaration.dims)
        if declaration.key in self.chosen:
            return Value(self.chosen[declaration.key], declaration.type, rank, declaration.key)
        if span is None:
            if declaration.storage == "PERS":
                raise Unknown(Kind.NO_VALUE, declaration.name, "", declaration.name, declaration.span)
            return Value(self.unset(declaration, home), declaration.type, rank)
        if declaration.type == "robtarget":  # many, and mostly plain numbers: no tree is built for these
            numbers = read_literal_numbers(declaration.source.data, *span)
            if numbers is not None:
                return Value(numbers, declaration.type, rank, declaration.key)
        tree = read_whole_expression(declaration.source.data, *span, f"the value of `{declaration.name}`")
        value = evaluate(tree, home(declaration))
        data = as_type(value.data, declaration.type)
        return Value(data, declaration.type, rank, declaration.key, assumed=value.assumed)

    def unset(self, declaration: Declaration, home: Home) -> Data:
        """The value of data declared without an initial value: 0, FALSE or empty, in an array of the declared size.

        Raises:
            Unknown: the size is not known, or exceeds ``MAX_ELEMENTS``.
        """
        kind = declaration.type
        if kind not in self.zeros:
            self.zeros[kind] = zero(kind, self.records)
        data = self.zeros[kind]
        total = 1
        for span in reversed(declaration.dims):
            tree = read_whole_expression(declaration.source.data, *span, f"the size of `{declaration.name}`")
            size = evaluate(tree, home(declaration)).data
            total *= max(1, whole(size))
            if total > MAX_ELEMENTS:
                raise Unknown(Kind.TOO_LARGE, declaration.name)
            data = (data,) * whole(size)
        return data

    def part_span(self, declaration: Declaration, indices: tuple[int, ...]) -> Span | None:
        """Byte span of an array element or a component in the text of its declaration; None if it is not written
        there.

        Args:
            indices: of elements and components, from 1.

        Raises:
            Unknown: the array has no such element.
        """
        if declaration.init is None:
            return None
        span = declaration.init
        for level, index in enumerate(indices):
            spans = self.elements.get((declaration.key, indices[:level]))
            if spans is None:
                data, (start, end) = declaration.source.data, span
                is_aggregate = data[start : start + 1] == b"[" and data[end - 1 : end] == b"]"
                spans = patterns.listed(data, start + 1, end - 1) if is_aggregate else ()
                self.elements[declaration.key, indices[:level]] = spans
            if level >= len(declaration.dims) and not spans:
                return None
            if not 1 <= index <= len(spans):
                raise Unknown(Kind.NO_ELEMENT, declaration.name, ", ".join(map(str, indices)))
            span = spans[index - 1]
        return span
