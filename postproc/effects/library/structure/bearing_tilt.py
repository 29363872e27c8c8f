"""Main bearings that tilt across their axis."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Displacement, Effect, State, Variant, by_joint, param, structure
from postproc.effects.geometry import distal_point, joint_axis

FLOOR_ODDS = 0.05
"""Odds of joint 1 alone: an even floor or pedestal does exactly the same with two numbers."""


class BearingTilt(
    Effect,
    unlikely=6.0,
    reads=("load", "robot"),
    after="joint_compliance",
    confused_with={
        "base_compliance": "for joint 1, a second reflector on the base",
        "link_compliance": "measured orientations: a beam bends as well as it turns",
        "joint_compliance": "loads across the joint's own axis (wrist out to the side)",
    },
):
    """A joint's bearing tilts under the moment across its axis.

    Equation: rotation c_j (M - (M . a_j) a_j) where joint j sits, M the moment there and a_j the joint's axis. Where on
    its axis joint 1 sits is a convention of drawings: ``pivot`` says at joint 2's height or at the ``floor``.
    Source: tilting stiffness of crossed-roller and gearbox main bearings (gear catalogues).
    Typical size: 1e-8 to 3e-7 rad/(N m): 0.02 to 0.3 mm.
    """

    pivot: str = structure("joint 1", choices=("joint 1", "floor"))
    tilt_rad_per_Nm: Array = param(unit="rad/(N m)", shape=(6,), low=-1e-5, high=1e-4, typical=1e-7, least=0.0)

    def displacement(self, state: State) -> Displacement | None:
        """Displacements of the ends of bodies by tilted bearings, (n, 6) [m], [rad]; None without loads on bodies."""
        if state.body_load is None or state.robot is None:
            return None
        moves: dict[int, Array] = {}
        for j in np.flatnonzero(self.tilt_rad_per_Nm):
            # Joint j sits at the distal end of body j - 1, counted from 0: of body j.
            low = j == 0 and self.pivot == "floor"
            arm = distal_point(state.robot, 0) if low else np.zeros(3)
            axis, load = joint_axis(state.robot, int(j)), state.body_load[:, j]
            moment = load[:, 3:] + np.cross(arm, load[:, :3])
            turn = self.tilt_rad_per_Nm[j] * (moment - (moment @ axis)[:, None] * axis)
            moves[int(j)] = np.concatenate([np.cross(turn, arm), turn], axis=1)
        return Displacement(body=moves)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: all joints, each alone, and joint 1 about the floor; joint 1 is less likely, as a base tilts alike."""
        forms = by_joint(current or cls())
        if current is not None or state.robot is None:
            return forms
        forms = (forms[0], replace(forms[1], odds=FLOOR_ODDS), *forms[2:])
        if not np.any(distal_point(state.robot, 0)):
            return forms
        return (*forms, replace(by_joint(cls(pivot="floor"))[1], label="joint 1, about the floor", odds=FLOOR_ODDS))
