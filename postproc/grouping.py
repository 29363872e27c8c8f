"""Values by what they have in common, what many of them share, and what is reached from some."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable
from operator import attrgetter
from typing import Any, TypeVar

K = TypeVar("K")
V = TypeVar("V")
H = TypeVar("H", bound=Hashable)


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Group values by key; keys and values keep the order in which they come."""
    groups: defaultdict[K, list[V]] = defaultdict(list)
    for key, value in pairs:
        groups[key].append(value)
    return dict(groups)


def closure(start: Iterable[H], successors: Callable[[H], Iterable[H]]) -> set[H]:
    """All values that are reached: those at the start, and step by step what ``successors`` gives for each of them."""
    reached = set(start)
    pending = list(reached)
    while pending:
        new = set(successors(pending.pop())) - reached
        reached |= new
        pending += new
    return reached


def shared(path: str) -> Any:
    """Return a property that reads an attribute of an attribute, such as ``shape.instruction``.

    Many values share the inner one. It is read without a Python call, as fast as an attribute of the value's own.

    Args:
        path: names of the attributes with a dot between them.
    """
    return property(attrgetter(path))
