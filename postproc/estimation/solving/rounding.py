"""Joint angles that are rounded in the table: an error of every pose, or the commanded angles themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import Problem, Weights
from postproc.measure.checks.repeats import Noise
from postproc.measure.measurements import Measurements

Result = TypeVar("Result")

SILENT_SHARE = 0.01
"""Share of the noise's variance below which rounding does not matter."""
DENIED = 6.1
"""Log-likelihood by which the points must speak against rounding: of tables that were rounded 1 % deny it so clearly,
half of the 99 % point of the chi-bar-square distribution of six variances at their bounds (Self and Liang 1987)."""


def blurred(problem: Problem, noise: Noise) -> tuple[Problem, Noise]:
    """Return problem and noise with the error that rounded joint angles add, of covariance J J^T step^2 / 12 per pose.

    All repeats of a pose have this error in common. So have its position and orientation, where repeats show the noise
    of orientations (weights by their own residual include the rounding already). Each of m repeats gets m times this
    covariance, so that the m together say as much as their mean does. Both come back unchanged where angles are not
    rounded or the error is far below the noise.
    """
    if not problem.data.step or problem.data.rounded is False:
        return problem, noise
    size = 3 if problem.data.rotation is None or noise.rotation is None else 6
    J = problem.sensitivity.matrix[:, :size, :6]
    covariance = J @ np.swapaxes(J, 1, 2) * problem.data.step**2 / 12
    values = problem.weights.values[:, :size, None]
    common = values * covariance * np.swapaxes(values, 1, 2)
    if float(np.mean(np.trace(common, axis1=1, axis2=2))) <= SILENT_SHARE * size:
        return problem, noise
    each = np.bincount(problem.data.repeats)[problem.data.repeats]
    turn = np.linalg.inv(np.linalg.cholesky(np.eye(size) + common * each[:, None, None]))
    measured = problem.weights.used[:, :3]
    added = float(np.mean(np.diagonal(covariance[:, :3, :3], axis1=1, axis2=2)[measured])) if measured.any() else 0.0
    if noise.sigma is not None:
        noise = replace(noise, sigma=float(np.hypot(noise.sigma, np.sqrt(added))), rounding=float(np.sqrt(added)))
    return problem.weighted(Weights(problem.weights.values, turn)), noise


def rounded(fit: Fit) -> bool:
    """Return whether the table's angles were rounded after the measurement, so that the arm stood at other angles.

    Otherwise the rounded angles were commanded. The mean e of the m repeats of a pose has the covariance
    C = (s^2 / m + u^2) I + sum_j t_j^2 J_j J_j^T: of the noise s, and of what the model misses, anywhere (u) and at
    each joint (t_j), each as likely as it can be. Rounding is a lower bound on the scatter of every joint, t_j^2 >=
    step^2 / 12. It is assumed unless the likelihood contradicts it by `DENIED`.
    """
    data, values = fit.data, fit.problem.weights.values[:, :3]
    good = np.flatnonzero((values > 0).any(axis=1))
    if not len(good):
        return True
    used = (values > 0)[good]
    _, first, group = np.unique(data.repeats[good], return_index=True, return_inverse=True)

    def total(numbers: Array) -> Array:
        """Return sums (poses, 3) over the repeats of each pose, of the coordinates that were measured."""
        return np.stack([np.bincount(group, column) for column in np.where(used, numbers, 0.0).T], axis=1)

    count = total(np.ones(used.shape))
    each = np.maximum(count, 1.0)
    # The parameters take up what they can of the n means, and the (n - p)-th part of their variance remains.
    poses, fitted = int((count > 0).sum()), len(fit.problem.residual) - fit.freedom
    error = total(fit.problem.error[good, :3]) / each * np.sqrt(poses / max(poses - fitted, 1.0))
    known = fit.noise.sigma is not None
    noise = known * total(np.where(used, values[good], 1.0) ** -2.0) / each**2
    turns = fit.problem.sensitivity.matrix[good[first], :3, :6] * data.step / np.sqrt(12) * (count > 0)[:, :, None]
    likely = [_likelihood(error, noise, turns, count > 0, least) for least in (0.0, 1.0)]
    return likely[0] - likely[1] < DENIED


def with_judged_rounding(
    estimate: Callable[[Measurements], Result], data: Measurements, fit_of: Callable[[Result], Fit]
) -> Result:
    """Return the result of an estimation whose final fit agrees with what it assumes of rounded joint angles.

    The estimation runs once, and a second time with the other assumption where the residual of its final fit denies the
    one that its first fit made (``data.rounded``): an effect that the model lacked looked like rounded angles, or hid
    them.

    Args:
        estimate: returns the result for measurements; it decides whether angles are rounded where ``data.rounded`` is
            None.
        fit_of: returns the final fit of a result.
    """
    result = estimate(data)
    fit = fit_of(result)
    if fit.data.rounded is None or fit.data.rounded == rounded(fit):
        return result
    return estimate(replace(data, rounded=not fit.data.rounded))


def _likelihood(error: Array, noise: Array, turns: Array, measured: NDArray[np.bool_], least: float) -> float:
    """Return the largest log likelihood of errors (n, 3) [m] with the covariance V + x_0 w I + sum_j x_j J_j J_j^T.

    It is maximised over x_0 and the six x_j, and is that of the measured coordinates alone.

    Args:
        error: of the mean of each pose. noise: (n, 3) diagonals of V [m^2]; w is the mean square error.
        turns: (n, 3, 6) J, the displacement of the TCP by the rounding of each joint.
        measured: (n, 3) mask; errors and turns of other coordinates are 0. least: lower bound of x_j.
    """
    from scipy.optimize import minimize

    typical = float(np.mean(error[measured] ** 2))
    outer = np.einsum("nij,nkj->njik", turns, turns)
    apart = np.eye(3) * measured[:, None, :]
    fixed = np.eye(3) * np.where(measured, noise, 1.0)[:, None, :]

    def cost(x: Array) -> tuple[float, Array]:
        """Return minus the log likelihood at x, and its derivative (7,)."""
        C = fixed + typical * x[0] * apart + np.einsum("j,njik->nik", x[1:], outer)
        inverse = np.linalg.inv(C)
        seen = (inverse @ error[:, :, None])[:, :, 0]
        slope = inverse - seen[:, :, None] * seen[:, None, :]
        value = np.sum(error * seen) + np.sum(np.linalg.slogdet(C)[1])
        along = np.concatenate([[typical * np.sum(slope * apart)], np.einsum("nik,njik->j", slope, outer)])
        return 0.5 * float(value), 0.5 * along

    start = np.concatenate([[0.1], np.full(6, 1.0)])
    bounds = [(1e-6, None), *[(least, None)] * 6]
    return -float(minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds).fun)
