"""Two sequences paired in order, with what stands in one of them only."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")
LOOK_AHEAD = 400


def aligned(a: Sequence[T], b: Sequence[T], same: Callable[[T, T], bool]) -> Iterator[tuple[T | None, T | None]]:
    """Pair the items of two sequences in order; None stands where one side has no partner.

    Sequences of equal length are paired one to one, others by searching up to ``LOOK_AHEAD`` items ahead for a match.

    Args:
        same: whether two items match; items that do not match may be paired, too, as a change.
    """
    if len(a) == len(b):
        yield from zip(a, b, strict=True)
        return
    i = j = 0
    while i < len(a) and j < len(b):
        if not same(a[i], b[j]):
            skipped = _skip(a, b, i, j, same)
            if skipped is not None:
                for _ in range(skipped[0]):
                    yield a[i], None
                    i += 1
                for _ in range(skipped[1]):
                    yield None, b[j]
                    j += 1
        yield a[i], b[j]
        i, j = i + 1, j + 1
    for item in a[i:]:
        yield item, None
    for item in b[j:]:
        yield None, item


def _skip(a: Sequence[T], b: Sequence[T], i: int, j: int, same: Callable[[T, T], bool]) -> tuple[int, int] | None:
    """How many items of ``a`` (from ``i``) and of ``b`` (from ``j``) to leave without partner until the next match.

    Returns:
        (0, n) or (n, 0); None if the present two items are a changed pair, or nothing matches within ``LOOK_AHEAD``.
    """
    for ahead in range(1, LOOK_AHEAD):
        if j + ahead < len(b) and same(a[i], b[j + ahead]):
            return 0, ahead
        if i + ahead < len(a) and same(a[i + ahead], b[j]):
            return ahead, 0
        if i + ahead < len(a) and j + ahead < len(b) and same(a[i + ahead], b[j + ahead]):
            return None
    return None
