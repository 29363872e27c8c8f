"""What a residual holds beside noise: against the integrals themselves, and how often intervals with it hold."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from postproc.estimation.fitted import ODDS, excess_variance


@pytest.mark.parametrize(
    ("total", "dof"), [(0.3, 4.0), (0.9, 9.0), (1.0, 40.0), (2.3, 9.0), (4.0, 9.0), (1.1, 300.0), (25.0, 2.0)]
)
def test_it_is_the_mean_of_the_posterior(total: float, dof: float) -> None:
    """Likelihood of s^2 ~ v chi^2 / nu; v = n^2 with odds of 1 to h, else of the density n^2 / v^2 above n^2 = 1."""

    def likelihood(v: float) -> float:
        return float(np.exp(-0.5 * dof * (np.log(v) + total / v - np.log(max(total, 1.0)) - total / max(total, 1.0))))

    ends = [1.0, 1.0 + 3.0 / np.sqrt(dof), max(2.0, 2 * total), 50.0 * max(1.0, total), np.inf]
    parts = [
        [quad(lambda v, k=k: likelihood(v) * (v - 1.0) ** k / v**2, a, b)[0] for k in (0, 1)] for a, b in pairwise(ends)
    ]
    whole, first = np.sum(parts, axis=0)
    expected = ODDS * first / (likelihood(1.0) + ODDS * whole)
    assert excess_variance(total, dof, 1.0, np.inf) == pytest.approx(expected, rel=1e-5)
    assert excess_variance(4e-10 * total, dof, 4e-10, np.inf) == pytest.approx(4e-10 * expected, rel=1e-5)


def test_many_rows_are_the_difference_and_few_are_not_nothing() -> None:
    assert excess_variance(2.0, 1e5, 1.0, np.inf) == pytest.approx(1.0, rel=1e-3)
    assert excess_variance(1.0, 1e5, 1.0, np.inf) < 1e-3
    assert 0.1 < excess_variance(1.0, 9.0, 1.0, 20.0) < 0.6
    # Twice the noise with 9 degrees of freedom, where the true excess was 0.031 beside 0.018.
    assert np.sqrt(excess_variance(0.036**2, 9.0, 0.018**2, 20.0)) == pytest.approx(0.031, rel=0.15)
    for dof in (1.0, 9.0, 3000.0):
        for total in (1e-6, 1e6):
            assert np.isfinite(excess_variance(total, dof, 1.0, 9.0))


@pytest.mark.parametrize("dof", [9, 20, 60, 200])
@pytest.mark.parametrize("excess", [0.0, 0.3, 0.5, 0.7, 1.0, 1.7, 3.0])
def test_intervals_of_fits_with_few_degrees_of_freedom_hold(dof: int, excess: float) -> None:
    """Linear fits of 14 parameters to rows with noise and excess; noise known by 20 repeats."""
    rng, count, held, asked = np.random.default_rng(dof), 14, 0, 0
    for _ in range(120):
        A, x = rng.normal(size=(dof + count, count)), rng.normal(size=(20, count))
        y = rng.normal(size=dof + count) * np.hypot(1.0, excess)
        inverse = np.linalg.inv(A.T @ A)
        found = inverse @ A.T @ y
        square = float(np.sum((y - A @ found) ** 2)) / dof
        variance = square * np.einsum("ij,jk,ik->i", x, inverse, x)
        variance += excess_variance(square, dof, rng.chisquare(20) / 20, 20.0)
        held += int(np.sum(np.abs(x @ found - excess * rng.normal(size=20)) < 1.96 * np.sqrt(variance)))
        asked += 20
    assert 0.87 < held / asked < 0.998
