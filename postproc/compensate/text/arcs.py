"""Targets on arcs: the text of each follows the three points of its arc.

No short expression gives a point on a circle through three targets, so the program gets a function that does
(templates/arc_point.j2): ``Offs([ppArcPoint(pStart,pCircle,pGoal,0.25),[..],[..],[..]],0.012,-0.03,0.007)``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensate.correction.fewest_targets import Pieces
from postproc.compensate.text.expressions import position_of
from postproc.compensate.text.laws import Allowed, OffsetLaw, constant_law, fit_affine, nearest_law
from postproc.compensate.text.values import ArcPoint, Change, Insertion, TargetValue
from postproc.motion.path.curves import circle_through
from postproc.rapid.data.events import MotionEvent, Origin
from postproc.rapid.data.records import RobTarget
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.tokens import identifiers

NO_START = "where its arc begins has no name here"
NO_PARTS = "a point of its arc is an expression that cannot be taken apart"
UNLIKE = "it runs several times on different ways"
SHARE_DECIMALS = 5

Texts = tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class ArcRun:
    """One execution of a divided arc.

    Args:
        texts: start, circle point and goal as the program calls them; points: (3, 3) where these are now [mm].
        shares: of the way at the added goals, via_shares: at the circle points, one more.
    """

    event: MotionEvent
    texts: Texts
    points: Array
    shares: Array
    via_shares: Array


def all_numbers(event: MotionEvent, before: MotionEvent) -> bool:
    """Whether the three points of an arc stand in its statements as numbers."""
    origins = (before.target_origin, event.target_origin, event.via_origin)
    return all(o is not None and o.kind == "inline" and o.handed is None for o in origins)


def function_name(program: Program) -> str:
    """A name for the function that the program does not have."""
    taken = set[str]().union(*(identifiers(source.data) for source in program.sources))
    names = ("ppArcPoint", *(f"ppArcPoint{n}" for n in range(2, 1000)))
    return next(name for name in names if name.lower() not in taken)


def arc_run(
    part: Pieces,
    event: MotionEvent,
    before: MotionEvent,
    shares: Array,
    program: Program,
    *,
    written: Callable[[Origin, RobTarget], Array],
) -> ArcRun | str:
    """One execution, or why it cannot be divided.

    Args:
        shares: of the way at the samples; written: (3,) where a target is as the text has it now [mm].
    """
    to, via, start = event.statement.argument("to"), event.statement.argument("via"), event.start
    assert to is not None and via is not None and event.via is not None and event.via_origin is not None
    if not isinstance(before.target, RobTarget) or not isinstance(event.target, RobTarget):
        return NO_START
    literal = before.statement.argument("to")
    if start is None and before.target_origin.kind == "inline" and before.target_origin.handed is None and literal:
        start = literal.text
    frames = [(e.wobj, e.displacement, e.tool) for e in (before, event)]
    if start is None or event.touched or frames[0] != frames[1]:
        return NO_START
    module = event.statement.module
    known = dict(before.numbers) | dict(event.numbers)
    for text, target in ((start, before.target), (via.text, event.via), (to.text, event.target)):
        position = position_of(text, target, program, module)
        if position is None or any(name not in known for name, _ in position.terms):
            return NO_PARTS
    points = np.array(
        [
            written(before.target_origin, before.target),
            written(event.via_origin, event.via),
            written(event.target_origin, event.target),
        ]
    )
    return ArcRun(event, (start, via.text, to.text), points, shares[list(part.goals)], shares[list(part.vias)])


def follow_arc(
    function: str,
    runs: Sequence[ArcRun],
    added: Sequence[Sequence[Insertion]],
    last: TargetValues,
    allowed: Allowed,
) -> tuple[list[Insertion], Change] | None:
    """The same statements for all runs, written with the three points, and the circle point of the part that is left;
    None where the runs ask for different ones.

    Args:
        added: what each run would add as numbers; last: the circle point of the last part in each run.
    """
    first = runs[0]
    if any(run.texts != first.texts or len(run.shares) != len(first.shares) for run in runs):
        return None
    found = []
    for k, insertions in enumerate(zip(*added, strict=True)):
        to = _on_arc(function, runs, [i.to for i in insertions], [run.shares[k] for run in runs], allowed)
        vias = [i.via for i in insertions if i.via is not None]
        via = _on_arc(function, runs, vias, [run.via_shares[k] for run in runs], allowed)
        if to is None or via is None:
            return None
        found.append(replace(insertions[0], to=to, via=via))
    left = _on_arc(function, runs, last, [run.via_shares[-1] for run in runs], allowed)
    statement = first.event.statement
    argument = statement.argument("via")
    if left is None or argument is None:
        return None
    return found, Change(statement.source, argument.span, "offset", left, left.law or OffsetLaw())


TargetValues = Sequence[TargetValue]


def _on_arc(
    function: str, runs: Sequence[ArcRun], values: TargetValues, shares: Sequence[float], allowed: Allowed
) -> TargetValue | None:
    share = round(float(np.median(shares)), SHARE_DECIMALS)
    points = [_point(run.points, own) for run, own in zip(runs, shares, strict=True)]
    law = nearest_law(_laws(runs, np.array([value.pose.trans for value in values]) - points, allowed), allowed)
    return None if law is None else replace(values[0], law=law, arc=ArcPoint(function, *runs[0].texts, share))


def _laws(runs: Sequence[ArcRun], rest: Array, allowed: Allowed) -> Iterator[tuple[OffsetLaw, Array]]:
    yield constant_law(rest)
    regressors: list[Mapping[str, float]] = [dict(run.event.numbers) for run in runs]
    law = fit_affine(regressors, rest, allowed.fine)
    yield law, rest - [law.at(numbers) for numbers in regressors]


def _point(points: Array, share: float) -> Array:
    """(3,) the point after a share of the circle through three points (3, 3)."""
    start, via, goal = points[:, None]
    center, radial, tangent, angle, _, _ = circle_through(start, via, goal)
    along: Array = (center + np.cos(share * angle) * radial + np.sin(share * angle) * tangent)[0]
    return along
