"""A fit less some of its parameters, as a linear problem: nothing is fitted again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.identify.fitted import Fit
from postproc.identify.linear import Linear, basis_of, independent_share


def without(fit: Fit, out: NDArray[np.bool_]) -> Linear:
    """The linear problem of a fit without some of its parameters: y + A_o x_o beside the columns of the others.

    A_o are the columns of their amplitudes, x_o the values.

    Args:
        out: (p,) which of ``fit.parameters``.
    """
    if not out.any():
        return fit.linear
    values = {e.key: e.vector() for e in fit.model.effects}
    amplitude = {e.key: e.amplitudes() for e in fit.model.effects}
    x = np.array([values[key][i] for key, i in fit.parameters])
    back = (out & np.array([amplitude[key][i] for key, i in fit.parameters])) | (fit.penalty > 0)
    y = fit.problem.residual + fit.columns[:, back] @ x[back]
    return counted(fit, Linear(y, basis_of(fit.columns[:, ~out], fit.penalty[~out]), fit.problem.row))


def counted(fit: Fit, linear: Linear) -> Linear:
    """The same with its own share of independent numbers."""
    turns = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, :6])
    return replace(linear, independent=independent_share(linear.rest, turns, linear.row))


def of_effects(fit: Fit, keys: set[str]) -> NDArray[np.bool_]:
    """(p,) which parameters are those of some effects."""
    return np.array([key in keys for key, _ in fit.parameters], dtype=bool)
