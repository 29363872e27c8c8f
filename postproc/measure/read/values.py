"""Single cells as tables write them: units, numbers with decimal commas and marks between thousands, time stamps."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import partial

import numpy as np

from postproc.arrays import Array
from postproc.numbers import read_number

_QUANTITIES: tuple[Mapping[str, float], ...] = (
    {"deg": math.pi / 180, "rad": 1.0, "mrad": 1e-3},
    {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "um": 1e-6, "in": 0.0254, "inch": 0.0254},
    {"deg_s": math.pi / 180, "rad_s": 1.0},
    {"deg_s2": math.pi / 180, "rad_s2": 1.0},
    {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    *({unit: 1.0} for unit in ("N", "Nm", "C")),
    {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0},
    {"1": 1.0},
)
"""Units that may stand for each other, with their factors to SI; temperatures stay in degrees Celsius."""
UNITS: Mapping[str, float] = {unit: factor for kind in _QUANTITIES for unit, factor in kind.items()}
_WRITTEN = {
    "deg": "° degree degrees",
    "rad": "radian radians",
    "um": "µm \u03bcm micron",
    "deg_s": "deg/s °/s",
    "rad_s": "rad/s",
    "deg_s2": "deg/s2 deg/s^2 deg/s² °/s2 °/s^2 °/s²",
    "rad_s2": "rad/s2 rad/s^2 rad/s²",
    "N": "n",
    "Nm": "nm",
    "C": "°c degc c celsius",
    "s": "sec",
}
_SPELT = {theirs: unit for unit, spellings in _WRITTEN.items() for theirs in spellings.split()}
GROUPED_THOUSANDS = {
    ".": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:[.]\\d*)?|[-+]?\\d{1,3}(?:,\\d{3})+[.]\\d*"),
    ",": re.compile("[-+]?\\d{1,3}(?:['\u2019 \u00a0]\\d{3})+(?:,\\d*)?|[-+]?\\d{1,3}(?:[.]\\d{3})+,\\d*"),
}
"""Numbers with marks between thousands, by the decimal sign; 1,193 alone may be either and is not one of them."""
EMPTY_CELLS = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "#n/a"})
DATES = ("%d.%m.%Y", "%d.%m.%y", "%m/%d/%Y", "%d/%m/%Y", "%Y/%m/%d", "%m/%d/%y", "%d/%m/%y")
CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
DAY = 86400.0


def stated_unit(header: str) -> str:
    """Return the unit in brackets or at the end of a column's header, by its name in `UNITS`; empty if it has none.

    A unit in brackets that is not known comes back as it is written.
    """
    match = re.search(r"[\[(]([^\[(\])]*+)[\])]", header) or re.search(r"[ _.](rad|deg|mm|cm|m|in)$", header.strip())
    return _spelt(match[1].strip()) if match else ""


def is_unit(cell: str) -> bool:
    """Return whether a cell below a column's name is a unit."""
    return _spelt(cell.strip("[]() ")) in UNITS.keys() - {"1"}


def _spelt(unit: str) -> str:
    """Return the name in `UNITS` of a unit that may be written otherwise; an unknown one as it is."""
    return unit if unit in UNITS else _SPELT.get(unit.lower(), unit)


def fitting(unit: str, standard: str) -> bool:
    """Return whether two units measure the same quantity (mm and in, deg and rad)."""
    return unit == standard or any(unit in group and standard in group for group in _QUANTITIES)


def as_number(cell: str, decimal: str) -> str:
    """Return a cell as Python reads numbers: with a decimal point, without thousands separators (1'234.5, 1.234,5).

    Args:
        decimal: decimal sign of the table, ``.`` or ``,``.
    """
    mark = "," if decimal == "." else "."
    if GROUPED_THOUSANDS[decimal].fullmatch(cell):
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
    number = re.compile(r"[-+\d.,'\u2019\u2212 \u00a0eE]*\d[.,]\d+(?:[eE][-+]?\d+)?")
    numbers = [cell for cell in cells if number.fullmatch(cell)]
    commas = sum(cell.rfind(",") > cell.rfind(".") for cell in numbers)
    return "," if 2 * commas > len(numbers) else "."


def seconds(cells: Sequence[str]) -> Array | None:
    """Return (n,) seconds since the earliest of these stamps, NaN where a cell is empty; None where they are no stamps.

    ISO 8601, dates with points or slashes and a time of day, or the time of day alone, which may pass midnight. Where
    day and month may be either way round, the reading with the shorter duration is taken.
    """
    # An apostrophe before a stamp marks text for a spreadsheet.
    cells = [cell.lstrip("'\u2019") for cell in cells]
    filled = [i for i, cell in enumerate(cells) if cell]
    readings: list[Callable[[str], datetime]] = [datetime.fromisoformat]
    readings += [partial(_read, form=f"{date} {clock}") for date in DATES for clock in CLOCKS]
    readings += [partial(_read, form=clock) for clock in CLOCKS]
    best: Array | None = None
    for read in readings:
        try:
            read(cells[filled[0]])
            stamps = [read(cells[i]) for i in filled]
            passed = np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
        except (ValueError, TypeError, IndexError):
            continue
        if stamps[0].year == 1900:
            passed = passed + DAY * np.cumsum(np.diff(passed, prepend=0.0) < -DAY / 2)
        if best is None or np.ptp(passed) < np.ptp(best[filled]):
            best = np.full(len(cells), np.nan)
            best[filled] = passed - passed.min()
    return best


def _read(cell: str, form: str) -> datetime:
    """Return the time in a cell, read by a format of ``strptime``; raise ValueError where it does not fit."""
    return datetime.strptime(cell, form)
