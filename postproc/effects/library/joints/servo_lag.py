"""Joints that trail their command."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, Variant, by_joint, param


class ServoLag(
    Effect,
    reads=("v",),
    confused_with={
        "backlash": "stop and wait before measuring, or two speeds: lag grows with the speed, lost motion does not",
        "frame_drift": "the same path in both directions",
    },
):
    """Joints trail their command, or the clocks of robot and instrument differ.

    Equation: dq_j = -T_j v_j; a skew of the clocks is one T for all joints.
    Source: first-order servo loop. Typical size: 0.3 to 5 ms; 1 ms is 1 mm at 1 m/s.
    """

    lag_s: Array = param(unit="s", shape=(6,), low=-1.0, high=1.0, typical=1e-3)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad]."""
        return -self.lag_s * np.asarray(state.v)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Return one form for each joint, and one for all of them."""
        return by_joint(current or cls())
