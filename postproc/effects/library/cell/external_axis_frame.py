"""Where an external axis stands and which way it goes, against what the controller believes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from postproc.arrays import Array, invert
from postproc.effects.base import XYZ, State, Variant, param, variant
from postproc.effects.library.cell.axis_motion import AxisMotion, across, position_of, small_motion

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Joint


class ExternalAxisFrame(
    AxisMotion,
    confused_with={
        "external_axis_error": "more positions of the axis: a straight rail that stands askew is straight",
        "external_axis_compliance": "two payloads, or the arm stretched to both sides, at each position of the axis",
        "frame_drift": "positions of the axis in mixed order, some of them twice",
    },
):
    """An external axis goes another way than the controller believes, about another place, or by another scale.

    Equation: C Move((1 + s) e) C^-1 in place of Move(e), with C a small shift, then the rotation vector, in the axes of
    its frame. Nothing happens at position 0, where base and work were calibrated. Of a sliding axis the two turns
    across it and the scale count, of a turning axis the two shifts and the two turns across it and the scale: along it
    C changes nothing. Source: rigid-body geometry; calibration of a base frame moved by a track (ABB, calibration of a
    coordinated axis). Typical size: 0.2 to 2 mrad, 0.2 to 2 mm, 50 to 300 parts in a million.
    """

    place_m: Array = param(unit="m", shape=("axes", 3), low=-0.1, high=0.1, typical=5e-4, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=("axes", 3), low=-0.1, high=0.1, typical=5e-4, labels=XYZ)
    scale_error: Array = param(unit="1", shape=("axes",), low=-0.1, high=0.1, typical=1e-4)

    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        """T_base_axis and X - 1 (n, 4, 4) of the k-th axis: X leads from its nominal to its misplaced position."""
        position = position_of(state, self.axes[k])
        C = np.eye(4) + small_motion(self.place_m[k, None], self.turn_rad[k, None])
        nominal = _moved(joint, position)
        real = C @ _moved(joint, (1.0 + self.scale_error[k]) * position) @ invert(C)
        return state.axis_frames[self.axes[k]][0], (real - nominal) @ invert(nominal)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: each moving axis alone: place and direction, scale, or both; then all axes together."""
        axes = cls.moving(state, current)
        if not axes or state.station is None:
            return ()
        effect, joints = current or cls(axes=axes), state.station.joints
        scale = np.array([name.startswith("scale") for name in effect.names()])
        every, forms = np.zeros(len(scale), dtype=bool), list[Variant]()
        for k, axis in enumerate(axes):
            way = np.zeros_like(effect.place_m, dtype=bool)
            way[k] = across(joints[axis])
            rotary = joints[axis].kind == "rotary"
            counted = np.concatenate([(way & rotary).ravel(), way.ravel(), np.arange(len(axes)) == k])
            every |= counted
            for what, part in ((", way", ~scale), (", scale", scale), ("", True)):
                forms.append(variant(effect, f"eax_{axis}{what}", counted & part, counted & part))
        if len(axes) > 1:
            forms.append(variant(effect, "all axes", every, every))
        return tuple(forms)


def _moved(joint: Joint, position: Array) -> Array:
    """The nominal motion (n, 4, 4) of a joint at positions (n,) [m] or [rad], in the axes of a model file."""
    way = position[:, None] * joint.way
    parts = (way, np.zeros_like(way))
    return np.eye(4) + small_motion(*(parts if joint.kind == "linear" else parts[::-1]))
