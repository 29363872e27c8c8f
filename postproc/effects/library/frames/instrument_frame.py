"""Where the measuring instrument thinks the base is."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, param
from postproc.effects.roles import Role


class InstrumentFrame(
    Effect,
    role=Role.INSTRUMENT_FRAME,
    reads=(),
    confused_with={
        "link_geometry": "nothing: the pedestal and the frame are one and the same to the instrument",
        "joint_offset": "nothing for joint 1: turning it and turning the frame about its axis are the same",
    },
):
    """The base as the instrument sees it: position and orientation.

    Equation: T_instrument_base = translation x[:3] [m], then the rotation vector x[3:] [rad]; six constants.
    Source: rigid-body geometry. Typical size: metres and any angle where the instrument was set up freely,
    2 mm and 1 mrad where the frame was measured on the base.
    """

    shift_m: Array = param(unit="m", shape=(3,), typical=1e-3, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=(3,), typical=1e-3, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the instrument, (6,) [m], [rad], the same in every pose."""
        return Displacement(instrument=np.concatenate([self.shift_m, self.turn_rad]))
