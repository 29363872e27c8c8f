"""Numbers as people and instruments write them: decimal commas, marks between thousands, cells that are empty."""

from __future__ import annotations

import re
from collections.abc import Sequence

from postproc.numbers import read_number

GROUPED = {
    ".": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:[.]\\d*)?|[-+]?\\d{1,3}(?:,\\d{3})+[.]\\d*"),
    ",": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:,\\d*)?|[-+]?\\d{1,3}(?:[.]\\d{3})+,\\d*"),
}
"""Numbers with marks between thousands, by the decimal sign; 1,193 alone may be either and is not one of them."""
EMPTY_CELLS = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})


def as_number(cell: str, decimal: str) -> str:
    """Return a cell as Python reads numbers: with a decimal point, without thousands separators (1'234.5, 1.234,5).

    Args:
        decimal: decimal sign of the table, ``.`` or ``,``.
    """
    mark = "," if decimal == "." else "."
    if GROUPED[decimal].fullmatch(cell):
        cell = re.sub(f"['\u2019 \u00a0{mark}]", "", cell)
    cell = cell.replace("\u2212", "-")
    return cell.replace(",", ".") if decimal == "," else cell


def is_number(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number in a table with this decimal sign."""
    try:
        read_number(as_number(cell, decimal))
    except ValueError:
        return False
    return True


def holds_numbers(cells: Sequence[str], decimal: str) -> bool:
    """Return whether at least half of the cells that are not empty are numbers, and one is not empty."""
    filled = [cell for cell in cells if cell.lower() not in EMPTY_CELLS]
    return 2 * sum(is_number(cell, decimal) for cell in filled) >= max(len(filled), 1)


def find_decimal(cells: Sequence[str]) -> str:
    """Return the decimal sign, ``,`` where it stands last in most numbers, else ``.``."""
    numbers = [
        cell for cell in cells if re.fullmatch(r"[-+\d.,'\u2019\u2212 \u00a0eE]*\d[.,]\d+(?:[eE][-+]?\d+)?", cell)
    ]
    commas = sum(cell.rfind(",") > cell.rfind(".") for cell in numbers)
    return "," if 2 * commas > len(numbers) else "."
