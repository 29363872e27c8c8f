"""Motion statements of two versions of a routine, paired so that as little as possible differs; sequences in order.

A pair costs what differs between its targets, names and instructions, one without a partner costs ``UNPAIRED_COST``.
The cheapest pairing in order is found by dynamic programming between statements that occur once in both versions.
Other sequences (`aligned`) are paired by a search for the next item that matches.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from postproc.rapid.data.events import MotionEvent, MotionStatement, StatementKey
from postproc.rapid.data.records import JointTarget, RobTarget

Pair = tuple[int | None, int | None]
Array = NDArray[np.float64]

UNPAIRED_COST = 0.6  # two of them are more than any pair of one instruction costs: that is told as a change
HALF_MM = 2.0  # targets this far apart cost half of what any two do
DEGREE = 5.0  # a joint's degree counts as so many millimetres
OTHER_NAME, OTHER_INSTRUCTION, UNKNOWN = 0.1, 1.0, 0.9
DIAGONAL_SLACK = 200  # statements by which a long pairing may wander from the shortest way
MOST_CELLS = 2e8  # cells; beyond, neighbours alone decide


def pair_motions(
    a: Sequence[MotionStatement],
    b: Sequence[MotionStatement],
    events_a: Mapping[StatementKey, Sequence[MotionEvent]],
    events_b: Mapping[StatementKey, Sequence[MotionEvent]],
) -> list[tuple[MotionStatement | None, MotionStatement | None]]:
    """Pair the motion statements of two versions of a routine in order, so that as little as possible differs.

    Args:
        events_a, events_b: executions of the statements by statement key; the first of each gives its target.

    Returns:
        Pairs in order; None in place of the partner of a statement that was added or removed.
    """
    ours, theirs = _described(a, events_a), _described(b, events_b)
    pairs: list[Pair] = []
    for (i, j), (k, m) in pairwise([(-1, -1), *_anchors(ours.keys, theirs.keys), (len(a), len(b))]):
        pairs += ((i + 1 + x if x is not None else None, j + 1 + y if y is not None else None)
                  for x, y in _between(ours.part(i + 1, k), theirs.part(j + 1, m)))  # fmt: skip
        pairs.append((k, m))
    return [(None if x is None else a[x], None if y is None else b[y]) for x, y in pairs[:-1]]


@dataclass(frozen=True, slots=True)
class _Compared:
    """What n statements are compared by.

    Args:
        keys: their words.
        place: (n, 6) positions [mm] or joints, NaN where unknown; kind: (n,) 1 a position, 2 joints, 0 unknown.
        name: (n,) texts of their targets, empty for numbers; instruction: (n,).
    """

    keys: list[Hashable]
    place: Array
    kind: NDArray[np.int64]
    name: NDArray[np.object_]
    instruction: NDArray[np.object_]

    def part(self, begin: int, end: int) -> _Compared:
        """The same arrays for the statements ``begin`` to ``end`` (exclusive) alone."""
        rows = slice(begin, end)
        return _Compared(self.keys[rows], self.place[rows], self.kind[rows], self.name[rows], self.instruction[rows])

    def costs(self, i: int, other: _Compared, columns: slice) -> Array:
        """Costs (k,) of pairing statement ``i`` with each statement in the slice ``columns`` of the other version.

        Targets d mm apart cost d / (d + HALF_MM), unknown ones ``UNKNOWN`` or 0 if they have the same name; another
        name or instruction adds ``OTHER_NAME`` or ``OTHER_INSTRUCTION``.
        """
        away = np.linalg.norm(other.place[columns] - self.place[i], axis=1)
        known = (other.kind[columns] == self.kind[i]) & (self.kind[i] > 0)
        named = other.name[columns] == self.name[i]
        cost = np.where(known, away / (away + HALF_MM), np.where(named & (self.name[i] != ""), 0.0, UNKNOWN))
        if self.name[i] != "":
            cost += OTHER_NAME * (~named & (other.name[columns] != ""))
        return np.asarray(cost + OTHER_INSTRUCTION * (other.instruction[columns] != self.instruction[i]), dtype=float)


def _described(
    statements: Sequence[MotionStatement], events: Mapping[StatementKey, Sequence[MotionEvent]]
) -> _Compared:
    """Arrays by which statements are compared; the target is that of the first event of each, NaN if there is none."""
    words: list[list[tuple[str, str]]] = [
        [(g.role, g.text.lower().replace(" ", "")) for g in s.arguments] for s in statements
    ]
    targets = [next((text for role, text in row if role == "to"), "") for row in words]
    instructions = [s.instruction.lower() for s in statements]
    place, kind = np.full((len(statements), 6), np.nan), np.zeros(len(statements), dtype=np.int64)
    for i, statement in enumerate(statements):
        target = next((event.target for event in events.get(statement.key, ())), None)
        if isinstance(target, RobTarget):
            place[i], kind[i] = (*target.trans, 0.0, 0.0, 0.0), 1
        elif isinstance(target, JointTarget):
            place[i], kind[i] = DEGREE * np.array(target.robax), 2
    return _Compared(
        [(name, *row) for name, row in zip(instructions, words, strict=True)],
        place,
        kind,
        np.array(["" if text.startswith("[") else text for text in targets], dtype=object),
        np.array(instructions, dtype=object),
    )


def _anchors(a: Sequence[Hashable], b: Sequence[Hashable]) -> list[tuple[int, int]]:
    """Index pairs of items that occur once in both: the longest series that rises in both (patience diff)."""
    once_a, once_b = Counter(a), Counter(b)
    at = {key: j for j, key in enumerate(b) if once_b[key] == 1}
    shared = [(i, at[key]) for i, key in enumerate(a) if once_a[key] == 1 and key in at]
    ends, last, before = list[int](), list[int](), list[int]()  # of rows by length; the row that each pair goes on from
    for n, (_, j) in enumerate(shared):
        length = bisect_left(ends, j)
        before.append(last[length - 1] if length else -1)
        ends[length : length + 1], last[length : length + 1] = [j], [n]
    row, n = list[tuple[int, int]](), last[-1] if last else -1
    while n >= 0:
        row.append(shared[n])
        n = before[n]
    return row[::-1]


def _between(a: _Compared, b: _Compared) -> Iterator[Pair]:
    """Index pairs of the cheapest pairing of all statements of ``a`` and ``b`` in order; None for a missing partner."""
    n, m = len(a.keys), len(b.keys)
    if not n or not m:
        yield from ((i, None) for i in range(n))
        yield from ((None, j) for j in range(m))
        return
    low, high = min(0, m - n) - DIAGONAL_SLACK, max(0, m - n) + DIAGONAL_SLACK
    if n * (high - low + 1) > MOST_CELLS:
        rows = list(range(n)), list(range(m))
        yield from aligned(*rows, lambda i, j: float(a.costs(i, b, slice(j, j + 1))[0]) < 0.5)
        return
    yield from cheapest_pairs(n, m, lambda i, columns: a.costs(i, b, columns), low, high)


def cheapest_pairs(
    n: int, m: int, costs: Callable[[int, slice], Array], low: int, high: int
) -> list[tuple[int | None, int | None]]:
    """Pair n and m items in order at the least cost; None stands for the partner of an item that is left alone.

    D[i, j] = min(D[i-1, j-1] + c[i-1, j-1], D[i-1, j] + UNPAIRED_COST, D[i, j-1] + UNPAIRED_COST),
    in the band low <= j - i <= high.

    Args:
        costs: gives the costs (k,) of row i (from 0) with a slice of k columns.
    """
    width = high - low + 1
    step = UNPAIRED_COST * np.arange(width)
    band = np.arange(width) + low  # j of row 0
    row = np.where((band >= 0) & (band <= m), UNPAIRED_COST * band, np.inf)
    taken = np.zeros((n + 1, width), dtype=np.uint8)  # 0 pair, 1 removed, 2 added
    taken[0] = 2
    for i in range(1, n + 1):
        column = band + i
        inside, beyond = (column >= 1) & (column <= m), (column < 0) | (column > m)
        pair = np.full(width, np.inf)
        first, last = max(1, band[0] + i), min(m, band[-1] + i)
        if first <= last:
            pair[inside] = row[inside] + costs(i - 1, slice(first - 1, last))
        removed = np.append(row[1:], np.inf) + UNPAIRED_COST
        best = np.minimum(pair, removed)
        best[beyond] = np.inf
        row = np.minimum.accumulate(best - step) + step
        row[beyond] = np.inf
        added = np.append(np.inf, row[:-1]) + UNPAIRED_COST
        # Of two ways that cost the same: pairs, then what was removed before what was added.
        taken[i] = np.where(pair <= row + 1e-12, 0, np.where(added <= row + 1e-12, 2, 1))
    pairs: list[tuple[int | None, int | None]] = []
    i, j = n, m
    while i or j:
        choice = taken[i, j - i - low]
        pairs.append((i - 1 if choice != 2 else None, j - 1 if choice != 1 else None))
        i, j = i - (choice != 2), j - (choice != 1)
    return pairs[::-1]


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
