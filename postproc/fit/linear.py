"""Linear least squares on whitened rows: ranks, projections, the fall of the residual, held-out errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

MANY = 150
"""Columns beyond which the normal equations take the place of QR."""


@dataclass(frozen=True)
class Linear:
    """A fitted model seen from its present parameters: whitened residual and what the fitted parameters can still move.

    Args:
        residual: (N,) residual in units of the noise.
        nuisance: (N, k) basis U of the columns of the fitted parameters, orthonormal where no penalty holds them.
        row: (N,) measured row that each entry belongs to.
        independent: share of the entries that count as numbers of their own (`independent_share`).
        serial: share that is left of them where neighbours in a record resemble each other (`serial_share`).
    """

    residual: Array
    nuisance: Array
    row: NDArray[np.int_]
    independent: float = 1.0
    serial: float = 1.0

    @cached_property
    def parameters(self) -> int:
        """Fitted parameters (the effective number, where a penalty holds them)."""
        return round(float(np.sum(self.nuisance**2)))

    @cached_property
    def freedom(self) -> int:
        """Independent entries minus fitted parameters, as many as a record's correlation leaves of them."""
        return round(self.serial * (round(self.independent * len(self.residual)) - self.parameters))

    @cached_property
    def rest(self) -> Array:
        """(N,) the residual with the fitted parameters projected out."""
        return self.residual - self.nuisance @ (self.nuisance.T @ self.residual)

    def project(self, columns: Array) -> Array:
        """(N, m) columns with the fitted parameters projected out."""
        return columns - self.nuisance @ (self.nuisance.T @ columns)

    @cached_property
    def square(self) -> float:
        """y^T (I - U U^T) y: the sum of squares that is left, with what a penalty counts."""
        return float(self.residual @ self.rest)

    def extended(self, columns: Array, rank: float = 1e-5) -> Linear:
        """The same with more columns among the fitted ones; directions below ``rank`` of their length are left out.

        With M = I - U U^T of the problem so far, the new part of the basis is M C (C^T M C)^(-1/2): exact also where a
        penalty makes M no projection.
        """
        length = np.linalg.norm(columns, axis=0)
        scaled = columns / np.where(length > 0, length, 1.0)
        rest = self.project(scaled)
        value, vector = np.linalg.eigh(scaled.T @ rest)
        keep = value > rank**2
        more = rest @ (vector[:, keep] / np.sqrt(value[keep]))
        return Linear(self.residual, np.hstack([self.nuisance, more]), self.row, self.independent, self.serial)


