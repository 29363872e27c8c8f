"""A mass that nobody modelled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import XYZ, Effect, Load, State, Variant, param, structure, variant
from postproc.effects.geometry import weight
from postproc.effects.roles import Role
from postproc.robot.arm import Robot

WRIST_ODDS = 0.1
"""How ordinary a part on body 5 is beside one on the arm: a hand's breadth long, it leaves room for the tool alone."""


class ArmLoad(
    Effect,
    role=Role.CARRIED_MASS,
    reads=("pose",),
    linear=False,
    confused_with={
        "joint_compliance": "weigh the part, or two payloads: a fixed mass does not scale with the payload",
        "payload_error": "wrist poses: what rides on the forearm does not turn with the flange",
        "gravity_compensator": "joint 3 up and down at the same joint 2",
        "dress_pack": "wrist turns: a weight does not pull",
    },
):
    """A part rides on a link (wire feeder, valve block), or the link's own mass is wrong.

    Equation: force m (g - acceleration) at the point c of body b, at rest linear in the mass m and the moment m c; one
    entry a body. Source: Newton. Typical size: 5 to 30 kg on the forearm housing, 0.05 to 0.5 mm through the
    joints' elasticity. Only the product of mass, lever and compliance shows in poses.
    """

    body: tuple[int, ...] = structure((3,), low=0, high=6)
    mass_kg: Array = param(unit="kg", shape=("body",), low=-500.0, high=500.0, typical=10.0)
    moment_kgm: Array = param(unit="kg m", shape=("body", 3), low=-500.0, high=500.0, typical=3.0, labels=XYZ)

    def load(self, state: State) -> Load:
        """Weights of the parts on their bodies, wrenches (n, 6) [N], [N m]."""
        wrenches: dict[int, Array] = {}
        for i, b in enumerate(self.body):
            share = weight(state, b, [(self.mass_kg[i], self.moment_kgm[i])])
            wrenches[b] = wrenches[b] + share if b in wrenches else share
        return Load(body=wrenches)

    def impossible(self, robot: Robot, effects: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Mask (p,) of the masses, and their moments, that would make a link of stated mass weigh less than nothing."""
        link_mass = robot.mass[list(self.body)]
        none = (link_mass > 0) & (link_mass + self.mass_kg < 0)
        return np.concatenate([none, np.repeat(none, 3)])

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: one more of bodies 2 to 5; a part on body 6 is `payload_error`, weight of body 1 loads no joint."""
        old = cls(body=()) if current is None else current
        forms: list[Variant] = []
        for b in range(2, 6):
            if b not in old.body:
                effect = cls(
                    body=(*old.body, b),
                    mass_kg=np.append(old.mass_kg, 0.0),
                    moment_kgm=np.vstack([old.moment_kgm, np.zeros(3)]),
                )
                last = np.arange(len(effect.body)) == len(old.body)
                new = np.concatenate([last, np.repeat(last, 3)])
                odds = WRIST_ODDS if b == 5 else 1.0
                forms.append(variant(effect, f"body {b}", new, effect.amplitudes(), odds))
        return tuple(forms)
