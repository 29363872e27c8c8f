"""The arm's first natural period along a path: what lasts shorter is no quasi-static load."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.model.arm import Model
from postproc.model.derivatives.stiffness import natural_frequencies
from postproc.model.equilibrium import carries_load
from postproc.motion.path.samples import Samples

_MOST = 200  # poses at which frequencies are computed; they change slowly along a path


def first_periods(model: Model, path: Samples) -> Array:
    """First natural period (n,) [s] at every sample of a path (Eq. 6 of the source paper), 0 for a rigid arm.

    It is computed at no more than 200 samples and interpolated between them.
    """
    n = len(path.q)
    if n == 0 or not carries_load(model):
        return np.zeros(n)
    rows = np.linspace(0, n - 1, min(n, _MOST)).round().astype(int)
    moves = [path.moves[i] for i in path.move[rows]]
    state = State(
        q=path.q[rows],
        payload_mass=np.array([m.payload_mass for m in moves]),
        payload_center=np.array([m.payload_center for m in moves]),
        T_flange_tcp=path.mounts_at(rows).flange_tcp(path.T_work_tcp[rows]),
    )
    first = natural_frequencies(model, state)[:, 0]
    period = np.where(np.isfinite(first) & (first > 0), 1.0 / np.maximum(first, 1e-3), 0.0)
    return np.interp(np.arange(n), rows, period)