def serial_share(errors: Array) -> float:
    """Share of the rows of a record that count as independent, 1 / (1 + 2 sum of rho_k).

    rho_k is the autocorrelation at lag k, summed until it is lost in its own noise (Bartlett 1946; initial sequence of
    Geyer 1992). A tracker that reads fifty times a second repeats its own error.

    Args:
        errors: (n, r) whitened errors in the order of time, NaN where not measured.
    """
    x = np.nan_to_num(errors)
    n, total = len(x), float(np.sum(x**2))
    if n < 20 or total == 0.0:
        return 1.0
    chance, whole = 2 / np.sqrt(np.isfinite(errors).sum()), 1.0
    for k in range(1, n // 4):
        rho = float(np.sum(x[k:] * x[:-k])) / total
        if rho < chance:
            break
        whole += 2 * rho
    return 1 / whole


def independent_share(residual: Array, turns: Array, row: NDArray[np.int_]) -> float:
    """Share of the entries of a residual that count as independent, in (0, 1].

    Where one joint's angle is off by a number of its own in every pose, the r numbers of a pose are one number. With f
    the largest share of the sum of squares that a free turn of one joint in every pose explains, and the rest spread
    evenly over the r - 1 other directions, they count as 1 / (f^2 + (1 - f)^2 / (r - 1)): r for noise, 1 for f = 1 (the
    participation ratio of a spectrum).

    Args:
        residual: (N,) whitened; turns: (N, 6) whitened derivative by a turn of each joint; row: (N,) row of each entry.
    """
    per_row = np.bincount(row)
    size = len(row) / max(int((per_row > 0).sum()), 1)
    total = float(residual @ residual)
    if size < 1.5 or total == 0.0:
        return 1.0
    share = 0.0
    for turn in turns.T:
        length, along = np.bincount(row, turn**2), np.bincount(row, turn * residual)
        share = max(share, float(np.sum(along**2 / np.where(length > 0, length, 1.0))) / total)
    share = max(share, 1 / size)
    return 1 / (size * (share**2 + (1 - share) ** 2 / (size - 1)))


def basis_of(columns: Array, penalty: Array) -> Array:
    """(N, p) U with U U^T the hat matrix of least squares with penalty |w x|^2; orthonormal where w is zero."""
    from scipy.linalg import solve_triangular

    Q, R = _factored(columns, penalty)
    return np.asarray(solve_triangular(R, columns.T, trans="T", check_finite=False).T) if Q is None else Q


def _factored(columns: Array, penalty: Array) -> tuple[Array | None, Array]:
    """Q and R of [A; w] = [Q; ..] R; Q = A R^-1 is left to the caller where there are many columns.

    They go through the normal equations (five times as fast as QR, and a penalty keeps them well conditioned).
    """
    from scipy.linalg import LinAlgError, cholesky

    p = columns.shape[1]
    if p > MANY:
        gram = columns.T @ columns
        gram[np.diag_indices(p)] += penalty**2
        length = _positive(np.sqrt(np.diag(gram)))
        try:
            return None, cholesky(gram / np.outer(length, length), overwrite_a=True, check_finite=False) * length
        except LinAlgError:
            pass
    length = _positive(np.sqrt(np.einsum("np,np->p", columns, columns) + penalty**2))
    soft = np.flatnonzero(penalty)
    extra = np.zeros((len(soft), p))
    extra[np.arange(len(soft)), soft] = (penalty / length)[soft]
    Q, R = np.linalg.qr(np.vstack([columns / length, extra]))
    return Q[: len(columns)], R * length


def _positive(length: Array) -> Array:
    return np.where(length > 0, length, 1.0)


def f_test(before: float, after: float, added: int, freedom: float) -> float:
    """P value of the fall of a sum of squares by ``added`` parameters, ``freedom`` degrees of freedom left after."""
    from scipy.special import betainc

    if added == 0 or freedom <= 0 or before <= after:
        return 1.0
    if after <= 0:
        return 0.0
    # P(F > f) = I_x(freedom/2, added/2), x = freedom / (freedom + added f); exact in the far tail, unlike 1 - cdf.
    return float(betainc(freedom / 2, added / 2, after / before))


def schwarz(before: float, fall: float, count: int, freedom: float, tried: float) -> float:
    """Nu log(S / (S - fall)) - m log(nu) - 2 log(tried).

    The same for parameters whose ordinary size nobody knows, Schwarz (1978).
    """
    if count == 0 or freedom - count < 1:
        return -np.inf
    after = max(before - fall, 1e-12 * before)
    return float(freedom * np.log(before / after) - count * np.log(freedom) - 2 * np.log(tried))


def hold_out(y: Array, U: Array, blocks: NDArray[np.int_]) -> Array:
    """(N,) whitened held-out residual: every block predicted by a fit to the others.

    With the hat matrix H = U U^T and e = y - H y, leaving block B out gives e_B(out) = (I - H_BB)^-1 e_B: no refits.

    Args:
        y: (N,); U: (N, p); blocks: (N,) number of the block of each entry.
    """
    out = y - U @ (U.T @ y)
    order = np.argsort(blocks, kind="stable")
    for at in np.split(order, np.flatnonzero(np.diff(blocks[order])) + 1):
        own = U[at]
        if len(at) <= own.shape[1]:
            out[at] = _left_out(own @ own.T, out[at])
        else:
            out[at] += own @ _left_out(own.T @ own, own.T @ out[at])
    return out


def _left_out(square: Array, e: Array) -> Array:
    """(I - H)^-1 e; the shortest solution where nothing but this block tells something."""
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    whole = np.eye(len(e)) - square
    try:
        factor = cho_factor(whole, check_finite=False)
        if np.diag(factor[0]).min(initial=1.0) > 1e-4:
            return np.asarray(cho_solve(factor, e, check_finite=False))
    except LinAlgError:
        pass
    return np.asarray(np.linalg.lstsq(whole, e, rcond=1e-9)[0])


def contiguous_blocks(groups: NDArray[np.int_], count: int = 0) -> NDArray[np.int_]:
    """(n,) block of each row: contiguous rows in file order, repeats of one pose never split.

    Args:
        count: number of blocks; 0 takes ten, and blocks of 25 poses on long records.
    """
    _, first = np.unique(groups, return_index=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=int)
    rank[order] = np.arange(len(order))
    _, index = np.unique(groups, return_inverse=True)
    count = count or max(10, len(order) // 25)
    return np.asarray(rank[index] * min(count, len(order)) // len(order))
