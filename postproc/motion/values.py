"""What the motion room works on: moves in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, constant
from postproc.motion.mounts import Mounts
from postproc.rapid.data.events import MotionEvent
from postproc.robot.cells.cell import Kind
from postproc.robot.cells.station import Station

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


def stretches(flags: Flags) -> list[tuple[int, int]]:
    """Begin and end [a, b) of every stretch of consecutive True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


@dataclass(frozen=True, slots=True, eq=False)
class WorkFrame:
    """The frame that the work (or a stationary tool) stands in: the world (no unit), or a mechanical unit's end."""

    station: Station
    unit: str | None

    def at(self, axes: Array) -> Array:
        """T_base_frame (n, 4, 4) of this frame at positions (n, 6) [m], [rad] of the external axes."""
        return self.station.frame(self.unit, axes)


@dataclass(frozen=True, slots=True)
class Move:
    r"""One motion event in SI units, ready for geometry.

    Args:
        row, event: index of the program's motion event that it comes from, and that event.
        kind: ``joint`` and ``absjoint`` in joint space, ``line`` and ``arc`` in space.
        q: (6,) goal joint angles [rad] from the nominal inverse kinematics, turns resolved.
        T_mount_tcp: (4, 4) tool in force, on the flange, or in its frame where it is stationary.
        T_work_tcp: (4, 4) commanded goal pose of the TCP in the work frame (see ``mounts``), work object and
            displacement resolved (None for absjoint).
        T_work_via: (4, 4) circle point, arcs only.
        payload_mass: [kg], payload_center: (3,) [m] in tool0: tool plus grip load.
        speed: [m/s], rotation_speed: [rad/s] of the TCP; the weld speed is merged into ``speed``.
        axis_speed: of external axes by their kind [m/s], [rad/s].
        duration: [s] where ``\T`` was given.
        ease: share of the joints' acceleration limits that AccSet leaves.
        fine: stop point; zone, zone_rotation: radii of the corner path for position and orientation [m]; zone_angle:
            [rad] of the corner for a reorientation in place.
        welding: the arc burns on the way to this goal.
        starts_chain: how the arm gets to this goal is unknown; a chain of connected moves starts here.
        resumes_from: index of the earlier move whose goal this one restates: no motion, but the start of another way.
        frame: what the work stands in, None for the base itself; moves of one program share the objects.
        axes: (6,) external axes at the goal [m], [rad], NaN where nothing is known.
    """

    row: int
    event: MotionEvent
    kind: Literal["joint", "absjoint", "line", "arc"]
    q: Array
    T_mount_tcp: Array
    stationary: bool = False
    T_work_tcp: Array | None = None
    T_work_via: Array | None = None
    payload_mass: float = 0.0
    payload_center: Array = field(default_factory=lambda: np.zeros(3))
    speed: float = 0.25
    rotation_speed: float = 8.7
    axis_speed: Mapping[Kind, float] = field(default_factory=lambda: {"linear": 5.0, "rotary": 17.5})
    duration: float | None = None
    ease: float = 1.0
    fine: bool = False
    zone: float = 0.0
    zone_rotation: float = 0.0
    zone_angle: float = 0.0
    welding: bool = False
    starts_chain: bool = False
    resumes_from: int | None = None
    frame: WorkFrame | None = None
    axes: Array = field(default_factory=lambda: np.full(6, np.nan))


def payloads(moves: Sequence[Move]) -> tuple[Array, Array]:
    """Payload masses (m,) [kg] and their centers (m, 3) in tool0 [m] of m moves."""
    return np.array([m.payload_mass for m in moves]), np.array([m.payload_center for m in moves]).reshape(-1, 3)


def goal_axes(moves: Sequence[Move]) -> Array:
    """(m, 6) positions [m], [rad] of the external axes at the goals of m moves, NaN where not known."""
    return np.array([m.axes for m in moves]).reshape(-1, 6)


def mounts_of(moves: Sequence[Move], axes: Array | None = None) -> Mounts:
    """How tool and work are mounted at the goals of moves, in their order.

    Args:
        axes: (m, 6) positions of the external axes; without them those at the goals of the moves.
    """
    T_mount_tcp = constant(np.array([m.T_mount_tcp for m in moves]).reshape(-1, 4, 4))
    stationary = np.array([m.stationary for m in moves], dtype=bool)
    frames = list(dict.fromkeys([m.frame for m in moves]))
    if not any(frames):
        return Mounts(T_mount_tcp, stationary)
    which = np.array([frames.index(m.frame) for m in moves])
    at = goal_axes(moves) if axes is None else axes
    return Mounts(T_mount_tcp, stationary, frames_at(frames, which, at), which)


def frames_at(frames: Sequence[WorkFrame | None], which: Index, axes: Array) -> Array:
    """T_base_frame (n, 4, 4) of the frames of index ``which`` (n,), the identity for None.

    Args:
        axes: (n, 6) positions of the external axes [m], [rad].
    """
    T = np.tile(np.eye(4), (len(which), 1, 1))
    for k, frame in enumerate(frames):
        rows = np.flatnonzero(which == k)
        if frame is not None and len(rows):
            T[rows] = frame.at(axes[rows])
    return T
