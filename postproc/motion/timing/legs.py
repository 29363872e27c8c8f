"""A long program in legs that begin and end at rest.

Each is sampled and timed by itself, so that working memory grows with the longest leg, not with the program.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from postproc.motion.values import Index, Move

MOST = 10_000  # samples after which the next stop ends a leg


def cut_legs(moves: tuple[Move, ...], size: Index, most: int = MOST) -> Iterator[tuple[int, tuple[Move, ...]]]:
    """Divide a program at stops, once ``most`` samples are reached, into legs of consecutive moves.

    Each leg comes as the index of its first move, and its moves; a leg that starts where the arm has stopped begins
    with the move to that stop. A program without a stop is one leg, however long it is.

    Args:
        size: (m,) approximate number of samples of each move.
        most: samples after which the next stop ends a leg.
    """
    begin, load = 0, 0
    for i in range(1, len(moves) + 1):
        load += int(size[i - 1])
        rest = i == len(moves) or (load >= most and (moves[i].first or moves[i - 1].fine))
        if not rest:
            continue
        if begin == 0 or moves[begin].first:
            yield begin, moves[begin:i]
        else:
            yield begin - 1, (replace(moves[begin - 1], first=True), *moves[begin:i])
        begin, load = i, 0
