"""The columns of a measurement table: standard names, whose ends are their units, and what other programs call them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence

from postproc.channels.state import COLUMNS
from postproc.measure.read.layout import MappedColumn
from postproc.measure.read.values import fitting

_UNIT_OF_SUFFIX = ("deg_s2", "deg_s", "deg", "mm", "kg", "Nm", "N", "C", "s")

JOINT_COLUMNS = COLUMNS["q"]
POSITION = ("x_mm", "y_mm", "z_mm")
ORIENTATION = ("qw", "qx", "qy", "qz")
MEASURED_JOINTS = tuple(f"mq{j}_deg" for j in range(1, 7))
COMMAND_POSITION = ("cmd_x_mm", "cmd_y_mm", "cmd_z_mm")
COMMAND_ORIENTATION = ("cmd_qw", "cmd_qx", "cmd_qy", "cmd_qz")
CONFIGURATION_COLUMNS = ("cf1", "cf4", "cf6", "cfx")
TOOL_POSITION = ("tool_x_mm", "tool_y_mm", "tool_z_mm")
TOOL_ORIENTATION = ("tool_qw", "tool_qx", "tool_qy", "tool_qz")
OBJECT_POSITION = ("wobj_x_mm", "wobj_y_mm", "wobj_z_mm")
OBJECT_ORIENTATION = ("wobj_qw", "wobj_qx", "wobj_qy", "wobj_qz")
PAYLOAD_COLUMNS = COLUMNS["payload"]
WRENCH = COLUMNS["wrench"]
APPROACH = COLUMNS["approach"]
SPEED_COLUMNS = COLUMNS["v"]
ACCELERATION_COLUMNS = COLUMNS["a"]
EXTERNAL_AXES = COLUMNS["external_axes"]
SETUPS = COLUMNS["setup"]
DIRECTION = ("nx", "ny", "nz")
SETUP_READINGS = ("distance_mm", "reading_mm")
TEXT_COLUMNS = ("pose_id", "session", "reflector", "target", *SETUPS)
STANDARD = (
    *(*TEXT_COLUMNS, *JOINT_COLUMNS, *POSITION, *ORIENTATION, *MEASURED_JOINTS, *COMMAND_POSITION),
    *(*COMMAND_ORIENTATION, *CONFIGURATION_COLUMNS, *PAYLOAD_COLUMNS, *WRENCH, *APPROACH, *SPEED_COLUMNS),
    *(*ACCELERATION_COLUMNS, "temperature_C", "time_s", "sigma_mm", *EXTERNAL_AXES),
    *(*TOOL_POSITION, *TOOL_ORIENTATION, *OBJECT_POSITION, *OBJECT_ORIENTATION, *SETUP_READINGS, *DIRECTION),
)


def columns_of(channel: str) -> str:
    """Return a text that names the columns of a channel, ``q1_deg .. q6_deg``; of a user's own, the channel itself."""
    names = COLUMNS.get(channel)
    return channel if names is None else " .. ".join(f"`{name}`" for name in dict.fromkeys((names[0], names[-1])))


def unit_of(column: str) -> str:
    """Return the unit at the end of a standard column's name, ``1`` where it has none."""
    return next((unit for unit in _UNIT_OF_SUFFIX if column.endswith("_" + unit)), "1")


LABELS = frozenset({"pose", "pose id", "point", "point id", "point name", "name", "label", "id", "no", "nr", "punkt"})
EXPANDED = re.compile(r"u[ _]*+(?:[xyz][ _]*+)?(?:\([ _]*+)?95.*", re.IGNORECASE)
"""Expanded uncertainties as instruments call them: U95, U(95), Ux95."""
_JOINT = "(?:j|a|q|axis|axe|achse|eje|asse|joint|joint[ _]?a|gelenk|theta|rob)"
_UR = {"base": "j1", "shoulder": "j2", "elbow": "j3", "wrist1": "j4", "wrist2": "j5", "wrist3": "j6"}
"""What Universal Robots call their joints."""
_ROS = {"shoulderpan": "j1", "shoulderlift": "j2", "elbow": "j3", "wrist1": "j4", "wrist2": "j5", "wrist3": "j6"}
"""The same in its drivers for ROS, each followed by `joint`."""
_RADIANS = re.compile(r"(?:.*_joint|(?:actual|target)_q_?\d|joint_a\d)")
"""Names that ROS (REP 103) and the real-time interface of Universal Robots write: their angles are in radians."""
ZEROTH = frozenset({"actual_q_0", "target_q_0", "actual_q0", "target_q0"})
"""Joints that are counted from 0."""
_WHOSE = "(?:actual|act|ist|measured|measurement|meas|tracker|smr)"
_ENDS = "(?:rad|deg|cmd|command|commanded|set|soll)"
TURN_COLUMNS: Mapping[tuple[str, ...], str] = {
    ("w", "p", "r"): "xyz",
    ("rx", "ry", "rz"): "rotvec",
    ("q0", "q1", "q2", "q3"): "wxyz",
    ("q1", "q2", "q3", "q4"): "wxyz",
    ("roll", "pitch", "yaw"): "xyz",
    ("a", "b", "c"): "ZYX",
    ("o", "a", "t"): "ZYZ",
}
"""What robots call the parts of an orientation, in small letters, and the form that is then usual."""
_COLUMN_WORDS = {"temperature": "temperature_C", "temp": "temperature_C", "time": "time_s", "payload": "payload_kg"}


