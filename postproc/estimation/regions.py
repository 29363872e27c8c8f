"""What a model is worth in regions of the joint space that no row of its fit came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.estimation.held_out import left_out
from postproc.estimation.linear import Linear
from postproc.estimation.solution import Solution
from postproc.measure.errors import rms
from postproc.model.arm import Model
from postproc.model.field import COORDINATES, Field, coordinates

FEWEST_ROWS = 30
"""Measured rows from which on anything is said."""
ROWS_JUDGED, ROWS_KEPT = 110, 250
"""Rows that the lengths are fitted to, and that tell afterwards where the arm was measured."""
ORDINARY_LENGTH = 1.0
"""Angle [rad] over which what arms lack changes; of other coordinates, the range that was measured."""
LENGTHS = (0.05, 20.0)
"""Least and largest length, in ordinary ones."""
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
class LeftOut:
    """A region that was left out.

    Args:
        inside: (n,) mask of its rows. before: (n, w) errors [m], [rad] of angles, of the w numbers of a row that are
            observed, by the model before; after: the same by the model; nan where they do not count.
        rows: (m,) index of some of its rows; open_: (m, w, k) what the parameters may be off there, one standard
            deviation [m], [rad] each.
    """

    inside: NDArray[np.bool_]
    before: Array
    after: Array
    rows: NDArray[np.intp]
    open_: Array

    @classmethod
    def of(
        cls, before: Solution, after: tuple[Solution, Linear], inside: NDArray[np.bool_], variance: float
    ) -> LeftOut:
        """Return a region as the rows outside of it predict it.

        Args:
            before: the fit before. after: the fit whose weights count, and the linear problem, with what was added.
            variance: of the residual of the fit with it, in units of the assumed one.
        """
        old, _ = _left_out(before, before.linear, inside)
        new, known = _left_out(*after, inside)
        rows = _some(np.flatnonzero(inside & np.isfinite(old + new).all(axis=1)), ROWS_JUDGED)
        return cls(inside, old, new, rows, np.sqrt(variance) * known[np.searchsorted(np.flatnonzero(inside), rows)])


def _left_out(fit: Solution, linear: Linear, inside: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return errors (n, w) of what is observed in m rows that were left out, nan elsewhere.

    Args:
        fit: whose weights count; linear: of that fit, or with more columns; inside: (n,) mask of the rows.

    Returns:
        The errors, and (m, w, k) what parameters may be off there where the noise is as assumed.
    """
    weights = fit.problem.weights.rows(inside)
    at = np.repeat(inside[:, None], weights.values.shape[1], axis=1)[fit.problem.weights.used]
    errors, known = left_out(linear.residual, linear.nuisance, at)
    metres = np.full((*weights.values.shape, 1 + known.shape[1]), np.nan)
    metres[weights.used] = np.column_stack([errors, known]) / weights.values[weights.used][:, None]
    metres = metres[:, fit.observed.columns]
    every = np.full((len(inside), metres.shape[1]), np.nan)
    every[inside] = metres[..., 0]
    return every, metres[..., 1:]


def judged_by_regions(fit: Solution, lacking: tuple[Field, float], regions: Sequence[LeftOut]) -> Regions:
    """Return what a fit is worth beyond its rows.

    The model before lacks a smooth random function of variance s^2 (`lacking_field`). What of that still lacks is
    another one, of the same lengths and variance b^2 <= s^2, of which the rows tell all but the posterior covariance.
    With t the residual deviation of the fit and G what its parameters may be off, errors of a region are normal with
    covariance t^2 I + G G^T + b^2 (K_BB - K_BA (K_AA + r I)^-1 K_AB), A the rows of the other regions. The logarithm of
    b is uniform below that of s, and its square averaged over what the errors of all regions say.

    Args:
        lacking: by the model before, of `lacking_field`.
    """
    from scipy.linalg import cholesky, solve_triangular

    field, deviation = lacking
    kept = np.ones(len(fit.data), dtype=bool)
    kept[list(fit.excluded)] = False
    level = rms(fit.observed_error[kept])
    sizes = np.append(0.0, deviation * np.geomspace(1e-3, 1.0, SIZES))
    evidence = np.zeros(len(sizes))
    x = coordinates(fit.data.state, field.names)
    before, after, gain = [], [], 0.0
    for region in regions:
        good = kept & region.inside & np.isfinite(region.before + region.after).all(axis=1)
        before.append(region.before[good])
        after.append(region.after[good])
        counted = good[region.rows]
        rows, others = region.rows[counted], _some(np.flatnonzero(kept & ~region.inside), ROWS_KEPT)
        across = field.covariance(x[others], x[rows])
        told = field.covariance(x[others], x[others]) + max(field.noise, 1e-9) * np.eye(len(others))
        left = field.covariance(x[rows], x[rows]) - across.T @ np.linalg.solve(told, across)
        known = region.open_[counted].reshape(region.after[rows].size, -1)
        lower = cholesky(level**2 * np.eye(len(known)) + known @ known.T, lower=True, check_finite=False)
        first = solve_triangular(lower, np.kron(left, np.eye(region.after.shape[1])), lower=True, check_finite=False)
        second = solve_triangular(lower, first.T, lower=True, check_finite=False)
        size, axes = np.linalg.eigh(second)
        errors = np.column_stack([region.before[rows].ravel(), region.after[rows].ravel()])
        old, new = solve_triangular(lower, errors, lower=True, check_finite=False).T
        gain += float(old @ old - new @ new)
        turned = axes.T @ new
        variance = 1.0 + sizes[:, None] ** 2 * np.maximum(size, 0.0)
        evidence -= 0.5 * np.sum(np.log(variance) + turned**2 / variance, axis=1)
    weight = np.exp(evidence - evidence.max())
    weight[1:] /= SIZES
    beyond = float(np.sqrt(np.sum(weight * sizes**2) / np.sum(weight)))
    return Regions(field, deviation, beyond, np.concatenate(before), np.concatenate(after), gain > 0)


