"""Text of a measurement file, or a sheet of a workbook -> columns of cells, each with its place in the file."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, time
from typing import TYPE_CHECKING
from zipfile import ZipFile

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Severity, Source, Span
from postproc.files import is_program
from postproc.measure.read.layout import ColumnMap
from postproc.measure.read.values import EMPTY_CELLS, as_number, find_decimal, holds_numbers, is_unit, stated_unit
from postproc.numbers import read_number

if TYPE_CHECKING:
    from openpyxl import Workbook

LARGEST_READING = 1e100  # larger numbers count as not measured: their squares could not be formed
NINES = re.compile(r"[-+]?9{3,}(?:[.,][90]*)?")
"""What many instruments write where they saw nothing."""
NUMBER_WITH_UNIT = re.compile(r"[-+]?\d++(?:[.,]\d*+)?\s*+[^\d\s.,;:/-]")
SAMPLE = 20
MOST_TABLE_ROWS = 300_000
"""Of a table: `predict` takes 40 s and 0.6 GB for them."""
BLANK_CHARACTERS = " \t,;"
"""What a spreadsheet writes for a line in which nothing stands."""
MARK = b"PK"
"""The first bytes of a zip archive, which a workbook is."""
MOST_CELLS, MOST_BYTES = 2_000_000, 256_000_000
"""Of a workbook, with its empty cells, and unpacked: counted before anything is kept."""


@dataclass(frozen=True)
class Cells:
    """A table as text.

    Args:
        source: the file as UTF-8 with line feeds.
        header: column names; numbers from 1 where the file has no header.
        units: the unit that each column states, in its name or in a row of units; empty where it states none.
        rows: cells as text, stripped, every row as long as the header.
        lines: line number of each row.
        decimal: decimal sign.
    """

    source: Source
    header: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    decimal: str

    def span(self, row: int) -> Span:
        """Return the byte offsets (start, end) of a row, by its index from 0, in the file."""
        return self.source.line_span(self.lines[row])

    def finding(self, code: str, severity: Severity, message: str, help_: str = "", row: int | None = 0) -> Diagnostic:
        """Return a finding at a row, by its index from 0; about the file as a whole for None."""
        return Diagnostic(code, severity, message, self.source, None if row is None else self.span(row), help_)

    def at(self, name: str | int) -> int:
        """Return the index of a column by its name, or by its number from 1; -1 where there is none."""
        if isinstance(name, int):
            return name - 1 if 0 < name <= len(self.header) else -1
        return self.header.index(name) if name in self.header else -1

    def text(self, name: str | int) -> list[str]:
        """Return the cells of one column as they are written."""
        at = self.at(name)
        return [row[at] for row in self.rows]

    def numbers(
        self, name: str | int, diagnostics: list[Diagnostic], help_: str = "correct the cell or leave it empty"
    ) -> Array:
        """Return (n,) one column as numbers, NaN where a cell is empty.

        Signs alone are 1 and -1 where a plus occurs. Cells that are no numbers (DAT003), and nines far from all other
        values (DAT005), are reported and become NaN; where most cells are no numbers, that is an error.

        Args:
            name: header or number from 1; diagnostics: gets the findings; help_: what they advise.
        """
        cells = self.text(name)
        if "+" in cells:
            cells = [f"{cell}1" if cell in ("+", "-", "\u2212") else cell for cell in cells]
        cells = [as_number(cell, self.decimal) for cell in cells]
        values, wrong = np.full(len(cells), np.nan), list[int]()
        for i, cell in enumerate(cells):
            try:
                values[i] = read_number(cell) if cell and cell.lower() not in EMPTY_CELLS else np.nan
            except ValueError:
                wrong.append(i)
        huge = np.abs(values) > LARGEST_READING
        values[huge] = np.nan
        diagnostics += self._wrong(np.flatnonzero(huge).tolist(), name, "DAT005", "is no measured number", help_)
        if any(NUMBER_WITH_UNIT.match(cells[i]) for i in wrong):
            help_ = "write the number alone, and its unit behind the column's name: `X [mm]`"
        diagnostics += self._wrong(wrong, name, "DAT003", "is not a number", help_)
        if 2 * len(wrong) > np.isfinite(values).sum() + len(wrong) and diagnostics:
            # So many are no slips: the column is not what it is taken for.
            diagnostics[-1] = replace(diagnostics[-1], severity="error")
        nines = np.array([bool(NINES.fullmatch(cell)) for cell in cells])
        others = values[~nines & np.isfinite(values)]
        if nines.any() and len(others):
            away = np.abs(values - (others.max() + others.min()) / 2) > 1.5 * np.ptp(others)
            values[nines & away] = np.nan
            what = "is far from all other values there, as instruments write what they did not see"
            rows = np.flatnonzero(nines & away).tolist()
            diagnostics += self._wrong(rows, name, "DAT005", what, "leave such cells empty")
        return values

    def _wrong(self, rows: list[int], name: str | int, code: str, what: str, help_: str) -> list[Diagnostic]:
        """Return one finding about cells of a column, at the first of some rows; none where there are no rows.

        Args:
            rows: indices from 0; what: end of the message, after the cell and the column; help_: what to do.
        """
        if not rows:
            return []
        at = self.at(name)
        others = f" (and {len(rows) - 1} more)" if rows[1:] else ""
        message = f"`{self.rows[rows[0]][at]}`{others} in column `{self.header[at]}` {what}"
        return [self.finding(code, "warning", message, f"{help_}; it counts as not measured", rows[0])]


def read_cells(source: Source, layout: ColumnMap, diagnostics: list[Diagnostic], every: bool = False) -> Cells:
    """Split a delimited text file, or the fullest sheet of a workbook, into cells.

    Args:
        layout: separator, decimal sign, comments and header, as far as the user states them.
        diagnostics: gets the findings.
        every: a row that has not as many cells as the header stays, with all cells but the first emptied; else it is
            left out.

    Raises:
        PostprocError: DAT001 where there is no table.
    """
    source = _as_text(source, diagnostics)
    if (count := source.data.count(b"\n")) > MOST_TABLE_ROWS:
        message = f"this table has {count:,} rows, and at most {MOST_TABLE_ROWS:,} are read"
        raise _no_table(message, source, "take every n-th row, or a part of the table at a time")
    text = source.data.decode(source.encoding)
    if is_program(text):
        help_ = "name the table of what was measured; where it names targets of this program (column `target`), add "
        help_ += f"`--program {source.path}`"
        raise _no_table("this is a RAPID program, not a table of measured poses", source, help_)
    numbered = [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=1)
        if line.strip(BLANK_CHARACTERS) and not (layout.comment and line.lstrip().startswith(layout.comment))
    ]
    if len(numbered) < (2 if layout.header else 1):
        help_ = "a table has a line of column names and below it a line for each row; export it as CSV"
        raise _no_table("there are no rows in this file", source, help_)
    separator = layout.separator or _find_separator([line for _, line in numbered[:SAMPLE]], layout.header)
    split = [(number, [cell.strip() for cell in _split(line, separator)]) for number, line in numbered]
    decimal = layout.decimal or find_decimal([cell for _, cells in split[:SAMPLE] for cell in cells])
    if layout.header:
        header, units, body = _heading(split, decimal, source, diagnostics)
    else:
        header, body = [str(i + 1) for i in range(len(split[0][1]))], split
        units = ["" for _ in header]
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    for number, cells in body:
        if len(cells) == len(header) + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) != len(header):
            message = f"row {number} has {len(cells)} cells where the header has {len(header)}"
            then = "nothing is told of it" if every else "the row is left out"
            help_ = f"check for a missing separator or a decimal comma; until then {then}"
            if separator == "," and (split_at := _split_numbers(cells, header)):
                written, column = split_at[0]
                message += f": `{written}` in column `{column}` has a decimal comma"
                help_ = f"write `{written.replace(',', '.')}`, or put the cell in quotes; until then {then}"
            diagnostics.append(Diagnostic("DAT004", "warning", message, source, _start(source, number), help_))
            if not every:
                continue
            cells = [cells[0], *("" for _ in header[1:])]
        rows.append(tuple(cells))
        lines.append(number)
    if all(not any(row) for row in rows):
        raise _unlike_its_header(body, header, separator, source)
    return Cells(source, tuple(header), tuple(units), tuple(rows), tuple(lines), decimal)


def _unlike_its_header(
    body: Sequence[tuple[int, list[str]]], header: Sequence[str], separator: str, source: Source
) -> PostprocError:
    """Return DAT001 for a table of which no row has as many cells as its header.

    Args:
        body: line number and cells of each row; header: names of the columns.
    """
    most = Counter(len(cells) for _, cells in body).most_common(1)
    others = f"rows have {most[0][0]}" if most else "there is no other row"
    message = f"no row has as many cells as the header: it has {len(header)}, {others}"
    help_ = "check the separator and the decimal sign, and that every column has a name"
    if separator == "," and most and most[0][0] > len(header) > 1:
        help_ = "is the comma the decimal sign, too? export with semicolons between the cells, or with decimal points"
        number, cells = body[0]
        if split_at := _split_numbers(cells, header):
            written, column = split_at[0]
            message += f"; `{written}` in column `{column}` of line {number} has a decimal comma"
    return _no_table(message, source, help_)


def _split_numbers(cells: Sequence[str], header: Sequence[str]) -> list[tuple[str, str]]:
    """Return the numbers that decimal commas have split into two cells each, with their columns; none if unclear.

    From the last column on, two cells of digits alone are taken for one number as long as there are too many cells.
    """
    k, extra, numbers = len(cells) - 1, len(cells) - len(header), list[tuple[str, str]]()
    for column in reversed(header):
        if len(numbers) < extra and k > 0 and cells[k].isdigit() and cells[k - 1].lstrip("+-").isdigit():
            numbers.append((f"{cells[k - 1]},{cells[k]}", column))
            k -= 1
        k -= 1
    return numbers[::-1] if len(numbers) == extra > 0 and k == -1 else []


def _as_text(source: Source, diagnostics: list[Diagnostic]) -> Source:
    """Return the file as text with line feeds and no byte order mark; UTF-16 and workbooks become UTF-8."""
    if source.data.startswith(MARK):
        return sheet_text(source, diagnostics)
    data = source.data
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", "replace").encode()
    if b"\0" in data[:4096]:
        help_ = "save the table as `.xlsx`, `CSV UTF-8`, or as plain text"
        raise _no_table("this file is no text: an old spreadsheet, or another binary form", source, help_)
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return source if data == source.data else replace(source, data=data)


def _heading(
    split: Sequence[tuple[int, list[str]]], decimal: str, source: Source, diagnostics: list[Diagnostic]
) -> tuple[list[str], list[str], Sequence[tuple[int, list[str]]]]:
    """Return names and units of the columns, and the lines below; the header is the fullest line before any numbers.

    Lines before it are reported as a title (DAT004); a line below it that holds units alone belongs to it.

    Args:
        split: (line number, cells) of every line.
    """
    numbers = (i for i, (_, cells) in enumerate(split[:SAMPLE]) if holds_numbers(cells, decimal))
    first = next(numbers, min(len(split) - 1, SAMPLE))
    if first == 0:
        help_ = "add a header row (pose_id,q1_deg,...), or a column map with `header = false`"
        raise _no_table("the first row holds numbers where the column names should be", source, help_)
    at = max(range(first), key=lambda i: (sum(bool(cell) for cell in split[i][1]), -i))
    if at:
        lines = "1 line before the column names is" if at == 1 else f"{at} lines before the column names are"
        help_ = "start them with `#` if they are, or remove them"
        message = f"{lines} taken for a title"
        diagnostics.append(Diagnostic("DAT004", "info", message, source, _start(source, split[0][0]), help_))
    header = split[at][1]
    units = [stated_unit(name) for name in header]
    below = split[at + 1][1]
    filled = [cell for cell in below if cell.strip("[]()").lower() not in EMPTY_CELLS]
    if len(below) != len(header) or 2 * sum(map(is_unit, filled)) <= len(filled) or holds_numbers(below, decimal):
        return header, units, split[at + 1 :]
    units = [stated_unit(f"[{cell.strip('[]()')}]") or unit for cell, unit in zip(below, units, strict=True)]
    return header, units, split[at + 2 :]


def _find_separator(sample: Sequence[str], header: bool) -> str:
    """Return the mark (comma, semicolon, tab, or ``whitespace``) that splits a line into most cells.

    With a header, commas between digits do not count: they may be decimal signs.
    """
    lines = [re.sub(r"(?<=\d),(?=\d)", "", line) if header else line for line in sample]
    best = max((",", ";", "\t"), key=lambda mark: max(line.count(mark) for line in lines))
    return best if any(best in line for line in lines) else "whitespace"


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line, quotes taken into account."""
    if separator == "whitespace":
        return line.split()
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator))
    except csv.Error:  # a cell of more than 131072 letters
        return line.split(separator)


