"""How far the rows leave the numbers of a curve open: its profile likelihood, sampled where it is high."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.arrays import Array
from postproc.identification.curves.form import CurveForm, Edge

SMOOTH, EDGE = 3.84, 7.35
"""What 2 log likelihood falls by at the true value of a number, in 95 % of experiments at most: of a number that the
curve follows smoothly (chi-square, one degree of freedom), and of an edge (Hansen 2000, Econometrica 68, Table I)."""
ROUNDS, DRAWN = 10, 200
"""How often the region from which points are drawn is adapted; points that are drawn at once."""


def limits(form: CurveForm, likelihood: Callable[[Array], Array]) -> tuple[Edge, ...]:
    """Return the lowest and the highest value of each number of a curve with which it fits the rows nearly as well.

    Points are drawn evenly from an ellipsoid, which is moved and stretched to where the likelihood is high. The
    extremes of one number over all points there, whatever the others are, are those of its profile likelihood.

    Args:
        form: the curve, with the numbers that fit best.
        likelihood: returns (P,) 2 log likelihood, up to a constant, for numbers (P, K) of the curve; the sizes and all
            fitted parameters at their best.
    """
    kinds = [(kind, signal.values) for curve, signal, _ in form.each for kind in curve.numbers]
    if not kinds:
        return ()
    low, high, step = np.array([_possible(kind, x, n) for (kind, x), n in zip(kinds, form.numbers, strict=True)]).T
    allowed = EDGE if any(kind == "edge" for kind, _ in kinds) else SMOOTH
    ball = _ball(len(kinds))
    points = np.array([form.numbers])
    worth, centre, spread = likelihood(points), points[0], np.diag(step)
    for _ in range(ROUNDS):
        new = centre + ball @ spread.T
        new = new[((new >= low) & (new <= high)).all(axis=1)]
        if len(new):
            points, worth = np.vstack([points, new]), np.append(worth, likelihood(new))
        near = worth > worth.max() - allowed
        good = points[near]
        if near[len(near) - len(new) :].sum() > 0.6 * DRAWN:
            spread = 2.5 * spread
        elif len(good) < 4 * len(kinds):
            spread = 0.4 * spread
        else:
            centre, spread = 0.5 * (good.min(axis=0) + good.max(axis=0)), 1.2 * _ellipsoid(good)
    good = np.vstack([points[worth > worth.max() - allowed], [form.numbers]])
    return tuple(zip(good.min(axis=0).tolist(), good.max(axis=0).tolist(), strict=True))


def _possible(kind: str, x: Array, number: float) -> tuple[float, float, float]:
    """Return the lowest and highest value that a number of a kind may have, and a first step away from it.

    Args:
        x: (n,) values of the signal.
    """
    extent = float(np.ptp(x))
    if kind in ("edge", "knot"):
        return float(x.min()), float(x.max()), 0.02 * extent
    if kind in ("phase", "start", "duty"):
        return number - 1.0, number + 1.0, 0.05
    most = np.inf if kind == "order" else 3 * extent
    return 1e-6 * number, max(most, number), 0.2 / extent if kind == "order" else 0.1 * number


def _ball(dimensions: int) -> Array:
    """Return (DRAWN, K) points spread evenly over the unit ball of K dimensions, always the same."""
    if dimensions == 1:
        return np.linspace(-1.0, 1.0, DRAWN)[:, None]
    rng = np.random.default_rng(0)
    points = rng.standard_normal((DRAWN, dimensions))
    radius = rng.uniform(size=(DRAWN, 1)) ** (1 / dimensions)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True) * radius)


def _ellipsoid(points: Array) -> Array:
    """Return the (K, K) matrix that stretches the unit ball to an ellipsoid about (P, K) points.

    An ellipsoid that is filled evenly has the covariance R R^T / (K + 2), R being that matrix.
    """
    K = points.shape[1]
    covariance = np.atleast_2d(np.cov(points.T)) * (K + 2)
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 1e-18 * values.max())))
