"""What stands around an arm: tracks, gantries and positioners, what each carries, and where that puts base and work.

The chain is world, track or gantry, base, arm on one side and world, positioner, user frame on the other. Positions of
external axes are (n, 6) arrays by letter a to f, in m and rad, NaN where nothing is known.

A unit's frame is where its last joint ends:

    T_world_end(e) = T_world_parent(e) T_parent_base Prod_j (T_before_j Move_j(e))

with Move_j a shift along, or a turn about, the joint's direction. An arm stands at T_world_end(e) T_unit_base.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.rapid.data.records import NO_AXIS
from postproc.robot.controller import Calibration
from postproc.robot.pose import transform

LETTERS = "abcdef"
Kind = Literal["linear", "rotary", "fixed"]


def _identity() -> Array:
    """Return the identity pose (4, 4)."""
    return np.eye(4)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint of a track, gantry or positioner.

    Args:
        axis: letter of the external axis that moves it; None for a joint that is locked.
        direction: (3,) unit vector along which it slides or about which it turns, right before it moves.
        T_before: (4, 4) from where the joint before it ends.
        lower, upper: limits [m] or [rad]; speed, acceleration: [m or rad per s, s^2]; None where nothing is said.
        leader: letter of the axis that it follows where its own position is not stated (two drives of one portal).
    """

    name: str
    axis: str | None
    kind: Kind
    direction: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    T_before: Array = field(default_factory=_identity)
    lower: float | None = None
    upper: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    leader: str | None = None

    @property
    def way(self) -> Array:
        """(3,) direction of the motion in the joint's own frame in a model file: x of a slide, z of a turn."""
        return np.array([1.0, 0.0, 0.0] if self.kind == "linear" else [0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Unit:
    """A mechanical unit, as RAPID names it (``ActUnit STN1``, ``ufmec``).

    Args:
        parent: the unit on which it stands; None for the world.
        T_parent_base: (4, 4) its base frame there.
        active: whether it is active after start.
        unknown: why its motion is not known; empty where it is.
        idle: it carries neither an arm nor work.
    """

    name: str
    joints: tuple[Joint, ...]
    parent: str | None = None
    T_parent_base: Array = field(default_factory=_identity)
    active: bool = True
    unknown: str = ""
    idle: bool = False


@dataclass(frozen=True, slots=True)
class CellArm:
    """An arm of the cell.

    Args:
        type: what the controller calls it.
        unit: the unit that carries it; None for one that stands in the world.
        T_unit_base: (4, 4) its base frame at the end of that unit, or in the world.
        gravity: (3,) in base axes, with all external axes at zero [m/s^2]; None where it is not known.
        calibrated: its controller corrects geometry and weight itself (Absolute Accuracy); calibration: by what.
    """

    name: str
    type: str
    unit: str | None = None
    T_unit_base: Array = field(default_factory=_identity)
    gravity: Array | None = None
    calibrated: bool = False
    calibration: Calibration | None = None


@dataclass(frozen=True, slots=True)
class CellTask:
    """A task of the controller: whether it moves anything, the arm that it drives, and its units."""

    name: str
    moves: bool
    arm: str | None
    units: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """Units, arms and tasks by name in lower case, and what about a unit or an arm is not understood."""

    units: Mapping[str, Unit] = field(default_factory=dict)
    arms: Mapping[str, CellArm] = field(default_factory=dict)
    tasks: Mapping[str, CellTask] = field(default_factory=dict)
    findings: tuple[tuple[str, Diagnostic], ...] = ()

    def unit(self, name: str) -> Unit:
        """Return the unit of this name, in any case; KeyError where there is none."""
        return self.units[name.lower()]

    def below(self, name: str | None) -> tuple[str, ...]:
        """Return the names, in lower case, of this unit and all on which it stands; empty for None, the world."""
        return () if name is None else (name.lower(), *self.below(self.unit(name).parent))

    def joints(self, units: tuple[str, ...]) -> dict[str, Joint]:
        """Return the joints of these units by the letter of their axis; joints without an axis are left out."""
        return {j.axis: j for name in units for j in self.unit(name).joints if j.axis is not None}


def axis_positions(cell: Cell, units: tuple[str, ...], extax: Array) -> Array:
    """Convert ``extax`` (n, 6), in mm and degrees with 9E9 for none, to positions (n, 6) [m], [rad].

    Args:
        units: names of those of the task, as each task has its own axes a to f; the columns of other axes are NaN.
    """
    stated = np.asarray(extax, dtype=float).reshape(-1, 6)
    positions = np.full(stated.shape, np.nan)
    for letter, joint in cell.joints(units).items():
        column = stated[:, LETTERS.index(letter)]
        scale = 1e-3 if joint.kind == "linear" else np.pi / 180.0
        positions[:, LETTERS.index(letter)] = np.where(column < NO_AXIS, scale * column, np.nan)
    return positions


def moved(joint: Joint, positions: Array) -> Array:
    """Return the motion (n, 4, 4) of a joint at its own position among axis positions (n, 6) [m], [rad].

    A joint follows its ``leader`` where its own position is NaN; a joint without axis does not move.
    """
    n = len(positions)
    if joint.kind == "fixed" or joint.axis is None:
        return np.tile(np.eye(4), (n, 1, 1))
    value = positions[:, LETTERS.index(joint.axis)]
    if joint.leader is not None:
        value = np.where(np.isnan(value), positions[:, LETTERS.index(joint.leader)], value)
    way = value[:, None] * joint.direction
    if joint.kind == "linear":
        return transform(way)
    known = np.isfinite(value)
    turn = np.full((n, 3, 3), np.nan)
    turn[known] = Rotation.from_rotvec(way[known]).as_matrix()
    return transform(np.zeros((n, 3)), turn)
