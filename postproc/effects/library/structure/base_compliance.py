"""Pedestal, floor or track that tilts with the overturning moment."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Displacement, Effect, State, Variant, param, structure, variant
from postproc.effects.geometry import distal_point


class BaseCompliance(
    Effect,
    reads=("load", "robot"),
    after="joint_compliance",
    confused_with={
        "bearing_tilt": "a second reflector on the base: it moves with the floor, not with the bearing of axis 1",
        "joint_compliance": "joint 1 at 0 and 90 degrees with the arm stretched: the floor is fixed in the room",
        "link_compliance": "the same load on a folded and on a stretched arm",
    },
):
    """The whole arm tilts on its foundation.

    Equation: rotation (c_x M_x + c_xy M_y, c_xy M_x + c_y M_y, 0), with M the overturning moment about the pivot: the
    ``floor`` (base origin) or the pedestal's distal end at ``joint 1``. The cross term belongs to feet or a plate that
    are softest about an axis between x and y. Source: linear tilt spring; foundation loads in robot manuals.
    Typical size: 1e-8 to 1e-7 rad/(N m), 0.05 to 0.3 mrad at 3 kN m; more on a stand or a trolley.
    """

    pivot: str = structure("floor", choices=("floor", "joint 1"))
    tilt_rad_per_Nm: Array = param(
        unit="rad/(N m)", shape=(2,), low=-1e-5, high=1e-4, typical=1e-7, least=0.0, labels=("x", "y")
    )
    cross_tilt_rad_per_Nm: float = param(unit="rad/(N m)", low=-1e-4, high=1e-4, typical=1e-7)

    def displacement(self, state: State) -> Displacement | None:
        """Displacement of the end of body 0, (n, 6) [m], [rad]; None without loads on bodies."""
        if state.body_load is None or state.robot is None:
            return None
        arm = distal_point(state.robot, 0) if self.pivot == "floor" else np.zeros(3)
        force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
        along, across = self.tilt_rad_per_Nm
        cross = self.cross_tilt_rad_per_Nm
        spring = np.array([[along, cross, 0.0], [cross, across, 0.0], [0.0, 0.0, 0.0]])
        turn = (moment + np.cross(arm, force)) @ spring
        return Displacement(body={0: np.concatenate([np.cross(turn, arm), turn], axis=1)})

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: about the floor and about joint 1, each with tilts about x and y, and with a cross term besides."""
        if current is not None:
            return (variant(current),)
        same = state.robot is not None and not np.any(distal_point(state.robot, 0))
        straight = np.array([True, True, False])
        forms: list[Variant] = []
        for pivot in ("floor",) if same else ("floor", "joint 1"):
            where = "about the floor" if pivot == "floor" else f"about {pivot}"
            forms.append(variant(cls(pivot=pivot), where, straight, straight))
            forms.append(variant(cls(pivot=pivot), f"{where}, turned"))
        return tuple(forms)
