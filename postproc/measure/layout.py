"""How another program writes its table: separators, names and units of its columns, the form of its orientations."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from postproc.diagnostics import PostprocError, Source
from postproc.measure.columns import MappedColumn
from postproc.measure.units import UNITS

SETTINGS = ("separator", "decimal", "comment", "header")
ORIENTATIONS = ("orientation", "cmd_orientation")
EULER = re.compile(r"(?!.*(.)\1)(?:[xyz]{3}|[XYZ]{3})")


@dataclass(frozen=True, slots=True)
class MappedRotation:
    """Where and how another layout writes orientations.

    Args:
        columns: three angles or components, or the four of a quaternion.
        form: ``wxyz``, ``xyzw``, ``rotvec``, or the axes of three turns as scipy names them: small letters about fixed
            axes (roll, pitch, yaw: ``xyz``), capitals about axes that turn along (KUKA's A, B, C: ``ZYX``).
        unit: ``deg``, ``rad`` or ``mrad`` of angles; empty for the one that the columns state, or the form's usual one.
    """

    columns: tuple[str, ...]
    form: str
    unit: str


@dataclass(frozen=True, slots=True)
class ColumnMap:
    """How another program writes its table.

    Args:
        columns: standard column -> its place there. Standard names found in the header need no entry.
        separator: one character, ``whitespace``, or None to find it out.
        decimal: ``.`` or ``,``; None to find it out.
        comment: lines that begin so are skipped.
        header: False where the first row already holds numbers.
        rotations: ``orientation`` (measured) and ``cmd_orientation`` where they are no ``qw`` .. ``qz``.
    """

    columns: Mapping[str, MappedColumn] = field(default_factory=dict)
    rotations: Mapping[str, MappedRotation] = field(default_factory=dict)
    separator: str | None = None
    decimal: str | None = None
    comment: str = "#"
    header: bool = True


def read_column_map(source: Source | Mapping[str, Any] | None) -> ColumnMap:
    """The column map in a TOML file (``separator``, ``decimal``, ``comment``, ``header``, and tables).

    ``[columns]`` maps a standard name, or the name of a channel, to ``"their name"`` (the unit that it states, or the
    same) or to ``{name = "J1",
    unit = "rad", sign = -1, offset = 90}``; ``[orientation]`` has ``columns``, ``form``, ``unit`` (`MappedRotation`).

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
    settings = {key: table.pop(key) for key in SETTINGS if key in table}
    rotations = {key: _rotation(key, table.pop(key), where) for key in ORIENTATIONS if key in table}
    if table or not isinstance(entries, Mapping):
        names = ", ".join(f"`{key}`" for key in table) or "`columns`"
        raise _map_error(f"the column map has no setting {names}", where)
    columns = {key: _mapped(key, value, where) for key, value in entries.items()}
    return ColumnMap(columns=columns, rotations=rotations, **settings)


def _rotation(key: str, value: object, where: Source | None) -> MappedRotation:
    form = str(value.get("form", "")) if isinstance(value, Mapping) else ""
    quaternion = form in ("wxyz", "xyzw")
    if not isinstance(value, Mapping) or not (quaternion or form == "rotvec" or EULER.fullmatch(form)):
        help_ = "`wxyz`, `xyzw`, `rotvec`, or axes as `xyz` (about fixed ones) or `ZYX` (that turn along)"
        raise _map_error(f"`[{key}]` needs a form: {help_}", where)
    names, many = value.get("columns"), 4 if quaternion else 3
    unit = str(value.get("unit", ""))
    if not isinstance(names, list) or len(names) != many or set(value) - {"columns", "form", "unit"}:
        raise _map_error(f"`[{key}]` needs `columns`, the names of {many} columns", where)
    if unit not in (("", "1") if quaternion else ("", "deg", "rad", "mrad")):
        raise _map_error(f"`[{key}]` has the unit `{unit}`; known are deg, rad, mrad", where)
    return MappedRotation(tuple(str(name) for name in names), form, unit)


def _mapped(key: str, value: object, where: Source | None) -> MappedColumn:
    if isinstance(value, str | int):
        return MappedColumn(value, "")
    if not isinstance(value, Mapping) or not set(value) <= {"name", "unit", "sign", "offset"} or "name" not in value:
        raise _map_error(f"column `{key}` needs a name, or a table with name, unit, sign, offset", where)
    unit = str(value.get("unit", ""))
    if unit not in UNITS.keys() | {""}:
        raise _map_error(f"column `{key}` has the unit `{unit}`; known are {', '.join(UNITS)}", where)
    return MappedColumn(value["name"], unit, float(value.get("sign", 1)), float(value.get("offset", 0)))


def _map_error(message: str, where: Source | None) -> PostprocError:
    help_ = "see `postproc explain DAT002` for a column map that works"
    return PostprocError.of("DAT002", message, where, help=help_)
