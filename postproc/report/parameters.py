"""Fitted parameters as people read them: in mm and mrad, with their standard deviations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.effects.parameters import unit_suffix
from postproc.identify.fitted import Fit

FEW = 12  # parameters of one effect that are told one by one


def fitted_values(fit: Fit, key: str) -> Iterator[tuple[str, float, float, str]]:
    """Name without its unit, value, standard deviation and unit of every parameter of an effect that was fitted."""
    effect = fit.model.effect(key)
    if effect is None:
        return
    sigma = dict(zip(fit.parameters, np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), strict=True))
    units = [meta.unit for name, meta in effect.parameters().items() for _ in range(int(np.prod(effect.shape(name))))]
    for i, (name, unit, value) in enumerate(zip(effect.names(), units, effect.vector(), strict=True)):
        if (key, i) in sigma:
            factor, small = (1e3, "m") if unit == "m" or unit.startswith(("rad", "m/")) else (1.0, "")
            shown = "" if unit == "1" else small + unit
            yield name.replace(unit_suffix(unit), ""), factor * float(value), factor * float(sigma[key, i]), shown


def values_text(fit: Fit, key: str) -> str:
    """The same on one line; only their number where there are many."""
    said = [f"{name} {value:.3g} ± {sigma:.1g} {unit}".rstrip() for name, value, sigma, unit in fitted_values(fit, key)]
    return "; ".join(said) if len(said) <= FEW else f"{len(said)} numbers"
