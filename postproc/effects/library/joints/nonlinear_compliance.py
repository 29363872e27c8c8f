"""Gearboxes that are soft near zero torque and stiffen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect, State, Variant, by_joint, param, structure, variant
from postproc.robot.arm import Robot

LAWS = ("tanh", "piecewise", "catalogue", "hardening", "cubic")
STIFF = 0.05
"""Share of the largest compliance by which what is left of a stiff joint may be wrong."""
SHARES_OF_LOAD = (0.05, 0.1, 0.2, 0.4, 0.8)
UNLOADED = 1e-6
"""Share of the largest load of all joints below which a joint is not loaded."""


class NonlinearCompliance(
    Effect,
    reads=("load",),
    after="joint_compliance",
    confused_with={
        "backlash": "approach from both sides under the same load: lost motion follows the side, this follows the load",
        "joint_compliance": "loads from nearly zero to full on the same joint, in both directions",
    },
):
    """A joint winds up in a curve, not in a line.

    Equation, with t0 the knee, x = tau / t0, and w = e t0 the wind-up, e being the extra compliance at zero load:
        tanh:      dq = w tanh(x)            soft until the knee, then no more
        piecewise: dq = w clip(x, -1, 1)     two rates of strain-wave gears (K1 below the torque T1)
        catalogue: a quarter of that more    three rates: up to 3 t0, K2 lies between K1 and K3
        hardening: dq = w f(x), f + f^3 = x  the spring tau = t0 (dq/w + (dq/w)^3)
        cubic:     dq = w x^3                softens instead
    beside the linear share, which is `joint_compliance`. Wind-up and knee are better told apart than e and knee.
    Source: strain-wave and cycloidal gear catalogues (spring rates K1, K2, K3); Duffing spring.
    Typical size: 0.05 to 0.3 mrad around zero torque.
    """

    law: str = structure("tanh", choices=LAWS)
    windup_rad: Array = param(unit="rad", shape=(6,), low=-0.05, high=0.05, typical=1e-4)
    knee_Nm: Array = param(unit="N m", shape=(6,), low=1e-3, high=1e5, typical=100.0, null=100.0, amplitude=False)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad]."""
        return self.windup_rad * curve(self.law, np.asarray(state.joint_load) / self.knee_Nm)

    def impossible(self, robot: Robot, effects: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Mask (12,) of joints stiffer than rigid at zero load, with their linear compliance c: c + w / t0 < 0."""
        linear = effects.get("joint_compliance")
        if linear is None or self.law == "cubic":
            return super().impossible(robot, effects)
        compliance = linear.vector()
        rigid = compliance + self.windup_rad / self.knee_Nm < -STIFF * np.abs(compliance).max()
        return np.tile(rigid & (self.windup_rad != 0), 2)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: each law, on each joint, joints 2 and 3, or all, with the knee at some shares of the largest load."""
        if current is not None:
            return tuple(_forms(current))
        largest = np.full(6, 500.0) if state.joint_load is None else np.abs(state.joint_load).max(axis=0, initial=0.0)
        # A joint that bears no load has no knee to find, and one near zero would make it yield without end.
        largest = np.where(largest > UNLOADED * largest.max(), largest, 100.0)
        forms: list[Variant] = []
        for law in LAWS:
            for share in (1.0,) if law == "cubic" else SHARES_OF_LOAD:
                knee = f", knee at {'the largest load' if share == 1.0 else f'{share:g} of the largest load'}"
                forms += _forms(cls(law=law, knee_Nm=np.clip(share * largest, 1e-3, 1e5)), knee)
        return tuple(forms)


def _forms(effect: NonlinearCompliance, knee: str = "") -> list[Variant]:
    """The forms with this law: all joints, each joint alone, joints 2 and 3; ``knee`` is put behind their labels."""
    two = np.isin(np.arange(12) % 6, (1, 2))
    some = (*by_joint(effect), variant(effect, "joints 2 and 3", two & effect.amplitudes(), two))
    # The knee of a cubic only scales its amplitude.
    cubic = effect.law == "cubic"
    return [Variant(effect, f.free, f.free if cubic else f.refit, f"{effect.law}, {f.label}{knee}") for f in some]


def curve(law: str, x: Array) -> Array:
    """Value of the law of this name at x (tau over knee), of any shape; its slope at zero is 1 (cubic: 0)."""
    if law == "tanh":
        return np.tanh(x)
    if law == "piecewise":
        return np.clip(x, -1.0, 1.0)
    if law == "catalogue":
        return np.clip(x, -1.0, 1.0) + 0.25 * np.sign(x) * np.clip(np.abs(x) - 1.0, 0.0, 2.0)
    if law == "cubic":
        return x**3
    # Real root of f + f^3 = x.
    return np.asarray(2 / np.sqrt(3) * np.sinh(np.arcsinh(1.5 * np.sqrt(3) * x) / 3))
