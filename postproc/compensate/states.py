"""What loads the arm at every sample: tool and payload, wrench, motion, side of approach."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.compensate.options import Options
from postproc.compensate.samples import Samples
from postproc.effects.contract import State
from postproc.motion.values import Trajectory

_STANDSTILL = 1e-7  # joint travel between samples [rad] that does not count as an approach


def build_state(samples: Samples, trajectory: Trajectory | None, options: Options, burning: Array, reads_speed: bool) -> State:
    """The state at every sample.

    Args:
        trajectory: where inertia, speeds and times come from; None leaves them out.
        burning: (n,) bool, whether the arc burns at a sample.
        reads_speed: an effect of the model follows the joint speeds.
    """
    moves = samples.moves
    rows = samples.move
    wrench = np.zeros((len(rows), 6))
    loaded = burning if options.force_on == "arc" else np.ones(len(rows), dtype=bool)
    wrench[loaded] = np.array([*options.force, *options.moment])
    state = State(
        q=samples.q,
        approach=approach_side(samples),
        payload_mass=np.array([m.payload_mass for m in moves])[rows],
        payload_center=np.array([m.payload_center for m in moves])[rows],
        wrench=wrench,
        T_flange_tcp=samples.curves.T_flange_tcp[rows],
    )
    if trajectory is None:
        return state
    v, a, t = (at_samples(samples, trajectory, x) for x in (trajectory.v, trajectory.a_sustained, trajectory.t))
    if options.inertia:
        return state.with_(v=v, a=a, time=t)
    # Speeds alone load the arm too (centripetal forces): without inertia they are kept for effects that follow speed.
    return state.with_(v=v if reads_speed else None, time=t)


def at_samples(samples: Samples, trajectory: Trajectory, values: Array) -> Array:
    """Values (k,) or (k, j) along the trajectory, read at the samples by move and fraction."""
    path = trajectory.path
    known = path.move + path.u
    wanted = samples.move + samples.u
    if values.ndim == 1:
        return np.interp(wanted, known, values)
    return np.stack([np.interp(wanted, known, column) for column in values.T], axis=1)


def approach_side(samples: Samples) -> Array:
    """Sign of each joint's last travel before a sample, (n, 6); 0 as long as a joint has not moved since the start."""
    first = np.array([m.first for m in samples.moves])
    step = np.diff(samples.q, axis=0, prepend=samples.q[:1])
    side = np.where(np.abs(step) > _STANDSTILL, np.sign(step), 0.0)
    at_start = (samples.u == 0.0)[:-1]
    side[:-1][at_start] = np.where(side[1:][at_start] != 0, side[1:][at_start], side[:-1][at_start])
    side[first[samples.move]] = 0.0
    # Where a joint rests, its last travel counts, but not across the start of a chain.
    index = np.where(side != 0, np.arange(len(side))[:, None], -1)
    begin = np.maximum.accumulate(np.where(first[samples.move], np.arange(len(side)), 0))
    last = np.maximum.accumulate(index, axis=0)
    valid = last >= begin[:, None]
    return np.where(valid, np.take_along_axis(side, np.maximum(last, 0), axis=0), 0.0)
