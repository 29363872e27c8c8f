"""Where a work object really stands."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, State, Variant, param, variant
from postproc.effects.library.frames.session import Session
from postproc.effects.roles import Role


class WorkObject(
    Session,
    role=Role.WORK_OBJECTS,
    unlikely=np.inf,
    confused_with={"instrument_frame": "nothing: this says where each work object stands beside the others"},
):
    """Where each work object stands beside where the program says so, in tables of touched-up targets.

    Equation: constant translation and rotation of the base as the work sees it, for the rows of each work object that
    is listed by its name.
    Source: rigid-body geometry. Typical size: 2 mm and 2 mrad, as fixtures are set up and work objects are taught.
    """

    shift_m: Array = param(unit="m", shape=("session", 3), typical=2e-3, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=("session", 3), typical=2e-3, labels=XYZ)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: that of the model alone: which rows have work objects is known of a table, and is not searched for."""
        return () if current is None else (variant(current),)
