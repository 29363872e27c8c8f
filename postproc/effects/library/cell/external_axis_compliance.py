"""A column or gantry that leans under the arm's moment, a positioner that sags under its work."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, State, Variant, param, variant
from postproc.effects.geometry import distal_point
from postproc.effects.library.cell.axis_motion import AxisMotion, Mask, across, position_of, side_of, small_motion

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Joint

POSITION_POWERS = 3
"""Powers of the position in the compliance of a carriage: 1, e, e^2."""
COLUMN_POINTS = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5
"""Shares of a column's height at which two springs stand for all its slices (Gauss and Legendre: exact)."""
LEAST_SAG_SHARE = 1e-3
"""Share of the largest by which a sag must change from row to row to be looked for."""


class ExternalAxisCompliance(
    AxisMotion,
    reads=("external_axes", "load", "robot"),
    after="joint_compliance",
    confused_with={
        "base_compliance": "the arm in one posture at both ends of the axis: the lever to the column's foot changes",
        "external_axis_error": "two payloads, or the arm stretched to both sides, at each position of the axis",
        "external_axis_frame": "two payloads, or the arm stretched to both sides, at each position of the axis",
    },
):
    """What an external axis stands on leans under the load on it.

    Equation, in the axes of the axis' frame (``xyz_mm`` of its table, before it moves): springs at points p turn what
    they carry about p by c_i M_i(p), with M the moment about p of all that the arm's base carries, or, of an axis that
    carries the work, of the reaction to the process force.
        foot:     p = foot_m, c = tilt
        carriage: p = carriage_m + e d, c = sum over k of carriage_k (e / 1 m)^k: guides are not alike on all the travel
        column:   a cantilever from the foot to the carriage: c = bend ds for each of its slices
    with e the position and d the direction of a linear axis. Where springs really stand nobody states: foot_m and
    carriage_m are fitted. Under the weight of the work it turns by sum over j of s_ij (R e_j x g / |g|)_i besides: e_j
    are the axes of the plate, R turns them into the frame of the axis, and s_ij is the compliance times the work's
    weight times its lever along e_j, which nobody states.
    Source: linear tilt springs; Euler-Bernoulli cantilever. Typical size: 1e-8 to 3e-7 rad/(N m) of a column, 0.05 to
    0.5 mrad of sag.
    """

    tilt_rad_per_Nm: Array = param(
        unit="rad/(N m)", shape=("axes", 3), low=-1e-5, high=1e-4, typical=1e-7, least=0.0, labels=XYZ
    )
    sag_rad: Array = param(unit="rad", shape=("axes", 3, 3), low=-0.05, high=0.05, typical=2e-4, labels=XYZ)
    bend_rad_per_Nm2: Array = param(
        unit="rad/(N m2)", shape=("axes", 3), low=-1e-5, high=1e-4, typical=1e-7, least=0.0, labels=XYZ
    )
    carriage_rad_per_Nm: Array = param(
        unit="rad/(N m)", shape=("axes", POSITION_POWERS, 3), low=-1e-5, high=1e-4, typical=1e-7, labels=XYZ
    )
    foot_m: Array = param(unit="m", shape=("axes", 3), low=-10.0, high=10.0, typical=0.5, amplitude=False, labels=XYZ)
    carriage_m: Array = param(
        unit="m", shape=("axes", 3), low=-10.0, high=10.0, typical=0.5, amplitude=False, labels=XYZ
    )

    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        """T_base_axis and X - 1 (n, 4, 4) of the k-th axis: its end turns by X under the load on it."""
        T, side = state.axis_frames[self.axes[k]][0], side_of(state, self.axes[k])
        force, moment = _load(state, T, side)
        turn, shift = np.zeros_like(moment), np.zeros_like(moment)
        if np.any(self.sag_rad[k]):
            turn = np.einsum("ij,nij->ni", self.sag_rad[k], _sagging(state, T, side))
        for point, compliance in self._springs(k, position_of(state, self.axes[k])[:, None], joint.way):
            lean = compliance * (moment - np.cross(point, force))
            turn, shift = turn + lean, shift + np.cross(point, lean)
        return T, small_motion(shift, turn)

    def _springs(self, k: int, position: Array, way: Array) -> Iterator[tuple[Array, Array]]:
        """Yield place [m] and compliance [rad/(N m)] of each spring of the k-th axis, (3,) or (n, 3), in its frame.

        Args:
            position: (n, 1) of the axis; way: (3,) along which it slides.
        """
        foot, carriage = self.foot_m[k], self.carriage_m[k] + position * way
        yield foot, self.tilt_rad_per_Nm[k]
        if np.any(self.bend_rad_per_Nm2[k]):
            height = (carriage - foot) @ way[:, None]
            for share in COLUMN_POINTS:
                yield foot + share * height * way, 0.5 * np.abs(height) * self.bend_rad_per_Nm2[k]
        if np.any(self.carriage_rad_per_Nm[k]):
            yield carriage, position ** np.arange(POSITION_POWERS) @ self.carriage_rad_per_Nm[k]

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: each moving axis alone, then all together.

        Under the arm the foot, and of a linear axis the column or the carriage; under work tilt and sag, sag alone, or
        both about the axis itself.
        """
        axes = cls.moving(state, current)
        if not axes or state.station is None or state.robot is None:
            return ()
        effect, forms = current or cls(axes=axes), list[Variant]()
        free = refit = np.zeros(len(effect.vector()), dtype=bool)
        for k, axis in enumerate(axes):
            joint, carries = state.station.joints[axis], side_of(state, axis)
            some = effect._under_arm(k, joint) if (carries > 0).any() else effect._under_work(state, k, joint)
            forms += some
            free, refit = free | some[0].free, refit | some[0].refit
        return tuple(forms) if len(axes) == 1 else (*forms, variant(effect, "all axes", free, refit))

    def _under_arm(self, k: int, joint: Joint) -> list[Variant]:
        """Return the forms of the k-th axis, which carries the arm: one sort of spring each, and where it stands."""
        forms = [("", "foot_m", {"tilt_rad_per_Nm": True})]
        if joint.kind == "linear":
            forms += [(", its column", "foot_m", {"bend_rad_per_Nm2": True})]
            for power, words in enumerate(("", ", by position", ", by position squared")):
                some = np.arange(POSITION_POWERS)[:, None] == power
                forms.append((f", its carriage{words}", "carriage_m", {"carriage_rad_per_Nm": some}))
        return [
            variant(
                self, f"eax_{self.axes[k]}{words}", self._mask(k, **springs), self._mask(k, **springs, **{at: True})
            )
            for words, at, springs in forms
        ]

    def _under_work(self, state: State, k: int, joint: Joint) -> list[Variant]:
        """Return the forms of the k-th axis, which carries the work; at least one, which may free nothing."""
        T, side = state.axis_frames[self.axes[k]][0], side_of(state, self.axes[k])
        about_axis, forms = ~across(joint), list[Variant]()
        sag = np.ptp(_sagging(state, T, side), axis=0)
        seen = sag > LEAST_SAG_SHARE * max(1.0, float(sag.max()))
        forced = state.wrench is not None and np.any(np.asarray(state.wrench)[side < 0])
        tilt, none = np.full(3, forced), np.zeros(3, dtype=bool)
        for what, tilts, sags in (
            ("", tilt, seen),
            (", its sag", none, seen),
            (", about itself", tilt & about_axis, seen & about_axis[:, None]),
        ):
            free = self._mask(k, tilt_rad_per_Nm=tilts, sag_rad=sags)
            if not any(np.array_equal(free, v.free) for v in forms):
                forms.append(variant(self, f"eax_{self.axes[k]}{what}", free, free))
        return forms

    def _mask(self, k: int, **freed: bool | Mask) -> Mask:
        """Return a mask of the vector that frees, of these parameters, this part of what belongs to the k-th axis."""
        parts = {name: np.zeros(self.shape(name), dtype=bool) for name in self.parameters()}
        for name, part in freed.items():
            parts[name][k] = part
        return np.concatenate([part.ravel() for part in parts.values()])


def _load(state: State, T_base_axis: Array, side: Array) -> tuple[Array, Array]:
    """Force [N] and moment [N m], (n, 3) each, of the load on an axis at the origin of its frame, in its axes.

    Args:
        T_base_axis: (n, 4, 4) the frame.
        side: (n,) 1 where the axis carries the arm, -1 where it carries work, which bears the process force.
    """
    assert state.robot is not None and state.body_load is not None and state.T_base_body is not None
    origin = T_base_axis[:, :3, 3]
    force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
    moment = moment + np.cross(distal_point(state.robot, 0) - origin, force)
    if (side < 0).any():
        wrench = np.zeros((len(state), 6)) if state.wrench is None else np.broadcast_to(state.wrench, (len(state), 6))
        flange = state.T_base_body[:, 6] @ state.robot.link[6]
        tip = (flange @ state.T_flange_tcp)[:, :3, 3]
        reaction = -wrench[:, 3:] - np.cross(tip - origin, wrench[:, :3])
        force = np.where((side < 0)[:, None], -wrench[:, :3], force)
        moment = np.where((side < 0)[:, None], reaction, moment)
    return _in_frame(T_base_axis, force), _in_frame(T_base_axis, moment)


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
