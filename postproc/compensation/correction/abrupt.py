"""Laws of one's own that jump or bend sharply on the way: samples stand close there, so that nothing is bridged unseen.

Laws of the library are smooth over a sample's distance; what a user's file says of a joint angle may be a step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.effects.contract import State
from postproc.effects.registry import BUILT_IN
from postproc.model.arm import Model
from postproc.model.deflection import REACH
from postproc.motion.path.samples import sample_moves
from postproc.motion.values import Move

PROBED = 0.002  # [m] between the places at which a law is asked
SHARP = 1e-5  # [m] by which it may leave the straight line through two of them
CLOSE_SAMPLES_M = 0.0005  # [m] between samples of a move on which it leaves that


def intervals_for_jumps(model: Model, moves: Sequence[Move], intervals: Array) -> Array:
    """(m,) sample intervals per move: those passed, or as many of 0.5 mm where a user's effect jumps or bends sharply.

    Only the user's own effects that read nothing but the commanded joint angles are examined, along lines and arcs.

    Args:
        intervals: (m,) least number of intervals per move without regard to such effects.
    """
    user_effects = [e for e in model.effects if type(e) not in BUILT_IN and set(e.reads) == {"q"}]
    if not user_effects or not moves:
        return intervals
    length = sample_moves(model.robot, moves, intervals).curves.length
    probes = sample_moves(model.robot, moves, np.ceil(length / PROBED))
    state = model.with_arm(State(q=probes.q))
    inside = (probes.move[2:] == probes.move[:-2]) & ~probes.curves.joint[probes.move[2:]]
    sharp = np.zeros(len(inside), dtype=bool)
    for effect in user_effects:
        for part in _displacements(effect, state):
            sharp |= np.abs(np.diff(part, 2, axis=0)).max(axis=1) > SHARP
    wanted = intervals.astype(float)
    jumping = np.unique(probes.move[2:][sharp & inside])
    wanted[jumping] = np.maximum(wanted, np.ceil(length / CLOSE_SAMPLES_M))[jumping]
    return wanted


def _displacements(effect: Effect, state: State) -> list[Array]:
    """Displacements (n, 6) [m] by one effect: an array for each of joints, tool, instrument and bodies that it moves.

    Joint angles and rotations [rad] are multiplied by the reach of the arm.
    """
    share = displacement_of(effect, state)
    twist = np.array([1.0, 1.0, 1.0, REACH, REACH, REACH])
    displacements = [] if share.joint is None else [REACH * share.joint]
    displacements += [twist * part for part in (share.tool, share.instrument, *share.body.values()) if part is not None]
    return [np.broadcast_to(part, (len(state), 6)) for part in displacements]
