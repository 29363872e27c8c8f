"""Robtargets written as numbers: their values and the span of every number."""

from __future__ import annotations

import re
from math import isfinite

from postproc.diagnostics import Source, Span
from postproc.rapid.events import TargetSpans
from postproc.rapid.expressions import Aggregate, Expression, ExpressionError, Number, read_whole_expression
from postproc.rapid.records import NO_AXIS, Ax6, RobTarget
from postproc.rapid.values import Data, NotKnown, to_conf, to_quat, to_robtarget

_GAP = rb"[ \t\r\n]*+"
_NUMBER = rb"([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)"


def _list(count: int) -> bytes:
    return rb"\[" + _GAP + (_GAP + b"," + _GAP).join([_NUMBER] * count) + _GAP + rb"\]"


_COMMA = _GAP + b"," + _GAP
_LITERAL = re.compile(rb"\[" + _GAP + _COMMA.join(_list(n) for n in (3, 4, 4, 6)) + _GAP + rb"\]" + _GAP)
NO_AXES: Ax6 = (NO_AXIS,) * 6
NO_AXES_LIST = list(NO_AXES)


class LiteralSpans(TargetSpans):
    """Spans that are found again whenever they are asked for: eleven of them take 1.5 kB of memory."""

    __slots__ = ()

    def __init__(self, source: Source, whole: Span) -> None:
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "whole", whole)

    def _groups(self, first: int, last: int) -> tuple[Span, ...]:
        found = _LITERAL.fullmatch(self.source.data, *self.whole)
        return found.regs[first:last] if found else ()

    @property
    def trans(self) -> tuple[Span, ...]:
        return self._groups(1, 4)

    @property
    def rot(self) -> tuple[Span, ...]:
        return self._groups(4, 8)

    @property
    def robconf(self) -> tuple[Span, ...]:
        return self._groups(8, 12)

    @property
    def numbers(self) -> tuple[Span, ...]:
        return self._groups(1, 12)

    def __reduce__(self) -> tuple[type[LiteralSpans], tuple[Source, Span]]:
        return LiteralSpans, (self.source, self.whole)


def read_literal_numbers(data: bytes, start: int, end: int) -> Data | None:
    """A robtarget's numbers as they are written, or None if the text is more than numbers."""
    found = _LITERAL.fullmatch(data, start, end)
    if found is None:
        return None
    n = [float(group) for group in found.groups()]
    return (tuple(n[0:3]), tuple(n[3:7]), tuple(n[7:11]), tuple(n[11:17]))


def read_literal_target(source: Source, start: int, end: int) -> tuple[RobTarget, TargetSpans] | None:
    """The robtarget at ``data[start:end]`` if it consists of numbers alone.

    Raises:
        NotKnown: the numbers are no robtarget (orientation zero).
    """
    found = _LITERAL.fullmatch(source.data, start, end)
    if found is not None:
        n = [float(group) for group in found.groups()]
        if not isfinite(sum(n)):
            raise NotKnown("a number in the data is too large")
        # The same as to_robtarget, without its checks: there are as many numbers as targets need.
        rot = to_quat((n[3], n[4], n[5], n[6]))
        conf = to_conf(n[7:11])
        extax = NO_AXES if n[11:] == NO_AXES_LIST else (n[11], n[12], n[13], n[14], n[15], n[16])
        return RobTarget((n[0], n[1], n[2]), rot, conf, extax), LiteralSpans(source, (start, end))
    if source.data[start : start + 1] != b"[":
        return None
    try:
        tree = read_whole_expression(source.data, start, end)
    except ExpressionError:
        return None
    return _of_tree(source, tree)


def _of_tree(source: Source, tree: Expression) -> tuple[RobTarget, TargetSpans] | None:
    if not isinstance(tree, Aggregate) or len(tree.items) != 4:
        return None
    groups = []
    for item, count in zip(tree.items, (3, 4, 4, 6), strict=True):
        if not isinstance(item, Aggregate) or len(item.items) != count:
            return None
        numbers = [n for n in item.items if isinstance(n, Number)]
        if len(numbers) != count:
            return None
        groups.append(numbers)
    spans: list[tuple[Span, ...]] = [tuple(n.span for n in group) for group in groups[:3]]
    data: Data = tuple(tuple(n.value for n in group) for group in groups)
    return to_robtarget(data), TargetSpans(source, spans[0], spans[1], spans[2], tree.span)
