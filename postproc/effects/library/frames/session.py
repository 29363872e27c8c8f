"""A step between measuring sessions."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, Variant, param, structure, variant
from postproc.effects.roles import Role


class Session(
    Effect,
    role=Role.SESSION_FRAMES,
    unlikely=4.0,
    reads=("session",),
    about_data=True,
    confused_with={
        "frame_drift": "reference poses at the start and the end of each session",
        "thermal_growth": "the temperature of each session, and two temperatures within one",
    },
):
    """The frame stepped between two sessions (instrument moved, tool remounted): a finding about the data.

    Equation: constant translation and rotation of the base as the instrument sees it, for the rows of each session
    that is listed by its name against the others.
    Source: rigid-body geometry. Typical size: 20 to 40 micrometres after a new set-up on the same points;
    metres and any angle where the instrument stands elsewhere.
    """

    session: tuple[str, ...] = structure(("1",))
    shift_m: Array = param(unit="m", shape=("session", 3), typical=3e-5, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=("session", 3), typical=3e-5, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the instrument, (n, 6) [m], [rad]: zero in sessions that are not listed."""
        member = (state.session_of_rows[:, None] == np.array(self.session)).astype(float)
        return Displacement(instrument=member @ np.concatenate([self.shift_m, self.turn_rad], axis=1))

    def missing(self, state: State) -> tuple[str, ...]:
        """``session`` where the states have none or only one, which shows no step; else nothing."""
        several = state.session is not None and len(np.unique(state.session)) > 1
        return () if several else self.reads

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: all sessions against the first: translation alone, and translation with rotation."""
        if state.session is None:
            return ()
        later = tuple(dict.fromkeys(state.session_of_rows[np.argsort(state.session, kind="stable")].tolist()))[1:]
        if current is not None or not later:
            return (variant(current),) if current is not None else ()
        effect = cls(session=later)
        shift = np.arange(6 * len(later)) < 3 * len(later)
        return (variant(effect, "translation", shift, shift), variant(effect, "translation and rotation"))
