"""What moves an external axis beside its nominal motion, as the arm on it, or beside it, sees that.

A small motion X of a track or gantry takes the arm's base along, D = T_base_axis X T_base_axis^-1. Work that a
positioner carries is moved the same way, which is the inverse motion of the arm relative to the work.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, invert
from postproc.channels.state import AXES
from postproc.effects.base import Displacement, Effect, State, structure
from postproc.effects.files import FieldProblem
from postproc.effects.geometry import distal_point
from postproc.robot.kinematics import skew

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Joint

Mask = NDArray[np.bool_]

LEAST_MOVE = 1e-6  # [m] or [rad]: an axis that stood still in all rows tells nothing of its motion


class AxisMotion(Effect, ABC, reads=("external_axes", "robot"), linear=False):
    """A small motion of external axes, one entry of every parameter for each of them."""

    axes: tuple[str, ...] = structure(("a",))

    @abstractmethod
    def motion(self, state: State, k: int, joint: Joint) -> tuple[Array, Array]:
        """Return T_base_axis (n, 4, 4) of the k-th axis, and X - 1 (n, 4, 4) of its small motion X in that frame."""

    def displacement(self, state: State) -> Displacement | None:
        """Displacement of the end of body 0 by the motions of all axes; None without a robot or a station."""
        if state.robot is None or state.station is None:
            return None
        total, joints = np.zeros((len(state), 6)), state.station.joints
        for k, axis in enumerate(self.axes):
            side = side_of(state, axis)
            rows = np.flatnonzero(side)
            if axis in joints and len(rows):
                some = state if len(rows) == len(state) else state.rows(rows)
                T, change = self.motion(some, k, joints[axis])
                change = T @ np.where((side[rows] < 0)[:, None, None], inverse(change), change) @ invert(T)
                total[rows] += _at_the_end(change, distal_point(state.robot, 0))
        return Displacement(body={0: total})

    @property
    def external_axes(self) -> tuple[str, ...]:
        """Letters of the axes, in the order of the parameters' entries."""
        return self.axes

    @classmethod
    def moving(cls, state: State, current: Self | None) -> tuple[str, ...]:
        """Letters of axes that vary in the states and move arm or work in some; those of ``current`` if it is given."""
        if current is not None:
            return current.axes
        if state.station is None or state.external_axes is None:
            return ()
        moved = np.ptp(np.nan_to_num(state.external_axes), axis=0) > LEAST_MOVE
        axes = (axis for axis in state.station.joints if moved[AXES.index(axis)] and side_of(state, axis).any())
        return tuple(sorted(axes))

    @classmethod
    def problems(cls, table: Mapping[str, Any]) -> list[FieldProblem]:
        """What `Effect.problems` finds, and letters in ``axes`` that are not a to f (EFF024)."""
        problems = super().problems(table)
        odd = [] if problems else [axis for axis in table.get("axes", ()) if axis not in [*AXES]]
        text = "`axes` of `{}` names `{}`, and external axes are called a to f"
        return problems + [FieldProblem("EFF024", "axes", text.format(cls.key, axis)) for axis in odd]


def side_of(state: State, axis: str) -> Array:
    """(n,) 1 where an axis moves the arm, -1 where it moves the work in whose frame the pose is, else 0."""
    sides = np.zeros(len(state))
    if state.station is not None:
        units = np.full(len(state), "") if state.work is None else state.work
        for unit in np.unique(units).tolist():
            sides[units == unit] = state.station.sides(unit or None).get(axis, 0)
    return sides


def position_of(state: State, axis: str) -> Array:
    """(n,) position of an axis by its letter [m] or [rad]; zero where it is not known."""
    return np.nan_to_num(np.asarray(state.external_axes)[:, AXES.index(axis)])


def across(joint: Joint) -> Mask:
    """(3,) True for the axes of a joint's frame at right angles to the direction of its motion."""
    return np.asarray(joint.way == 0.0)


def small_motion(shift: Array, turn: Array) -> Array:
    """X - 1 (n, 4, 4) of motions X: a shift (n, 3) [m] and a turn by a rotation vector (n, 3) [rad] (Rodrigues)."""
    angle = np.linalg.norm(turn, axis=1)[:, None, None] / np.pi
    S = skew(turn)
    change = np.zeros((len(turn), 4, 4))
    change[:, :3, :3] = np.sinc(angle) * S + 0.5 * np.sinc(angle / 2) ** 2 * (S @ S)
    change[:, :3, 3] = shift
    return change


def inverse(change: Array) -> Array:
    """X^-1 - 1 (n, 4, 4) of motions X, from X - 1 (n, 4, 4) and without the rounding of the 1."""
    result = np.array(np.swapaxes(change, 1, 2))
    result[:, 3] = 0.0
    result[:, :3, 3] = -change[:, :3, 3] - (result[:, :3, :3] @ change[:, :3, 3:])[:, :, 0]
    return result


def _at_the_end(change: Array, point: Array) -> Array:
    """Displacement (n, 6) of the end ``point`` (3,) of body 0 by D - 1 (n, 4, 4): shift [m], turns about x, y, z."""
    shift = change[:, :3, :3] @ point + change[:, :3, 3]
    R = np.eye(3) + change[:, :3, :3]
    turn = np.arctan2(-R[:, 1, 2], R[:, 2, 2]), np.arcsin(R[:, 0, 2]), np.arctan2(-R[:, 0, 1], R[:, 0, 0])
    return np.column_stack([shift, *turn])
