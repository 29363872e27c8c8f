"""A column or gantry that leans under the arm's moment, a positioner that sags under its work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import State, Variant, param, variant
from postproc.effects.geometry import distal_point
from postproc.effects.library.cell.axis_motion import AxisMotion, Mask, across, side_of, small_motion

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Joint

LEAST_SAG_SHARE = 1e-3
"""Share of the largest by which a sag must change from row to row to be looked for."""


class ExternalAxisCompliance(
    AxisMotion,
    reads=("external_axes", "load", "robot"),
    beside="joint_compliance",
    confused_with={
        "base_compliance": "the arm in one posture at both ends of the axis: the lever to the column's foot changes",
        "external_axis_error": "two payloads, or the arm stretched to both sides, at each position of the axis",
        "external_axis_frame": "two payloads, or the arm stretched to both sides, at each position of the axis",
    },
):
    """What an external axis stands on leans under the load on it.

    Equation: a turn about the origin of the axis' frame (``xyz_mm`` of its table, where it stands at the time), in the
    axes of that frame: c_i M_i, with M the moment of all that the arm's base carries, or, of an axis that carries the
    work, of the reaction to the process force. Under the weight of the work it turns by
    sum over j of s_ij (R e_j x g / |g|)_i besides: e_j are the axes of the plate, R turns them into the frame of the
    axis, and s_ij is the compliance times the work's weight times its lever along e_j, which nobody states.
    Source: linear tilt springs. Typical size: 1e-8 to 3e-7 rad/(N m) of a column, 0.05 to 0.5 mrad of sag.
    """

    tilt_rad_per_Nm: Array = param(
        unit="rad/(N m)",
        shape=("axes", 3),
        low=-1e-5,
        high=1e-4,
        typical=1e-7,
        least=0.0,
        labels=("x", "y", "z"),
    )
    sag_rad: Array = param(unit="rad", shape=("axes", 3, 3), low=-0.05, high=0.05, typical=2e-4, labels=("x", "y", "z"))

    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        """T_base_axis and X - 1 (n, 4, 4) of the k-th axis: its end turns by X under the load on it."""
        T, side = state.axis_frames[self.axes[k]][0], side_of(state, self.axes[k])
        turn = self.tilt_rad_per_Nm[k] * _moment(state, T, side)
        if np.any(self.sag_rad[k]):
            turn = turn + np.einsum("ij,nij->ni", self.sag_rad[k], _sagging(state, T, side))
        return T, small_motion(np.zeros_like(turn), turn)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: each moving axis alone, then all together: tilt and sag, sag alone, or both about the axis itself."""
        axes = cls.moving(state, current)
        if not axes or state.station is None or state.robot is None:
            return ()
        effect, forms = current or cls(axes=axes), list[Variant]()
        every = np.zeros(len(effect.vector()), dtype=bool)
        for k, axis in enumerate(axes):
            T, side = state.axis_frames[axis][0], side_of(state, axis)
            about_axis = ~across(state.station.joints[axis])
            sag = np.ptp(_sagging(state, T, side), axis=0)
            seen = sag > LEAST_SAG_SHARE * max(1.0, float(sag.max()))
            forced = (side > 0).any() or (state.wrench is not None and np.any(np.asarray(state.wrench)[side < 0]))
            tilt, none = np.full(3, forced), np.zeros(3, dtype=bool)
            for what, tilts, sags in (
                ("", tilt, seen),
                (", its sag", none, seen),
                (", about itself", tilt & about_axis, seen & about_axis[:, None]),
            ):
                free = cls._mask(effect, k, tilts, sags)
                if free.any() and not any(np.array_equal(free, v.free) for v in forms):
                    forms.append(variant(effect, f"eax_{axis}{what}", free, free))
                every |= free
        return tuple(forms) if len(axes) == 1 else (*forms, variant(effect, "all axes", every, every))

    @staticmethod
    def _mask(effect: ExternalAxisCompliance, k: int, tilt: Mask, sag: Mask) -> Mask:
        """Mask of the effect's vector that frees these tilts (3,) and sags (3, 3) of the k-th axis."""
        tilts, sags = (np.zeros(x.shape, dtype=bool) for x in (effect.tilt_rad_per_Nm, effect.sag_rad))
        tilts[k], sags[k] = tilt, sag
        return np.concatenate([tilts.ravel(), sags.ravel()])


def _moment(state: State, T_base_axis: Array, side: Array) -> Array:
    """Moment (n, 3) [N m] of the load on an axis about the origin of its frame, in its axes.

    Args:
        T_base_axis: (n, 4, 4) the frame.
        side: (n,) 1 where the axis carries the arm, -1 where it carries work, which bears the process force.
    """
    assert state.robot is not None and state.body_load is not None and state.T_base_body is not None
    origin = T_base_axis[:, :3, 3]
    load = state.body_load[:, 0]
    moment = load[:, 3:] + np.cross(distal_point(state.robot, 0) - origin, load[:, :3])
    if (side < 0).any():
        wrench = np.zeros((len(state), 6)) if state.wrench is None else np.broadcast_to(state.wrench, (len(state), 6))
        flange = state.T_base_body[:, 6] @ state.robot.link[6]
        tip = (flange @ state.T_flange_tcp)[:, :3, 3]
        reaction = -wrench[:, 3:] - np.cross(tip - origin, wrench[:, :3])
        moment = np.where((side < 0)[:, None], reaction, moment)
    return _in_frame(T_base_axis, moment)


def _sagging(state: State, T_base_axis: Array, side: Array) -> Array:
    """Moment (n, 3, 3) of a unit weight, in the frame of an axis, by axis of the work along which its unit lever lies.

    Zero where ``side`` (n,) is not -1: there the axis carries no work. T_base_axis: (n, 4, 4) the frame.
    """
    assert state.station is not None and state.external_axes is not None
    sagging = np.zeros((len(state), 3, 3))
    units = np.full(len(state), "") if state.work is None else state.work
    gravity = np.broadcast_to(state.gravity, (len(state), 3))
    for unit in np.unique(units[side < 0]).tolist():
        rows = (units == unit) & (side < 0)
        last = [joint.axis for joint in state.station.cell.unit(unit).joints if joint.axis is not None][-1]
        R = state.axis_frames[last][1][rows, :3, :3]
        pull = gravity[rows] / np.linalg.norm(gravity[rows], axis=1, keepdims=True)
        moments = np.cross(np.swapaxes(R, 1, 2), pull[:, None])
        sagging[rows] = np.swapaxes(moments @ T_base_axis[rows, :3, :3], 1, 2)
    return sagging


def _in_frame(T: Array, vectors: Array) -> Array:
    """Turn vectors (n, 3) from the outer axes into those of frames T (n, 4, 4)."""
    return np.asarray(np.einsum("nji,nj->ni", T[:, :3, :3], vectors))
