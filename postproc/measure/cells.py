"""Text of a measurement file -> columns of cells, each with its place in the file."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.measure.layout import ColumnMap

LARGEST = 1e100  # larger numbers count as not measured: their squares could not be formed
GROUPED = {
    ".": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:[.]\\d*)?|[-+]?\\d{1,3}(?:,\\d{3})+[.]\\d*"),
    ",": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:,\\d*)?|[-+]?\\d{1,3}(?:[.]\\d{3})+,\\d*"),
}
"""Numbers with marks between thousands, by the decimal sign; 1,193 alone may be either and is not one of them."""
EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})


@dataclass(frozen=True)
class Cells:
    """A table as text.

    Args:
        source: the file.
        header: column names; numbers from 1 where the file has no header.
        rows: cells as text, stripped, every row as long as the header.
        lines: line number of each row.
        decimal: decimal sign.
    """

    source: Source
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    decimal: str

    def span(self, row: int) -> Span:
        start = self.source.line_starts[self.lines[row] - 1]
        return start, start + len(self.source.line(self.lines[row]).encode(self.source.encoding))

    def text(self, name: str) -> list[str]:
        at = self.header.index(name)
        return [row[at] for row in self.rows]

    def numbers(self, name: str, diagnostics: list[Diagnostic]) -> Array:
        """One column as numbers, NaN where a cell is empty.

        A cell that is no number is reported as DAT003 and becomes NaN.
        """
        cells = self.text(name)
        cells = [as_number(cell, self.decimal) for cell in cells]
        try:
            values = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            values = np.full(len(cells), np.nan)
            for i, cell in enumerate(cells):
                if cell.lower() in EMPTY:
                    continue
                try:
                    values[i] = float(cell)
                except ValueError:
                    message = f"`{self.rows[i][self.header.index(name)]}` in column `{name}` is not a number"
                    help_ = "correct the cell or leave it empty; it counts as not measured"
                    diagnostics.append(Diagnostic("DAT003", "warning", message, self.source, self.span(i), help_))
        values[np.abs(values) > LARGEST] = np.nan
        return values


def read_cells(source: Source, layout: ColumnMap, diagnostics: list[Diagnostic]) -> Cells:
    """Split a delimited text file into cells.

    Raises:
        PostprocError: DAT001 where there is no table.
    """
    if source.data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        help_ = "save it again as `CSV UTF-8`, or as plain text"
        raise PostprocError(Diagnostic("DAT001", "error", "this file is written in UTF-16", source, help=help_))
    text = source.data.decode(source.encoding)
    numbered = [
        (number, line.rstrip("\r"))
        for number, line in enumerate(text.removeprefix("\ufeff").split("\n"), start=1)
        if line.strip() and not (layout.comment and line.lstrip().startswith(layout.comment))
    ]
    if len(numbered) < (2 if layout.header else 1):
        raise PostprocError(Diagnostic("DAT001", "error", "there are no measured rows in this file", source))
    if layout.header and not layout.separator:
        numbered = _without_title(numbered, source, diagnostics)
    sample = [line for _, line in numbered[:20]]
    separator = layout.separator or _find_separator(sample)
    decimal = layout.decimal or (
        "," if separator != "," and _counts(sample[1:], ",") > _counts(sample[1:], ".") else "."
    )
    split = [(number, _split(line, separator)) for number, line in numbered]
    header = _header(split[0][1]) if layout.header else tuple(str(i + 1) for i in range(len(split[0][1])))
    body = split[1:] if layout.header else split
    if layout.header and all(_is_number(cell, decimal) for cell in header if cell):
        message = "the first row holds numbers where the column names should be"
        help_ = "add a header row (pose_id,q1_deg,...), or a column map with `header = false`"
        raise PostprocError(Diagnostic("DAT001", "error", message, source, (0, 1), help_))
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, cells in body:
        if len(cells) == len(header) + 1 and not cells[-1].strip():
            cells = cells[:-1]
        if len(cells) != len(header):
            message = f"row {number} has {len(cells)} cells where the header has {len(header)}"
            start = source.line_starts[number - 1]
            help_ = "check for a missing separator or a decimal comma; until then the row is left out"
            diagnostics.append(Diagnostic("DAT004", "warning", message, source, (start, start + 1), help_))
            continue
        rows.append(tuple(cell.strip() for cell in cells))
        lines.append(number)
    if not rows:
        message = "no row has as many cells as the header"
        raise PostprocError(
            Diagnostic("DAT001", "error", message, source, help="check the separator and the decimal sign")
        )
    return Cells(source, header, tuple(rows), tuple(lines), decimal)


def _without_title(
    numbered: list[tuple[int, str]], source: Source, diagnostics: list[Diagnostic]
) -> list[tuple[int, str]]:
    """The lines from the header on: lines before it that have hardly any cells are a title, and said so."""
    marks = [max(line.count(mark) for mark in (";", "\t", ",")) for _, line in numbered[:20]]
    first = next((i for i, count in enumerate(marks) if 2 * count >= max(marks)), 0)
    if first == 0 or len(numbered) - first < 2:
        return numbered
    start = source.line_starts[numbered[0][0] - 1]
    lines = "1 line before the column names is" if first == 1 else f"{first} lines before the column names are"
    message = f"{lines} taken for a title"
    help_ = "start them with `#` if they are, or remove them"
    diagnostics.append(Diagnostic("DAT004", "info", message, source, (start, start + 1), help_))
    return numbered[first:]


def as_number(cell: str, decimal: str) -> str:
    """A number as Python reads it: with a decimal point, without marks between thousands (1'234.5, 1.234,5)."""
    mark = "," if decimal == "." else "."
    if GROUPED[decimal].fullmatch(cell):
        cell = re.sub(f"['\u2019 \u00a0{mark}]", "", cell)
    return cell.replace(",", ".") if decimal == "," else cell


def _find_separator(sample: Sequence[str]) -> str:
    """The separator that splits the header into most cells.

    A comma is the decimal sign where semicolons or tabs do better.
    """
    head = sample[0]
    best = max((";", "\t", ","), key=lambda mark: (head.count(mark), mark == ","))
    return best if head.count(best) else "whitespace"


def _split(line: str, separator: str) -> list[str]:
    if separator == "whitespace":
        return line.split()
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line.replace("\r", " ")], delimiter=separator))
    except csv.Error:  # a cell of more than 131072 letters
        return line.split(separator)


def _header(cells: Sequence[str]) -> tuple[str, ...]:
    return tuple(cell.strip() for cell in cells)


def _counts(lines: Sequence[str], mark: str) -> int:
    return sum(line.count(mark) for line in lines)


def _is_number(cell: str, decimal: str) -> bool:
    try:
        float(cell.replace(decimal, "."))
    except ValueError:
        return False
    return True
