"""A sheet of a spreadsheet as the text of a table."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import date, datetime, time
from zipfile import BadZipFile

from postproc.diagnostics import Diagnostic, PostprocError, Source

MARK = b"PK"
"""The first bytes of a zip archive, which a workbook is."""


def sheet_text(source: Source, diagnostics: list[Diagnostic]) -> Source:
    """The fullest sheet of a workbook (.xlsx) as comma-separated text, formulas as they were computed.

    Raises:
        PostprocError: DAT001 where it is no workbook, or nothing reads it (openpyxl, the extra ``xlsx``).
    """
    try:
        from openpyxl import load_workbook
        from openpyxl.utils.exceptions import InvalidFileException
    except ImportError:
        help_ = "install the reader, `pip install 'postproc[xlsx]'`, or save the table as `CSV UTF-8`"
        raise PostprocError.of(
            "DAT001", "this file is a spreadsheet, and openpyxl is missing", source, help=help_
        ) from None
    try:
        book = load_workbook(io.BytesIO(source.data), read_only=True, data_only=True)
        sheets = {sheet.title: [[_text(cell) for cell in row] for row in sheet.values] for sheet in book.worksheets}
    except (BadZipFile, InvalidFileException, KeyError, ValueError, OSError):
        help_ = "save the table as `.xlsx`, `CSV UTF-8`, or as plain text"
        raise PostprocError.of("DAT001", "this file is an archive, and no workbook", source, help=help_) from None
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


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime | date | time):
        return cell.isoformat(sep=" ") if isinstance(cell, datetime) else cell.isoformat()
    return repr(cell) if isinstance(cell, float) else str(cell).replace("\n", " ")
