"""A track or gantry that is not straight, a positioner that runs out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.polynomial.legendre import legvander

from postproc.arrays import Array
from postproc.effects.base import XYZ, State, Variant, param, structure, variant
from postproc.effects.files import FieldProblem
from postproc.effects.library.cell.axis_motion import AxisMotion, position_of, small_motion

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Joint

WAVE_ORDERS = (1, 2, 3, 4, 5, 6, 8, 10, 13)
ALL_TERMS = {
    "": (slice(0, 2), slice(0, 3)),
    ", shifts": (slice(0, 1), slice(0, 3)),
    ", turns": (slice(1, 2), slice(0, 3)),
}
SINGLE_TERMS = {
    f", {what} {'xyz'[i]}": (slice(k, k + 1), slice(i, i + 1))
    for k, what in enumerate(("shift along", "turn about"))
    for i in range(3)
}
COMPONENTS = ALL_TERMS | SINGLE_TERMS
"""Which of the six error motions a form frees: shifts or turns, and along or about which axes of the frame."""
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

    Equation: beside its nominal motion the axis shifts by s_0 + the sum over k = 1 .. K of s_k (B_k(e) - B_k(0)), and
    turns by the rotation vector of the same with t_k, in the axes of its frame. B_k are Legendre polynomials over the
    travel ``low`` to ``high`` (m, rad), divided by k, or, of an axis that turns farther than 270 degrees, sine and
    cosine of its angle and of multiples, divided by these. Beyond that travel the error keeps the value of its end. The
    place at position 0, where base and work were calibrated, is wrong by s_0 and t_0; where all points are in the world
    nothing tells them, and they stay zero.
    Source: six error motions of a linear and a rotary axis (ISO 230-1, ISO 230-7). Typical size: rails for robots 0.05
    to 0.5 mm and 0.05 to 0.3 mrad over some metres; tables 0.02 to 0.2 mm.
    """

    functions: int = structure(4, low=2, high=40)
    low: tuple[float, ...] = structure((-1.0,), low=-1e3, high=1e3)
    high: tuple[float, ...] = structure((1.0,), low=-1e3, high=1e3)
    shift_m: Array = param(unit="m", shape=("axes", "functions", 3), low=-0.05, high=0.05, typical=1e-4, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=("axes", "functions", 3), low=-0.05, high=0.05, typical=1e-4, labels=XYZ)

    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        """T_base_axis and X - 1 (n, 4, 4) of the k-th axis: X is a smooth function of the axis position."""
        functions = self._functions(position_of(state, self.axes[k]), k, joint.kind == "rotary")
        before, after = state.axis_frames[self.axes[k]]
        change = small_motion(functions @ self.shift_m[k], functions @ self.turn_rad[k])
        return (before if joint.kind == "rotary" else after), change

    def _functions(self, position: Array, k: int, rotary: bool) -> Array:
        """Values (n, functions) at positions (n,) of the k-th axis: 1, then functions that are zero at position 0."""
        low, high = self.low[k], self.high[k]
        if rotary and high - low > ROUND:
            waves = np.arange(self.functions - 1) // 2 + 1.0
            angle = position[:, None] * waves
            B = np.where(np.arange(self.functions - 1) % 2 == 0, np.sin(angle), np.cos(angle) - 1.0) / waves
            return np.column_stack([np.ones(len(B)), B])
        along = np.clip(np.append(position, 0.0), low, high)
        B = legvander(2.0 * (along - low) / max(high - low, 1e-9) - 1.0, self.functions - 1)
        B[:-1, 1:] = (B[:-1, 1:] - B[-1, 1:]) / np.arange(1.0, self.functions)
        return np.asarray(B[:-1])

    @classmethod
    def problems(cls, table: Mapping[str, Any]) -> list[FieldProblem]:
        """What `AxisMotion.problems` finds, and ``low`` or ``high`` without an entry for each axis (EFF022)."""
        problems = super().problems(table)
        many = len(table.get("axes", ("a",)))
        short = [name for name in ("low", "high") if not problems and len(table.get(name, (0,))) != many]
        text = "`{}` of `{}` has one entry for each of `axes`: {}"
        return problems + [FieldProblem("EFF022", name, text.format(name, cls.key, many)) for name in short]

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: each moving axis, then all: all components, shifts, turns, or one; orders that the positions tell."""
        axes = cls.moving(state, current)
        if not axes:
            return ()
        where = np.column_stack([position_of(state, axis) for axis in axes])
        low, high = tuple(where.min(axis=0).tolist()), tuple(where.max(axis=0).tolist())
        orders = [len(np.unique(np.round(column, 3))) - 1 for column in where.T]
        forms: list[Variant] = []
        for order in WAVE_ORDERS if current is None else (current.functions - 1,):
            effect = cls(axes=axes, functions=order + 1, low=low, high=high) if current is None else current
            # (2, axes, functions, 3): shifts, then turns, as the vector has them.
            none = np.zeros((2, *effect.shift_m.shape), dtype=bool)
            every = [(f"eax_{axis}", [k], orders[k]) for k, axis in enumerate(axes)]
            every += [("all axes", list(range(len(axes))), min(orders))] if len(axes) > 1 else []
            for name, some, most in every if order <= max(orders) else ():
                for what, part in COMPONENTS.items() if len(some) == 1 else ALL_TERMS.items():
                    free = none.copy()
                    free[part[0], some, :, part[1]] = True
                    # Where the arm stands against the work at position 0 is one thing, whichever axis is blamed.
                    free[:, some[1:], 0] = False
                    if order <= most:
                        forms.append(variant(effect, f"{name}{what}, order {order}", free.ravel(), free.ravel()))
        return tuple(forms)