def _start(source: Source, line: int) -> Span:
    """Return the byte offsets of the first byte of a line, counted from 1."""
    start = source.line_starts[line - 1]
    return start, start + 1


def _no_table(message: str, source: Source, help_: str = "") -> PostprocError:
    """Return the exception for a file that is no table (DAT001)."""
    return PostprocError.of("DAT001", message, source, help=help_)


def sheet_text(source: Source, diagnostics: list[Diagnostic]) -> Source:
    """Return the fullest sheet of a workbook (.xlsx) as comma-separated text, formulas by their stored results.

    Raises:
        PostprocError: DAT001 where it is no workbook, or nothing reads it (openpyxl, the extra ``xlsx``).
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        help_ = "install the reader, `pip install 'postproc[xlsx]'`, or save the table as `CSV UTF-8`"
        raise _no_table("this file is a spreadsheet, and openpyxl is missing", source, help_) from None
    help_ = "save the table as `.xlsx`, `CSV UTF-8`, or as plain text"
    try:
        unpacked = sum(part.file_size for part in ZipFile(io.BytesIO(source.data)).infolist())
        if unpacked > MOST_BYTES:
            text = f"this workbook unpacks to {unpacked / 1e6:.0f} MB, and at most {MOST_BYTES / 1e6:g} are read"
            raise _no_table(text, source, "save the table alone, as `CSV UTF-8`")
        book = load_workbook(io.BytesIO(source.data), read_only=True, data_only=True)
        sheets = _sheets(book, source)
    except PostprocError:
        raise
    except Exception as error:  # a damaged workbook goes wrong anywhere in its reader
        text = f"this file is an archive, and no whole workbook ({type(error).__name__})"
        raise _no_table(text, source, help_) from error
    filled = {name: sum(bool(cell) for row in rows for cell in row) for name, rows in sheets.items()}
    name = max(filled, key=lambda one: filled[one], default="")
    if not name or not filled[name]:
        raise _no_table("no sheet of this workbook holds anything", source, "name another file")
    if sum(count > 0 for count in filled.values()) > 1:
        message = f"sheet `{name}` is read, the fullest of {len(filled)}"
        diagnostics.append(Diagnostic("DAT015", "info", message, source, help="save another one as a file of its own"))
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(sheets[name])
    return replace(source, data=out.getvalue().encode())


def _sheets(book: Workbook, source: Source) -> dict[str, list[list[str]]]:
    """Return the rows of cells of every sheet as text, by its name; DAT001 where there are more than `MOST_CELLS`."""
    sheets: dict[str, list[list[str]]] = {}
    count = 0
    for sheet in book.worksheets:
        sheet.reset_dimensions()  # what a file says of its size may be wrong
        rows = sheets.setdefault(sheet.title, [])
        for row in sheet.values:
            count += max(1, len(row))
            if count > MOST_CELLS:
                text = f"this workbook has more than {MOST_CELLS:,} cells, empty ones between others included"
                raise _no_table(text, source, "save the table alone, as `CSV UTF-8`")
            rows.append([_text(cell) for cell in row])
    return sheets


def _text(cell: object) -> str:
    """Return a cell's value as text, dates in ISO 8601, line feeds as blanks."""
    if cell is None:
        return ""
    if isinstance(cell, datetime | date | time):
        return cell.isoformat(sep=" ") if isinstance(cell, datetime) else cell.isoformat()
    return repr(cell) if isinstance(cell, float) else str(cell).replace("\n", " ")
