"""Orientations that are farther from a unit quaternion than rounding explains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.evaluation.literals import ROUNDED_NORM, numbers_of
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.spans import literal
from postproc.rapid.syntax.trees import Aggregate, Expression, Number
from postproc.rapid.unknown import Unknown

FRAMED = frozenset({"tooldata", "wobjdata"})


def rough_frames(program: Program) -> Iterator[Diagnostic]:
    """Report RAP025 for every quaternion in a tool or work object whose length differs from 1 by more than rounding."""
    for declaration in program.declarations:
        if declaration.type.lower() in FRAMED and declaration.init is not None:
            try:
                tree = read_whole_expression(declaration.source.data, *declaration.init)
            except Unknown:
                continue
            for quaternion in _quaternions(tree):
                length = math.hypot(*(item.value for item in quaternion.items if isinstance(item, Number)))
                if ROUNDED_NORM < abs(length - 1.0) < 1.0:  # [0,0,0,0] is a load that nobody has measured
                    what = f"an orientation of `{declaration.name}`"
                    yield _rough(what, length, declaration.source, quaternion.span)


def _quaternions(tree: Expression) -> Iterator[Aggregate]:
    """All aggregates of four literal numbers in an expression, itself included."""
    if isinstance(tree, Aggregate):
        if len(tree.items) == 4 and all(isinstance(item, Number) for item in tree.items):
            yield tree
        for item in tree.items:
            yield from _quaternions(item)


def _rough(what: str, length: float, source: Source, span: Span) -> Diagnostic:
    """The finding RAP025: the quaternion of ``what`` at this span has this length, not 1, and is scaled to 1."""
    text = f"{what} is no unit quaternion: its length is {length:.4g}, and it is scaled to 1"
    return Diagnostic("RAP025", "warning", text, source, span, "look for a typing error: a wrong digit turns the torch")


def rough_orientations(events: Sequence[MotionEvent]) -> Iterator[Diagnostic]:
    """Report RAP025, once per place in the text, for every target whose quaternion is too far from length 1."""
    seen: set[tuple[str, int]] = set()
    for event in events:
        for origin in (event.target_origin, event.via_origin):
            spans = origin.spans if origin is not None else None
            if spans is None or not spans.rough or (spans.source.path, spans.whole[0]) in seen:
                continue
            seen.add((spans.source.path, spans.whole[0]))
            match = literal(spans.source.data, *spans.whole)
            if match is not None:
                length = math.hypot(*numbers_of(match)[3:7])
                yield _rough("the orientation", length, spans.source, (match.start(4), match.end(7)))