def _some(index: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """Return indices, thinned evenly to at most ``most``."""
    return index[np.unique(np.linspace(0, len(index) - 1, min(most, len(index))).round().astype(int))]


def lacking_field(fit: Solution) -> tuple[Field, float] | None:
    """Return what a fitted model lacks as a random function, and its standard deviation per axis [m], [rad] of angles.

    Each axis of what is observed follows a function of its own, of one covariance. Its lengths l, and the ratio a of
    its variance to that of the noise, are where restricted likelihood (Patterson and Thompson 1971) times prior is
    largest: ln l is normal about an ordinary length with deviation 1, and a / (1 + a) uniform. None without 30 measured
    rows.
    """
    from scipy.linalg import cho_solve
    from scipy.optimize import minimize

    weights = fit.problem.weights
    columns = fit.observed.columns
    width = columns.stop - columns.start
    good = np.flatnonzero(weights.used[:, columns].all(axis=1))
    if len(good) < FEWEST_ROWS:
        return None
    rows = _some(good, ROWS_JUDGED)
    start = (np.cumsum(weights.used.ravel()) - 1)[weights.used.shape[1] * rows + columns.start]
    at = (start[:, None] + np.arange(width)).ravel()
    y = fit.linear.residual[at]
    left, size, _ = np.linalg.svd(fit.basis()[at], full_matrices=False)
    U = left[:, size > 1e-6 * max(size.max(initial=0.0), 1e-300)]
    freedom = len(y) - U.shape[1]
    if freedom < 20:
        return None
    every = coordinates(fit.data.state, COORDINATES)
    spread = np.ptp(every[good], axis=0)
    used = np.flatnonzero((np.arange(len(COORDINATES)) < 6) | (spread > 0))
    ordinary = np.where(used < 6, ORDINARY_LENGTH, spread[used])
    x = every[np.ix_(rows, used)] / ordinary
    square = (x[:, None] - x) ** 2
    count = len(rows)

    def cost(t: Array) -> tuple[float, Array]:
        """Return minus the logarithm of likelihood times prior, and its slope, at ln a and ln l (1 + d,)."""
        ratio, inverse_square = np.exp(t[0]), np.exp(-2 * t[1:])
        part = ratio * np.exp(-0.5 * square @ inverse_square)
        lower = np.linalg.cholesky(part + np.eye(count))
        inverse = cho_solve((lower, True), np.eye(count))
        VU = (inverse @ U.reshape(count, -1)).reshape(len(y), -1)
        inner = U.T @ VU
        taken = np.linalg.solve(inner, VU.T)
        w = (inverse @ y.reshape(count, width)).ravel() - VU @ (taken @ y)
        rest = max(float(y @ w), 1e-300)
        value = 0.5 * freedom * np.log(rest) + width * np.log(np.diag(lower)).sum() + 0.5 * np.linalg.slogdet(inner)[1]
        P = width * inverse - np.einsum("xik,kyi->xy", VU.reshape(count, width, -1), taken.reshape(-1, count, width))
        W = w.reshape(count, width) @ w.reshape(count, width).T
        change = 0.5 * (P - freedom / rest * W) * part
        slope = np.append(change.sum(), np.einsum("xy,xyd->d", change, square) * inverse_square)
        value += 0.5 * float(t[1:] @ t[1:]) - t[0] + 2 * np.log1p(ratio)
        return float(value), slope + np.append(2 * ratio / (1 + ratio) - 1, t[1:])

    bounds = [(-9.0, 12.0), *[tuple(np.log(LENGTHS))] * len(used)]
    starts = [np.append(ratio, np.zeros(len(used))) for ratio in (-1.0, 2.0)]
    best = min((minimize(cost, s, jac=True, method="L-BFGS-B", bounds=bounds) for s in starts), key=lambda r: r.fun)
    ratio, lengths = float(np.exp(best.x[0])), ordinary * np.exp(best.x[1:])
    part = ratio * np.exp(-0.5 * square @ np.exp(-2 * best.x[1:]))
    VU = np.linalg.solve(part + np.eye(count), U.reshape(count, -1)).reshape(len(y), -1)
    Vy = np.linalg.solve(part + np.eye(count), y.reshape(count, width)).ravel()
    noise = float(y @ Vy - (VU.T @ y) @ np.linalg.solve(U.T @ VU, VU.T @ y)) / freedom
    unit = float(np.mean(weights.values[rows, columns]))
    kept = every[np.ix_(_some(good, ROWS_KEPT), used)]
    field = Field(tuple(COORDINATES[i] for i in used), lengths, kept, 1.0 / ratio)
    return field, float(np.sqrt(ratio * noise)) / unit
