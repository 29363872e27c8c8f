"""The columns of a measurement table, their units, and maps from other layouts.

Units stand in the column names of the standard layout; a column map names the columns of another layout and their
units.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from postproc.diagnostics import Diagnostic, PostprocError, Source

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
    "s": 1.0,
    "min": 60.0,
    "h": 3600.0,
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


@dataclass(frozen=True, slots=True)
class ColumnMap:
    """How another program writes its table.

    Args:
        columns: standard column -> its place there. Standard names found in the header need no entry.
        separator: one character, ``whitespace``, or None to find it out.
        decimal: ``.`` or ``,``; None to find it out.
        comment: lines that begin so are skipped.
        header: False where the first row already holds numbers.
    """

    columns: Mapping[str, MappedColumn] = field(default_factory=dict)
    separator: str | None = None
    decimal: str | None = None
    comment: str = "#"
    header: bool = True


def read_column_map(source: Source | Mapping[str, Any] | None) -> ColumnMap:
    """The column map in a TOML file (``separator``, ``decimal``, ``comment``, ``header``, ``[columns]``).

    ``[columns]`` maps a standard name to ``"their name"`` (same unit) or to ``{name = "J1", unit = "rad", sign = -1,
    offset = 90}``.

    Raises:
        PostprocError: DAT002 for an unknown key, column or unit.
    """
    if source is None:
        return ColumnMap()
    where = source if isinstance(source, Source) else None
    try:
        table = tomllib.loads(source.data.decode(source.encoding)) if isinstance(source, Source) else dict(source)
    except tomllib.TOMLDecodeError as error:
        raise _map_error(f"the column map is not TOML: {error}", where) from None
    entries = table.pop("columns", {})
    settings = {key: table.pop(key) for key in ("separator", "decimal", "comment", "header") if key in table}
    if table or not isinstance(entries, Mapping):
        names = ", ".join(f"`{key}`" for key in table) or "`columns`"
        raise _map_error(f"the column map has no setting {names}", where)
    columns = {key: _mapped(key, value, where) for key, value in entries.items()}
    return ColumnMap(columns=columns, **settings)


def _mapped(key: str, value: object, where: Source | None) -> MappedColumn:
    if isinstance(value, str | int):
        return MappedColumn(value, unit_of(key))
    if not isinstance(value, Mapping) or not set(value) <= {"name", "unit", "sign", "offset"} or "name" not in value:
        raise _map_error(f"column `{key}` needs a name, or a table with name, unit, sign, offset", where)
    unit = str(value.get("unit", unit_of(key)))
    if unit not in UNITS:
        raise _map_error(f"column `{key}` has the unit `{unit}`; known are {', '.join(UNITS)}", where)
    return MappedColumn(value["name"], unit, float(value.get("sign", 1)), float(value.get("offset", 0)))


def _map_error(message: str, where: Source | None) -> PostprocError:
    help_ = "see `postproc explain DAT002` for a column map that works"
    return PostprocError(Diagnostic("DAT002", "error", message, where, help=help_))


def likely_map(header: Sequence[str]) -> str:
    """The lines of a column map for columns that are called as robots and trackers often call them; empty if none are.

    Joints: J1, A1, axis_1, joint1, theta1 ..; positions: X, px, x [mm], TCP.Y ... Units in brackets are taken over.
    """
    found: dict[str, str] = {}
    for theirs in header:
        plain = re.sub(r"[\[(].*?[\])]", "", theirs).strip().lower()
        unit = next((u for u in re.findall(r"[\[(]\s*(\w+)\s*[\])]", theirs) if u in UNITS), "")
        joint = re.fullmatch(r"(?:j|a|q|axis|joint|theta|rob)[ _.]*(?:angle)?[ _.]*([1-6])(?:[ _.](rad|deg))?", plain)
        place = re.fullmatch(r"(?:p|pos|position|tcp|point|meas|measured)?[ _.]*([xyz])(?:[ _.](mm|m|in))?", plain)
        if joint:
            name, unit = f"q{joint[1]}_deg", unit or joint[2] or ""
        elif place:
            name, unit = f"{place[1]}_mm", unit or place[2] or ""
        else:
            continue
        other = unit and unit != unit_of(name)
        found.setdefault(
            name, f'{name} = {{ name = "{theirs}", unit = "{unit}" }}' if other else f'{name} = "{theirs}"'
        )
    wanted = [name for name in (*JOINTS, *POSITION) if name in found and name not in header]
    return "\n".join(["[columns]", *(found[name] for name in wanted)]) if len(wanted) >= 3 else ""
