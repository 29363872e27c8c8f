"""The columns of a measurement table: standard names, whose ends are their units, and what other programs call them."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

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
MEASURED = (*POSITION, *ORIENTATION, *MEASURED_JOINTS, *SETUP_READINGS)
"""What is read off an instrument and filled in."""
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


EXPANDED = re.compile(r"u[ _]*+(?:[xyz][ _]*+)?(?:\([ _]*+)?95.*", re.IGNORECASE)
"""Expanded uncertainties as instruments call them: U95, U(95), Ux95."""
_UR = {"base": "j1", "shoulder": "j2", "elbow": "j3", "wrist1": "j4", "wrist2": "j5", "wrist3": "j6"}
"""What Universal Robots call their joints."""
_ROS = {"shoulderpan": "j1", "shoulderlift": "j2", "elbow": "j3", "wrist1": "j4", "wrist2": "j5", "wrist3": "j6"}
"""The same in its drivers for ROS, each followed by `joint`."""
_RADIANS = re.compile(r"(?:.*_joint|(?:actual|target)_q_?\d|joint_a\d)")
"""Names that ROS (REP 103) and the real-time interface of Universal Robots write: their angles are in radians."""
ZEROTH = frozenset({"actual_q_0", "target_q_0", "actual_q0", "target_q0"})
"""Joints that are counted from 0."""
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
    """Return the standard name of a column by its header and its unit ("" if none); empty where none is known.

    Axes and coordinates need no unit; other quantities do, and texts (`pose_id`, `session`, `target`) have none.
    """
    bare = bare_name(header)
    bare = _UR.get(bare) or _ROS.get(bare.removesuffix("joint")) or bare
    words = column_words()
    if joint := words.joint.fullmatch(bare):
        return f"q{joint[1]}_deg"
    if place := words.place.fullmatch(bare):
        return f"{place[1]}_mm"
    if part := re.fullmatch(r"(?:q|quat|quaternion)([wxyz])", bare):
        return f"q{part[1]}"
    name = words.columns.get(bare, "")
    return name if unit or name in TEXT_COLUMNS else ""


def named(header: str) -> str:
    """Return the standard column that a header may mean, whatever its unit; empty for none, an axis or a coordinate."""
    words, bare = column_words(), bare_name(header)
    return words.columns.get(bare) or words.possible.get(bare, "")


def bare_name(header: str) -> str:
    """Return a header in small letters without units in brackets, blanks and the signs between words."""
    return re.sub(r"[\s_.\-:/#]", "", re.sub(r"[\[(][^\[(\])]*+[\])]", "", header)).lower()


class ColumnWords(NamedTuple):
    """What columns are called elsewhere (``words.toml``), as `bare_name` gives it.

    Args:
        joint, place: patterns of a joint angle with its number and of a coordinate with its letter.
        columns: standard column by name; possible: the same of names that have other meanings, too.
    """

    joint: re.Pattern[str]
    place: re.Pattern[str]
    columns: Mapping[str, str]
    possible: Mapping[str, str]


@cache
def column_words() -> ColumnWords:
    """Read ``words.toml``."""
    data = tomllib.loads(Path(__file__).with_name("words.toml").read_text("utf-8"))
    joint, position, commanded, measured = (
        "|".join(sorted(map(re.escape, data[key]), key=len, reverse=True))
        for key in ("joint", "position", "commanded", "measured")
    )
    return ColumnWords(
        re.compile(rf"(?:robot)?(?:{commanded})?(?:{joint}){{1,2}}(?:angle|winkel)?([1-6])(?:rad|deg|{commanded})?"),
        re.compile(rf"(?:{position}|{measured})?([xyz])(?:mm|m|in|{measured})?"),
        *({word: name for name, words in data[key].items() for word in words} for key in ("columns", "possible")),
    )
