"""The columns of a table by their standard names, in SI; what is missing or not understood is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Severity
from postproc.measure.read import columns as names
from postproc.measure.read.cells import Cells
from postproc.measure.read.columns import unit_of
from postproc.measure.read.layout import QUATERNIONS, ColumnMap, MappedColumn, MappedRotation
from postproc.measure.read.turns import Turns
from postproc.measure.read.values import EMPTY_CELLS, UNITS, fitting, seconds

UNIT_LENGTH = 1e-2
"""By so much the length of a quaternion may differ from 1."""
UNIT_OF_FORM = {"wxyz": "1", "xyzw": "1", "rotvec": "rad"}
"""Units of orientations that state none; others are in degrees."""


class Table:
    """Cells looked up by standard column name, converted to SI."""

    def __init__(self, cells: Cells, layout: ColumnMap, diagnostics: list[Diagnostic]) -> None:
        self.cells = cells
        self.diagnostics = diagnostics
        self.layout = layout
        self.place = self._find(layout)

    def _find(self, layout: ColumnMap) -> dict[str, MappedColumn]:
        """Return the place and unit of every standard column and channel that the table has.

        They are found by the column map, the standard name, or another known name, which is reported (DAT015); DAT002
        is raised for columns that are missing or ambiguous.
        """
        header, units = self.cells.header, self.cells.units
        lower = {theirs.lower(): theirs for theirs in reversed(header)}
        place = {
            name: self._in_its_unit(name, MappedColumn(name=name if name in header else lower[name.lower()]))
            for name in names.STANDARD
            if name.lower() in lower and name not in layout.columns
        }
        stated = {name: self._in_its_unit(name, m) for name, m in layout.columns.items()}
        mapped = {header[self.cells.at(m.name)] for m in stated.values()}
        mapped |= {header[self.cells.at(m.minus)] for m in stated.values() if m.minus is not None}
        mapped |= layout.orientation_columns
        known = names.recognised(header, units)
        taken = {k: m for k, m in known.items() if m.name not in mapped and k not in layout.columns}
        if not {"time_s"} & (place.keys() | taken.keys() | layout.columns.keys()):
            free = [theirs for theirs in header if theirs not in mapped]
            stamped = [theirs for theirs in free if names.named(theirs) == "time_s"]
            if stamped and self._stamps(stamped[0]) is not None:
                taken["time_s"] = MappedColumn(name=stamped[0], unit="s")
        if taken:
            pairs = ", ".join(f"`{m.name}` as `{name}`" for name, m in taken.items())
            message = f"columns are known by their names and units: {pairs}"
            self.say("DAT015", "info", message, "a column map overrules it")
        for name in layout.columns:
            near = None if name in names.STANDARD else names.nearest(name)
            if near is not None:
                message = f"the column map has `{name}`, which is no standard column and is kept as a channel"
                self.say("DAT015", "warning", message, f"did you mean `{near}`?")
        place |= taken | stated
        for name, mapped_column in place.items():
            self._once(name, mapped_column.name)
        return place

    def _in_its_unit(self, name: str, wanted: MappedColumn) -> MappedColumn:
        """Return a column with its unit: that of the map, else the one it states if that fits, else the standard.

        Args:
            name: the standard column or channel that it stands for; wanted: where it stands, as the map says.
        """
        at = self.cells.at(wanted.name)
        if at < 0:
            raise self._no_such(wanted.name, name)
        if wanted.minus is not None and self.cells.at(wanted.minus) < 0:
            raise self._no_such(wanted.minus, name)
        stated, standard = self.cells.units[at], unit_of(name)
        known = fitting(stated, standard) or (name not in names.STANDARD and stated in UNITS)
        if stated and not known and not wanted.unit and name not in names.TEXT_COLUMNS:
            message = f"column `{self.cells.header[at]}` states the unit `{stated}`; `{name}` is read in {standard}"
            self.say("DAT015", "warning", message, "give the unit in a column map")
        return wanted.model_copy(update={"unit": wanted.unit or (stated if stated and known else standard)})

    def _once(self, name: str, theirs: str | int) -> None:
        """Raise DAT002 where the header ``theirs``, read as ``name``, stands over two columns that differ."""
        header = self.cells.header
        same = [k + 1 for k, other in enumerate(header) if other == theirs]
        if len(same) > 1 and any(self.cells.text(k) != self.cells.text(same[0]) for k in same):
            listed = " and ".join(map(str, same))
            message = f"columns {listed} are both called `{theirs}`: which of them is `{name}`?"
            help_ = f"rename one, or give its number in a column map: {name} = {same[0]}"
            raise PostprocError.of("DAT002", message, self.cells.source, help=help_)

    def _no_such(self, theirs: str | int, wanted: str) -> PostprocError:
        """Return the exception DAT002: the map names the column ``theirs`` for ``wanted``, and the table lacks it."""
        message = f"the column map names `{theirs}` for `{wanted}`, and the table has no such column"
        return PostprocError.of("DAT002", message, self.cells.source, help=missing_help(self.cells))

    def say(self, code: str, severity: Severity, message: str, help_: str, row: int | None = None) -> None:
        """Add a finding about the table to ``diagnostics``, at a row (index from 0) where one is given."""
        self.diagnostics.append(self.cells.finding(code, severity, message, help_, row))

    def text(self, name: str) -> list[str]:
        """Return one column as it is written; an empty list where the table lacks it."""
        return self.cells.text(self.place[name].name) if name in self.place else []

    def column(self, name: str, fill: float | str | None = None) -> Array | None:
        """Return (n,) one column in SI, NaN in gaps; None where the table lacks it.

        Args:
            name: standard name or channel.
            fill: value in gaps: a number, the ``median``, or what lies ``between`` the rows before and after; reported
                as DAT005. The result is None where all is empty.
        """
        if name not in self.place:
            return None
        mapped = self.place[name]
        stamps = self._stamps(mapped.name) if name == "time_s" else None
        if stamps is None:
            cure = ("write sides as +1, -1 or 0",) if name in names.APPROACH else ()
            values = self.cells.numbers(mapped.name, self.diagnostics, *cure)
            if mapped.minus is not None:
                values = values - self.cells.numbers(mapped.minus, self.diagnostics)
            values = mapped.sign * mapped.factor * values + mapped.offset
            values = (values - np.nanmin(values) if mapped.unit == "d" else values) * UNITS[mapped.unit]
        else:
            values = stamps
        gaps = ~np.isfinite(values)
        if fill is None or not gaps.any():
            return values
        if gaps.all():
            return None
        row = np.arange(len(values))
        known = values[~gaps]
        value: Any = float(np.median(known)) if fill == "median" else fill
        taken = "what lies between its neighbours"
        if fill == "between":
            value = np.interp(row, row[~gaps], known)
        else:
            taken = f"{value / UNITS[mapped.unit]:g}"
        message = f"column `{mapped.name}` is empty in {gaps.sum()} of {len(values)} rows; {taken} is taken there"
        first = int(np.flatnonzero(gaps)[0])
        self.say("DAT005", "warning", message, "fill in the cells, or remove the column", first)
        return np.where(gaps, value, values)

    def vector(
        self, wanted: Sequence[str], fill: float | None = None, partial: bool = False, absent: float = 0.0
    ) -> Array | None:
        """Return (n, k) several columns in SI; None where the table has none of them.

        Args:
            wanted: standard names; fill: value in gaps and for missing columns, with a warning.
            partial: whether some of the columns are enough; absent: value of the others then.

        Raises:
            PostprocError: DAT002 where some are missing that nothing fills.
        """
        present = [name for name in wanted if name in self.place]
        if not present:
            return None
        if len(present) < len(wanted) and not partial:
            missing = ", ".join(f"`{name}`" for name in wanted if name not in present)
            severity: Severity = "warning" if fill is not None else "error"
            self.say("DAT002", severity, f"there is a column `{present[0]}` and no {missing}", missing_help(self.cells))
            if fill is None:
                raise PostprocError(self.diagnostics.pop())
        nothing = np.full(len(self.cells.rows), absent)
        parts = [self.column(name, fill) for name in wanted]
        return np.stack([nothing if part is None else part for part in parts], axis=1)

    def turns(self, wanted: Sequence[str], mapped: MappedRotation | None) -> Turns | None:
        """Return orientations from the columns of a quaternion, or as the column map says; None where there are none.

        Args:
            wanted: standard names of the quaternion's columns, w first; mapped: the entry of the column map.
        """
        if mapped is None:
            quaternion = self.vector(wanted)
            columns = tuple(str(self.place[name].name) for name in wanted if name in self.place)
            return None if quaternion is None else self._of_length_one(Turns(quaternion, "wxyz", "1", columns))
        unknown = [name for name in mapped.columns if self.cells.at(name) < 0]
        if unknown:
            raise self._no_such(unknown[0], "an orientation")
        numbers = np.stack([self.cells.numbers(name, self.diagnostics) for name in mapped.columns], axis=1)
        stated = {self.cells.units[self.cells.at(name)] for name in mapped.columns} & {"deg", "rad", "mrad"}
        unit = mapped.unit or (stated.pop() if len(stated) == 1 else UNIT_OF_FORM.get(mapped.form, "deg"))
        turns = Turns(numbers * UNITS[unit], mapped.form, unit, mapped.columns)
        return self._of_length_one(turns) if mapped.form in QUATERNIONS else turns

    def _of_length_one(self, turns: Turns) -> Turns:
        """Return quaternions, NaN where their length is not 1 to a hundredth; the first five are reported (DAT008)."""
        length = np.linalg.norm(turns.numbers, axis=1)
        bad = np.abs(length - 1) > UNIT_LENGTH
        for i in np.flatnonzero(bad)[:5]:
            message = f"the quaternion of this row has the length {length[i]:.4f}, not 1; its orientation is not used"
            self.say("DAT008", "warning", message, "check columns qw,qx,qy,qz", int(i))
        return replace(turns, numbers=np.where(bad[:, None], np.nan, turns.numbers))

    def _stamps(self, name: str | int) -> Array | None:
        """Return (n,) seconds since the earliest of a column of time stamps; None where it holds anything else."""
        cells = ["" if cell.lower() in EMPTY_CELLS else cell for cell in self.cells.text(name)]
        return seconds(cells) if self.has_words(name) else None

    def has_words(self, name: str | int) -> bool:
        """Return whether a column holds cells that are neither numbers nor empty."""
        pairs = zip(self.cells.text(name), self.cells.numbers(name, []), strict=True)
        return any(cell.lower() not in EMPTY_CELLS for cell, value in pairs if not np.isfinite(value))


def missing_help(cells: Cells, wanted: Sequence[str] = names.STANDARD, otherwise: str = "") -> str:
    """Return help for missing columns: the columns that the table has, and a column map that may be meant.

    Args:
        wanted: standard columns that are looked for.
        otherwise: what to do where no other column looks like any of them.
    """
    shown = ", ".join(cells.header[:8]) + (", ..." if len(cells.header) > 8 else "")
    likely = names.likely_map(cells.header, cells.units, wanted)
    if likely:
        proposal = "if these are meant, give a column map (`--columns FILE.toml`) with the lines:"
        return f"the table has the columns {shown}; {proposal}\n{likely}"
    help_ = otherwise or "name others with a column map (`postproc explain DAT002`)"
    return f"the table has the columns {shown}; {help_}"
