"""Zero errors of the joints."""

from __future__ import annotations

from postproc.arrays import Array
from postproc.effects.base import Effect, State, param


class JointOffset(
    Effect,
    confused_with={
        "instrument_frame": "nothing for joint 1",
        "tool_frame": "nothing for joint 6",
        "joint_compliance": "mean droop looks like an offset: two payloads, joint 2 on both sides of the vertical",
        "thermal_joint_drift": "the same poses cold and warm",
    },
):
    """Joint zeros are off (mastering, calibration marks).

    Equation: dq_j = c_j. Source: Mooring, Roth and Driels (1991), Fundamentals of Manipulator Calibration.
    Typical size: 0.1 to 1 mrad; 0.1 mrad is 0.15 mm at 1.5 m.
    """

    offset_rad: Array = param(unit="rad", shape=(6,), low=-0.5, high=0.5, typical=1e-3)

    def displacement(self, state: State) -> Array:
        """(n, 6) joint angles [rad], the same in every pose."""
        return self.offset_rad + 0.0 * state.q
