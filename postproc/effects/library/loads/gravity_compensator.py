"""Spring or gas balancer on axis 2."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, Load, State, Variant, param, structure, variant


class GravityCompensator(
    Effect,
    reads=("q",),
    confused_with={
        "arm_load": "joint 3 up and down at the same joint 2: a balancer does not care",
        "joint_compliance": "two payloads at the same joint angles",
        "transmission_error": "the motor's torque at rest; a linear spring turns joint 2 as a first harmonic does",
        "joint_error_map": "the motor's torque at rest; a linear spring turns joint 2 as a map of it may",
    },
):
    """A balancer pulls on the upper arm.

    Equation: torque on joint j = sum over orders n of S_n sin(n q_j) + C_n cos(n q_j) [N m]. The plain balancer
    -k sin(q_2 + q_0) is n = 1 with S = -k cos q_0, C = -k sin q_0; a gas spring between two pins adds a little n = 2.
    Source: static balancing by springs, e.g. Klimchik, Caro and Pashkevich (2013) for gravity compensators.
    Typical size: 500 to 5000 N m on arms of 100 kg payload and more; small arms have none. An order more has a quarter
    of that: between pins at D and r from the axis, sin q / |pin to pin| has r / 2D of order 2, and gas adds as much.
    """

    joint: int = structure(2, low=1, high=6)
    order: tuple[int, ...] = structure((1,), low=1, high=20)
    sine_Nm: Array = param(unit="N m", shape=("order",), low=-1e5, high=1e5, typical=500.0)
    cosine_Nm: Array = param(unit="N m", shape=("order",), low=-1e5, high=1e5, typical=500.0)

    def load(self, state: State) -> Load:
        """Torques (n, 6) [N m], which act on one joint only."""
        angle = state.q[:, self.joint - 1, None] * np.array(self.order, dtype=float)
        torque = np.zeros((len(state), 6))
        torque[:, self.joint - 1] = np.sin(angle) @ self.sine_Nm + np.cos(angle) @ self.cosine_Nm
        return Load(joint=torque)

    def scale(self) -> Array:
        """(p,) ordinary sizes [N m]: each further order has a quarter of the one before."""
        return super().scale() * np.tile(0.25 ** (np.array(self.order) - 1.0), 2)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: a spring and a gas spring on joint 2; with ``current``, that one as it is."""
        if current is not None:
            return (variant(current, "as it is"),)
        return (variant(cls(), "joint 2, spring"), variant(cls(order=(1, 2)), "joint 2, gas spring"))
