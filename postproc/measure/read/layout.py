"""How another program writes its table: separators, names and units of its columns, the form of its orientations."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from postproc.diagnostics import Source
from postproc.measure.read.values import UNITS
from postproc.tomlfile import FileTable, check, parse_toml

QUATERNIONS = {"wxyz": [1, 2, 3, 0], "xyzw": [0, 1, 2, 3]}
"""Where x, y, z and w stand."""
EULER = re.compile(r"(?!.*(.)\1)(?:[xyz]{3}|[XYZ]{3})")
LAYOUT_FORMS = {"help": "`wxyz`, `xyzw`, `rotvec`, or axes as `xyz` (about fixed ones) or `ZYX` (that turn along)"}


def _known(unit: str) -> str:
    """Return the unit; raise a validation error where it is not in `UNITS`."""
    if unit not in UNITS.keys() | {""}:
        raise PydanticCustomError("unit", f"`{unit}` is no unit of a column", {"help": f"known are {', '.join(UNITS)}"})
    return unit


def _form(form: str) -> str:
    """Return the form of an orientation (`MappedRotation`); raise a validation error where there is no such form."""
    if form not in QUATERNIONS and form != "rotvec" and not EULER.fullmatch(form):
        raise PydanticCustomError("form", f"`{form}` is no form of an orientation", LAYOUT_FORMS)
    return form


def _stripped(name: object) -> object:
    """Return a name without the blanks around it; other values as they are."""
    return name.strip() if isinstance(name, str) else name


def _numbered(name: object) -> object:
    """Return a column's number as text; other values as they are."""
    return str(name) if type(name) is int else name


Name = Annotated[str | int, BeforeValidator(_stripped)]
"""A column by its header, without the blanks around it, or by its number."""


class MappedColumn(FileTable):
    """Where a standard column stands in another layout.

    Args:
        name: header of the column there, or its number counted from 1 where there is no header.
        unit: its unit, a key of ``UNITS``; empty for the one that the column states, or the standard one.
        minus: a column in the same unit that is taken off it (measured = tracker - correction).
        sign: +1, or -1 for an axis that counts the other way.
        factor: by which it is multiplied: 0.5 makes a standard deviation of an expanded uncertainty U(95).
        offset: added after sign and factor, in the column's own unit (another joint zero).
    """

    name: Name
    unit: Annotated[str, AfterValidator(_known)] = ""
    minus: Name | None = None
    sign: float = 1.0
    factor: float = 1.0
    offset: float = 0.0


def _by_its_name(value: object) -> object:
    """Return a bare name or number as the table ``{name = ..}``; other values as they are."""
    return {"name": value} if isinstance(value, str | int) else value


Column = Annotated[MappedColumn, BeforeValidator(_by_its_name, json_schema_input_type=MappedColumn | str | int)]


class MappedRotation(FileTable):
    """Where and how another layout writes orientations.

    Args:
        columns: three angles or components, or the four of a quaternion.
        form: ``wxyz``, ``xyzw``, ``rotvec``, or the axes of three turns as scipy names them: small letters about fixed
            axes (roll, pitch, yaw: ``xyz``), capitals about axes that turn along (KUKA's A, B, C: ``ZYX``).
        unit: ``deg``, ``rad`` or ``mrad`` of angles; empty for the one that the columns state, or the form's usual one.
    """

    columns: tuple[Annotated[str, BeforeValidator(_numbered), BeforeValidator(_stripped)], ...]
    form: Annotated[str, AfterValidator(_form)]
    unit: Literal["", "1", "deg", "rad", "mrad"] = ""

    @model_validator(mode="after")
    def _as_many_as_the_form_has(self) -> MappedRotation:
        """Raise a validation error unless the number of columns and the unit suit the form."""
        many = 4 if self.form in QUATERNIONS else 3
        if len(self.columns) != many:
            help_ = {"help": "name them in `columns`"}
            raise PydanticCustomError("columns", f"`{self.form}` has {many} columns", help_)
        if (self.unit not in ("", "1") and many == 4) or (self.unit == "1" and many == 3):
            raise PydanticCustomError("unit", f"`{self.form}` has no unit `{self.unit}`", {"help": "leave it out"})
        return self


class ColumnMap(FileTable):
    """How another program writes its table.

    Args:
        columns: standard column, or the name of a channel -> its place there, or just its name. Standard names found in
            the header need no entry.
        separator: one character, ``whitespace``, or None to find it out.
        decimal: ``.`` or ``,``; None to find it out.
        comment: lines that begin so are skipped.
        header: False where the first row already holds numbers.
        references: names of reflectors that stand beside the arm, where their rows do not show it.
        anchor_offset: whether distances from an anchor begin at zero (``none``) or have an offset of their own that a
            fit finds (``free``).
        orientation, cmd_orientation: measured and commanded orientations that are no ``qw`` .. ``qz``.
    """

    columns: dict[str, Column] = {}
    separator: Annotated[str, Field(pattern=r"^([^\n]|whitespace)$")] | None = None
    decimal: Literal[".", ","] | None = None
    comment: str = "#"
    header: bool = True
    references: tuple[str, ...] = ()
    anchor_offset: Literal["none", "free"] = "none"
    orientation: MappedRotation | None = None
    cmd_orientation: MappedRotation | None = None

    @property
    def orientation_columns(self) -> set[str]:
        """Headers or numbers of the columns that the map reads as orientations."""
        return {name for mapped in (self.orientation, self.cmd_orientation) if mapped for name in mapped.columns}


def read_column_map(source: Source | None) -> ColumnMap:
    """Return the column map of a TOML file; an empty one for None.

    Raises:
        PostprocError: DAT002 for an unknown key, a wrong column or unit.
    """
    return ColumnMap() if source is None else check(ColumnMap, parse_toml(source, "DAT002"), source, "DAT002")
