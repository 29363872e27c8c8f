"""What is doubtful in the motions of a program as a whole: lines that change the sign of axis 5, rough orientations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

from postproc.diagnostics import Diagnostic, Source, Span
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget
from postproc.rapid.evaluation.declared import ROUNDED_NORM, numbers_of
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.spans import literal
from postproc.rapid.syntax.trees import Aggregate, Expression, Number
from postproc.rapid.unknown import Unknown

SETTING = "wrist_in_joints"


def assume_wrist(events: Sequence[MotionEvent]) -> tuple[list[MotionEvent], list[Diagnostic]]:
    r"""The events, with ``SingArea\Wrist`` switched on where a line or arc would change the sign of axis 5.

    Nothing changes in a program that never switches it on.

    Returns:
        The events, and RAP026 at each statement for which it is assumed.
    """
    assumed = list(events)
    if not any([now.options.get(SETTING) for now in {event.in_force for event in events}]):
        return assumed, []
    findings: dict[object, Diagnostic] = {}
    for i, (before, event) in enumerate(pairwise(events), 1):
        if not event.options.get(SETTING) and _flips(before, event):
            options = MappingProxyType({**event.options, SETTING: True})
            assumed[i] = replace(event, in_force=replace(event.in_force, options=options))
            argument = event.statement.argument("to")
            span = event.statement.span if argument is None else argument.span
            text = r"axis 5 changes its sign on the way to this target: `SingArea\Wrist` is taken to be in force here"
            help_ = r"set it in front, if an operator starts here; other paths of the program set it elsewhere"
            finding = Diagnostic("RAP026", "warning", text, event.statement.source, span, help_)
            findings.setdefault(event.statement.key, finding)
    return assumed, list(findings.values())


def _flips(before: MotionEvent, event: MotionEvent) -> bool:
    """Whether a line or arc, monitored by ConfL, has ends whose configurations state different signs of axis 5."""
    in_space = (
        event.statement.interpolation in ("line", "arc") and not event.start_unknown and event.resumes_from is None
    )
    if not in_space or not all(e.options.get("conf_l") is not False for e in (before, event)):
        return False
    ends = before.target, event.target
    bits = [target.robconf[3] for target in ends if isinstance(target, RobTarget)]
    return len(bits) == 2 and bool((bits[0] ^ bits[1]) & 1)


FRAMED = frozenset({"tooldata", "wobjdata"})


def rough_frames(program: Program) -> Iterator[Diagnostic]:
    """Report RAP025 for every quaternion in a tool or work object whose length differs from 1 by more than rounding."""
    for declaration in program.declarations:
        if declaration.type.lower() in FRAMED and declaration.init is not None:
            try:
                tree = read_full_expression(declaration.source.data, *declaration.init)
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
            if spans is None or not spans.rough or (spans.source.path, spans.span[0]) in seen:
                continue
            seen.add((spans.source.path, spans.span[0]))
            match = literal(spans.source.data, *spans.span)
            if match is not None:
                length = math.hypot(*numbers_of(match)[3:7])
                yield _rough("the orientation", length, spans.source, (match.start(4), match.end(7)))
