"""Several measured points on one tool."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, param, structure
from postproc.effects.roles import Role


class Reflector(
    Effect,
    role=Role.REFLECTOR_POINTS,
    unlikely=np.inf,
    reads=("reflector",),
    about_data=True,
    confused_with={"tool_frame": "nothing: it says where the first reflector is, this where the others are beside it"},
):
    """Where each reflector is on the tool, beside the first one: what an instrument measures in turn in one pose.

    Equation: the measured point is the TCP shifted by a constant along tool axes, in the rows of each reflector that is
    listed by its name; ``first`` names the one that the tool frame places.
    Source: rigid-body geometry. Typical size: any, as reflectors were mounted; 1 mm where their places are known.
    """

    first: tuple[str, ...] = structure(("1",))
    reflector: tuple[str, ...] = structure(("2",))
    shift_m: Array = param(unit="m", shape=("reflector", 3), typical=1e-3, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the tool, (n, 6) [m], [rad]: zero in rows of reflectors that are not listed."""
        member = (state.reflector_of_rows[:, None] == np.array(self.reflector)).astype(float)
        return Displacement(tool=np.concatenate([member @ self.shift_m, np.zeros((len(state), 3))], axis=1))