def nearest(name: str) -> str | None:
    """Return the standard column that a name may be a misspelling of, with the same digits; None for none."""
    for match in difflib.get_close_matches(name, STANDARD, 3, 0.85):
        if re.sub(r"\D", "", match) == re.sub(r"\D", "", name) and match != name:
            return match
    return None


def recognised(header: Sequence[str], units: Sequence[str]) -> dict[str, MappedColumn]:
    """Return standard columns found under another name that states its unit, ``X [mm]`` or ``J1 (rad)``.

    Only those that one column alone may stand for.

    Args:
        header, units: of every column; the unit is empty where a column states none.
    """
    pairs = zip(_meanings(header, units), header, units, strict=True)
    every = [(theirs, name, unit) for name, theirs, unit in pairs if name]
    names = [name for _, name, _ in every]
    lower = {theirs.lower() for theirs in header}
    return {
        name: MappedColumn(name=theirs, unit=unit or "1")
        for theirs, name, unit in every
        if names.count(name) == 1
        and name.lower() not in lower
        and fitting(unit or "1", unit_of(name))
        and name not in TEXT_COLUMNS
    }


def likely_map(header: Sequence[str], units: Sequence[str], needed: Sequence[str] = STANDARD) -> str:
    """Return lines of a column map for columns with names that robots and trackers often use; empty if there are few.

    Joints: J1, A1, axis_1, joint1, theta1, base, shoulder ..; positions: X, px, x [mm], TCP.Y, Actual X .. Units that
    are stated are taken over. At least three columns must be known.

    Args:
        needed: columns of which at least one must be among them.
    """
    entries: dict[str, str] = {}
    for name, theirs, unit in zip(_meanings(header, units), header, units, strict=True):
        unit = unit or ("rad" if name in JOINT_COLUMNS and _RADIANS.fullmatch(theirs.lower()) else "")
        other = unit != unit_of(name) and fitting(unit, unit_of(name))
        entry = f'{{ name = "{theirs}", unit = "{unit}" }}' if other else f'"{theirs}"'
        entries.setdefault(name, f"{name} = {entry}")
    wanted = [name for name in STANDARD if name in entries and name not in header]
    if len(wanted) < 3 or not set(wanted) & set(needed):
        return ""
    guess = "# units that the names do not state are guesses: deg, mm"
    return "\n".join(["[columns]", guess, *(entries[name] for name in wanted)])


def _meanings(header: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return for each column the standard name that its header and unit mean, empty where none is known.

    Joint angles are six: fewer columns q1, q2, .. may be the parts of a quaternion, and are none.
    """
    lower = {theirs.lower() for theirs in header}
    counted = [_counted(theirs) for theirs in header] if lower & ZEROTH else header
    meanings = [_meant(theirs, unit) for theirs, unit in zip(counted, units, strict=True)]
    if set(JOINT_COLUMNS) <= set(meanings):
        return meanings
    pairs = zip(meanings, header, strict=True)
    return ["" if name in JOINT_COLUMNS and theirs.lower().startswith("q") else name for name, theirs in pairs]


def _counted(header: str) -> str:
    """Return the header of a joint that counts from 0 as one from 1: ``actual_q_0`` as ``q1``; others as they are."""
    match = re.fullmatch(r"(?:actual|target)_q_?([0-5])", header.strip().lower())
    return f"q{int(match[1]) + 1}" if match else header


def _meant(header: str, unit: str) -> str:
    """Return the standard name of a column by its header and its unit ("" if none); empty where none is known."""
    plain = re.sub(r"[\[(][^\[(\])]*+[\])]", "", header).strip().lower()
    bare = re.sub("[ _]", "", plain)
    plain = _UR.get(bare) or _ROS.get(bare.removesuffix("joint")) or plain
    if joint := re.fullmatch(rf"(?:robot[ _.])?{_JOINT}[ _.]*+(?:angle[ _.]*+)?([1-6])(?:[ _.]{_ENDS})?", plain):
        return f"q{joint[1]}_deg"
    coordinate = rf"(?:p|pos|position|tcp|point|{_WHOSE})?[ _.]*([xyz])(?:[ _.](?:mm|m|in|{_WHOSE}))?"
    if place := re.fullmatch(coordinate, plain):
        return f"{place[1]}_mm"
    if part := re.fullmatch(r"(?:q|quat|quaternion)[ _.]*([wxyz])", plain):
        return f"q{part[1]}"
    if plain in LABELS:
        return "pose_id"
    return _COLUMN_WORDS.get(plain, "") if unit else ""
