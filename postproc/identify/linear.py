"""Linear least squares on whitened rows: ranks, projections, the fall of the residual, held-out errors."""

from __future__ import annotations

from collections.abc import Sequence
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
    """

    residual: Array
    nuisance: Array
    row: NDArray[np.int_]

    @cached_property
    def freedom(self) -> int:
        """Entries minus fitted parameters (the effective number, where a penalty holds them)."""
        return len(self.residual) - round(float(np.sum(self.nuisance**2)))

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
        return Linear(self.residual, np.hstack([self.nuisance, more]), self.row)


def basis_of(columns: Array, penalty: Array) -> Array:
    """(N, p) U with U U^T the hat matrix of a least-squares problem with penalty |w x|^2; orthonormal where w is zero.

    Many columns go through the normal equations (five times as fast as QR, and a penalty keeps them well conditioned).
    """
    from scipy.linalg import LinAlgError, cholesky, solve_triangular

    p = columns.shape[1]
    if not p:
        return columns
    length = np.sqrt(np.sum(columns**2, axis=0) + penalty**2)
    length = np.where(length > 0, length, 1.0)
    scaled = columns / length
    if p > MANY:
        try:
            R = cholesky(scaled.T @ scaled + np.diag((penalty / length) ** 2))
            return np.asarray(solve_triangular(R, scaled.T, trans="T").T)
        except LinAlgError:
            pass
    soft = np.flatnonzero(penalty)
    extra = np.zeros((len(soft), p))
    extra[np.arange(len(soft)), soft] = (penalty / length)[soft]
    return np.asarray(np.linalg.qr(np.vstack([scaled, extra]))[0][: len(columns)])


def f_test(before: float, after: float, added: int, freedom: float) -> float:
    """P value of the fall of a sum of squares by ``added`` parameters, ``freedom`` degrees of freedom left after."""
    from scipy.special import betainc

    if added == 0 or freedom <= 0 or before <= after:
        return 1.0
    if after <= 0:
        return 0.0
    # P(F > f) = I_x(freedom/2, added/2), x = freedom / (freedom + added f); exact in the far tail, unlike 1 - cdf.
    return float(betainc(freedom / 2, added / 2, after / before))


def hold_out(linear: Linear, columns: Sequence[Array], blocks: NDArray[np.int_]) -> Array:
    """(N,) whitened held-out residual: every block predicted by a fit of nuisance and columns to the other blocks.

    With orthonormal columns U of all parameters and the fitted residual e, leaving block B out gives
    e_B(out) = (I - U_B U_B^T)^-1 e_B: no refits.

    Args:
        blocks: (N,) number of the block of each entry; entries below zero (rows of a penalty) always stay in.
    """
    for block in columns:
        linear = linear.extended(block)
    U, e = linear.nuisance, linear.rest
    out = np.empty_like(e)
    out[blocks < 0] = 0.0
    for block in np.unique(blocks[blocks >= 0]):
        at = np.flatnonzero(blocks == block)
        small = U[at]
        if len(at) <= small.shape[1]:
            out[at] = np.linalg.lstsq(np.eye(len(at)) - small @ small.T, e[at], rcond=1e-9)[0]
        else:
            inner = np.eye(small.shape[1]) - small.T @ small
            out[at] = e[at] + small @ np.linalg.lstsq(inner, small.T @ e[at], rcond=1e-9)[0]
    return out


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
