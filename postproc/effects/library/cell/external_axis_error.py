"""A track or gantry that is not straight, a positioner that runs out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.polynomial.legendre import legvander

from postproc.arrays import Array
from postproc.effects.base import State, Variant, param, structure, variant
from postproc.effects.library.cell.axis_motion import AxisMotion, position_of, small_motion

if TYPE_CHECKING:
    from postproc.robot.cell import Joint

ORDERS = (1, 2, 3, 4, 6, 9, 13)
ROUND = 1.5 * np.pi
"""Travel [rad] of a turning axis from which on its error is a function of the angle on the circle."""


class ExternalAxisError(
    AxisMotion,
    confused_with={
        "external_axis_frame": "more positions of the axis: a straight rail that stands askew is straight",
        "external_axis_compliance": "two payloads, or the arm stretched to both sides, at each position of the axis",
        "frame_drift": "positions of the axis in mixed order, some of them twice",
    },
):
    """An external axis leaves its straight line, or its circle, by a smooth function of its own position.

    Equation: beside its nominal motion the axis shifts by sum over k = 1 .. K of s_k (B_k+1(e) - B_k+1(0)) and turns by
    the rotation vector of t_k (B_k(e) - B_k(0)), in the axes of its frame: nothing happens at position 0. B_k are
    Legendre polynomials over the travel ``low`` to ``high`` (m, rad), so that a shift has no slope in the mean (that is
    `external_axis_frame`); of an axis that turns farther than 270 degrees sines and cosines of multiples of its angle,
    for shift and turn alike. Beyond that travel the error keeps the value of its end.
    Source: six error motions of a linear and a rotary axis (ISO 230-1, ISO 230-7). Typical size: rails for robots 0.05
    to 0.5 mm and 0.05 to 0.3 mrad over some metres; tables 0.02 to 0.2 mm.
    """

    order: int = structure(3, low=1, high=40)
    low: tuple[float, ...] = structure((-1.0,), low=-1e3, high=1e3)
    high: tuple[float, ...] = structure((1.0,), low=-1e3, high=1e3)
    shift_m: Array = param(
        unit="m", shape=("axes", "order", 3), low=-0.05, high=0.05, typical=1e-4, labels=("x", "y", "z")
    )
    turn_rad: Array = param(
        unit="rad", shape=("axes", "order", 3), low=-0.05, high=0.05, typical=1e-4, labels=("x", "y", "z")
    )

    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        shifts, turns = self._functions(position_of(state, self.axes[k]), k, joint.kind == "rotary")
        before, after = state.axis_frames[self.axes[k]]
        change = small_motion(shifts @ self.shift_m[k], turns @ self.turn_rad[k])
        return (before if joint.kind == "rotary" else after), change

    def _functions(self, position: Array, k: int, rotary: bool) -> tuple[Array, Array]:
        """(n, order) each: the functions of a position that shift and turn the axis."""
        low, high = self.low[k], self.high[k]
        if rotary and high - low > ROUND:
            waves = np.arange(self.order) // 2 + 1.0
            angle = position[:, None] * waves
            both = np.where(np.arange(self.order) % 2 == 0, np.sin(angle), np.cos(angle) - 1.0)
            return both, both
        along = np.clip(np.append(position, 0.0), low, high)
        B = legvander(2.0 * (along - low) / max(high - low, 1e-9) - 1.0, self.order + 1)
        B = B[:-1] - B[-1]
        return B[:, 2:], B[:, 1:-1]

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Each axis alone, then all; all six components, shifts or turns alone; orders that its positions can tell."""
        axes = cls.moving(state, current)
        if not axes:
            return ()
        where = np.column_stack([position_of(state, axis) for axis in axes])
        low, high = tuple(where.min(axis=0).tolist()), tuple(where.max(axis=0).tolist())
        told = [len(np.unique(np.round(column, 3))) - 2 for column in where.T]
        found: list[Variant] = []
        for order in ORDERS if current is None else (current.order,):
            effect = cls(axes=axes, order=order, low=low, high=high) if current is None else current
            own = np.array([name.partition("[")[2].partition(",")[0] for name in effect.names()])
            shift = np.array([name.startswith("shift") for name in effect.names()])
            alone = [(f"eax_{axis}", own == str(k + 1), told[k]) for k, axis in enumerate(axes)]
            every = [("all axes", np.ones(len(own), dtype=bool), min(told))] if len(axes) > 1 else []
            for name, mine, most in [*alone, *every]:
                for what, part in (("", True), (", shifts", shift), (", turns", ~shift)):
                    if order <= most:
                        free = mine & part
                        found.append(variant(effect, f"{name}{what}, order {order}", free, free))
        return tuple(found)
