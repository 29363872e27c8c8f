"""Which text to change: the numbers of a declaration, of an array element or of an aggregate, or the whole argument.

A declaration is edited when all that it serves for are targets of compensated moves and all of them ask for the same
value; otherwise each statement gets a target of its own. A statement that runs several times with different corrections
cannot have one of its own: where its target is derived (Offs, RelTool) from one that is edited it follows that, else it
is left alone, with that reason.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from postproc.compensate.sharing import Users, fully_wished
from postproc.compensate.values import Change, Place, StatementKey, TargetValue, key_of
from postproc.rapid.events import MotionEvent, Origin

SAME_MM = 0.002  # two uses of a target whose corrected positions are this close share one value
SAME_QUATERNION = 2e-6
DIFFERENT = "it runs several times and each time needs another correction"
FOLLOWS = "it follows the target that it is derived from"

IN_PLACE: Mapping[str, Place] = {"inline": "aggregate", "declared": "declaration", "element": "element"}

ArgumentKey = tuple[StatementKey, str]  # a motion statement and the role of its argument
PlaceKey = tuple[str, int]  # path and offset of the literal numbers of a target


@dataclass(frozen=True, slots=True)
class Wish:
    """The corrected value that one execution of a statement asks for, in one argument."""

    event: int
    role: str
    origin: Origin
    value: TargetValue


@dataclass(frozen=True)
class Decisions:
    """What is written.

    Args:
        changes: texts to change.
        refused: statements that stay as they are, with the reason.
        following: statements whose targets move with the declarations named, because they are derived from them.
    """

    changes: tuple[Change, ...]
    refused: Mapping[StatementKey, str] = field(default_factory=dict)
    following: Mapping[StatementKey, frozenset[str]] = field(default_factory=dict)

    @cached_property
    def _replaced(self) -> frozenset[StatementKey]:
        return frozenset(key_of(c.statement) for c in self.changes if c.role == "to" and c.spans is None)

    def place(self, event: MotionEvent) -> Place | None:
        """Where the new target of a statement that is compensated is written."""
        key = key_of(event.statement)
        if key in self.following:
            return "derived"
        if key in self._replaced or event.target_origin is None:
            return "argument"
        return IN_PLACE.get(event.target_origin.kind)


def same_value(a: TargetValue, b: TargetValue, within_mm: float = SAME_MM) -> bool:
    return (
        a.robconf == b.robconf
        and float(np.abs(np.subtract(a.pose.trans, b.pose.trans)).max()) <= within_mm
        and float(np.abs(np.subtract(a.pose.rot, b.pose.rot)).max()) <= SAME_QUATERNION * within_mm / SAME_MM
    )


def decide_changes(events: Sequence[MotionEvent], wishes: Sequence[Wish], users: Mapping[str, Users]) -> Decisions:
    """Decide for every wish where it is written.

    Args:
        events: all executions; wishes: of those that can be compensated.
        users: from ``target_users``.
    """
    places: dict[PlaceKey, list[Wish]] = {}
    arguments: dict[ArgumentKey, list[Wish]] = {}
    for wish in wishes:
        spans = wish.origin.spans
        if spans is not None:
            places.setdefault((spans.source.path, spans.whole[0]), []).append(wish)
        arguments.setdefault((key_of(events[wish.event].statement), wish.role), []).append(wish)
    complete = fully_wished(events, [w.event for w in wishes])
    bases: dict[StatementKey, set[str]] = {}
    for declaration, use in users.items():
        for key in use.derived:
            bases.setdefault(key, set()).add(declaration)

    editable = {key for key, group in places.items() if _agree(group) and _serves_these(group, events, users, complete)}
    while True:
        refused, edited = _refuse(places, arguments, editable, bases)
        # A declaration stays as it is when a statement that uses it does.
        kept = editable
        if refused:
            kept = {k for k in editable if not any(key_of(events[w.event].statement) in refused for w in places[k])}
        if kept == editable:
            break
        editable = kept
    changes = [_change(events, places[key][0], in_place=True) for key in places if key in editable]
    for argument, group in arguments.items():
        if argument[0] not in refused and _agree(group) and not _all_edited(group, editable):
            changes.append(_change(events, group[0], in_place=False))
    following = {
        key: edited_of
        for (key, _), group in arguments.items()
        if not _agree(group) and (edited_of := edited & bases.get(key, set())) and not _all_edited(group, editable)
    }
    return Decisions(tuple(changes), refused, following)


def _refuse(
    places: Mapping[PlaceKey, list[Wish]],
    arguments: Mapping[ArgumentKey, list[Wish]],
    editable: set[PlaceKey],
    bases: Mapping[StatementKey, set[str]],
) -> tuple[dict[StatementKey, str], frozenset[str]]:
    """Statements for which no text can be found, and the declarations that are edited."""
    edited = frozenset(d for key in editable if (d := places[key][0].origin.declaration) is not None)
    refused: dict[StatementKey, str] = {}
    for (key, _), group in arguments.items():
        if not _agree(group) and not _all_edited(group, editable) and not edited & bases.get(key, set()):
            refused[key] = DIFFERENT
    return refused, edited


def _agree(group: Sequence[Wish]) -> bool:
    return all(same_value(group[0].value, w.value) for w in group[1:])


def _all_edited(group: Sequence[Wish], editable: set[PlaceKey]) -> bool:
    spans = [w.origin.spans for w in group]
    return all(s is not None and (s.source.path, s.whole[0]) in editable for s in spans)


def _serves_these(
    group: Sequence[Wish],
    events: Sequence[MotionEvent],
    users: Mapping[str, Users],
    complete: frozenset[StatementKey],
) -> bool:
    """Whether editing the text that a group of wishes shares changes nothing but targets of compensated moves."""
    origin = group[0].origin
    if origin.declaration is None:
        return True  # an inline aggregate belongs to its statement alone
    known = users.get(origin.declaration)
    if known is None or not known.derived <= complete:
        return False
    if origin.kind == "element":
        # Statements that use other elements do not matter, but one whose index is not known may mean this one.
        return known.plain <= complete
    return known.plain == {key_of(events[w.event].statement) for w in group}


def _change(events: Sequence[MotionEvent], wish: Wish, in_place: bool) -> Change:
    return Change(events[wish.event].statement, wish.role, wish.value, wish.origin.spans if in_place else None)
