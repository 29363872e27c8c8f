"""Fitted parameters as a table."""

from __future__ import annotations

from collections.abc import Iterable

from postproc.estimation.fitted import Fit
from postproc.estimation.words.wording import FEW, fitted_values, with_sigma
from postproc.report.page import table


def parameter_table(fit: Fit, keys: Iterable[str]) -> str:
    """HTML of the parameters of some effects, in mm and mrad; of a free function only how many there are."""
    rows: list[tuple[object, ...]] = []
    for key in keys:
        values = list(fitted_values(fit, key))
        if len(values) > 4 * FEW:
            rows.append((key, f"{len(values)} numbers, in the model file", "", ""))
        else:
            rows += [(key, name, with_sigma(value, sigma), unit) for name, value, sigma, unit in values]
    return table("parameters", ("effect", "parameter", "value ± 1 σ", "unit"), rows)
