"""How many numbers of a residual are independent information."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.evidence import CLOSE_EVIDENCE, schwarz
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.measure.trajectory import is_record


def record_share(problem: Problem, plain: Linear, stopped: Sequence[Array]) -> float:
    """Return the share in (0, 1] of a problem's rows that count as independent; 1 unless they record a moving arm.

    Neighbouring rows of a record have similar errors. The residual of a missing delay or lost motion is not noise,
    however smooth it is: where both together earn their parameters (Schwarz 1978), the autocorrelation is computed
    without them.

    Args:
        plain: the fit as a linear problem in which all rows are independent.
        stopped: (N, k) whitened columns of parameters that stopped at a bound, one array for each effect.
    """
    state = problem.data.state
    if state.v is None or state.time is None or not is_record(state):
        # Poses one by one: what drifts from each to the next is missing physics, not noise.
        return 1.0
    order = np.argsort(state.time, kind="stable")

    def share(linear: Linear) -> float:
        """Return `serial_share` of a fit's residual."""
        errors = np.full(problem.weights.values.shape, np.nan)
        errors[problem.weights.used] = linear.projected_residual
        return serial_share(errors[order])

    moved = state.v if state.approach is None else np.concatenate([state.v, state.approach], axis=1)
    turns = np.tile(problem.sensitivity.matrix[:, :, :6], moved.shape[1] // 6)
    without = plain.extended(np.hstack([problem.whiten(turns * moved[:, None, :]), *stopped]))
    new = share(without)
    count = without.parameters - plain.parameters
    freedom = new * len(plain.residual) - count
    earned = schwarz(plain.square, without.square, count, freedom)
    return new if earned > CLOSE_EVIDENCE else share(plain)


def serial_share(errors: Array) -> float:
    """Return the share of a record's rows that count as independent, 1 / (1 + 2 sum of rho_k); 1 for a short record.

    rho_k is the autocorrelation of the errors at lag k, summed until it is below its own noise (Bartlett 1946; initial
    sequence of Geyer 1992). A tracker that reads fifty times a second repeats its own error. Short is a record of fewer
    than 20 rows.

    Args:
        errors: (n, r) whitened errors in the order of time, NaN where not measured.
    """
    x = np.nan_to_num(errors)
    n, total = len(x), float(np.sum(x**2))
    if n < 20 or total == 0.0:
        return 1.0
    chance, correlation_sum = 2 / np.sqrt(np.isfinite(errors).sum()), 1.0
    for k in range(1, n // 4):
        rho = float(np.sum(x[k:] * x[:-k])) / total
        if rho < chance:
            break
        correlation_sum += 2 * rho
    return 1 / correlation_sum


def independent_share(residual: Array, turns: Array, row: NDArray[np.int_]) -> float:
    """Return the share in (0, 1] of a residual's entries that count as independent, given that joint errors are shared.

    Where one joint's angle is off by another number in every pose, the r measured numbers of a pose are one
    number. Let f be the largest share of the sum of squares that a free turn of one joint in every pose explains, and
    let the rest be spread evenly over the r - 1 other directions. Then a pose counts as 1 / (f^2 + (1 - f)^2 / (r - 1))
    numbers: r for noise, 1 for f = 1 (the participation ratio of a spectrum).

    Args:
        residual: (N,) whitened residual; turns: (N, 6) whitened derivative by a turn of each joint.
        row: (N,) index of the measured row of each entry.
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


def repeated_share(turn: Array, repeats: NDArray[np.int_]) -> float:
    """Return the share in (0, 1] of the measured numbers that are new information where repeats share rounded angles.

    For m repeats of a pose with the whitened covariance C (`rounding.blurred`), it is (1 + (m - 1) tr C^-1 / dim C) /
    m.

    Args:
        turn: (n, d, d) C^(-1/2) of each row (`Weights.turn`); repeats: (n,) number of the pose of each row.
    """
    each = np.bincount(repeats)[repeats]
    return float(np.mean((1 + (each - 1) * np.sum(turn**2, axis=(1, 2)) / turn.shape[1]) / each))
