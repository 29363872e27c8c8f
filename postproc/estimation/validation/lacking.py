"""What a fitted model lacks, as a smooth random function of the joint angles: its size and how fast it changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.solution import Solution
from postproc.model.uncertainty.field import COORDINATES, Field, coordinates

FEWEST_ROWS = 30
"""Measured rows from which on anything is said."""
ROWS_JUDGED, ROWS_KEPT = 110, 250
"""Rows that the lengths are fitted to, and that tell afterwards where the arm was measured."""
ORDINARY_LENGTH = 1.0
"""Angle [rad] over which what arms lack changes; of other coordinates, the range that was measured."""
LENGTHS = (0.05, 20.0)
"""Least and largest length, in ordinary ones."""
RANK = 1e-6
"""Singular value, in the largest, below which a column repeats others."""
FEWEST_FREE = 20
"""Measured numbers beyond the fitted parameters from which on anything is said."""


def lacking_field(fit: Solution) -> tuple[Field, float] | None:
    """Return what a fitted model lacks as a random function, and its standard deviation per axis [m], [rad] of angles.

    Each axis of what is observed follows a function of its own, of one covariance; a number read along a direction
    follows their sum along it. Its lengths l, and the ratio a of
    its variance to that of the noise, are where restricted likelihood times prior is largest (`RestrictedLikelihood`).
    None without 30 measured rows.
    """
    from scipy.optimize import minimize

    weights, columns = fit.problem.weights, fit.observed.columns
    used = weights.used[:, columns]
    good = np.flatnonzero(used.any(axis=1))
    if len(good) < FEWEST_ROWS:
        return None
    rows = some_of(good, ROWS_JUDGED)
    place = np.reshape(np.cumsum(weights.used.ravel()) - 1, weights.used.shape)[:, columns][rows]
    entries, of_row = place[used[rows]], np.nonzero(used[rows])[0]
    every = coordinates(fit.data.state, COORDINATES)
    spread = np.ptp(every[good], axis=0)
    chosen = np.flatnonzero((np.arange(len(COORDINATES)) < 6) | (spread > 0))
    ordinary = np.where(chosen < 6, ORDINARY_LENGTH, spread[chosen])
    x, y, U = every[np.ix_(rows, chosen)] / ordinary, fit.linear.residual[entries], fit.basis()[entries]
    if used[rows].all():
        likelihood = RestrictedLikelihood.of(y, U, x)
    else:
        along = fit.problem.directions[rows][used[rows]]
        likelihood = RestrictedLikelihood.of(y, U, x[of_row], along @ along.T)
    if likelihood.freedom < FEWEST_FREE:
        return None
    bounds = [(-9.0, 12.0), *[tuple(np.log(LENGTHS))] * len(chosen)]
    starts = [np.append(ratio, np.zeros(len(chosen))) for ratio in (-1.0, 2.0)]
    fitted = [minimize(likelihood.cost, t, jac=True, method="L-BFGS-B", bounds=bounds) for t in starts]
    best = min(fitted, key=lambda r: r.fun).x
    ratio, unit = float(np.exp(best[0])), float(np.mean(weights.values[rows, columns][used[rows]]))
    kept = every[np.ix_(some_of(good, ROWS_KEPT), chosen)]
    field = Field(tuple(COORDINATES[i] for i in chosen), ordinary * np.exp(best[1:]), kept, 1.0 / ratio)
    return field, float(np.sqrt(ratio * max(likelihood.noise(best), 0.0))) / unit


@dataclass(frozen=True)
class RestrictedLikelihood:
    """The likelihood of the residual of a fit beside its parameters, times the prior of a random function.

    The residual has covariance n^2 V (x) I, V = 1 + a exp(-sum_i (x_i - x'_i)^2 / 2 l_i^2), n^2 that of the noise. The
    likelihood is that of the part of the residual that no parameter takes up (Patterson and Thompson 1971); ln l is
    normal about 0 with deviation 1, and a / (1 + a) uniform.

    Args:
        y: (m w,) whitened residual of w numbers a row; U: (m w, p) basis of the fitted parameters' columns.
        square: (m, m, d) squared differences of the coordinates of every two rows.
        along: (m, m) cosines between the directions of every two numbers, where rows are single numbers; else 1.
    """

    y: Array
    U: Array
    square: Array
    along: Array | float = 1.0

    @classmethod
    def of(cls, y: Array, columns: Array, x: Array, along: Array | float = 1.0) -> RestrictedLikelihood:
        """Return the likelihood with linearly dependent columns taken out; x: (m, d) coordinates of the rows."""
        basis, size, _ = np.linalg.svd(columns, full_matrices=False)
        U = basis[:, size > RANK * max(size.max(initial=0.0), 1e-300)]
        return cls(y, U, (x[:, None] - x) ** 2, along)

    @property
    def freedom(self) -> int:
        """Numbers less parameters."""
        return int(self.U.shape[0] - self.U.shape[1])

    def cost(self, t: Array) -> tuple[float, Array]:
        """Return minus the logarithm of likelihood times prior, and its derivative (1 + d,), at t = (ln a, ln l)."""
        rows, width = len(self.square), len(self.y) // len(self.square)
        ratio, inverse_square = np.exp(t[0]), np.exp(-2 * t[1:])
        part, lower, inverse, VU, gram, w = self._solved(t)
        quadratic = max(float(self.y @ w), 1e-300)
        scale = width * np.log(np.diag(lower)).sum() + 0.5 * np.linalg.slogdet(gram)[1]
        value = 0.5 * self.freedom * np.log(quadratic) + scale
        value += 0.5 * float(t[1:] @ t[1:]) - t[0] + 2 * np.log1p(ratio)
        projected = np.linalg.solve(gram, VU.T).reshape(-1, rows, width)
        P = width * inverse - np.einsum("xik,kyi->xy", VU.reshape(rows, width, -1), projected)
        W = w.reshape(rows, width) @ w.reshape(rows, width).T
        change = 0.5 * (P - self.freedom / quadratic * W) * part
        slope = np.append(change.sum(), np.einsum("xy,xyd->d", change, self.square) * inverse_square)
        return float(value), slope + np.append(2 * ratio / (1 + ratio) - 1, t[1:])

    def noise(self, t: Array) -> float:
        """Return the likeliest variance of the noise at t, in units of the assumed one."""
        return float(self.y @ self._solved(t)[-1]) / self.freedom

    def _solved(self, t: Array) -> tuple[Array, ...]:
        """Return V - 1, the Cholesky factor of V and its inverse, V^-1 U, U^T V^-1 U, and P y, P as `cost` has it."""
        from scipy.linalg import cho_solve

        rows, width = len(self.square), len(self.y) // len(self.square)
        part = self.along * np.exp(t[0]) * np.exp(-0.5 * self.square @ np.exp(-2 * t[1:]))
        lower = np.linalg.cholesky(part + np.eye(rows))
        inverse = cho_solve((lower, True), np.eye(rows))
        VU = (inverse @ self.U.reshape(rows, -1)).reshape(len(self.y), -1)
        gram = self.U.T @ VU
        Vy = (inverse @ self.y.reshape(rows, width)).ravel()
        return part, lower, inverse, VU, gram, Vy - VU @ np.linalg.solve(gram, VU.T @ self.y)


def some_of(index: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """Return indices, thinned evenly to at most ``most``."""
    return index[np.unique(np.linspace(0, len(index) - 1, min(most, len(index))).round().astype(int))]
