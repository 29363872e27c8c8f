"""Periodic errors of the gears."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, JointBasis, State, Variant, param, structure, variant

HIGHEST_ORDER = 60


class TransmissionError(
    Effect,
    confused_with={
        "joint_error_map": "a fine sweep of one joint (five points a period): one line in the spectrum, or many",
        "gravity_compensator": "two payloads, and a first harmonic on joint 2 with the forearm up and down",
        "link_geometry": "first harmonics only: wide ranges of the joints after it",
        "joint_compliance": "first harmonics only: two payloads",
    },
):
    """A joint's angle oscillates with its own turning (eccentric gears, strain waves).

    Equation: dq_j = A sin(n q_j) + B cos(n q_j); each term has a joint (from 1), an order n (motor orders are large and
    need not be whole), its A and its B. Source: gear catalogues (angular transmission accuracy).
    Typical size: 50 to 600 microradian (1 to 2 arcmin for strain-wave gears).
    """

    joint: tuple[int, ...] = structure((1, 2, 3, 4, 5, 6), low=1, high=6)
    order: tuple[float, ...] = structure((1.0, 1.0, 1.0, 1.0, 1.0, 1.0), low=0.0, high=1000.0)
    sine_rad: Array = param(unit="rad", shape=("joint",), low=-0.05, high=0.05, typical=1e-4)
    cosine_rad: Array = param(unit="rad", shape=("joint",), low=-0.05, high=0.05, typical=1e-4)

    def basis(self, state: State) -> JointBasis:
        joint = np.array(self.joint, dtype=int) - 1
        angle = state.q[:, joint] * np.array(self.order)
        return JointBasis(np.tile(joint, 2), np.concatenate([np.sin(angle), np.cos(angle)], axis=1))

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """One more term: every joint that moves, orders from 1 up."""
        old = cls(joint=(), order=()) if current is None else current
        terms = len(old.joint)
        new = np.tile(np.arange(terms + 1) == terms, 2)
        known = set(zip(old.joint, old.order, strict=True))
        found: list[Variant] = []
        for j in (int(i) + 1 for i in np.flatnonzero(np.ptp(state.q, axis=0) > 0.1)):
            for n in range(1, HIGHEST_ORDER + 1):
                if (j, float(n)) not in known:
                    effect = cls(
                        joint=(*old.joint, j),
                        order=(*old.order, float(n)),
                        sine_rad=np.append(old.sine_rad, 0.0),
                        cosine_rad=np.append(old.cosine_rad, 0.0),
                    )
                    found.append(variant(effect, f"joint {j}, order {n}", new, effect.amplitudes()))
        return tuple(found)
