"""Lost motion in the gearboxes."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, Variant, by_joint, param


class Backlash(
    Effect,
    reads=("approach",),
    confused_with={
        "servo_lag": "stop and wait before measuring, or two speeds: lag grows with the speed and vanishes at rest",
        "nonlinear_compliance": "the same pose and load from both sides",
        "joint_offset": "approach from both sides; from one side alone lost motion is an offset",
    },
):
    """A joint stops short on the side from which it came.

    Equation: dq_j = -h_j sign(approach_j), h half the gap; zero where the side is not known.
    Source: gear catalogues (lost motion); Slamani, Nubiola and Bonev (2012) for its measurement on an arm.
    Typical size: half a gap of 15 to 150 microradian (a cycloidal gear of 1 arcmin has 145).
    """

    half_gap_rad: Array = param(unit="rad", shape=(6,), low=0.0, high=0.01, typical=1e-4)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad]."""
        return -self.half_gap_rad * np.asarray(state.approach)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Return one form for each joint, and one for all of them."""
        return by_joint(current or cls())
