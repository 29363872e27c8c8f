"""Which text to change: the numbers of a declaration, of an array element or of an aggregate, or the whole argument.

A declaration is edited when every use of it is a target of a compensated move and all of them ask for the same value;
otherwise each statement gets a target of its own. A statement that runs several times with different corrections and has
no text to tell them apart is left alone, with that reason.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from postproc.compensate.sharing import fully_wished
from postproc.compensate.values import Change, StatementKey, TargetValue, key_of
from postproc.rapid.events import MotionEvent, Origin

SAME_MM = 0.002  # two uses of a target whose corrected positions are this close share one value
SAME_QUATERNION = 2e-6
UNCHANGED_MM = 0.0005  # below the last decimal that is written
DIFFERENT = "it runs several times and each time needs another correction"


@dataclass(frozen=True, slots=True)
class Wish:
    """The corrected value that one execution of a statement asks for, in one argument."""

    event: int
    role: str
    origin: Origin
    value: TargetValue


@dataclass(frozen=True, slots=True)
class Decisions:
    """Changes to make, and the statements (by offset) that cannot be changed, with the reason."""

    changes: tuple[Change, ...]
    refused: Mapping[tuple[str, int], str] = field(default_factory=dict)


def same_value(a: TargetValue, b: TargetValue) -> bool:
    return (
        a.robconf == b.robconf
        and float(np.abs(np.subtract(a.pose.trans, b.pose.trans)).max()) <= SAME_MM
        and float(np.abs(np.subtract(a.pose.rot, b.pose.rot)).max()) <= SAME_QUATERNION
    )


def decide_changes(
    events: Sequence[MotionEvent], wishes: Sequence[Wish], users: Mapping[str, frozenset[StatementKey]]
) -> Decisions:
    """Decide for every wish where it is written.

    Args:
        events: all executions; wishes: of those that can be compensated.
        users: statements that use a declaration as their target, where it is used for nothing else.
    """
    complete = fully_wished(events, [(w.event, w.role) for w in wishes])
    in_place: dict[tuple[str, int], list[Wish]] = {}
    by_argument: dict[tuple[str, int, str], list[Wish]] = {}
    for wish in wishes:
        statement = events[wish.event].statement
        spans = wish.origin.spans
        if spans is not None:
            in_place.setdefault((spans.source.path, spans.whole[0]), []).append(wish)
        by_argument.setdefault((*key_of(statement), wish.role), []).append(wish)

    changes: list[Change] = []
    settled: set[tuple[str, int, str]] = set()
    keep_argument: set[tuple[str, int, str]] = set()
    for group in in_place.values():
        origin = group[0].origin
        agree = all(same_value(group[0].value, w.value) for w in group[1:])
        if agree and _serves_these_only(origin, {key_of(events[w.event].statement) for w in group}, users, complete):
            first = group[0]
            changes.append(Change(events[first.event].statement, first.role, first.value, origin.spans))
            settled |= {(*key_of(events[w.event].statement), w.role) for w in group}
        else:
            keep_argument |= {(*key_of(events[w.event].statement), w.role) for w in group}
    refused: dict[tuple[str, int], str] = {}
    for key, group in by_argument.items():
        if key in settled and key not in keep_argument:
            continue
        agree = all(same_value(group[0].value, w.value) for w in group[1:])
        if not agree or key in settled:  # one element of the array could be edited, another could not
            refused[key[:2]] = DIFFERENT
            continue
        first = group[0]
        changes.append(Change(events[first.event].statement, first.role, first.value, None))
    return _without_refused(changes, refused, events, in_place)


def _serves_these_only(
    origin: Origin,
    statements: set[StatementKey],
    users: Mapping[str, frozenset[StatementKey]],
    complete: frozenset[tuple[StatementKey, str]],
) -> bool:
    """Whether editing the text at an origin changes nothing but the targets of the given statements."""
    if origin.declaration is None:
        return True  # an inline aggregate belongs to its statement alone
    known = users.get(origin.declaration)
    if known is None:
        return False
    if origin.kind == "element":
        # Statements that use other elements do not matter, but one whose index is not known may mean this one.
        return all((s, "to") in complete for s in known)
    return known == statements


def _without_refused(
    changes: list[Change],
    refused: dict[tuple[str, int], str],
    events: Sequence[MotionEvent],
    in_place: Mapping[tuple[str, int], list[Wish]],
) -> Decisions:
    """Drop changes that a refused statement would see: its other argument, a declaration that it shares."""
    while True:
        kept: list[Change] = []
        spread = dict(refused)
        for change in changes:
            users = {key_of(change.statement)}
            if change.spans is not None:
                group = in_place[(change.spans.source.path, change.spans.whole[0])]
                users = {key_of(events[w.event].statement) for w in group}
            if users & refused.keys():
                spread.update({u: refused.get(u, DIFFERENT) for u in users})
            else:
                kept.append(change)
        if len(spread) == len(refused):
            return Decisions(tuple(kept), refused)
        changes, refused = kept, spread
