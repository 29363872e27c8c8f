"""The cell that a TOML file states: ``[[external_axes]]`` of a model file or of a file of its own.

Each entry is one external axis: its letter, how it moves, what it carries, and its frame in the world with all axes at
zero. A linear axis slides along +x of its frame, a rotary one turns about +z. The robot's base frame is that at zero.
Entries of one unit stand on one another in their order; ``parent`` is the letter of the axis on which another stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, gravity_in, invert
from postproc.diagnostics import PostprocError, Source
from postproc.files import read_source
from postproc.rapid.data.records import Vec3
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
from postproc.robot.cells.mechanical_units import read_cell
from postproc.robot.cells.station import ROBOT, Station
from postproc.robot.controller import Backup, read_backup, read_entries
from postproc.robot.pose import rpy, transform
from postproc.tomlfile import FileTable, Place, check, parse_toml, span_of

Letter = Literal["a", "b", "c", "d", "e", "f"]


class ExternalAxis(FileTable):
    """One entry of ``[[external_axes]]``; mm and degrees.

    Args:
        axis: letter of the extax.
        kind: along +x of its frame, or about its +z.
        carries: what stands on it.
        unit: mechanical unit; entries of one unit stand on one another, in their order.
        parent: axis of another unit that this one stands on.
        xyz_mm, quat: its frame in the world with all axes at zero.
        limits: lowest and highest position.
        speed: largest speed a second.
    """

    axis: Letter
    kind: Literal["linear", "rotary"]
    carries: Literal["robot", "work", "nothing"]
    unit: Annotated[str, Field(min_length=1)] | None = None
    parent: Letter | None = None
    xyz_mm: Place = (0.0, 0.0, 0.0)
    quat: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    limits: tuple[float, float] | None = None
    speed: Annotated[float, Field(gt=0)] | None = None

    @property
    def name(self) -> str:
        """Name of the mechanical unit of the axis; ``eax_`` and the letter of the axis where none is stated."""
        return self.unit or f"eax_{self.axis}"


class Mounting(FileTable):
    """How the base stands in the world with all axes at zero.

    Args:
        rpy_deg: roll, pitch, yaw about fixed axes.
    """

    rpy_deg: Vec3 = (0.0, 0.0, 0.0)


class _File(FileTable):
    mounting: Mounting = Mounting()
    external_axes: list[ExternalAxis] = []


def read_cell_file(path: Path) -> Cell:
    """Read a cell from a TOML file, from a controller's backup (a folder) or from its MOC.cfg.

    Raises:
        PostprocError: KIN016, the file cannot be read, or what it says does not fit, at file:line:col.
    """
    if path.is_dir():
        return read_cell(read_backup(path))
    if path.suffix.lower() == ".cfg":
        return read_cell(Backup(motion=read_entries(read_source(path, "KIN016").data.decode("latin-1"))))
    source = read_source(path, "KIN016")
    file = check(_File, parse_toml(source, "KIN016"), source, "KIN016")
    return stated_cell(file.external_axes, file.mounting, source)


def stated_cell(axes: Sequence[ExternalAxis], mounting: Mounting, source: Source) -> Cell:
    """Build the cell of the entries ``[[external_axes]]``; its only arm is called `ROBOT`.

    Args:
        source: the file that holds them, to which errors point.

    Raises:
        PostprocError: KIN016, an axis twice, a parent that is none, two chains that carry the robot.
    """
    below = _parents(axes, source)
    frames: dict[str, Array] = {a.axis: _frame(a, i, source) for i, a in enumerate(axes)}
    units: dict[str, Unit] = {}
    for axis in axes:
        parent = below[axis.axis]
        at_zero = np.eye(4) if parent is None else frames[parent]
        T = invert(at_zero[None])[0] @ frames[axis.axis]
        joint = _joint(axis)
        key, owner = axis.name.lower(), next((a.name for a in axes if a.axis == parent), None)
        if key in units:
            units[key] = replace(units[key], joints=(*units[key].joints, replace(joint, T_before=T)))
        else:
            units[key] = Unit(axis.name, (joint,), owner, T, idle=True)
        if axis.carries != "nothing":
            units[key] = replace(units[key], idle=False)
    carrier = _carrier(axes, below, source)
    R = rpy(np.radians(mounting.rpy_deg))
    unit, T_unit_base = None, np.eye(4)
    if carrier is not None:
        unit, T_unit_base = carrier.name, invert(frames[carrier.axis][None])[0]
    arm = CellArm(ROBOT, "", unit, T_unit_base, gravity_in(R))
    return Cell(units, {ROBOT: arm})


def stated_axes(station: Station) -> list[dict[str, Any]]:
    """Return the tables ``[[external_axes]]`` of a model file that state a station's axes.

    Their frames are in the axes of the base with all axes at zero. Left out are units whose motion is not known, and an
    axis that follows another one of its unit. A unit that only follows another one is stated as carrying nothing.
    """
    zero, work = np.zeros((1, 6)), set(station.cell.below(station.work))
    arm, axes = set(station.cell.below(station.cell_arm.unit)), list[dict[str, Any]]()
    for name in sorted(station.units, key=lambda unit: len(station.cell.below(unit))):
        unit, frames = station.cell.unit(name), station.axis_frames(zero)
        on = next(
            (j.axis for below in station.cell.below(unit.parent) for j in station.cell.unit(below).joints[::-1]), None
        )
        if unit.unknown:
            continue
        follows = all(joint.leader is not None for joint in unit.joints)
        moving = [joint for joint in unit.joints if joint.axis is not None and (follows or joint.leader is None)]
        for k, joint in enumerate(moving):
            T = frames[str(joint.axis)][0][0]
            scale = 1e-3 if joint.kind == "linear" else np.pi / 180.0
            entry: dict[str, Any] = {"axis": joint.axis, "kind": joint.kind}
            entry["carries"] = "robot" if name.lower() in arm else "work" if name.lower() in work else "nothing"
            entry |= {"unit": unit.name} | ({"parent": on} if on is not None and k == 0 else {})
            entry |= {"xyz_mm": [round(1e3 * float(x), 6) + 0.0 for x in T[:3, 3]]}
            entry |= {
                "quat": [round(float(x), 12) + 0.0 for x in Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)]
            }
            if joint.lower is not None and joint.upper is not None:
                entry["limits"] = [round(float(x) / scale, 6) for x in (joint.lower, joint.upper)]
            axes.append(entry | ({"speed": round(float(joint.speed) / scale, 6)} if joint.speed else {}))
    return axes


def restated(station: Station) -> Station:
    """Return the station as a model file states it: with the base as the world when all external axes are at zero.

    Raises:
        PostprocError: KIN016, it is not known where the arm stands.
    """
    if not station.placed:
        why = "; ".join(finding.message for finding in station.findings) or "a unit of it cannot be read"
        help_ = "describe what carries it in a TOML file (docs/my-cell.md)"
        raise PostprocError.of("KIN016", f"nobody can tell where the arm stands: {why}", help=help_)
    axes = [ExternalAxis(**entry) for entry in stated_axes(station)]
    cell, gravity = stated_cell(axes, Mounting(), Source("", b"")), station.gravity(np.zeros((1, 6)))
    arm = cell.arms[ROBOT] if gravity is None else replace(cell.arms[ROBOT], gravity=gravity[0])
    return Station(replace(cell, arms={ROBOT: arm}), ROBOT, tuple(cell.units))


def _parents(axes: Sequence[ExternalAxis], source: Source) -> dict[str, str | None]:
    """Return for each axis, by letter, the axis on which it is mounted; None for the world.

    An axis is on the one before it in its unit, else on its ``parent``.

    Raises:
        PostprocError: KIN016, an axis twice, a parent that is not described before or is another than the axis before
            it in its unit, or limits in the wrong order.
    """
    parents: dict[str, str | None] = {}
    last: dict[str, str] = {}
    for i, axis in enumerate(axes):
        if axis.axis in parents:
            raise _wrong(f"eax_{axis.axis} is described twice", source, i, "axis")
        parent = last.get(axis.name.lower(), axis.parent)
        if parent is not None and parent not in parents:
            raise _wrong(
                f"eax_{parent}, on which eax_{axis.axis} stands, is not described before it", source, i, "parent"
            )
        if axis.parent is not None and parent != axis.parent:
            raise _wrong(f"eax_{axis.axis} stands on eax_{parent}, the axis before it in its unit", source, i, "parent")
        parents[axis.axis], last[axis.name.lower()] = parent, axis.axis
        if axis.limits is not None and not axis.limits[0] < axis.limits[1]:
            raise _wrong(f"eax_{axis.axis}: the lower limit is not below the upper one", source, i, "limits")
    return parents


def _carrier(axes: Sequence[ExternalAxis], below: dict[str, str | None], source: Source) -> ExternalAxis | None:
    """Return the last axis of the chain that carries the robot; None without one, KIN016 where there are two chains.

    ``below`` is, by axis, the axis on which it is mounted.
    """
    carrying = {a.axis for a in axes if a.carries == ROBOT}
    ends = [i for i, a in enumerate(axes) if a.axis in carrying and a.axis not in {below[c] for c in carrying}]
    if len(ends) > 1:
        first, second = axes[ends[0]].axis, axes[ends[1]].axis
        text = f"eax_{first} and eax_{second} both carry the robot, and neither stands on the other"
        raise _wrong(text, source, ends[1], "carries")
    return axes[ends[0]] if ends else None


def _joint(axis: ExternalAxis) -> Joint:
    """Convert an entry to a joint, with limits and speed in m or rad."""
    scale = 1e-3 if axis.kind == "linear" else np.pi / 180.0
    lower, upper = (None, None) if axis.limits is None else (scale * x for x in axis.limits)
    speed = None if axis.speed is None else scale * axis.speed
    joint = Joint(f"eax_{axis.axis}", axis.axis, axis.kind, lower=lower, upper=upper, speed=speed)
    return replace(joint, direction=joint.way)


def _frame(axis: ExternalAxis, index: int, source: Source) -> Array:
    """Return the frame (4, 4) of an entry in the world; KIN016 at its ``index`` if its quaternion has not length 1."""
    if abs(np.linalg.norm(axis.quat) - 1.0) > 1e-2:
        raise _wrong(f"eax_{axis.axis}: `quat` has not the length 1", source, index, "quat")
    turn = Rotation.from_quat(axis.quat, scalar_first=True).as_matrix()
    return transform(np.array(axis.xyz_mm) * 1e-3, turn)


def _wrong(text: str, source: Source, index: int, key: str) -> PostprocError:
    """Return the error KIN016 at a key of the entry with this index."""
    span = span_of(source, ("external_axes", index, key)) or span_of(source, ("external_axes", index))
    return PostprocError.of("KIN016", text, source, span, "docs/robot.md describes `[[external_axes]]`")
