"""Instrument or fixture that creeps with time."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, Variant, param, variant


class FrameDrift(
    Effect,
    reads=("time",),
    confused_with={
        "thermal_growth": "temperature that rises and falls again; a reference point on the base every 20 minutes",
        "thermal_joint_drift": "a reference point on the base every 20 minutes",
        "session": "time goes on between sessions, too: reference poses at the start and the end of each",
    },
):
    """The instrument, the fixture or the floor creeps while measuring.

    Equation: translation v t and rotation w t of the base as the instrument sees it, t from the start of the record.
    Source: drift tests of laser trackers (ISO 10360-10). Typical size: 10 to 100 micrometres an hour.
    """

    velocity_m_per_s: Array = param(unit="m/s", shape=(3,), low=-1e-3, high=1e-3, typical=1e-8, labels=XYZ)
    turn_rad_per_s: Array = param(unit="rad/s", shape=(3,), low=-1e-3, high=1e-3, typical=1e-8, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the instrument, (n, 6) [m], [rad]."""
        rate = np.concatenate([self.velocity_m_per_s, self.turn_rad_per_s])
        return Displacement(instrument=np.asarray(state.time)[:, None] * rate)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: translation alone, and translation with rotation."""
        effect, shift = current or cls(), np.arange(6) < 3
        return (variant(effect, "translation", shift, shift), variant(effect, "translation and rotation"))
