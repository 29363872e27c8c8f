"""What declarations say: their values and the parts of these, read from the text; robtargets written as numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from math import hypot, isfinite

from postproc.diagnostics import Source, Span
from postproc.rapid.data.records import NO_AXES, Ax6, Quat, RobTarget
from postproc.rapid.data.values import Data, Value, as_type, known_records, to_conf, to_quat, zero
from postproc.rapid.evaluation.evaluate import Scope, as_integer, evaluate
from postproc.rapid.program.program import Program
from postproc.rapid.syntax import patterns
from postproc.rapid.syntax.expressions import number, read_full_expression
from postproc.rapid.syntax.nodes import Declaration
from postproc.rapid.syntax.spans import TargetSpans, literal, literal_parts
from postproc.rapid.syntax.tokens import number_text
from postproc.rapid.unknown import Kind, Unknown

ROUNDED_NORM = 0.002  # of the length of a quaternion: two decimals of each number leave no more than a few times this


def read_literal_numbers(data: bytes, start: int, end: int) -> Data | None:
    """17 numbers of a robtarget as ((x, y, z), (q1..q4), (cf1, cf4, cf6, cfx), (eax_a..eax_f)), as they are written.

    None if the text is anything else than literal numbers.
    """
    match = literal(data, start, end)
    if match is None:
        return None
    n = numbers_of(match)
    return (tuple(n[0:3]), tuple(n[3:7]), tuple(n[7:11]), tuple(n[11:17]))


def read_literal_target(source: Source, start: int, end: int) -> tuple[RobTarget, TargetSpans] | None:
    """The robtarget at ``data[start:end]`` and its place in the text; None if it does not consist of numbers alone.

    Raises:
        Unknown: the numbers are no robtarget (too large, orientation zero or no unit quaternion).
    """
    parts = literal_parts(source.data, start, end)
    if parts is not None:
        x, y, z, behind = parts.groups()
        trans, others = (float(x), float(y), float(z)), _written(behind)
    else:
        match = literal(source.data, start, end)
        if match is None:
            return None
        n = numbers_of(match)
        trans, others = (n[0], n[1], n[2]), _behind(n[3:])
    if not isfinite(trans[0] + trans[1] + trans[2]):
        raise Unknown(Kind.NUMBER_TOO_LARGE)
    rot, conf, extax, rough = others
    return RobTarget(trans, rot, conf, extax), TargetSpans(source, (start, end), rough)


Behind = tuple[Quat, tuple[int, int, int, int], Ax6, bool]


@lru_cache(maxsize=4096)
def _written(behind: bytes) -> Behind:
    """Orientation, configuration, axes and roughness as in `_behind`, of the text ``[q1,..],[cf1,..],[eax_a,..]``."""
    return _behind([float(number) for number in behind.translate(None, b"[]").split(b",")])


def _behind(n: Sequence[float]) -> Behind:
    """Orientation, configuration, external axes, and whether the quaternion's length is over ``ROUNDED_NORM`` from 1.

    Args:
        n: the 14 numbers of a robtarget that follow its position.

    Raises:
        Unknown: a number is too large, or the first four are no orientation.
    """
    if not isfinite(sum(n)):
        raise Unknown(Kind.NUMBER_TOO_LARGE)
    rot, conf = to_quat(tuple(n[0:4])), to_conf(n[4:8])
    extax = NO_AXES if tuple(n[8:]) == NO_AXES else (n[8], n[9], n[10], n[11], n[12], n[13])
    return rot, conf, extax, abs(hypot(*n[0:4]) - 1.0) > ROUNDED_NORM


def numbers_of(match: re.Match[bytes]) -> list[float]:
    """The 17 numbers of a robtarget from a match that ``literal`` returned, as floats in the order of the text."""
    try:
        return [float(group) for group in match.groups()]
    except ValueError:  # signs that stand apart from their digits, hexadecimal numbers
        texts = [number_text(match.string, span) for span in match.regs[1:]]
        return [-number(text[1:]) if text[0] == "-" else number(text) for text in texts]


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
        tree = read_full_expression(declaration.source.data, *span, f"the value of `{declaration.name}`")
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
            tree = read_full_expression(declaration.source.data, *span, f"the size of `{declaration.name}`")
            size = evaluate(tree, home(declaration)).data
            total *= max(1, as_integer(size))
            if total > MAX_ELEMENTS:
                raise Unknown(Kind.TOO_LARGE, declaration.name)
            data = (data,) * as_integer(size)
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
