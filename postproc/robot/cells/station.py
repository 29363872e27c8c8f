"""An arm in its cell: where its base and the frames of its work are, and which way gravity pulls, at axis positions.

    T_base_frame(e) = T_world_base(e)^-1 T_world_frame(e)

with the world itself, or the end of a mechanical unit, as the frame in which work (or a stationary tool) stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, invert
from postproc.diagnostics import Diagnostic
from postproc.rapid.data.records import NO_AXIS, Ax6
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit, axis_positions, moved

ROBOT = "robot"
"""What an arm is called in a cell where there is no other."""
INSTANT = 1e-3  # [s] between the positions whose differences are speeds and accelerations of the base


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """An arm, and the external axes of its task.

    Args:
        arm: its name in the cell; units: those of its task, whose axes the task's targets state.
        connected: the units are all there are: what targets say of other axes counts for nothing.
        standing: where units of other tasks stand as long as the task runs, (6,) as RAPID states it, by name in lower
            case; a unit of another task that is not among them is nowhere.
    """

    cell: Cell = field(default_factory=lambda: Cell(arms={ROBOT: CellArm(ROBOT, "")}))
    arm: str = ROBOT
    units: tuple[str, ...] = ()
    connected: bool = False
    standing: Mapping[str, Ax6] = field(default_factory=dict)

    @property
    def joints(self) -> dict[str, Joint]:
        """Joints of the task's units by the letter of their axis."""
        return self.cell.joints(self.units)

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Diagnostics of the cell about this arm or a unit of its task."""
        names = {name.lower() for name in (self.arm, *self.units)}
        return tuple(finding for name, finding in self.cell.findings if name.lower() in names)

    @property
    def cell_arm(self) -> CellArm:
        """The cell's entry of this arm."""
        return self.cell.arms[self.arm.lower()]

    @property
    def carried(self) -> bool:
        """Whether a mechanical unit carries the arm."""
        return self.cell_arm.unit is not None

    @property
    def placed(self) -> bool:
        """Whether the place of the arm's base can be computed once positions of the external axes are given."""
        return bool(np.isfinite(self.base(np.zeros((1, 6)))).all())

    @property
    def in_world(self) -> bool:
        """Whether the arm's base is the world frame and no unit carries it."""
        return not self.carried and bool((self.cell_arm.T_unit_base == np.eye(4)).all())

    @property
    def work(self) -> str | None:
        """Name of the task's unit at whose end work stands; None where no unit carries any, or where several do."""
        arm = self.cell.below(self.cell_arm.unit)
        names = {name.lower() for name in self.units if name.lower() not in arm and not _idle(self.cell.unit(name))}
        ends = names - {below for name in names for below in self.cell.below(name)[1:]}
        return self.cell.unit(ends.pop()).name if len(ends) == 1 else None

    def sides(self, unit: str | None) -> dict[str, int]:
        """Return by axis 1 where it moves the arm, -1 where it moves work at the end of ``unit`` (None: in the world).

        Axes that move both or neither are left out.
        """
        arm, work = (set(self.cell.below(name)) for name in (self.cell_arm.unit, unit))
        sides: dict[str, int] = {}
        for name in self.units:
            side = (name.lower() in arm) - (name.lower() in work)
            sides |= {joint.axis: side for joint in self.cell.unit(name).joints if joint.axis and side}
        return sides

    def axis_frames(self, positions: Array) -> dict[str, tuple[Array, Array]]:
        """Return by axis the frames T_base_axis (n, 4, 4) right before and right after its motion, at positions (n, 6).

        They are those of a model file: a slide goes along x, a turn about z. A controller's joint that moves another
        way is turned there by the smallest rotation, in the axes of the base with all axes at zero.
        """
        at_zero, frames_by_axis = self._joint_frames(np.zeros((1, 6))), {}
        for axis, frames in self._joint_frames(positions).items():
            joint, R = self.joints[axis], at_zero[axis][0][0, :3, :3]
            identity = np.eye(4)
            if not np.allclose(joint.direction, joint.way) and np.isfinite(R).all():
                stated, _ = Rotation.align_vectors([R @ joint.direction], [joint.way])
                identity[:3, :3] = R.T @ stated.as_matrix()
            frames_by_axis[axis] = frames[0] @ identity, frames[1] @ identity
        return frames_by_axis

    def _joint_frames(self, positions: Array) -> dict[str, tuple[Array, Array]]:
        """Return the frames that `axis_frames` turns: those in the axes of the controller's joints."""
        T_base_world = invert(self.base(positions))
        frames_by_axis = {}
        for name in self.units:
            frames = self._world_frames(name, positions)[1:]
            for joint, (before, after) in zip(self.cell.unit(name).joints, frames, strict=True):
                if joint.axis is not None:
                    frames_by_axis[joint.axis] = T_base_world @ before, T_base_world @ after
        return frames_by_axis

    def positions(self, extax: Array) -> Array:
        """Convert ``extax`` (n, 6) [mm], [deg] to positions (n, 6) [m], [rad]; NaN for axes that the task has not."""
        return axis_positions(self.cell, self.units, extax)

    def world(self, unit: str, positions: Array) -> Array:
        """Return T_world_end (n, 4, 4) of a unit at axis positions (n, 6); NaN where a needed position is not known.

        Raises:
            KeyError: there is no such unit.
        """
        return self._world_frames(unit, positions)[-1][1]

    def _world_frames(self, name: str, positions: Array) -> list[tuple[Array, Array]]:
        """Return pairs of frames (n, 4, 4) of a unit in the world: right before and right after each joint's motion.

        The first pair is the unit's base frame, twice. NaN where a needed position is not known.
        """
        unit, positions = self.cell.unit(name), np.asarray(positions, dtype=float).reshape(-1, 6)
        T = np.full((len(positions), 4, 4), np.nan)
        if not unit.unknown:
            T = (
                np.tile(np.eye(4), (len(positions), 1, 1))
                if unit.parent is None
                else self.world(unit.parent, positions)
            )
            T = T @ unit.T_parent_base
        frames = [(T, T)]
        stated = self._stated(name, positions)
        for joint in unit.joints:
            before = frames[-1][1] @ joint.T_before
            frames.append((before, before @ moved(joint, stated)))
        return frames

    def _stated(self, name: str, positions: Array) -> Array:
        """Return the axis positions (n, 6) [m], [rad] of a unit: ``positions`` for the task's own, else `standing`.

        NaN where nobody states any.
        """
        if name.lower() in {unit.lower() for unit in self.units}:
            return positions
        at = axis_positions(self.cell, (name,), np.array(self.standing.get(name.lower(), (NO_AXIS,) * 6)))
        return np.broadcast_to(at, positions.shape)

    def base(self, positions: Array) -> Array:
        """Return T_world_base (n, 4, 4) at axis positions (n, 6) [m], [rad]; NaN where a needed one is not known."""
        arm = self.cell_arm
        if arm.unit is None:
            return np.tile(arm.T_unit_base, (np.asarray(positions).size // 6, 1, 1))
        return self.world(arm.unit, positions) @ arm.T_unit_base

    def frame(self, unit: str | None, positions: Array) -> Array:
        """Return T_base_frame (n, 4, 4) of the world (None) or of the end of a unit, at axis positions (n, 6).

        Raises:
            KeyError: there is no such unit.
        """
        T_base_world = invert(self.base(positions))
        return T_base_world if unit is None else T_base_world @ self.world(unit, positions)

    def gravity(self, positions: Array) -> Array | None:
        """Return gravity in base axes (n, 3) [m/s^2] at axis positions (n, 6); None where it is not known."""
        stated = self.cell_arm.gravity
        if stated is None:
            return None
        zero = self.base(np.zeros((1, 6)))[0, :3, :3]
        return np.einsum("nji,jk,k->ni", self.base(positions)[:, :3, :3], zero, stated)

    def base_motion(self, positions: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Return the base's motion in its own axes: acceleration of its origin, angular velocity and acceleration.

        Args:
            positions, v, a: (n, 6) of the external axes [m or rad, per s, per s^2]; NaN in v and a counts as zero.

        Returns:
            (n, 3) each [m/s^2], [rad/s], [rad/s^2], by differences over 1 ms, which are exact for slides.
        """
        v, a = np.nan_to_num(v), np.nan_to_num(a)
        before, now, after = (self.base(positions + v * t + a * t**2 / 2) for t in (-INSTANT, 0.0, INSTANT))
        to_base = np.swapaxes(now[:, :3, :3], 1, 2)
        second = (after - 2 * now + before) / INSTANT**2
        first = (after - before) / (2 * INSTANT)
        acceleration = (to_base @ second[:, :3, 3:])[..., 0]
        # W = R^T R' is the angular velocity's cross-product matrix, R^T R'' that of its rate plus W^2.
        spin = to_base @ first[:, :3, :3]
        rate = to_base @ second[:, :3, :3]
        return acceleration, _axial(spin), _axial(rate)


def station_of(cell: Cell, task: str = "") -> Station | None:
    """Return the station of the arm that a task drives, with the task's units; None where it is not one arm.

    Args:
        task: its name, in any case; empty or unknown means the only arm of the cell.
    """
    known = cell.tasks.get(task.lower())
    arms = [known.arm] if known is not None and known.arm else [arm.name for arm in cell.arms.values()]
    if len(arms) != 1 or arms[0].lower() not in cell.arms:
        return None
    if known is None:
        known = next((t for t in cell.tasks.values() if (t.arm or "").lower() == arms[0].lower()), None)
    if known is None:
        return Station(cell, arms[0], tuple(cell.units))
    return Station(cell, arms[0], known.units, connected=True)


def _idle(unit: Unit) -> bool:
    """Tell whether a unit carries nothing or only follows another one, as the second drive of a portal."""
    return unit.idle or all(joint.leader is not None for joint in unit.joints)


def _axial(matrix: Array) -> Array:
    """Return the vector (n, 3) of the skew-symmetric part of matrices (n, 3, 3)."""
    skew = 0.5 * (matrix - np.swapaxes(matrix, 1, 2))
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
