"""Linear least squares on whitened rows: ranks, projections, the remaining sum of squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

MANY_COLUMNS = 150
"""Columns beyond which the normal equations take the place of QR."""
LEAST_EIGENVALUE = 1e-12
"""Eigenvalue of the hat matrix below which a direction that a penalty holds counts for nothing: a rounding error."""


@dataclass(frozen=True)
class Linear:
    """A fitted model seen from its present parameters: whitened residual and what the fitted parameters can still move.

    Args:
        residual: (N,) residual in units of the noise.
        nuisance: (N, k) basis U of the columns of the fitted parameters, orthonormal where no penalty holds them.
        row: (N,) measured row that each entry belongs to.
        independent: share of the entries that count as independent (`independent_share`).
        serial: remaining share of them where neighbours in a record are correlated (`serial_share`).
    """

    residual: Array
    nuisance: Array
    row: NDArray[np.int_]
    independent: float = 1.0
    serial: float = 1.0

    @cached_property
    def parameters(self) -> int:
        """Number of fitted parameters, rounded; where a penalty holds them, the effective number."""
        return round(float(np.sum(self.nuisance**2)))

    @cached_property
    def freedom(self) -> int:
        """Degrees of freedom: independent entries minus fitted parameters, less what a record's correlation takes."""
        return round(self.serial * (round(self.independent * len(self.residual)) - self.parameters))

    @cached_property
    def projected_residual(self) -> Array:
        """(N,) residual with the fitted parameters projected out."""
        return self.residual - self.nuisance @ (self.nuisance.T @ self.residual)

    def project(self, columns: Array) -> Array:
        """Return (N, m) columns with the fitted parameters projected out."""
        return columns - self.nuisance @ (self.nuisance.T @ columns)

    def by_row(self, a: Array, b: Array) -> Array:
        """Return (rows, k, m) sums of the products of a (N, k) and b (N, m) over the entries of each measured row."""
        size, starts = self._rows
        if not size:
            return np.asarray(np.add.reduceat(a[:, :, None] * b[:, None], starts, axis=0))
        rows = len(a) // size
        return np.asarray(np.swapaxes(a.reshape(rows, size, a.shape[1]), 1, 2) @ b.reshape(rows, size, b.shape[1]))

    @cached_property
    def _rows(self) -> tuple[int, NDArray[np.int_]]:
        """Number of entries of each measured row (0 where it differs), and the index at which each row begins."""
        starts = np.flatnonzero(np.diff(self.row, prepend=-1))
        count = np.diff(starts, append=len(self.row))
        return int(count[0]) if len(set(count.tolist())) == 1 else 0, starts

    @cached_property
    def square(self) -> float:
        """Sum of squares after the fit, y^T (I - U U^T) y, including the penalty's share."""
        return float(self.residual @ self.projected_residual)

    def extended(self, columns: Array, rank: float = 1e-5) -> Linear:
        """Return the fit with more columns C (N, m) than those of the fitted parameters.

        Directions of the columns are omitted that keep less than ``rank`` of their length in the projection. With
        M = I - U U^T of the fit so far, the new part of the basis is M C (C^T M C)^(-1/2), which is exact also where a
        penalty makes M no projection.
        """
        length = np.linalg.norm(columns, axis=0)
        scaled = columns / np.where(length > 0, length, 1.0)
        projected = self.project(scaled)
        value, vector = np.linalg.eigh(scaled.T @ projected)
        keep = value > rank**2
        new_basis = projected @ (vector[:, keep] / np.sqrt(value[keep]))
        return Linear(self.residual, np.hstack([self.nuisance, new_basis]), self.row, self.independent, self.serial)


def basis_of(columns: Array, penalty: Array) -> Array:
    """Return (N, k) U with U U^T the hat matrix of least squares with penalty |w x|^2; orthonormal where w is zero.

    More than `MANY_COLUMNS` go through the normal equations, five times as fast as QR and well conditioned by the
    penalty; what it leaves free in directions below `LEAST_EIGENVALUE` is omitted, mostly two in three.

    Args:
        columns: (N, p); penalty: (p,) w.
    """
    from scipy.linalg import LinAlgError, cholesky, solve_triangular

    p = columns.shape[1]
    if p > MANY_COLUMNS:
        data = columns.T @ columns
        gram = data + np.diag(penalty**2)
        length = _positive(np.sqrt(np.diag(gram)))
        try:
            R = cholesky(gram / np.outer(length, length), overwrite_a=True, check_finite=False) * length
        except LinAlgError:
            pass
        else:
            half = solve_triangular(R, data, trans="T", check_finite=False)
            share, way = np.linalg.eigh(solve_triangular(R, half.T, trans="T", check_finite=False))
            return np.asarray(columns @ solve_triangular(R, way[:, share > LEAST_EIGENVALUE], check_finite=False))
    length = _positive(np.sqrt(np.einsum("np,np->p", columns, columns) + penalty**2))
    soft = np.flatnonzero(penalty)
    extra = np.zeros((len(soft), p))
    extra[np.arange(len(soft)), soft] = (penalty / length)[soft]
    return np.asarray(np.linalg.qr(np.vstack([columns / length, extra]))[0][: len(columns)])


def solve_positive(matrix: Array, right: Array) -> Array:
    """Return A^-1 b, or the shortest solution where A is singular to rounding, of numbers of very different sizes.

    Args:
        matrix: (p, p) positive semidefinite A; right: (p,) or (p, k) b.
    """
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    scale = _positive(np.sqrt(np.diag(matrix)))
    unit, scaled = matrix / np.outer(scale, scale), (right.T / scale).T
    try:
        factor = cho_factor(unit, check_finite=False)
        # The squares of the pivots are bounded by eigenvalues, of which those below 1e-14 count as zero.
        good = np.diag(factor[0]).min(initial=1.0) > 1e-6
    except LinAlgError:
        good = False
    if good:
        solution = cho_solve(factor, scaled, check_finite=False)
    else:
        solution = np.linalg.pinv(unit, rcond=1e-14, hermitian=True) @ scaled
    return np.asarray((solution.T / scale).T)


def _positive(length: Array) -> Array:
    """Return lengths with 1 in place of 0, so that one can divide by them."""
    return np.where(length > 0, length, 1.0)
