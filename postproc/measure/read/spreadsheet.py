"""A sheet of a spreadsheet as the text of a table."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import date, datetime, time
from typing import TYPE_CHECKING
from zipfile import ZipFile

from postproc.diagnostics import Diagnostic, PostprocError, Source

if TYPE_CHECKING:
    from openpyxl import Workbook

MARK = b"PK"
"""The first bytes of a zip archive, which a workbook is."""
MOST_CELLS, MOST_BYTES = 2_000_000, 256_000_000
"""Of a workbook, with its empty cells, and unpacked: counted before anything is kept."""


def sheet_text(source: Source, diagnostics: list[Diagnostic]) -> Source:
    """Return the fullest sheet of a workbook (.xlsx) as comma-separated text, formulas by their stored results.

    Raises:
        PostprocError: DAT001 where it is no workbook, or nothing reads it (openpyxl, the extra ``xlsx``).
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        help_ = "install the reader, `pip install 'postproc[xlsx]'`, or save the table as `CSV UTF-8`"
        raise PostprocError.of(
            "DAT001", "this file is a spreadsheet, and openpyxl is missing", source, help=help_
        ) from None
    help_ = "save the table as `.xlsx`, `CSV UTF-8`, or as plain text"
    try:
        unpacked = sum(part.file_size for part in ZipFile(io.BytesIO(source.data)).infolist())
        if unpacked > MOST_BYTES:
            text = f"this workbook unpacks to {unpacked / 1e6:.0f} MB, and at most {MOST_BYTES / 1e6:g} are read"
            raise PostprocError.of("DAT001", text, source, help="save the table alone, as `CSV UTF-8`")
        book = load_workbook(io.BytesIO(source.data), read_only=True, data_only=True)
        sheets = _sheets(book, source)
    except PostprocError:
        raise
    except Exception as error:  # a damaged workbook goes wrong anywhere in its reader
        text = f"this file is an archive, and no whole workbook ({type(error).__name__})"
        raise PostprocError.of("DAT001", text, source, help=help_) from error
    filled = {name: sum(bool(cell) for row in rows for cell in row) for name, rows in sheets.items()}
    name = max(filled, key=lambda one: filled[one], default="")
    if not name or not filled[name]:
        raise PostprocError.of("DAT001", "no sheet of this workbook holds anything", source, help="name another file")
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
                raise PostprocError.of("DAT001", text, source, help="save the table alone, as `CSV UTF-8`")
            rows.append([_text(cell) for cell in row])
    return sheets


def _text(cell: object) -> str:
    """Return a cell's value as text, dates in ISO 8601, line feeds as blanks."""
    if cell is None:
        return ""
    if isinstance(cell, datetime | date | time):
        return cell.isoformat(sep=" ") if isinstance(cell, datetime) else cell.isoformat()
    return repr(cell) if isinstance(cell, float) else str(cell).replace("\n", " ")
