"""Findings about the data that a fit brings to light: rows that stand out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic, Span
from postproc.identify.fitted import Fit

RARE = 1e-3
"""Chance that any row of clean data stands out as much."""


def data_findings(fit: Fit) -> list[Diagnostic]:
    """Rows that were set aside, and rows that stand out of the residual of the rest."""
    found = []
    size = 1e3 * np.linalg.norm(fit.problem.error[:, :3], axis=1)
    for i in fit.set_aside:
        message = (
            f"row {_row(fit, i)} lies {size[i]:.2f} mm from the fitted model, far more than any other; it is left out"
        )
        help_ = "measure the row again; if it repeats, it shows something that the model lacks"
        found.append(Diagnostic("DAT013", "warning", message, fit.data.source, _span(fit, i), help_))
    for i in standing_out(fit)[:10]:
        message = f"row {_row(fit, int(i))} lies {size[i]:.2f} mm from the fitted model, more than noise explains"
        help_ = "measure the row again; it may be a bad reading, or the one that shows a missing effect"
        found.append(Diagnostic("DAT025", "warning", message, fit.data.source, _span(fit, int(i)), help_))
    return found


def standing_out(fit: Fit) -> NDArray[np.int_]:
    """Rows in use that lie farther off than noise explains (chi-square, corrected for their number)."""
    from scipy.special import chdtrc

    used = fit.problem.weights.used
    square = fit.problem.row_square() / max(fit.variance, 1e-300)
    rare = chdtrc(np.maximum(used.sum(axis=1), 1), square) * len(square)
    return np.flatnonzero((rare < RARE) & used.any(axis=1))


def _row(fit: Fit, index: int) -> int:
    return fit.data.row[index] if fit.data.row else index + 1


def _span(fit: Fit, index: int) -> Span | None:
    source = fit.data.source
    if source is None or not fit.data.line:
        return None
    start = source.line_starts[fit.data.line[index] - 1]
    return start, start + len(source.line(fit.data.line[index]).encode(source.encoding))
