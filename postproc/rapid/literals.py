"""Robtargets written as numbers: their values and the span of every number."""

from __future__ import annotations

import re

from postproc.diagnostics import Source, Span
from postproc.rapid.events import TargetSpans
from postproc.rapid.expressions import Aggregate, Expression, ExpressionError, Number, read_whole_expression
from postproc.rapid.records import RobTarget
from postproc.rapid.values import Data, to_robtarget

_GAP = rb"[ \t\r\n]*+"
_NUMBER = rb"([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?)"


def _list(count: int) -> bytes:
    return rb"\[" + _GAP + (_GAP + b"," + _GAP).join([_NUMBER] * count) + _GAP + rb"\]"


_COMMA = _GAP + b"," + _GAP
_LITERAL = re.compile(rb"\[" + _GAP + _COMMA.join(_list(n) for n in (3, 4, 4, 6)) + _GAP + rb"\]" + _GAP)


def read_literal_target(source: Source, start: int, end: int) -> tuple[RobTarget, TargetSpans] | None:
    """The robtarget at ``data[start:end]`` if it consists of numbers alone.

    Raises:
        NotKnown: the numbers are no robtarget (orientation zero).
    """
    found = _LITERAL.fullmatch(source.data, start, end)
    if found is not None:
        n = [float(group) for group in found.groups()]
        at = found.regs
        spans = TargetSpans(source, at[1:4], at[4:8], at[8:12], (start, end))
        data: Data = (tuple(n[0:3]), tuple(n[3:7]), tuple(n[7:11]), tuple(n[11:17]))
        return to_robtarget(data), spans
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
        numbers = [n for n in map(_number, item.items) if n is not None]
        if len(numbers) != count:
            return None
        groups.append(numbers)
    spans: list[tuple[Span, ...]] = [tuple(n.span for n in group) for group in groups[:3]]
    data: Data = tuple(tuple(n.value for n in group) for group in groups)
    return to_robtarget(data), TargetSpans(source, spans[0], spans[1], spans[2], tree.span)


def _number(item: Expression) -> Number | None:
    return item if isinstance(item, Number) else None
