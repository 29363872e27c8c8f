"""What free functions of the channels make of a residual: how much of it is noise, and how far they would bring it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.evidence import DECADES
from postproc.estimation.held_out import contiguous_blocks
from postproc.estimation.solution import Solution
from postproc.measure.errors import rms
from postproc.model.derivatives.places import INSTRUMENT

NUMBERS = 450
"""Measured numbers that are looked at: 150 positions, or 75 poses of six encoders."""
WIDTHS = (0.03, 0.1, 0.3, 1.0)
"""Lengths over which a free function changes, as shares of a channel's range."""
FIELD_WIDTHS = {"q": WIDTHS, "load": WIDTHS[1:], "v": WIDTHS[2:], "dir": WIDTHS[2:3]}
"""Channels by which a joint may move itself, and the lengths that they can carry."""
SLOW = ("temperature", "time", "session")


@dataclass(frozen=True)
class ResidualSplit:
    """What the residual of a fit consists of.

    Args:
        noise_share: share of its variance that follows no channel, in (0, 1].
        held_out: error of what is observed [m], [rad] of angles, that the likeliest free function leaves on rows it has
            not seen.
    """

    noise_share: float
    held_out: float


def split_residual(fit: Solution) -> ResidualSplit:
    """Split the variance of a fit's residual into what follows the channels and noise, without naming any physics.

    The residual is noise plus a Gaussian process: joints and the instrument move by free functions of channels, with
    covariance J(x) k(x, x') J(x')^T. The process is one of several (each joint by its channel, every joint by
    all channels, by all angles at once, by the slow channels), or none at even odds. Every process and every ratio of
    variances is weighted by its restricted likelihood, which allows for what the fitted parameters took up. Held-out
    errors of a block B follow in closed form, e_B = (P_BB)^-1 (P y)_B, the parameters being fitted without the block,
    too. Sources: Patterson and Thompson (1971); Rasmussen and Williams (2006), Sec. 2.7 and 5.4.2; Dubrule (1983).
    """
    columns = fit.observed.columns
    measured = fit.problem.weights.used[:, columns].any(axis=1)
    width = columns.stop - columns.start
    rows = np.flatnonzero(measured)[:: max(1, -(-int(measured.sum()) * width // NUMBERS))]
    used = fit.problem.weights.used[rows, columns].ravel()
    field = _Field.of(fit, rows, used)
    if len(rows) < 20 or field.freedom < 20:
        return ResidualSplit(1.0, fit.held_out_rms)
    alone = field.restricted(field.noise_covariance)
    evidence, variance, best, chosen = [alone[0]], [alone[1]], alone[0], field.noise_covariance
    several = list(_processes(fit, rows, used))
    for process in several:
        for ratio in DECADES:
            covariance = ratio * process + field.noise_covariance
            likelihood, factor = field.restricted(covariance)
            evidence.append(likelihood - np.log(len(several) * len(DECADES)))
            variance.append(factor)
            if likelihood > best:
                best, chosen = likelihood, covariance
    weight = np.exp(np.array(evidence) - max(evidence))
    noise = float(weight @ variance / weight.sum() / alone[1])
    blocks = np.repeat(contiguous_blocks(fit.data.fold_group)[rows], width)[used]
    each = np.zeros(len(used))
    each[used] = field.held_out(chosen, blocks)
    out = np.zeros(fit.problem.weights.values.shape)
    out[rows, columns] = each.reshape(-1, width)
    error = fit.problem.weights.measured(out[fit.problem.weights.used])[rows, columns]
    return ResidualSplit(min(noise, 1.0), min(rms(error), fit.held_out_rms))


@dataclass(frozen=True)
class _Field:
    """Whitened errors of some rows of a fit, the columns of its parameters, and the covariance without any process.

    Args:
        y: (N,) whitened errors. U: (N, p) orthonormal basis of the fitted parameters' columns without a penalty.
        noise_covariance: (N, N) of the noise, 1 each, plus what the penalised free functions of the model allow.
    """

    y: Array
    U: Array
    noise_covariance: Array

    @classmethod
    def of(cls, fit: Solution, rows: NDArray[np.int_], used: NDArray[np.bool_]) -> _Field:
        """Return the field of some rows of a fit.

        Args:
            rows: indices of the m rows; used: (m k,) mask of those of their k observed numbers that are in use, N of
                them True.
        """
        size, columns = fit.problem.weights.values.shape[1], fit.observed.columns
        place = np.cumsum(fit.problem.weights.used.ravel()) - 1
        at = place[(size * rows[:, None] + np.arange(columns.start, columns.stop)).ravel()[used]]
        soft = fit.penalty > 0
        penalised = fit.columns[at][:, soft] / fit.penalty[soft]
        U = np.linalg.qr(fit.columns[at][:, ~soft])[0]
        return cls(fit.linear.residual[at], U, np.eye(len(at)) + penalised @ penalised.T)

    @property
    def freedom(self) -> int:
        """Measured numbers less fitted parameters."""
        return int(self.U.shape[0] - self.U.shape[1])

    def restricted(self, covariance: Array) -> tuple[float, float]:
        """Return the log restricted likelihood of a covariance (N, N), and the factor on it that is likeliest.

        The factor is the variance of the noise in units of the assumed one.
        """
        from scipy.linalg import cholesky, solve_triangular

        lower = cholesky(covariance, lower=True, check_finite=False)
        white = solve_triangular(lower, np.column_stack([self.U, self.y]), lower=True, check_finite=False)
        triangle = np.linalg.qr(white, mode="r")
        size = np.abs(np.diag(triangle))
        variance = float(size[-1] ** 2) / self.freedom
        scale = float(np.log(np.diag(lower)).sum() + np.log(size[:-1]).sum())
        return -0.5 * self.freedom * float(np.log(max(variance, 1e-300))) - scale, variance

    def held_out(self, covariance: Array, blocks: NDArray[np.int_]) -> Array:
        """Return (N,) whitened errors of every block, predicted (with fitted parameters) from the other blocks.

        Args:
            covariance: (N, N) of the free function and the noise.
            blocks: (N,) number of the block that each entry belongs to.
        """
        from scipy.linalg import cho_factor, cho_solve

        factor = cho_factor(covariance, check_finite=False)
        inverse = cho_solve(factor, np.eye(len(self.y)), check_finite=False)
        known = inverse @ self.U
        P = inverse - known @ np.linalg.solve(self.U.T @ known, known.T)
        weighted = P @ self.y
        out = np.empty(len(self.y))
        for block in np.unique(blocks):
            at = np.flatnonzero(blocks == block)
            out[at] = np.linalg.lstsq(P[np.ix_(at, at)], weighted[at], rcond=1e-9)[0]
        return out


def _processes(fit: Solution, rows: NDArray[np.int_], used: NDArray[np.bool_]) -> Iterator[Array]:
    """Yield (N, N) covariances of free functions of the channels, each scaled to a mean variance of 1.

    In these, each joint follows its channel, or joints and instrument follow all channels, all angles, or the
    slow channels.

    Args:
        rows: indices of the m rows; used: (m k,) mask of those of their k observed numbers that are in use, N of them
            True.
    """
    problem = fit.problem
    named = problem.channels
    near = {name: (x[rows, None] - x[rows]) ** 2 / np.ptp(x) ** 2 for name, x in named.items()}
    J = problem.whitened.matrix[rows][:, fit.observed.columns]
    moves = (J[:, :, :6], J[:, :, INSTRUMENT : INSTRUMENT + 3])
    turn = moves[0]
    anywhere = np.sum([_products(move) / np.sum(move**2) for move in moves if move.any()], axis=0)
    for kind, widths in FIELD_WIDTHS.items():
        squares = [(j, near[f"{kind}{j + 1}"]) for j in range(6) if f"{kind}{j + 1}" in near]
        for width in widths if squares else ():
            yield _scaled(
                np.sum([_products(turn[:, :, j : j + 1]) * _kernel(square, width) for j, square in squares], axis=0),
                used,
            )
    angles = [near[f"q{j + 1}"] for j in range(6) if f"q{j + 1}" in near]
    slow = [near[name] for name in SLOW if name in near]
    for width in WIDTHS[2:] if angles else ():
        yield _scaled(anywhere * np.mean([_kernel(square, width) for square in near.values()], axis=0), used)
        yield _scaled(anywhere * _kernel(np.sum(angles, axis=0), width), used)
    if slow:
        yield _scaled(anywhere * np.mean([_kernel(square, WIDTHS[2]) for square in slow], axis=0), used)


def _products(J: Array) -> Array:
    """Return (n, k, n, k) products J_i J_j^T of the matrices of every two poses, of J (n, k, m)."""
    return np.asarray(np.einsum("nij,mkj->nimk", J, J, optimize=True))


def _kernel(square: Array, width: float) -> Array:
    """Return (n, 1, n, 1) covariances exp(-d^2 / 2 w^2) of a free function at n poses.

    Args:
        square: (n, n) squared distances d^2 between the poses, in shares of the channel's range; width: w.
    """
    return np.asarray(np.exp(-0.5 * square / width**2)[:, None, :, None])


def _scaled(covariance: Array, used: NDArray[np.bool_]) -> Array:
    """Return a covariance (n, k, n, k) as a matrix (N, N) of the numbers in use, scaled to a mean variance of 1.

    Args:
        used: (n k,) mask of the numbers in use, N of them True.
    """
    flat = covariance.reshape(len(used), len(used))
    flat = flat if used.all() else flat[np.ix_(used, used)]
    return np.asarray(flat / max(float(np.trace(flat)) / len(flat), 1e-300))
