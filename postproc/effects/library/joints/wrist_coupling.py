"""Gear coupling of the wrist axes that is not fully corrected."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, param


class WristCoupling(
    Effect,
    confused_with={
        "joint_error_map": "more than one turn of joints 4 and 6: a coupling goes on, a map repeats",
        "transmission_error": "more than one turn of joints 4 and 6",
        "joint_offset": "wide ranges of joints 4 and 5",
    },
):
    """Turning one wrist axis turns the next ones a little.

    Equation: dq_5 = k54 q_4, dq_6 = k64 q_4 + k65 q_5. Source: gear trains of hollow wrists, whose ratios the
    controller corrects. Typical size: 0 when the ratios are right, 1e-4 to 1e-3 when they are not.
    """

    k54: float = param(unit="1", low=-0.1, high=0.1, typical=1e-4)
    k64: float = param(unit="1", low=-0.1, high=0.1, typical=1e-4)
    k65: float = param(unit="1", low=-0.1, high=0.1, typical=1e-4)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad]."""
        dq = np.zeros((len(state), 6))
        dq[:, 4] = self.k54 * state.q[:, 3]
        dq[:, 5] = self.k64 * state.q[:, 3] + self.k65 * state.q[:, 4]
        return dq
