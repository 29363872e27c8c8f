"""Single bad rows."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, Variant, param, structure, variant


class Outlier(
    Effect,
    reads=("row",),
    about_data=True,
    unlikely=np.inf,
    confused_with={"session": "measure the row again", "backlash": "measure the row again from both sides"},
):
    """Single rows are wrong by themselves (a typing error, a lost reflector): a finding about the data.

    Equation: a translation of its own for each listed row (channel ``row``, from 0). Nothing is deleted: a row that
    stands out may be the one that shows a missing effect.
    Source: mean-shift outlier model, Cook and Weisberg (1982). Typical size: 0.2 mm to 99 mm.
    """

    row: tuple[int, ...] = structure((0,), low=0, high=100_000_000)
    shift_m: Array = param(unit="m", shape=("row", 3), low=-10.0, high=10.0, typical=1e-3, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the instrument, (n, 6) [m], [rad]: zero in all rows that are not listed."""
        member = (np.asarray(state.channel("row"))[:, None] == np.array(self.row)).astype(float)
        return Displacement(instrument=np.concatenate([member @ self.shift_m, np.zeros((len(state), 3))], axis=1))

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: the rows of ``current``; none without it, as rows are named by whoever looks at the residuals."""
        return () if current is None else (variant(current),)
