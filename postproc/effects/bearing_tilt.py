"""Main bearings that tilt across their axis."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Displacement, Effect, State, Variant, by_joint, param
from postproc.effects.geometry import joint_axis


class BearingTilt(
    Effect,
    reads=("load", "robot"),
    confused_with={
        "base_compliance": "for joint 1, a second reflector on the base",
        "link_compliance": "measured orientations: a beam bends as well as it turns",
        "joint_compliance": "loads across the joint's own axis (wrist out to the side)",
    },
):
    """A joint's bearing tilts under the moment across its axis.

    Equation: rotation c_j (M - (M . a_j) a_j) where joint j sits, M the moment there and a_j the joint's axis.
    Source: tilting stiffness of crossed-roller and gearbox main bearings (gear catalogues).
    Typical size: 1e-8 to 3e-7 rad/(N m): 0.02 to 0.3 mm.
    """

    tilt_rad_per_Nm: Array = param(unit="rad/(N m)", shape=(6,), low=-1e-5, high=1e-4, typical=1e-7)

    def displacement(self, state: State) -> Displacement | None:
        if state.body_load is None or state.robot is None:
            return None
        found: dict[int, Array] = {}
        for j in np.flatnonzero(self.tilt_rad_per_Nm):
            # Joint j sits at the distal end of body j - 1, counted from 0: of body j.
            axis, moment = joint_axis(state.robot, int(j)), state.body_load[:, j, 3:]
            across = moment - (moment @ axis)[:, None] * axis
            found[int(j)] = np.concatenate([np.zeros((len(state), 3)), self.tilt_rad_per_Nm[j] * across], axis=1)
        return Displacement(body=found)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        return by_joint(current or cls())
