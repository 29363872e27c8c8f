"""A free smooth function of each joint's own angle."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, JointBasis, State, Variant, param, structure, variant

MAP_ORDERS = (4, 6, 8, 12, 16, 25, 40, 64)
FALLS = (1.0, 1.5, 2.0, 3.0)
MANY_ROWS = 500  # Higher orders than 25 are only tried on data that could show them.
FULL = 100.0  # Angle [rad] to either side where a full turn has been seen.
MANY_CELLS = 4e7  # Numbers in the columns of a fit (rows times coefficients): 0.3 GB.


class JointErrorMap(
    Effect,
    unlikely=6.0,
    confused_with={
        "transmission_error": "a fine sweep of one joint: one line in the spectrum, or many",
        "link_geometry": "order 1 alone: wide ranges of the joints after it",
        "joint_compliance": "order 1 alone: two payloads",
        "gravity_compensator": "the motor's torque at rest, for joint 2: a map may be what a balancer does",
    },
):
    """A joint's angle is wrong by a broadband function of itself (encoder, strain-wave gear).

    Equation: dq_j = C_j q_j / pi + sum over k = 1 .. K of A_jk sin(k q_j) + B_jk cos(k q_j), without C_j where a full
    turn has been seen: elsewhere its ends need not meet. A fit adds the penalty strength^2 sum of k^fall (A^2 + B^2) /
    typical^2, for C as for order 1: strength 1 expects coefficients of the typical size over k^(fall / 2). Strength,
    fall and K are those of the largest restricted likelihood. The map knows the angles that it has seen, ``low_rad`` to
    ``high_rad``; beyond them it keeps the value of the nearest one.
    Source: Fourier series; penalised as smoothing splines are (Wahba 1990), by half a derivative or more.
    Typical size: 250 to 430 microradian rms a joint on a collaborative arm, orders 1 to 60, stable over months.
    """

    joint: tuple[int, ...] = structure((1, 2, 3, 4, 5, 6), low=1, high=6)
    order: int = structure(8, low=1, high=200)
    fall: float = structure(1.0, low=0.0, high=6.0)
    low_rad: tuple[float, ...] = structure((-10.0,) * 6, low=-FULL, high=FULL)
    high_rad: tuple[float, ...] = structure((10.0,) * 6, low=-FULL, high=FULL)
    sine_rad: Array = param(unit="rad", shape=("joint", "order"), low=-0.05, high=0.05, typical=1e-4)
    cosine_rad: Array = param(unit="rad", shape=("joint", "order"), low=-0.05, high=0.05, typical=1e-4)
    slope_rad: Array = param(unit="rad", shape=("joint",), low=-0.05, high=0.05, typical=1e-4)

    def joint_basis(self, state: State) -> JointBasis:
        """Columns sin(k q), cos(k q) of each mapped joint, then q / pi: rad per rad."""
        joint = np.array(self.joint, dtype=int) - 1
        low, high = np.array(self.low_rad)[joint], np.array(self.high_rad)[joint]
        q = np.clip(state.q[:, joint], low, high)
        turned = np.empty((*q.shape, self.order), dtype=complex)
        turned[:] = np.exp(1j * q)[:, :, None]
        # exp(i k q) as a product of k factors takes a third of the time of sines and cosines.
        waves = np.cumprod(turned, axis=2, out=turned).reshape(len(q), -1)
        slope = np.where(low > -FULL, q / np.pi, 0.0)
        each = np.repeat(joint, self.order)
        return JointBasis(np.concatenate([each, each, joint]), np.concatenate([waves.imag, waves.real, slope], axis=1))

    @property
    def label(self) -> str:
        """The mapped joints and the highest order, such as ``joints 1 and 2, orders to 16``."""
        return f"{named(self.joint)}, orders to {self.order}"

    def roughness(self) -> Array:
        """Weights (p,) of the penalty: k^(fall / 2) for sines and cosines of order k, 1 for slopes."""
        waves = np.tile(np.arange(1.0, self.order + 1) ** (self.fall / 2), 2 * len(self.joint))
        return np.append(waves, np.ones(len(self.joint)))

    def resolutions(self, state: State) -> tuple[tuple[Self, ...], ...]:
        """Maps that do nothing, from the highest order down, for each smoothness ``fall`` and each choice of joints.

        The joints are those of this map; where it has three or more, also all that move (one kind of gear). The penalty
        keeps within bounds what few rows could not determine. On one or two joints, orders that the rows alone could
        not determine would pass a worn tooth or a step for a map, and beside the finest a further joint must find room.
        """
        moving = tuple(int(j) + 1 for j in np.flatnonzero(np.ptp(state.q, axis=0) > 0.1) if j + 1 not in self.joint)
        several = len(self.joint) > 2
        choices = [self.joint, tuple(sorted((*self.joint, *moving)))] if several and moving else [self.joint]
        size, joints = 6 * len(state) * len(choices[-1]), len(self.joint)
        orders = [
            k for k in MAP_ORDERS if (size * k <= MANY_CELLS if several else _carried(state, joints + (k > 25), k))
        ]
        every = (orders or [self.order])[::-1]
        return tuple(tuple(self.on(joint, k, fall) for k in every) for joint in choices for fall in FALLS)

    def on(self, joint: tuple[int, ...], order: int | None = None, fall: float | None = None) -> Self:
        """A map that does nothing, of these joints (from 1), for the angles that this one has seen.

        ``order`` is the highest order, ``fall`` the smoothness; None for those of this map.
        """
        order, fall = order or self.order, self.fall if fall is None else fall
        return type(self)(joint=joint, order=order, fall=fall, low_rad=self.low_rad, high_rad=self.high_rad)

    def unlimited(self) -> Self:
        """The map extended beyond the angles that it has seen, where only the penalty determines it."""
        low, high = np.array(self.low_rad), np.array(self.high_rad)
        low, high = np.maximum(low - FULL / 2, -FULL), np.minimum(high + FULL / 2, FULL)
        return replace(self, low_rad=tuple(low.tolist()), high_rad=tuple(high.tolist()))

    def beyond_range(self, q: Array) -> Array:
        """(n, 6) how far each mapped joint is beyond the angles that the map has seen [rad]."""
        mapped = np.isin(np.arange(1, 7), self.joint)
        return np.asarray(np.maximum(np.maximum(q - np.array(self.high_rad), np.array(self.low_rad) - q), 0.0) * mapped)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: all moving joints, then each alone, with several highest orders, as far as the number of rows allows.

        With ``current``: one more joint, or a higher order, than it has.
        """
        low, high = state.q.min(axis=0), state.q.max(axis=0)
        # Angles beyond a full turn have been seen, whatever the number of the turn.
        full = high - low >= 2 * np.pi
        low, high = np.where(full, -FULL, low), np.where(full, FULL, high)
        moving = tuple(int(j) + 1 for j in np.flatnonzero(high - low > 0.1))
        choices: list[tuple[tuple[int, ...], tuple[int, ...]]] = []
        fine = tuple(k for k in MAP_ORDERS if k <= 25 or len(state) >= MANY_ROWS)
        if current is None:
            choices = [(joints, fine) for joints in [moving, *((j,) for j in moving)]]
        else:
            choices = [((*current.joint, j), (current.order,)) for j in moving if j not in current.joint]
            choices += [(current.joint, tuple(k for k in fine if k > current.order))]
        forms: list[Variant] = []
        for joints, orders in choices:
            for k in orders:
                if _carried(state, len(joints), k):
                    effect = cls(joint=joints, order=k, low_rad=tuple(low.tolist()), high_rad=tuple(high.tolist()))
                    where = "all joints" if set(joints) == set(moving) else named(joints)
                    waves = np.arange(len(effect.vector())) < 2 * k * len(joints)
                    forms.append(variant(effect, f"{where}, orders to {k}", waves))
        return tuple(forms)


def named(joints: tuple[int, ...]) -> str:
    """Text for joint numbers, such as ``joints 1, 2 and 3`` or ``joint 4``."""
    *most, last = map(str, sorted(joints))
    return f"joints {', '.join(most)} and {last}" if most else f"joint {last}"


def _carried(state: State, joints: int, order: int) -> bool:
    """Whether there are at least as many rows as a map of that many joints, up to that order, has coefficients."""
    return 2 * order * joints <= len(state)
