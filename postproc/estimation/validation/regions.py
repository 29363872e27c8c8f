"""What a model is worth in regions of the joint space that no row of its fit came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.estimation.held_out import without_block
from postproc.estimation.linear import Linear
from postproc.estimation.solution import Solution
from postproc.estimation.validation.lacking import ROWS_JUDGED, ROWS_KEPT, some_of
from postproc.measure.errors import rms
from postproc.model.arm import Model
from postproc.model.uncertainty.field import Field, coordinates

SIZES = 25
"""Sizes of what may be lacking beyond the rows that are compared."""


@dataclass(frozen=True)
class Regions:
    """What a model is worth where no row of its fit is near.

    Args:
        field: what the model before the addition lacks, as a random function.
        lacking: standard deviation [m], [rad] of angles, of each observed number of that: what the model before leaves
            anywhere. beyond: the same of the model, where no row is near.
        before, after: (r, w) errors [m], [rad] of rows whose region was left out, by both models, region after region.
        helps: whether the model predicts them better than the one before, beside what its parameters may be off there.
        surest: the model before, where the addition does not help there; else None.
    """

    field: Field
    lacking: float
    beyond: float
    before: Array
    after: Array
    helps: bool
    surest: Model | None = None


def parts_of_range(field: Field, state: State, most: int) -> list[NDArray[np.bool_]]:
    """Return masks (n,) of regions that are left out in turn: the quarters at both ends of the joints that matter.

    These are the joints along which what is lacking changes most over the range that was measured.

    Args:
        field: what is lacking; state: of the n rows; most: how many regions at most.
    """
    q = state.q
    changes = np.ptp(q, axis=0) / field.lengths[[field.names.index(f"q{j + 1}") for j in range(6)]]
    masks = []
    for j in np.argsort(-changes)[: most // 2]:
        low, high = np.quantile(q[:, j], [0.25, 0.75])
        masks += [q[:, j] < low, q[:, j] > high]
    return [mask for mask in masks if mask.any()]


@dataclass(frozen=True)
class HeldOutRegion:
    """A region that was left out.

    Args:
        region: (n,) mask of its rows. before: (n, w) errors [m], [rad] of angles, of the w numbers of a row that are
            observed, by the model before; after: the same by the model; nan where they do not count.
        rows: (m,) index of some of its rows; open_: (m, w, k) what the parameters may be off there, one standard
            deviation [m], [rad] each.
    """

    region: NDArray[np.bool_]
    before: Array
    after: Array
    rows: NDArray[np.intp]
    open_: Array

    @classmethod
    def of(
        cls, before: Solution, after: tuple[Solution, Linear], region: NDArray[np.bool_], variance: float
    ) -> HeldOutRegion:
        """Return a region as the rows outside of it predict it.

        Args:
            before: the fit before. after: the fit whose weights count, and the linear problem, with what was added.
            variance: of the residual of the fit with it, in units of the assumed one.
        """
        old, _ = _predicted_without(before, before.linear, region)
        new, known = _predicted_without(*after, region)
        rows = some_of(np.flatnonzero(region & np.isfinite(old + new).any(axis=1)), ROWS_JUDGED)
        return cls(region, old, new, rows, np.sqrt(variance) * known[np.searchsorted(np.flatnonzero(region), rows)])


def _predicted_without(fit: Solution, linear: Linear, region: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return errors (n, w) of what is observed in m rows that were left out, nan elsewhere.

    Args:
        fit: whose weights count; linear: of that fit, or with more columns; region: (n,) mask of the rows.

    Returns:
        The errors, and (m, w, k) what parameters may be off there where the noise is as assumed.
    """
    weights = fit.problem.weights.rows(region)
    at = np.repeat(region[:, None], weights.values.shape[1], axis=1)[fit.problem.weights.used]
    errors, known = without_block(linear.residual, linear.nuisance, at)
    metres = np.full((*weights.values.shape, 1 + known.shape[1]), np.nan)
    metres[weights.used] = np.column_stack([errors, known]) / weights.values[weights.used][:, None]
    metres = metres[:, fit.observed.columns]
    every = np.full((len(region), metres.shape[1]), np.nan)
    every[region] = metres[..., 0]
    return every, metres[..., 1:]


def judged_by_regions(fit: Solution, lacking: tuple[Field, float], regions: Sequence[HeldOutRegion]) -> Regions:
    """Return what a fit is worth beyond its rows.

    The model before lacks a smooth random function of variance s^2 (`lacking_field`). What of that still lacks is
    another one, of the same lengths and variance b^2 <= s^2, of which the rows tell all but the posterior covariance.
    With t the residual deviation of the fit and G what its parameters may be off, errors of a region are normal with
    covariance t^2 I + G G^T + b^2 (K_BB - K_BA (K_AA + r I)^-1 K_AB), A the rows of the other regions, K between
    numbers times the cosine of their directions. The logarithm of
    b is uniform below that of s, and its square averaged over what the errors of all regions say.

    Args:
        lacking: by the model before, of `lacking_field`.
    """
    from scipy.linalg import cholesky, solve_triangular

    field, deviation = lacking
    kept = np.ones(len(fit.data), dtype=bool)
    kept[list(fit.excluded)] = False
    level = rms(fit.observed_error[kept])
    weights, columns = fit.problem.weights.values[:, fit.observed.columns], fit.observed.columns
    used, directions = fit.problem.weights.used[:, columns], fit.problem.directions
    relative = np.where(used, 1.0 / np.where(used, weights, 1.0), 1.0)
    relative /= rms(relative[used])
    sizes = np.append(0.0, deviation * np.geomspace(1e-3, 1.0, SIZES))
    evidence = np.zeros(len(sizes))
    x = coordinates(fit.data.state, field.names)
    before, after, gain = [], [], 0.0
    for one in regions:
        good = kept & one.region & np.isfinite(one.before + one.after).any(axis=1)
        before.append(one.before[good])
        after.append(one.after[good])
        counted = good[one.rows]
        rows, others = one.rows[counted], some_of(np.flatnonzero(kept & ~one.region), ROWS_KEPT)
        posterior = field.posterior(x[others], x[rows])
        numbers = np.isfinite(one.after[rows])
        known, of_row, along = one.open_[counted][numbers], np.nonzero(numbers)[0], directions[rows][numbers]
        noise = level * relative[rows][numbers]
        lower = cholesky(np.diag(noise**2) + known @ known.T, lower=True, check_finite=False)
        # With errors and covariance in units of the known one, every size of b is judged by one decomposition.
        errors = np.column_stack([one.before[rows][numbers], one.after[rows][numbers]])
        old, new = solve_triangular(lower, errors, lower=True, check_finite=False).T
        gain += float(old @ old - new @ new)
        open_ = posterior[np.ix_(of_row, of_row)] * (along @ along.T)
        scaled = solve_triangular(lower, open_, lower=True, check_finite=False)
        size, axes = np.linalg.eigh(solve_triangular(lower, scaled.T, lower=True, check_finite=False))
        turned = axes.T @ new
        variance = 1.0 + sizes[:, None] ** 2 * np.maximum(size, 0.0)
        evidence -= 0.5 * np.sum(np.log(variance) + turned**2 / variance, axis=1)
    weight = np.exp(evidence - evidence.max())
    weight[1:] /= SIZES
    beyond = float(np.sqrt(np.sum(weight * sizes**2) / np.sum(weight)))
    return Regions(field, deviation, beyond, np.concatenate(before), np.concatenate(after), gain > 0)
