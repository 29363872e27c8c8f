"""The columns of a measurement table: standard names, whose ends are their units, and what other programs call them."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

UNITS: Mapping[str, float] = {
    "deg": math.pi / 180,
    "rad": 1.0,
    "mrad": 1e-3,
    "mm": 1e-3,
    "m": 1.0,
    "um": 1e-6,
    "in": 0.0254,
    "inch": 0.0254,
    "deg_s": math.pi / 180,
    "rad_s": 1.0,
    "deg_s2": math.pi / 180,
    "rad_s2": 1.0,
    "kg": 1.0,
    "lb": 0.45359237,
    "N": 1.0,
    "Nm": 1.0,
    "C": 1.0,
    "ms": 1e-3,
    "s": 1.0,
    "min": 60.0,
    "h": 3600.0,
    "d": 86400.0,
    "1": 1.0,
}
"""Factors to SI (angles in rad, temperatures stay in degrees Celsius)."""

_UNIT_OF_SUFFIX = ("deg_s2", "deg_s", "deg", "mm", "kg", "Nm", "N", "C", "s")

JOINTS = tuple(f"q{j}_deg" for j in range(1, 7))
POSITION = ("x_mm", "y_mm", "z_mm")
ORIENTATION = ("qw", "qx", "qy", "qz")
MEASURED_JOINTS = tuple(f"mq{j}_deg" for j in range(1, 7))
COMMAND_POSITION = ("cmd_x_mm", "cmd_y_mm", "cmd_z_mm")
COMMAND_ORIENTATION = ("cmd_qw", "cmd_qx", "cmd_qy", "cmd_qz")
CONFIGURATION = ("cf1", "cf4", "cf6", "cfx")
PAYLOAD = ("payload_kg", "payload_x_mm", "payload_y_mm", "payload_z_mm")
WRENCH = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")
APPROACH = tuple(f"dir{j}" for j in range(1, 7))
SPEED = tuple(f"v{j}_deg_s" for j in range(1, 7))
ACCELERATION = tuple(f"a{j}_deg_s2" for j in range(1, 7))
TEXT = ("pose_id", "session", "target")
BY_CHANNEL: Mapping[str, str] = {
    "v": "`v1_deg_s` .. `v6_deg_s`",
    "a": "`a1_deg_s2` .. `a6_deg_s2`",
    "approach": "`dir1` .. `dir6`",
    "temperature": "`temperature_C`",
    "time": "`time_s`",
    "session": "`session`",
    "wrench": "`fx_N` .. `mz_Nm`",
}
"""The columns of a table by the channel that an effect reads; a column of the table's own is its own channel."""
NUMBERS = (
    *JOINTS,
    *POSITION,
    *ORIENTATION,
    *MEASURED_JOINTS,
    *COMMAND_POSITION,
    *COMMAND_ORIENTATION,
    *CONFIGURATION,
    *PAYLOAD,
    *WRENCH,
    *APPROACH,
    *SPEED,
    *ACCELERATION,
    "temperature_C",
    "time_s",
    "sigma_mm",
)


def unit_of(column: str) -> str:
    """The unit that a standard column's name ends in, ``1`` where it has none."""
    if column in TEXT or column in APPROACH:
        return "1"
    return next((unit for unit in _UNIT_OF_SUFFIX if column.endswith("_" + unit)), "1")


@dataclass(frozen=True, slots=True)
class MappedColumn:
    """Where a standard column stands in another layout.

    Args:
        name: header of the column there, or its number counted from 1 where there is no header.
        unit: its unit, a key of ``UNITS``.
        sign: +1, or -1 for an axis that counts the other way.
        offset: added after the sign, in the column's own unit (another joint zero).
    """

    name: str | int
    unit: str
    sign: float = 1.0
    offset: float = 0.0


STANDARD = (*TEXT, *NUMBERS)
_SPELT = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "°c": "C",
    "degc": "C",
    "c": "C",
    "µm": "um",
    "micron": "um",
    "radian": "rad",
}
_ALIKE = ({"mm", "m", "um", "in", "inch"}, {"deg", "rad", "mrad"}, {"s", "ms", "min", "h", "d"}, {"kg", "lb"}, {"C"})
"""Units that may stand for each other."""
_LABELS = frozenset({"pose", "pose id", "point", "point name", "name", "label", "id", "no", "nr", "punkt"})
_WORDS = {"temperature": "temperature_C", "temp": "temperature_C", "time": "time_s", "payload": "payload_kg"}


def nearest(name: str) -> str | None:
    """The standard column that a name may be a misspelling of; the numbers in both must agree."""
    for found in difflib.get_close_matches(name, STANDARD, 3, 0.85):
        if re.sub(r"\D", "", found) == re.sub(r"\D", "", name) and found != name:
            return found
    return None


def recognised(header: Sequence[str]) -> dict[str, MappedColumn]:
    """Standard columns under another name that states its unit, ``X [mm]`` or ``J1 (rad)``, where it is unique."""
    every = [(theirs, *found) for theirs in header if (found := _meant(theirs)) and found[1]]
    names = [name for _, name, _ in every]
    lower = {theirs.lower() for theirs in header}
    return {
        name: MappedColumn(theirs, unit)
        for theirs, name, unit in every
        if names.count(name) == 1 and name.lower() not in lower
    }


def likely_map(header: Sequence[str]) -> str:
    """The lines of a column map for columns that are called as robots and trackers often call them; empty if none are.

    Joints: J1, A1, axis_1, joint1, theta1 ..; positions: X, px, x [mm], TCP.Y ... Units in brackets are taken over.
    """
    found: dict[str, str] = {}
    for theirs in header:
        name, unit = _meant(theirs) or ("", "")
        other = unit and unit != unit_of(name)
        found.setdefault(
            name, f'{name} = {{ name = "{theirs}", unit = "{unit}" }}' if other else f'{name} = "{theirs}"'
        )
    wanted = [name for name in STANDARD if name in found and name not in header]
    if len(wanted) < 3:
        return ""
    guess = "# units that the names do not state are guesses: deg, mm"
    return "\n".join(["[columns]", guess, *(found[name] for name in wanted)])


def _meant(theirs: str) -> tuple[str, str] | None:
    """Standard name and stated unit (empty where none is) of a column that another program wrote."""
    plain = re.sub(r"[\[(].*?[\])]", "", theirs).strip().lower()
    bracket = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]", theirs)
    stated = bracket[1] if bracket else ""
    joint = re.fullmatch(r"(?:j|a|q|axis|joint|theta|rob)[ _.]*(?:angle)?[ _.]*([1-6])(?:[ _.](rad|deg))?", plain)
    place = re.fullmatch(r"(?:p|pos|position|tcp|point|meas|measured)?[ _.]*([xyz])(?:[ _.](mm|m|in))?", plain)
    if joint:
        name, stated = f"q{joint[1]}_deg", stated or joint[2] or ""
    elif place:
        name, stated = f"{place[1]}_mm", stated or place[2] or ""
    elif part := re.fullmatch(r"(?:q|quat|quaternion)[ _.]*([wxyz])", plain):
        return f"q{part[1]}", "1"
    elif plain in _LABELS:
        return "pose_id", ""
    elif plain in _WORDS and stated:
        name = _WORDS[plain]
    else:
        return None
    unit = _SPELT.get(stated.lower(), stated)
    fits = any({unit, unit_of(name)} <= alike for alike in _ALIKE)
    return name, unit if fits else ""
