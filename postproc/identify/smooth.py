"""How smooth a free function should be: the strength of its penalty, chosen on rows that the fit has not seen."""

from __future__ import annotations

import numpy as np

from postproc.identify.fit import Fit, rms
from postproc.identify.linear import Linear, bases_of, contiguous_blocks, hold_out

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
    values = {e.key: e.vector() for e in fit.model.effects}
    y = fit.problem.residual + A @ np.array([values[k][i] for k, i in fit.parameters])
    mine = np.array([k == key for k, _ in fit.parameters])
    scale = float(np.sqrt(max(fit.variance, 1e-12)))
    weights = np.array([(scale * rough / effect.scale())[i] if k == key else 0.0 for k, i in fit.parameters])
    blocks = contiguous_blocks(fit.data.repeats)[row]
    bases = bases_of(A, np.where(mine, 0.0, fit.penalty), weights, STRENGTHS)
    errors = [rms(hold_out(Linear(y, U, row), (), blocks)) for U in bases]
    return scale * STRENGTHS[int(np.argmin(errors))]
