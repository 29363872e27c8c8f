"""RAPID records as values: mm, degrees, seconds and kg, as they stand in a program.

Layouts: ABB RAPID reference (robtarget, confdata, tooldata, wobjdata, speeddata, zonedata, loaddata).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Ax6 = tuple[float, float, float, float, float, float]

NO_AXIS = 9e9  # an unused external axis, however it is spelled
NO_AXES: Ax6 = (NO_AXIS,) * 6


@dataclass(frozen=True, slots=True)
class Pose:
    """trans [mm] and rot [q1..q4, scalar first, normalised]."""

    trans: Vec3 = (0.0, 0.0, 0.0)
    rot: Quat = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RobTarget:
    """trans [mm], rot [scalar first, normalised], robconf [cf1, cf4, cf6, cfx], extax [mm or deg, 9E9 unused]."""

    trans: Vec3
    rot: Quat
    robconf: tuple[int, int, int, int]
    extax: Ax6


@dataclass(frozen=True, slots=True)
class JointTarget:
    """robax [deg], extax [mm or deg]."""

    robax: Ax6
    extax: Ax6


@dataclass(frozen=True, slots=True)
class LoadData:
    """mass [kg], cog [mm] in the frame the load is given in, aom axes of moment, inertia [kg m^2] about cog."""

    mass: float = 0.0
    cog: Vec3 = (0.0, 0.0, 0.0)
    aom: Quat = (1.0, 0.0, 0.0, 0.0)
    inertia: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ToolData:
    """tframe: the TCP in tool0; tload: the tool's load, cog in tool0."""

    name: str = "tool0"
    robhold: bool = True
    tframe: Pose = Pose()
    tload: LoadData = LoadData()


@dataclass(frozen=True, slots=True)
class WobjData:
    """uframe, oframe: user and object frame; ufmec: the unit that moves the work where ufprog is false."""

    name: str = "wobj0"
    robhold: bool = False
    ufprog: bool = True
    ufmec: str = ""
    uframe: Pose = Pose()
    oframe: Pose = Pose()


@dataclass(frozen=True, slots=True)
class SpeedData:
    """v_tcp [mm/s], v_ori [deg/s], v_leax [mm/s], v_reax [deg/s]."""

    v_tcp: float
    v_ori: float = 500.0
    v_leax: float = 5000.0
    v_reax: float = 1000.0


@dataclass(frozen=True, slots=True)
class ZoneData:
    """finep: stop point; pzone_tcp, pzone_ori, pzone_eax [mm]; zone_ori [deg]; zone_leax [mm]; zone_reax [deg]."""

    finep: bool
    pzone_tcp: float = 0.0
    pzone_ori: float = 0.0
    pzone_eax: float = 0.0
    zone_ori: float = 0.0
    zone_leax: float = 0.0
    zone_reax: float = 0.0


@dataclass(frozen=True, slots=True)
class Weld:
    """What an Arc* statement adds: phase of the seam and the speed while welding [mm/s] (None if unknown)."""

    phase: Literal["start", "weld", "end"]
    speed: float | None
