"""Castings that grow with temperature."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Displacement, Effect, State, Variant, param, structure, variant
from postproc.effects.geometry import distal_point, long_bodies


class ThermalGrowth(
    Effect,
    reads=("temperature", "robot"),
    confused_with={
        "thermal_joint_drift": "several poses at each temperature: growth shifts along the links, drift turns joints",
        "frame_drift": "a reference point on the base; temperature that rises and falls again",
        "link_geometry": "the same poses at another temperature",
    },
):
    """The castings grow and shrink.

    Equation: translation ((alpha + extra_b) (T - T_ref) + strain + strain_b) p_b at the distal end p_b of each listed
    body, in its axes. The strains are the growth at the reference temperature: they stand for a T0 that is not the
    reference. The extra is what one casting grows beyond the others, and its strain strain_b goes with it: a pedestal
    or a motor housing does not warm as the air does.
    Source: linear expansion; 11 to 12e-6 per kelvin for iron and steel, 23e-6 for aluminium.
    Typical size: 25 micrometres per kelvin on an arm stretched to 2 m; 60e-6 per kelvin at most, of aluminium that
    warms two and a half times as much as what was recorded.
    """

    body: tuple[int, ...] = structure((0, 1, 2, 3, 4, 5, 6), low=0, high=6)
    reference_C: float = structure(20.0, low=-100.0, high=200.0)
    growth_per_K: float = param(unit="1/K", low=-1e-3, high=1e-3, typical=1.2e-5, most=5)
    strain: float = param(unit="1", low=-0.01, high=0.01, typical=5e-5)
    extra_per_K: Array = param(unit="1/K", shape=("body",), low=-1e-3, high=1e-3, typical=3e-6, most=20)
    extra_strain: Array = param(unit="1", shape=("body",), low=-0.01, high=0.01, typical=1e-5)

    def displacement(self, state: State) -> Displacement | None:
        """Displacements of the ends of the listed bodies, (n, 6) [m], [rad]; None without temperatures."""
        if state.temperature is None or state.robot is None:
            return None
        warmth = state.temperature - self.reference_C
        still = np.zeros(3)
        moves: dict[int, Array] = {}
        for b, extra, extra_strain in zip(self.body, self.extra_per_K, self.extra_strain, strict=True):
            stretch = (self.growth_per_K + extra) * warmth + self.strain + extra_strain
            moves[b] = stretch[:, None] * np.concatenate([distal_point(state.robot, b), still])
        return Displacement(body=moves)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: all castings alike, then each long body, and the base, by itself."""
        effect = current or cls()
        index = np.arange(len(effect.vector()))
        # A strain is fitted along, but a strain without growth is geometry.
        forms = [variant(effect, "all castings", index == 0, index < 2)]
        if state.robot is None:
            return tuple(forms)
        long = long_bodies(state.robot, 0.1)
        for k, b in enumerate(effect.body):
            if b in long or b == 0:
                growth = index == 2 + k
                forms.append(variant(effect, f"body {b}", growth, growth | (index == 2 + len(effect.body) + k)))
        return tuple(forms)
