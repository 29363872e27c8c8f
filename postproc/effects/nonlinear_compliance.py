"""Gearboxes that are soft near zero torque and stiffen."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, Variant, by_joint, param, structure

SHARES_OF_LOAD = (0.05, 0.2, 0.6)


class NonlinearCompliance(
    Effect,
    reads=("load",),
    confused_with={
        "backlash": "approach from both sides under the same load: lost motion follows the side, this follows the load",
        "joint_compliance": "loads from nearly zero to full on the same joint, in both directions",
    },
):
    """A joint winds up in a curve, not in a line.

    Equation, with e the extra compliance at zero load, t0 the knee and x = tau / t0:
        tanh:      dq = e t0 tanh(x)            soft until the knee, then no more
        piecewise: dq = e t0 clip(x, -1, 1)     the catalogue form of strain-wave gears (K1 below the torque T1)
        hardening: dq = e t0 f(x), f + f^3 = x  the spring tau = dq/e + dq^3/(e^3 t0^2)
        cubic:     dq = e t0 x^3                softens instead
    beside the linear share, which is `joint_compliance`.
    Source: strain-wave and cycloidal gear catalogues (spring rates K1, K2, K3); Duffing spring.
    Typical size: 0.05 to 0.3 mrad around zero torque.
    """

    law: str = structure("tanh", choices=("tanh", "piecewise", "hardening", "cubic"))
    soft_rad_per_Nm: Array = param(unit="rad/(N m)", shape=(6,), low=-1e-3, high=1e-3, typical=5e-7)
    knee_Nm: Array = param(unit="N m", shape=(6,), low=0.1, high=1e5, typical=100.0, null=100.0, amplitude=False)

    def displacement(self, state: State) -> Array | None:
        if state.joint_load is None:
            return None
        return self.soft_rad_per_Nm * self.knee_Nm * curve(self.law, state.joint_load / self.knee_Nm)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        largest = np.full(6, 500.0) if state.joint_load is None else np.abs(state.joint_load).max(axis=0, initial=0.0)
        found: list[Variant] = []
        for law in cls.structures()["law"].choices:
            for share in (1.0,) if law == "cubic" else SHARES_OF_LOAD:
                start = cls(law=law, knee_Nm=np.clip(share * largest, 1.0, 1e5))
                for form in by_joint(start):
                    # The knee of a cubic only scales its amplitude.
                    refit = form.free if law == "cubic" else form.refit
                    found.append(
                        Variant(start, form.free, refit, f"{law}, {form.label}, knee at {share:g} of the load")
                    )
        return tuple(found)


def curve(law: str, x: Array) -> Array:
    """The four laws, with slope 1 at zero (the cubic one: 0)."""
    if law == "tanh":
        return np.tanh(x)
    if law == "piecewise":
        return np.clip(x, -1.0, 1.0)
    if law == "cubic":
        return x**3
    # Real root of f + f^3 = x.
    return np.asarray(2 / np.sqrt(3) * np.sinh(np.arcsinh(1.5 * np.sqrt(3) * x) / 3))
