"""Where poses that are to be measured may be: a region, a list, in sight of the instrument, in the measured range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.problem import Problem


@dataclass(frozen=True)
class Room:
    """Where poses may be.

    Args:
        region: (2, 3) lowest and highest x, y, z of the TCP in the base frame [m].
        candidates: (c, 6) joint angles [rad] of the only poses that may be chosen; axes: (c, 6) where the external axes
            stand at them [m], [rad].
        sight: half the opening angle [rad] of the reflector on the tool, whose axis is +z of the tool: the instrument
            must stand inside that cone.
        measured_range: joints stay inside the range of the data so far.
    """

    region: Array | None = None
    candidates: Array | None = None
    sight: float | None = None
    measured_range: bool = False
    axes: Array | None = None

    def holds(self, problem: Problem) -> NDArray[np.bool_]:
        """Return (n,) mask of the poses of a problem that are inside the region and in sight of the instrument."""
        T = problem.equilibrium.T_base_tcp
        good = np.ones(len(T), dtype=bool)
        if self.region is not None:
            good &= ((T[:, :3, 3] >= self.region[0]) & (T[:, :3, 3] <= self.region[1])).all(axis=1)
        if self.sight is not None:
            seen = problem.T_instrument_tcp
            # The instrument is the origin of its own frame.
            toward = -seen[:, :3, 3] / np.maximum(np.linalg.norm(seen[:, :3, 3], axis=1), 1e-9)[:, None]
            good &= np.einsum("ni,ni->n", toward, seen[:, :3, 2]) >= np.cos(self.sight)
        return good


FULL_RANGE = Room()
