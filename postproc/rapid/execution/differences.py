"""What a turn of a loop leaves different."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.unknown import PartlyUnknown, Unknown


def present(memory: Memory, keys: Iterable[str]) -> dict[str, object]:
    """The present values of data and state by key; a key itself stands for the value if nothing has set it."""
    found: dict[str, object] = {}
    for key in keys:
        bound = memory.frame.bindings.get(key[1:]) if key.startswith("%") else None
        if bound is None or isinstance(bound, Reference):
            found[key] = memory.changed.get(key if bound is None else bound.declaration.key, key)
        else:
            found[key] = bound
    return found


def differing(before: Mapping[str, object], after: Mapping[str, object]) -> set[str]:
    """Keys whose value changed; an unknown value that is replaced by another unknown one counts as unchanged."""
    return {key for key, now in after.items() if before[key] is not now and not _alike(before[key], now)}


def _alike(before: object, now: object) -> bool:
    """Whether two values are equal, where any two unknown values (or parts) count as equal."""
    match before, now:
        case PartlyUnknown(), PartlyUnknown():
            return _alike(before.data, now.data)
        case (PartlyUnknown(), _) | (_, PartlyUnknown()):
            return False
        case Unknown(), Unknown():
            return True
        case tuple(), tuple() if before != now and len(before) == len(now):
            return all(map(_alike, before, now))
    return before == now
