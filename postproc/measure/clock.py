"""The times of rows as one clock that goes on: stamps that begin anew, and stamps coarser than the rows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from postproc.arrays import Array

PAUSE_S = 1.0
"""Between clocks that were set back: what follows the time goes on, and no record spans them."""
FEWEST_ROWS_IN_LINE = 10
"""Rows of a stretch, and of a line of times."""
CLOCK_STEPS = 10.0 ** np.arange(0, -7, -1)
"""Decimal places [s] to which stamps may be written."""


def going_on(times: Sequence[Array | None]) -> list[Array | None]:
    """Return times [s] of consecutive tables or records as one clock, None for those without times.

    Times that begin before the end of those in front are moved to `PAUSE_S` behind it; others stay.

    Args:
        times: (n,) of each [s], or None.
    """
    end, result = -np.inf, []
    for time in times:
        if time is not None and len(time):
            time = time if time.min() > end else time - time.min() + end + PAUSE_S
            end = float(time.max())
        result.append(time)
    return result


def without_restarts(time: Array) -> tuple[Array, int]:
    """Return times (n,) [s] in file order as one clock that never restarts, and how often it had restarted.

    A clock that is set back repeats some of the times before; stretches that stand in another order do not, and stay.
    """
    parts = np.split(time, np.flatnonzero(np.diff(time) < 0) + 1)
    again = [b.min() <= a.max() and b.max() >= a.min() for a, b in pairwise(parts)]
    if not any(again) or min(map(len, parts)) < FEWEST_ROWS_IN_LINE:
        return time, 0
    return np.concatenate([part for part in going_on(parts) if part is not None]), sum(again)


def evenly_spaced(time: Array) -> Array | None:
    """Return (n,) evenly spaced times [s] in place of coarse stamps; None where stamps are fine or not so spaced.

    Rounded stamps are off a line by half of their last decimal place; so are stamps that are cut, all to one side.
    """
    if len(time) < FEWEST_ROWS_IN_LINE:
        return None
    row = np.arange(len(time))
    line = time[0] + np.polyval(np.polyfit(row, time - time[0], 1), row)
    apart = np.diff(np.unique(time))
    step = next((s for s in CLOCK_STEPS if np.abs(time / s - np.round(time / s)).max() < 1e-3), 0.0)
    # Rows that share a stamp tell how coarse the clock is, whatever its decimals.
    step = max(step, float(apart.min(initial=np.inf)) if len(apart) < len(time) - 1 else 0.0)
    off = float(np.abs(time - line).max())
    return line if 1e-9 < off <= 0.75 * step else None
