"""Calibration error of the tool centre point."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, Variant, param, variant
from postproc.effects.roles import Role


class ToolFrame(
    Effect,
    role=Role.TOOL_FRAME,
    reads=(),
    confused_with={
        "joint_offset": "nothing for joint 6: turning it and turning the tool about its axis are the same",
        "link_geometry": "nothing: the flange and the tool are one body",
    },
):
    """The tool centre point is not where the program's tooldata says.

    Equation: T_flange_tcp = nominal tool, then translation x[:3] [m] and rotation vector x[3:] [rad] in tool axes;
    with positions alone only the translation counts.
    Source: rigid-body geometry. Typical size: 0.3 to 3 mm after a four-point calibration by hand; needs three or more
    orientations to be told from the instrument's frame.
    """

    shift_m: Array = param(unit="m", shape=(3,), typical=1e-3, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=(3,), typical=1e-3, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacement of the tool, (6,) [m], [rad], the same in every pose."""
        return Displacement(tool=np.concatenate([self.shift_m, self.turn_rad]))

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: position alone, and position with orientation."""
        effect, position = current or cls(), np.arange(6) < 3
        return (variant(effect, "position", position, position), variant(effect, "position and orientation"))
