"""Where the correction jumps on the way: samples stand close there, so that targets may too.

Between the last sample before the place where a joint turns back and the first one after, lost motion takes the
correction from one side of the gap to the other. Laws of the library are smooth over a sample's distance; what a user's
file says of a joint angle may be a step, which is not to be bridged unseen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.compensation.correction.curve import Transition
from postproc.compensation.path.motion import approach_side, feels_sides
from postproc.diagnostics import joined
from postproc.effects.asking import displacement_of
from postproc.effects.registry import BUILT_IN
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.deflection import REACH
from postproc.motion.path.samples import Samples, sample_moves
from postproc.motion.values import Flags, Move

CLOSEST = 0.002  # [m] between samples of a move in which a joint turns back
CROSSING = 0.1  # [s]: nor closer than the arm moves in this time, to cross the gap without a knock
PROBED = 0.002  # [m] between the places at which a law is asked
SHARP = 1e-5  # [m] by which it may leave the straight line through two of them
CLOSE_SAMPLES_M = 0.0005  # [m] between samples of a move on which it leaves that


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
        names, i = [str(j + 1) for j in np.flatnonzero(turns[k])], int(samples.move[k])
        where = f"where joint{'s' * (len(names) > 1)} {joined(names)} turn{'s' * (len(names) == 1)} back"
        reversals.append(Transition(i, where, i, float(jump[k]), float(t[k + 1] - t[k]), (k, k + 1), True))
    return reversals


def _turns(samples: Samples) -> Flags:
    """(n - 1, 6) whether each joint's direction of travel reverses between a sample and the next."""
    side = approach_side(samples)
    return side[1:] * side[:-1] < 0


def intervals_for_jumps(model: Model, moves: Sequence[Move], intervals: Array) -> Array:
    """(m,) sample intervals per move: those passed, or as many of 0.5 mm where a user's effect jumps or bends sharply.

    Only the user's own effects that read nothing but the commanded joint angles are examined, along lines and arcs.

    Args:
        intervals: (m,) least number of intervals per move without regard to such effects.
    """
    library = [cls for cls in BUILT_IN if cls.role is not Role.CURVE]
    abrupt = [e for e in model.effects if type(e) not in library and set(e.reads) == {"q"}]
    if not abrupt or not moves:
        return intervals
    length = sample_moves(model.robot, moves, intervals).curves.length
    probes = sample_moves(model.robot, moves, np.ceil(length / PROBED))
    state = model.with_arm(State(q=probes.q))
    inside = (probes.move[2:] == probes.move[:-2]) & ~probes.curves.joint[probes.move[2:]]
    sharp = np.zeros(len(inside), dtype=bool)
    twist = np.array([1.0, 1.0, 1.0, REACH, REACH, REACH])  # angles count at the reach of the arm
    for effect in abrupt:
        share = displacement_of(effect, state)
        parts = [] if share.joint is None else [REACH * share.joint]
        parts += [twist * part for part in (share.tool, share.instrument, *share.body.values()) if part is not None]
        for part in parts:
            bend = np.diff(np.broadcast_to(part, (len(state), 6)), 2, axis=0)
            sharp |= np.abs(bend).max(axis=1) > SHARP
    wanted = intervals.astype(float)
    jumping = np.unique(probes.move[2:][sharp & inside])
    wanted[jumping] = np.maximum(wanted, np.ceil(length / CLOSE_SAMPLES_M))[jumping]
    return wanted
