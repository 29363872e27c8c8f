"""Errors of rows that a fit has not seen, without fitting again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

OPEN = 1e8
"""Variance, in that of the noise, of what nothing determines."""
FEWEST_BLOCKS = 10
"""Blocks that are left out one after another."""


def hold_out(y: Array, U: Array, blocks: NDArray[np.int_]) -> Array:
    """Return (N,) whitened held-out residuals: every block is predicted by a fit to the other blocks.

    With the hat matrix H = U U^T and e = y - H y, leaving block B out gives (I - H_BB)^-1 e_B, so that nothing is
    fitted again.

    Args:
        y: (N,) whitened residual; U: (N, p) basis of the columns of the fitted parameters.
        blocks: (N,) number of the block that each entry belongs to.
    """
    out = y - U @ (U.T @ y)
    for at in _members(blocks):
        basis = U[at]
        if len(at) <= basis.shape[1]:
            out[at] = _solve_complement(basis @ basis.T, out[at])
        else:
            out[at] += basis @ _solve_complement(basis.T @ basis, basis.T @ out[at])
    return out


def standardised(y: Array, U: Array, blocks: NDArray[np.int_]) -> Array:
    """Return (N,) held-out residuals over their standard deviations in units of the noise; arguments as in `hold_out`.

    The covariance of the held-out residuals of block B is (I - H_BB)^-1, in units of the noise.
    """
    out = y - U @ (U.T @ y)
    for at in _members(blocks):
        inverse = _solve_complement(U[at] @ U[at].T, np.eye(len(at)))
        out[at] = inverse @ out[at] / np.sqrt(np.maximum(np.diag(inverse), 1.0))
    return out


def without_block(y: Array, U: Array, at: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return (m,) errors of entries that a fit to the others predicts, and (m, k) factor G of their covariance.

    With e = (I - U_B U_B^T)^-1 (y - U U^T y)_B as in `hold_out`, the covariance (I - U_B U_B^T)^-1 is I + G G^T in
    units of the noise. A direction that the others do not determine has a variance of `OPEN`.

    Args:
        y, U: as in `hold_out`; at: (N,) mask of the m entries.
    """
    e, basis = (y - U @ (U.T @ y))[at], U[at]
    size, axes = np.linalg.eigh(basis.T @ basis)
    grown = 1.0 / np.maximum(1.0 - size, 1.0 / OPEN)
    turned = basis @ axes
    return e + turned @ (grown * (turned.T @ e)), turned * np.sqrt(grown)


def _members(blocks: NDArray[np.int_]) -> list[NDArray[np.intp]]:
    """Return the indices of the entries of each block, one array per block."""
    order = np.argsort(blocks, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(blocks[order])) + 1)


def _solve_complement(square: Array, e: Array) -> Array:
    """Return (I - H)^-1 e; the shortest least-squares solution where I - H is singular.

    Args:
        square: (m, m) H, the hat matrix or its inner product U^T U for one block; e: (m,) or (m, k) right-hand side.
    """
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    complement = np.eye(len(e)) - square
    try:
        factor = cho_factor(complement, check_finite=False)
        if np.diag(factor[0]).min(initial=1.0) > 1e-4:
            return np.asarray(cho_solve(factor, e, check_finite=False))
    except LinAlgError:
        pass
    return np.asarray(np.linalg.lstsq(complement, e, rcond=1e-9)[0])


def contiguous_blocks(groups: NDArray[np.int_]) -> NDArray[np.int_]:
    """Return (n,) number of the block of each row: contiguous poses in file order, all repeats of a pose in one block.

    There are ten blocks, or one for every 25 poses where that is more, but no more than poses.

    Args:
        groups: (n,) number of the pose of each row.
    """
    _, first, index = np.unique(groups, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    count = min(max(FEWEST_BLOCKS, len(first) // 25), len(first))
    return np.asarray(rank[index] * count // len(first))


def neighbouring_blocks(groups: NDArray[np.int_], q: Array) -> NDArray[np.int_]:
    """Return (n,) number of the block of each row: ten regions of the joint space with about as many poses each.

    All repeats of a pose are in one block. The largest region is cut in two at the median of the joint that moves most
    in it, until there are ten, or as many as poses.

    Args:
        groups: (n,) number of the pose of each row; q: (n, 6) joint angles [rad].
    """
    _, first, index = np.unique(groups, return_index=True, return_inverse=True)
    poses = q[first]
    parts = [np.arange(len(poses))]
    while len(parts) < min(FEWEST_BLOCKS, len(poses)):
        parts.sort(key=len)
        largest = parts.pop()
        order = largest[np.argsort(poses[largest, np.argmax(np.std(poses[largest], axis=0))], kind="stable")]
        parts += np.array_split(order, 2)
    block = np.empty(len(poses), dtype=int)
    for k, part in enumerate(parts):
        block[part] = k
    return block[index]
