"""Bending, torsion and stretch of the long castings as Euler-Bernoulli beams."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Displacement, Effect, State, Variant, param, structure, variant
from postproc.effects.geometry import distal_point, long_bodies
from postproc.robot.kinematics import skew


class LinkCompliance(
    Effect,
    reads=("load", "robot"),
    after="joint_compliance",
    confused_with={
        "joint_compliance": "forces across the plane of motion of joints 2 and 3, and measured orientations",
        "bearing_tilt": "measured orientations: a beam turns less than it bends, a bearing only turns",
        "base_compliance": "the same load on a folded and on a stretched arm",
    },
):
    """Upper arm and forearm bend, twist and stretch under load.

    Equation: the tip of a uniform cantilever of length L along e, under force F and moment M at the tip,
        translation = F_e L/EA + F_x L^3/(3 EI) + (M x e) L^2/(2 EI)
        rotation    = M_e L/GJ + M_x L/EI + (e x F) L^2/(2 EI)
    with F_e, M_e along the beam and F_x, M_x across it.
    Source: Euler-Bernoulli beam; its use as a virtual link spring: Klimchik, Pashkevich and Chablat (2013).
    Typical size: EI 1e6 to 1e7 N m^2 on a 60 kg arm: 0.02 to 0.3 mm. The weight of the beam itself between its ends is
    not counted.
    """

    body: tuple[int, ...] = structure((2, 4), low=0, high=6)
    bending_per_Nm2: Array = param(unit="1/(N m^2)", shape=("body",), low=-1e-5, high=1e-3, typical=5e-7, least=0.0)
    torsion_per_Nm2: Array = param(unit="1/(N m^2)", shape=("body",), low=-1e-5, high=1e-3, typical=1e-6, least=0.0)
    stretch_per_N: Array = param(unit="1/N", shape=("body",), low=-1e-7, high=1e-5, typical=1e-9, least=0.0)

    def displacement(self, state: State) -> Displacement | None:
        """Displacements of the ends of the listed bodies, (n, 6) [m], [rad]; None without loads on bodies."""
        if state.body_load is None or state.robot is None:
            return None
        moves: dict[int, Array] = {}
        for i, b in enumerate(self.body):
            springs = self.bending_per_Nm2[i], self.torsion_per_Nm2[i], self.stretch_per_N[i]
            share = state.body_load[:, b] @ beam(distal_point(state.robot, b), *springs).T
            moves[b] = moves[b] + share if b in moves else share
        return Displacement(body=moves)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: the long bodies together, then each body from the first to the last of them alone, without stretch."""
        if current is not None or state.robot is None:
            return (variant(current or cls()),)
        bodies = long_bodies(state.robot)
        # The housing that carries the forearm bends as well, short as it is.
        alone = [b for b in range(bodies[0], bodies[-1] + 1) if np.any(distal_point(state.robot, b))]
        every = [*([bodies] if len(bodies) > 1 else []), *((b,) for b in alone)]
        length = {b: float(np.linalg.norm(distal_point(state.robot, b))) for b in alone}
        # A stub is stiff: what seems to bend there more likely tilts in its bearing.
        odds = [min(length[i] for i in b) / max(length.values()) for b in every]
        return tuple(_without_stretch(cls(body=b), x) for b, x in zip(every, odds, strict=True))


def beam(span: Array, bending: float, torsion: float, stretch: float) -> Array:
    """Compliance (6, 6) of the tip of a cantilever: translation [m] and rotation [rad] by force [N] and moment [N m].

    Args:
        span: (3,) from the clamp to the tip [m]; bending: 1/EI, torsion: 1/GJ [1/(N m^2)], stretch: 1/EA [1/N].
    """
    length = float(np.linalg.norm(span))
    if length == 0.0:
        return np.zeros((6, 6))
    e = span / length
    along, across = np.outer(e, e), np.eye(3) - np.outer(e, e)
    turn = bending * length**2 / 2 * skew(e)
    return np.block(
        [
            [stretch * length * along + bending * length**3 / 3 * across, -turn],
            [turn, torsion * length * along + bending * length * across],
        ]
    )


def _without_stretch(effect: LinkCompliance, odds: float) -> Variant:
    # Stretch of a casting (below 1 micrometre per 100 N) is left to users who have a reason for it.
    """A form in which bending and torsion are free and stretch is not; ``odds``: how ordinary it is."""
    free = np.array([not name.startswith("stretch") for name in effect.names()])
    return variant(effect, "body " + " and ".join(map(str, effect.body)), free, free, odds)
