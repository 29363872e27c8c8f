"""Where a joint turns back: lost motion makes the exact correction jump there.

Between the last sample before and the first one after, the correction passes over from one side of the gap to the
other; samples stand close there, so that targets may too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.abrupt import intervals_for_jumps
from postproc.compensation.correction.curve import Transition
from postproc.compensation.path.motion import approach_side, feels_sides
from postproc.model.arm import Model
from postproc.motion.path.samples import Samples, sample_moves
from postproc.motion.values import Flags, Move

CLOSEST = 0.002  # [m] between samples of a move in which a joint turns back
CROSSING = 0.1  # [s]: nor closer than the arm moves in this time, to cross the gap without a knock


def sample_for(model: Model, moves: Sequence[Move], intervals: Array) -> Samples:
    """Samples of every move, closer together where an effect jumps or a joint turns back on the way or at its ends.

    Args:
        moves: chains of moves.
        intervals: (m,) least number of intervals of each move.
    """
    intervals = intervals_for_jumps(model, moves, intervals)
    samples = sample_moves(model.robot, moves, intervals)
    if not feels_sides(model):
        return samples
    speed = np.array([m.speed for m in samples.moves])
    close = np.ceil(samples.curves.length / np.maximum(CLOSEST, CROSSING * speed))
    wanted = intervals.astype(float)
    at = np.flatnonzero(_turns(samples).any(axis=1))
    meeting = np.unique(samples.move[np.concatenate([at, at + 1])])
    wanted[meeting] = np.maximum(wanted, close)[meeting]
    if (wanted <= intervals).all():
        return samples
    return sample_moves(model.robot, moves, wanted)


def find_reversals(model: Model, samples: Samples, T_commanded: Array, t: Array, least: float) -> list[Transition]:
    """Transitions inside lines and arcs where a joint turns back, as lost motion makes the correction jump there.

    Args:
        T_commanded: (n, 4, 4) commanded poses at the samples.
        t: (n,) time at the samples [s].
        least: smallest jump that counts [m].
    """
    if not feels_sides(model):
        return []
    shift = T_commanded[:, :3, 3] - samples.T_work_tcp[:, :3, 3]
    jump = np.linalg.norm(np.diff(shift, axis=0), axis=1)
    inside = (np.diff(samples.move) == 0) & ~samples.curves.joint[samples.move[1:]]
    turns = _turns(samples)
    reversals = []
    for k in np.flatnonzero(turns.any(axis=1) & inside & (jump > least)).tolist():
        names = " and ".join(str(j + 1) for j in np.flatnonzero(turns[k]))
        i = int(samples.move[k])
        where = f"where joint {names} turns back"
        reversals.append(Transition(i, where, i, float(jump[k]), float(t[k + 1] - t[k]), (k, k + 1), True))
    return reversals


def _turns(samples: Samples) -> Flags:
    """(n - 1, 6) whether each joint's direction of travel reverses between a sample and the next."""
    side = approach_side(samples)
    return side[1:] * side[:-1] < 0
