"""Texts that hold targets: where the numbers of a wish stand, which wishes share them, and whom they serve beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from postproc.compensate.sharing import Users
from postproc.compensate.values import TargetValue, Wish
from postproc.grouping import grouped
from postproc.rapid.program.events import Base, Origin, StatementKey

SAME_MM = 0.002  # two uses of a target whose corrected positions are this close share one value
SAME_QUATERNION = 2e-6

ArgumentKey = tuple[StatementKey, str]  # a motion statement and the role of its argument
# Path and offset of the literal numbers of a target, or of the whole argument of a call.
PlaceKey = tuple[Literal["numbers", "call"], str, int]


def same_value(a: TargetValue, b: TargetValue, within_mm: float = SAME_MM) -> bool:
    return (
        a.robconf == b.robconf
        and float(np.abs(np.subtract(a.pose.trans, b.pose.trans)).max()) <= within_mm
        and float(np.abs(np.subtract(a.pose.rot, b.pose.rot)).max()) <= SAME_QUATERNION * within_mm / SAME_MM
    )


def agree(group: Sequence[Wish]) -> bool:
    """Whether one value will do for all."""
    return all(same_value(group[0].value, w.value) for w in group[1:])


def one_target(group: Sequence[Wish]) -> bool:
    """Whether all name one target now."""
    return len({(w.target, w.origin.named) for w in group}) == 1


def by_place(wishes: Sequence[Wish]) -> dict[PlaceKey, list[Wish]]:
    """Wishes by the texts that could hold their values."""
    return grouped((place, wish) for wish in wishes for place in places_of(wish))


def by_argument(wishes: Sequence[Wish]) -> dict[ArgumentKey, list[Wish]]:
    """Wishes by statement and role."""
    return grouped(((wish.event.statement.key, wish.role), wish) for wish in wishes)


def circles_apart(wishes: Sequence[Wish]) -> list[Wish]:
    """Circle points get texts of their own where they alone keep others from sharing the target that they name."""
    alike = {key for key, group in by_argument(wishes).items() if agree(group)}
    apart: set[ArgumentKey] = set()
    for group in by_place(wishes).values():
        goals = [wish for wish in group if wish.role == "to"]
        circles = {(wish.event.statement.key, wish.role) for wish in group if wish.role == "via"}
        if goals and circles <= alike and agree(goals) and not agree(group):
            apart |= circles
    return [replace(w, apart=True) if (w.event.statement.key, w.role) in apart else w for w in wishes]


def numbers_of(origin: Origin) -> PlaceKey | None:
    """Where the numbers of a target stand, in a file that may change."""
    spans = origin.spans
    return None if spans is None or spans.source.lent else ("numbers", spans.source.path, spans.whole[0])


def places_of(wish: Wish) -> list[PlaceKey]:
    """Texts that could hold a corrected value, the one to prefer first."""
    if wish.apart:
        return []
    spans, handed, numbers = wish.origin.spans, wish.origin.handed, numbers_of(wish.origin)
    found: list[PlaceKey] = [numbers] if numbers is not None else []
    if handed is not None and not handed.source.lent and (spans is None or spans.whole[0] != handed.span[0]):
        found.append(("call", handed.source.path, handed.span[0]))
    return found


def text_of(wish: Wish, editable: set[PlaceKey]) -> PlaceKey | None:
    """The text that holds a corrected value; None where only the statement's own argument can."""
    return next((place for place in places_of(wish) if place in editable), None)


def base_of(group: Sequence[Wish]) -> Base | None:
    """What is one target in all runs of a statement: what ``Offs`` displaces, or its own."""
    base = group[0].origin.base
    if base is not None and all(wish.origin.base == base for wish in group):
        return base
    statement = group[0].event.statement
    argument = statement.argument(group[0].role)
    if argument is None or not one_target(group):
        return None
    return Base(statement.source, argument.span, group[0].target)


def serves_these(
    place: PlaceKey, group: Sequence[Wish], users: Mapping[str, Users], complete: frozenset[StatementKey]
) -> bool:
    """Whether editing the text that a group of wishes shares changes nothing but targets of compensated moves."""
    origin = group[0].origin
    if origin.handed is not None and (place[0] == "call" or origin.declaration is None):
        known = users.get(origin.handed.parameters[0])
        return known is not None and known.derived | known.plain <= complete
    if origin.declaration is None:
        return True  # an inline aggregate belongs to its statement alone
    known = users.get(origin.declaration)
    if known is None or not known.derived <= complete:
        return False
    if origin.kind == "element":
        # Statements that use other elements do not matter, but one whose index is not known may mean this one.
        return known.plain <= complete
    return known.plain == {w.event.statement.key for w in group}
