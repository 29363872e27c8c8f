"""How far any smooth function of the channels could bring the held-out error: a yardstick, never a name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.identify.fitted import Fit, rms
from postproc.identify.linear import contiguous_blocks
from postproc.identify.sensitivity import INSTRUMENT

ROWS = 400
AMPLITUDES = (0.1, 0.5, 2.0, 8.0)
"""Prior standard deviation of the free functions, in units of the residual."""
WIDTH = 0.3
"""Length over which a free function changes, as a share of a channel's range."""


def nonparametric_bound(fit: Fit, named: Mapping[str, Array]) -> float:
    """Held-out rms per axis [m] of a Gaussian process on the residual, and never more than the residual's own.

    Every joint, and the instrument's frame, moves by a free function of all channels: covariance J(x) k(x, x') J(x')^T
    with
    k = mean over channels of exp(-d_c^2 / 2 w^2) + exp(-mean of d_c^2 / 2 w^2). Blocks are left out in closed form,
    e_B = ((C^-1)_BB)^-1 (C^-1 y)_B. Source: Rasmussen and Williams (2006), Sec. 5.4.2; the largest of four amplitudes
    by held-out error.
    """
    error = fit.problem.error[:, :3]
    rows = np.flatnonzero(np.isfinite(error).all(axis=1) & fit.problem.weights.used[:, :3].all(axis=1))
    rows = rows[:: max(1, -(-len(rows) // ROWS))]
    own = fit.held_out_rms
    if len(rows) < 20 or not named:
        return own
    typical = max(rms(error[rows]), 1e-12)
    y = (error[rows] / typical).ravel()
    kernel = _kernel(named, rows)
    J = fit.problem.sensitivity.matrix[rows][:, :3]
    turn = J[:, :, :6] / np.maximum(np.sqrt(np.mean(J[:, :, :6] ** 2, axis=(0, 1))), 1e-12)
    shift = J[:, :, INSTRUMENT : INSTRUMENT + 3]
    reach = np.einsum("nij,mkj->nimk", turn, turn) / 6 + np.einsum("nij,mkj->nimk", shift, shift)
    size = len(y)
    covariance = (reach * kernel[:, None, :, None]).reshape(size, size)
    blocks = np.repeat(contiguous_blocks(fit.data.repeats)[rows], 3)
    best = own / typical
    for amplitude in AMPLITUDES:
        inverse = np.linalg.inv(amplitude**2 * covariance + np.eye(size) * 0.25)
        weighted = inverse @ y
        out = np.empty(size)
        for block in np.unique(blocks):
            at = np.flatnonzero(blocks == block)
            out[at] = np.linalg.solve(inverse[np.ix_(at, at)], weighted[at])
        best = min(best, rms(out))
    return float(best * typical)


def _kernel(named: Mapping[str, Array], rows: NDArray[np.int_]) -> Array:
    alone, together = np.zeros((len(rows), len(rows))), np.zeros((len(rows), len(rows)))
    for values in named.values():
        x = values[rows] / max(float(np.ptp(values)), 1e-300) / WIDTH
        square = (x[:, None] - x[None, :]) ** 2
        alone += np.exp(-0.5 * square)
        together += square
    return np.asarray((alone + np.exp(-0.5 * together / 4) * len(named)) / (2 * len(named)))
