"""What loads the arm at every sample: tool and payload, wrench, motion, side of approach."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.compensate.options import Options
from postproc.compensate.samples import Samples
from postproc.compensate.timeline import Timeline
from postproc.effects.contract import State
from postproc.model.arm import Model
from postproc.motion.values import Flags

_NO_TRAVEL = 1e-7  # joint travel between samples [rad] that does not count as an approach


def build_state(
    model: Model, samples: Samples, timeline: Timeline, options: Options, place: Array | None = None
) -> State:
    """The state at every sample.

    Args:
        timeline: of the programmed path.
        place: (n,) where the samples stand on the programmed path, as move + fraction; None: they are its own samples.
    """
    moves, rows = samples.moves, samples.move
    wrench = np.zeros((len(rows), 6))
    loaded = burning(samples) if options.force_on == "arc" else np.ones(len(rows), dtype=bool)
    wrench[loaded] = np.array([*options.force, *options.moment])
    where = rows + samples.u if place is None else place
    # Speeds alone load the arm too (centripetal forces): without inertia they are kept for effects that follow speed.
    keeps_speed = options.inertia or any("v" in effect.reads for effect in model.effects)
    return State(
        q=samples.q,
        v=timeline.at(timeline.v, where) if keeps_speed else None,
        a=timeline.at(timeline.a, where) if options.inertia else None,
        time=timeline.at(timeline.t, where),
        approach=approach_side(samples),
        payload_mass=np.array([m.payload_mass for m in moves])[rows],
        payload_center=np.array([m.payload_center for m in moves])[rows],
        wrench=wrench,
        T_flange_tcp=samples.mounts.flange_tcp(samples.T_work_tcp),
    )


def burning(samples: Samples) -> Flags:
    """(n,) whether the arc burns at a sample."""
    burns: Flags = np.array([m.welding for m in samples.moves])[samples.move]
    return burns


def approach_side(samples: Samples) -> Array:
    """Sign of each joint's last travel before a sample, (n, 6); 0 as long as a joint has not moved since the start."""
    first = np.array([m.first for m in samples.moves])
    step = np.diff(samples.q, axis=0, prepend=samples.q[:1])
    side = np.where(np.abs(step) > _NO_TRAVEL, np.sign(step), 0.0)
    at_start = (samples.u == 0.0)[:-1]
    side[:-1][at_start] = np.where(side[1:][at_start] != 0, side[1:][at_start], side[:-1][at_start])
    side[first[samples.move]] = 0.0
    # Where a joint rests, its last travel counts, but not across the start of a chain.
    index = np.where(side != 0, np.arange(len(side))[:, None], -1)
    begin = np.maximum.accumulate(np.where(first[samples.move], np.arange(len(side)), 0))
    last = np.maximum.accumulate(index, axis=0)
    valid = last >= begin[:, None]
    return np.where(valid, np.take_along_axis(side, np.maximum(last, 0), axis=0), 0.0)
