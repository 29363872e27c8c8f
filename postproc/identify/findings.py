"""Findings about the data that a fit brings to light: rows that stand out."""

from __future__ import annotations

from postproc.diagnostics import Diagnostic
from postproc.identify.fit import Fit


def data_findings(fit: Fit) -> list[Diagnostic]:
    """Rows that were set aside, by their number in the file."""
    found = []
    data = fit.data
    for i in fit.set_aside:
        row = data.row[i] if data.row else i + 1
        size = 1e3 * float((fit.problem.error[i, :3] ** 2).sum() ** 0.5)
        message = (
            f"row {row} lies {size:.2f} mm from the fitted model, far more than any other; it was left out of the fit"
        )
        span = None
        if data.source is not None and data.line:
            start = data.source.line_starts[data.line[i] - 1]
            span = (start, start + len(data.source.line(data.line[i])))
        help_ = "measure the row again; if it repeats, it shows something that the model lacks"
        found.append(Diagnostic("DAT013", "warning", message, data.source, span, help_))
    return found
