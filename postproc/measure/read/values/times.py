"""Time stamps as loggers and spreadsheets write them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial

import numpy as np

from postproc.arrays import Array

DATES = ("%d.%m.%Y", "%d.%m.%y", "%m/%d/%Y", "%d/%m/%Y", "%Y/%m/%d", "%m/%d/%y", "%d/%m/%y")
CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
DAY = 86400.0


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
