"""Values by what they have in common, and what many of them share."""

from __future__ import annotations

from collections.abc import Iterable
from operator import attrgetter
from typing import Any, TypeVar

K = TypeVar("K")
V = TypeVar("V")


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Group values by key; keys and values keep the order in which they come."""
    found: dict[K, list[V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def shared(path: str) -> Any:
    """Return a property that reads an attribute of an attribute, such as ``shape.instruction``.

    Many values share the inner one. It is read without a Python call, as fast as an attribute of the value's own.

    Args:
        path: names of the attributes with a dot between them.
    """
    return property(attrgetter(path))
