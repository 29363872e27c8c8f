"""How much of a residual is more than noise: the mean of what the excess may be, given both degrees of freedom."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

ODDS = 2.0
"""Odds before any data that a fitted model lacks something of the arm, to none."""
NODES = 64
"""Values of the noise's variance that stand for its own uncertainty."""


def excess_variance(total: float, dof: float, noise: float, noise_dof: float) -> float:
    """Return the posterior mean of the variance u^2 that a residual has beside the noise's n^2.

    A residual variance s^2 with nu degrees of freedom is (n^2 + u^2) chi^2_nu / nu, and that of the noise as estimated
    n^2 chi^2_d / d. Before, the odds that something is lacking are h to 1, and if so, n^2 / (n^2 + u^2) is uniform in
    0 .. 1; else u = 0. With k = nu / 2, x = k s^2 / n^2 and g_a = e^x x^-a gamma(a, x) (the lower incomplete gamma
    function) that is

        E[u^2] / n^2 = h (g_k - g_(k+1)) / (1 + h g_(k+1)),

    averaged over n^2 with the weight n^-nu e^-x (1 + h g_(k+1)). It goes to s^2 - n^2 where that is many times its own
    uncertainty, and to 0 as many rows agree with the noise, but is not 0 because few rows prove nothing.

    Args:
        total: s^2; dof: nu > 0. noise: the estimate of n^2 > 0, in the same unit; noise_dof: d, infinite where known.
    """
    from scipy.special import chdtri

    variance = np.array([noise])
    if np.isfinite(noise_dof):
        variance = noise * noise_dof / chdtri(noise_dof, (np.arange(NODES) + 0.5) / NODES)
    k = 0.5 * dof
    x = k * total / variance
    first, second = (np.log(ODDS) + _log_scaled_gamma(a, x) for a in (k, k + 1.0))
    mean = variance * np.expm1(np.maximum(first - second, 0.0)) / (1.0 + np.exp(-second))
    weight = -k * np.log(variance) - x + np.logaddexp(0.0, second)
    weight = np.exp(weight - weight.max())
    return float(np.sum(weight * mean) / np.sum(weight))


def _log_scaled_gamma(a: float, x: Array) -> Array:
    """Return log(e^x x^-a gamma(a, x)) of x (m,) > 0, with the lower incomplete gamma function."""
    from scipy.special import gammainc, gammaln, hyp1f1

    small: NDArray[np.bool_] = x < a
    direct = x - a * np.log(x) + gammaln(a) + np.log(gammainc(a, np.where(small, a, x)))
    return np.where(small, np.log(hyp1f1(1.0, a + 1.0, np.where(small, x, 0.0)) / a), direct)
