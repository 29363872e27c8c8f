"""Rows that repeat another digit by digit: copies, or readings of an instrument whose last digit is coarse."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.measure.checks.repeats import pooled_scatter
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.measure.significance import CHANCE

SHOWN_COPIES = 5
UNTOLD = 3e-5
"""Scatter [m], [rad] of readings of one pose where no two that differ tell it: that of an ordinary arm and tracker."""
ROUNDING_STEPS = [float(f"{digit}e{power}") for power in range(1, -8, -1) for digit in (5, 2, 1)]
"""Steps in which an instrument may count [mm], [mrad], the coarsest first."""


def check_copies(data: Measurements, cells: Cells) -> list[Diagnostic]:
    """Return DAT006 for up to five rows that repeat another digit by digit, if readings would not agree so by chance.

    Two readings of a pose with the scatter s agree in all digits of a coordinate that counts in steps r with the chance
    r / (2 sqrt(pi) s). So a gauge of one coordinate in hundredths reads the same often, a tracker of three never.
    """
    skipped = [k for k, name in enumerate(cells.header) if name in ("pose_id", "time_s")]
    seen: dict[tuple[str, ...], int] = {}
    pairs = []
    for i, row in enumerate(cells.rows):
        key = tuple(cell for k, cell in enumerate(row) if k not in skipped)
        first = seen.setdefault(key, i)
        if first != i:
            pairs.append((i, first))
    if not pairs or _by_chance(data, [i for i, _ in pairs]):
        return []
    help_ = "if it was copied, remove it: copied rows make the noise look smaller than it is"
    message = "row {} repeats row {} digit by digit: readings with noise do not agree so by chance"
    return [
        Diagnostic("DAT006", "warning", message.format(i + 1, first + 1), cells.source, cells.span(i), help_)
        for i, first in pairs[:SHOWN_COPIES]
    ]


def _by_chance(data: Measurements, copies: Sequence[int]) -> bool:
    """Return whether so many rows may repeat others by chance (Poisson, 1 in 1,000).

    Args:
        copies: index of each row that repeats an earlier one.
    """
    from scipy.special import pdtrc

    numbers = data.numbers(data.observed)
    numbers = numbers[:, np.isfinite(numbers).any(axis=0)]
    if not numbers.size:
        return False
    different = np.delete(np.arange(len(data)), copies)
    square, dof = pooled_scatter(numbers[different], data.repeats[different])
    scatter = float(np.sqrt(square)) if dof > 0 and square > 0 else UNTOLD
    alike = np.prod([min(1.0, _step(column) / (2 * np.sqrt(np.pi) * scatter)) for column in numbers.T])
    each = np.bincount(data.repeats)
    return bool(pdtrc(len(copies) - 1, alike * np.sum(each * (each - 1)) / 2) > CHANCE)


def _step(column: Array) -> float:
    """Return the step [m], [rad] in which a column (n,) counts: the coarsest of which all its numbers are multiples."""
    thousandths = 1e3 * column[np.isfinite(column)]
    for step in ROUNDING_STEPS:
        if np.allclose(thousandths, np.round(thousandths / step) * step, rtol=0, atol=1e-8):
            return 1e-3 * step
    return 0.0
