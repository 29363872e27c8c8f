"""Pictures of what a model leaves unexplained, shared by the pages of compare and diagnose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import UNITS, channels
from postproc.identify.fit import Fit
from postproc.report.figures import residual_vectors
from postproc.report.page import Section
from postproc.report.svg import scatter


def workspace_section(fit: Fit, error: Array) -> Section:
    """Residuals (n, 3) [m], instrument axes, where they were measured."""
    html, times = residual_vectors(fit.data.position, error)
    return Section("Where it is off", html, f"Measured minus predicted position, drawn {times:g} times as long.")


def channel_section(fit: Fit, error: Array, names: Sequence[str], noise: float | None) -> Section:
    """Residuals (n, 3) [m] along their main direction against channels, the most telling first."""
    named = channels(fit.problem.sensitivity.state, fit.problem.rest.T_base_tcp[:, :3, 3])
    good = np.isfinite(error).all(axis=1)
    main = np.full(len(error), np.nan)
    if good.any():
        _, _, axes = np.linalg.svd(error[good] - error[good].mean(axis=0), full_matrices=False)
        main[good] = error[good] @ axes[0] * 1e3
    band = None if noise is None else 2e3 * noise
    charts = []
    for name in dict.fromkeys([*names, *named]):
        if name in named:
            unit, factor = UNITS.get(name.rstrip("0123456789"), ("", 1.0))
            charts.append(scatter(named[name] * factor, main, f"{name} [{unit}]" if unit else name, "mm", band))
    note = "The residual along its main direction. A pattern is physics that the model lacks; a cloud is noise."
    if band:
        note += " The grey band is twice the noise."
    return Section("What it follows", "".join(charts), note)
