"""Values by what they have in common."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V")


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """The values of each key, all in the order in which they come."""
    found: dict[K, list[V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def numbered(*columns: Sequence[Hashable]) -> list[int]:
    """Rows of equal values get equal numbers, from 0 in the order in which they come."""
    found: dict[tuple[int, ...], int] = {}
    return [found.setdefault(row, len(found)) for row in zip(*map(_numbers, columns), strict=True)]


def _numbers(column: Sequence[Hashable]) -> list[int]:
    """A number for each value; one object is compared once: the hash of a record is worked out from all it holds."""
    found: dict[Hashable, int] = {}
    seen: dict[int, int] = {}
    for value in column:
        if id(value) not in seen:
            seen[id(value)] = found.setdefault(value, len(found))
    return [seen[id(value)] for value in column]
