"""How rows and orientations weigh in a fit, by their residual."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.problem import Problem, Weights
from postproc.measure.checks.repeats import Noise
from postproc.measure.measurements import Measurements

ALIGNED, FEWEST = 0.97, 3
"""Cosine that each of so many poses must reach: errors without a reason do so for one of six joints once in 6000."""


def reweighted(problem: Problem, base: Weights, figures: Noise, robust: bool) -> tuple[Weights, tuple[int, ...]]:
    """Return the weights that follow from the present residual, and the indices of rows that are excluded.

    Args:
        base: weights by the noise alone; figures: that noise; robust: whether all rows get Huber weights.
    """
    excluded = far_off(problem, base)
    values = _balanced(base, problem.data, problem.error, figures)
    if robust:
        values = values * _huber(problem, values)[:, None]
    values[list(excluded)] = 0.0
    return Weights(values, base.turn), excluded


def far_off(problem: Problem, weights: Weights) -> tuple[int, ...]:
    """Return the indices of rows over ten times as far off as the median row, such as typing errors and lost beams.

    Each kind of measured number is judged alone, since one may have too much weight before its noise is known. The
    result is empty where more than one row in twenty is so far off, or where all of them are off as if one joint had
    turned: then they show what the model lacks.
    """
    squares = problem.weighted(weights).squares()
    kinds = [squares[:, kind.columns].sum(axis=1) for kind in problem.data.observations]
    far = np.flatnonzero(np.any([kind > max(100 * np.median(kind), 1e-12) for kind in kinds], axis=0))
    return tuple(int(i) for i in far) if len(far) <= max(1, len(squares) // 20) and not _turned(problem, far) else ()


def _turned(problem: Problem, rows: NDArray[np.int_]) -> bool:
    """Return whether the errors of some rows, of three poses at least, all look like a turn of one and the same joint.

    A turn of joint j moves the point along its column J_j of the Jacobian, a typing error along any direction, which
    reaches the cosine c to J_j in k poses with the probability (1 - c)^k.
    """
    rows = rows[np.isfinite(problem.error[rows, :3]).all(axis=1)]
    rows = rows[np.unique(problem.data.repeats[rows], return_index=True)[1]]
    if len(rows) < FEWEST:
        return False
    off, turned = problem.error[rows, :3], problem.some(rows).sensitivity.matrix[:, :3, :6]
    size = np.linalg.norm(off, axis=1)[:, None] * np.linalg.norm(turned, axis=1)
    cosine = np.abs(np.einsum("kx,kxj->kj", off, turned)) / np.maximum(size, 1e-300)
    return bool((cosine.min(axis=0) > ALIGNED).any())


def _balanced(weights: Weights, data: Measurements, every: Array, figures: Noise) -> Array:
    """Return (n, r) weights in which kinds of numbers without a known noise are weighted by their residual.

    A row's stated sigma is that of its position. Orientations or joint angles may scatter in proportion to it or be
    equally good everywhere: the likelier of the two is taken for each kind.

    Args:
        weights: by the noise alone; figures: that noise; every: (n, r) measured minus predicted.
    """
    values = weights.values.copy()
    first, *others = sorted(data.observations, key=lambda kind: kind != data.observed)
    scale = values[:, first.columns].max(axis=1)
    typical = np.sqrt(np.mean(scale[scale > 0] ** -2.0)) if scale.any() else 1.0
    share = np.where(scale > 0, scale * typical, 1.0)[:, None]
    whitened = weights.whiten(np.nan_to_num(every)[:, :, None])[:, first.columns, 0]
    reference = robust_rms(whitened[values[:, first.columns] > 0])
    for kind in others:
        known = figures.rotation if kind.name == "orientation" else None
        error, used = every[:, kind.columns], values[:, kind.columns] > 0
        if not used.any():
            continue
        seen = used.any(axis=1)
        with_it = _surprise(error * share) - np.mean(np.log(share[seen])) < _surprise(error)
        form = share if with_it else np.ones_like(share)
        scatter = robust_rms(error * form)
        level = (reference or 1.0) / scatter if known is None and scatter > 0 else values[:, kind.columns]
        values[:, kind.columns] = used * level * form
    return values


def robust_rms(error: Array) -> float:
    """Return 1.4826 times the median absolute finite number, the standard deviation of normal ones; 0 for none."""
    good = error[np.isfinite(error)]
    return 1.4826 * float(np.median(np.abs(good))) if len(good) else 0.0


def _surprise(error: Array) -> float:
    """Return minus the mean log likelihood of errors under a normal distribution with their robust scatter.

    Errors count as three standard deviations at most; a constant is omitted.
    """
    scatter = robust_rms(error)
    return float(np.log(scatter) + 0.5 * np.nanmean(np.minimum((error / scatter) ** 2, 9.0))) if scatter > 0 else 0.0


def _huber(problem: Problem, values: Array) -> Array:
    """Return (n,) Huber factors of the rows: 1 for a whitened error up to 1.5 times the median, less beyond.

    Args:
        values: (n, r) weights.
    """
    length = np.sqrt(np.nansum((problem.error * values) ** 2, axis=1))
    limit = 1.5 * float(np.median(length))
    return np.asarray(np.sqrt(np.minimum(1.0, limit / np.maximum(length, 1e-300))))
