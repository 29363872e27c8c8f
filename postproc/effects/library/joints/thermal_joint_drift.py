"""Joint zeros that move with temperature."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, Variant, by_joint, param, structure


class ThermalJointDrift(
    Effect,
    reads=("temperature",),
    confused_with={
        "thermal_growth": "several poses at each temperature: growth shifts along the links, drift turns joints",
        "frame_drift": "temperature that rises and falls again; drift of joint 1 and of the frame need a base point",
        "joint_offset": "the same poses cold and warm",
    },
):
    """A joint's zero moves as its gearbox warms up.

    Equation: dq_j = k_j (T - T_ref); the offset at the reference temperature is `joint_offset`.
    Source: warm-up tests of ISO 9283 (drift of pose accuracy). Typical size: 5 to 50 microradian per kelvin,
    200 at most: 4 mrad while a gearbox warms by 20 K.
    """

    reference_C: float = structure(20.0, low=-100.0, high=200.0)
    drift_rad_per_K: Array = param(unit="rad/K", shape=(6,), low=-1e-2, high=1e-2, typical=1e-5, most=20)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad]."""
        return self.drift_rad_per_K * (np.asarray(state.temperature) - self.reference_C)[:, None]

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: all joints at once, then each joint alone."""
        return by_joint(current or cls())
