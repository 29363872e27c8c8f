"""How smooth a free function should be: the strength of its penalty, chosen on rows that the fit has not seen."""

from __future__ import annotations

import numpy as np

from postproc.identify.fit import Fit, rms
from postproc.identify.linear import Linear, basis_of, contiguous_blocks, hold_out

STRENGTHS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)


def choose_strength(fit: Fit, key: str) -> float:
    """The penalty's strength for one effect of a fit with the smallest held-out error, without refitting the model.

    The fit is linear in the amplitudes near its solution: with y = r + A x the penalised problem min |y - A x|^2 + |w
        x|^2 is
    solved for every strength at once for all blocks, and its held-out residuals are exact.
    """
    effect = fit.model.effect(key)
    rough = None if effect is None else effect.roughness()
    if effect is None or rough is None:
        return 0.0
    A, row = fit.columns, fit.problem.row
    values = np.array([_value(fit, k, i) for k, i in fit.parameters])
    weights = rough / effect.scale()
    own = [(c, i) for c, (k, i) in enumerate(fit.parameters) if k == key]
    scale = np.sqrt(max(fit.variance, 1e-12))
    y = fit.problem.residual + A @ values
    blocks = contiguous_blocks(fit.data.repeats)[row]
    best, smallest = 0.0, np.inf
    for strength in STRENGTHS:
        penalty = fit.penalty.copy()
        for c, i in own:
            penalty[c] = strength * scale * weights[i]
        error = rms(hold_out(Linear(y, basis_of(A, penalty), row), (), blocks))
        if error < smallest:
            best, smallest = strength * scale, error
    return float(best)


def _value(fit: Fit, key: str, index: int) -> float:
    effect = fit.model.effect(key)
    assert effect is not None
    return float(effect.vector()[index])
