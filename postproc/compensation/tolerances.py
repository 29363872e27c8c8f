"""How far the torch may stay off: one tolerance for motions that weld, one in the air; which motions are in scope."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.compensation.options import TOLERANCE_M, Options
from postproc.motion.values import Flags, Move

NOTICED = 0.25  # of what remains on the arm: with as much across it, sqrt(1 + 1/16), the whole grows by 3 %


def path_tolerances(moves: Sequence[Move], options: Options) -> Array:
    """(m,) largest deviation [m] allowed along each move.

    It is the air tolerance for moves that do not weld in a program that welds, the weld tolerance for all others.
    """
    if not _any_weld(moves):
        return np.full(len(moves), options.tolerance_m)
    welding = np.array([move.welding for move in moves])
    return np.where(welding, options.tolerance_m, max(options.tolerance_m, options.air_tolerance_m))


def division_tolerances(path: Array, options: Options, expected_m: float) -> Array:
    """(m,) distance [m] from each move's commanded curve below which no target is added.

    It is the tolerance of the move, and at least a quarter of what is expected to remain on the arm; a tolerance closer
    than the default is kept all the same.

    Args:
        path: (m,) tolerance along each move [m]. expected_m: expected to remain on the arm [m].
    """
    return path if options.tolerance_m < TOLERANCE_M else np.maximum(path, NOTICED * expected_m)


def goal_tolerances(moves: Sequence[Move], options: Options) -> Array:
    """(m,) largest deviation [m] allowed at each goal, the smaller one of the two moves that meet there."""
    path = path_tolerances(moves, options)
    first = np.array([move.starts_chain for move in moves])
    behind = np.append(np.where(first[1:], np.inf, path[1:]), np.inf)
    return np.minimum(path, behind)


def in_scope(moves: Sequence[Move], options: Options) -> Flags:
    """(m,) moves whose goals are corrected: with the scope ``welds`` weld moves, and the move just before each of them.

    A move before is left out where a chain of moves begins behind it. Without a weld all moves are corrected.
    """
    if options.scope == "all" or not _any_weld(moves):
        return np.ones(len(moves), dtype=bool)
    welding = np.array([move.welding for move in moves])
    return welding | np.append(welding[1:] & np.array([not move.starts_chain for move in moves[1:]], dtype=bool), False)


def _any_weld(moves: Sequence[Move]) -> bool:
    """Whether any of the moves belongs to a weld statement."""
    return any(move.event.weld is not None for move in moves)
