"""Linear least squares on whitened rows: ranks, projections, the fall of the residual, held-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

RANK = 1e-7
"""Directions whose columns shrink below this share of their length are not determined by the data."""


@dataclass(frozen=True)
class Linear:
    """A fitted model seen from its present parameters: whitened residual and what the fitted parameters can still move.

    Args:
        residual: (N,) residual in units of the noise.
        nuisance: (N, k) orthonormal basis of the columns of the fitted parameters.
        row: (N,) measured row that each entry belongs to.
    """

    residual: Array
    nuisance: Array
    row: NDArray[np.int_]

    @property
    def freedom(self) -> int:
        """Entries minus fitted parameters."""
        return len(self.residual) - int(self.nuisance.shape[1])

    @cached_property
    def rest(self) -> Array:
        """(N,) the residual with the fitted parameters projected out."""
        return self.residual - self.nuisance @ (self.nuisance.T @ self.residual)

    def project(self, columns: Array) -> Array:
        """(N, m) columns with the fitted parameters projected out."""
        return columns - self.nuisance @ (self.nuisance.T @ columns)

    def extended(self, columns: Array) -> Linear:
        """The same with more columns among the fitted parameters."""
        basis, _ = orthonormal(self.project(columns), np.linalg.norm(columns, axis=0))
        # Projecting twice keeps the basis orthogonal where columns were nearly inside the nuisance.
        basis = np.linalg.qr(self.project(basis))[0] if basis.shape[1] else basis
        return Linear(self.residual, np.hstack([self.nuisance, basis]), self.row)


def orthonormal(columns: Array, length: Array, rank: float = 1e-5) -> tuple[Array, Array]:
    """Orthonormal basis of projected columns, and its singular values relative to the length before projection.

    Args:
        columns: (N, m) projected columns; length: (m,) their lengths before the projection.

    Directions below ``rank`` of that length are left out.
    """
    scale = np.where(length > 0, length, 1.0)
    if columns.shape[1] == 0:
        return columns, np.zeros(0)
    if columns.shape[1] == 1:
        norm = np.linalg.norm(columns) / scale[0]
        return (columns / (norm * scale[0]), np.array([norm])) if norm > rank else (columns[:, :0], np.zeros(0))
    # The small Gram problem is enough: its accuracy (1e-8 in singular values) is far below `rank`.
    scaled = columns / scale
    value, vector = np.linalg.eigh(scaled.T @ scaled)
    singular = np.sqrt(np.maximum(value, 0.0))
    keep = singular > rank
    return scaled @ (vector[:, keep] / singular[keep]), singular[keep]


def undetermined(columns: Array, rank: float = RANK) -> tuple[NDArray[np.bool_], Array]:
    """Which columns the others already determine: (m,) True where a parameter is held, and the singular values.

    QR with column pivoting of the columns scaled to unit length; the later column of a dependent set is held.

    Source: Golub and Van Loan, Matrix Computations, 5.4.2. Columns that vanish are held as well.
    """
    from scipy.linalg import qr

    length = np.linalg.norm(columns, axis=0)
    alive = length > 0
    held = ~alive
    if not alive.any():
        return held, np.zeros(0)
    scaled = columns[:, alive] / length[alive]
    triangle, pivot = qr(scaled, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    index = np.flatnonzero(alive)
    held[index[pivot[: len(diagonal)][diagonal < rank * diagonal[0]]]] = True
    held[index[pivot[len(diagonal) :]]] = True
    return held, diagonal


def fall(rest: Array, columns: Array, length: Array) -> tuple[float, int]:
    """How much the sum of squares falls with projected columns, and how many of them count."""
    basis, _ = orthonormal(columns, length)
    along = basis.T @ rest
    return float(along @ along), basis.shape[1]


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


def contiguous_blocks(groups: NDArray[np.int_], count: int = 10) -> NDArray[np.int_]:
    """(n,) block of each row: contiguous rows in file order, repeats of one pose never split."""
    _, first = np.unique(groups, return_index=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=int)
    rank[order] = np.arange(len(order))
    _, index = np.unique(groups, return_inverse=True)
    return np.asarray(rank[index] * min(count, len(order)) // len(order))
