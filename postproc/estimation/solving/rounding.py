"""Joint angles that are rounded in the table: an error of every pose, or where the arm was told to stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import Problem, Weights
from postproc.measure.checks.repeats import Noise

SILENT = 0.01
"""Share of the noise's variance below which rounding does not matter."""
DENIED = 6.1
"""Log-likelihood by which the points must speak against rounding: of tables that were rounded 1 % deny it so clearly,
half of the 99 % point of the chi-bar-square distribution of six variances at their bounds (Self and Liang 1987)."""


def blurred(problem: Problem, noise: Noise) -> tuple[Problem, Noise]:
    """Return problem and noise with the error that rounded joint angles add, of covariance J J^T step^2 / 12 per pose.

    All repeats of a pose share it, and its position and orientation do, where repeats tell the noise of orientations
    (what is weighted by its own residual has its rounding in there). With m times as much in each of them, and m of
    them, the pose tells as much as its mean does. Unchanged where angles are not rounded or it is below the noise.
    """
    if not problem.data.step or problem.data.rounded is False:
        return problem, noise
    size = 3 if problem.data.rotation is None or noise.rotation is None else 6
    J = problem.sensitivity.matrix[:, :size, :6]
    own = J @ np.swapaxes(J, 1, 2) * problem.data.step**2 / 12
    values = problem.weights.values[:, :size, None]
    common = values * own * np.swapaxes(values, 1, 2)
    if float(np.mean(np.trace(common, axis1=1, axis2=2))) <= SILENT * size:
        return problem, noise
    each = np.bincount(problem.data.repeats)[problem.data.repeats]
    turn = np.linalg.inv(np.linalg.cholesky(np.eye(size) + common * each[:, None, None]))
    added = float(np.mean(np.trace(own[:, :3, :3], axis1=1, axis2=2))) / 3
    if noise.sigma is not None:
        noise = replace(noise, sigma=float(np.hypot(noise.sigma, np.sqrt(added))), rounding=float(np.sqrt(added)))
    return problem.weighted(Weights(problem.weights.values, turn)), noise


def rounded(fit: Fit) -> bool:
    """Return whether the angles of the table were rounded when written, so that the arm stood beside them.

    The mean e of the m repeats of a pose has the covariance C = (s^2 / m + u^2) I + sum_j t_j^2 J_j J_j^T: of the
    noise, and of what the model misses, anywhere and at each joint, as likely as it can be. Rounding is a floor under
    the scatter of every joint, t_j^2 >= step^2 / 12. It is believed unless the points deny it.
    """
    data, values = fit.data, fit.problem.weights.values[:, :3]
    good = np.flatnonzero((values > 0).all(axis=1))
    _, first, group, each = np.unique(data.repeats[good], return_index=True, return_inverse=True, return_counts=True)
    error = (
        np.stack([np.bincount(group, column[good]) for column in fit.problem.error[:, :3].T], axis=1) / each[:, None]
    )
    error *= np.sqrt(max(1.0, len(fit.problem.residual) / max(fit.freedom, 1.0)))
    known = fit.noise.sigma is not None
    noise = known * np.bincount(group, np.mean(values[good] ** -2.0, axis=1)) / each**2
    turns = fit.problem.sensitivity.matrix[good[first], :3, :6] * data.step / np.sqrt(12)
    return _likelihood(error, noise, turns, 0.0) - _likelihood(error, noise, turns, 1.0) < DENIED


def misjudged(fit: Fit) -> bool:
    """Return whether a fit took the angles of its table as rounded, and they were not, or the other way round.

    What a model lacked looked like rounded angles, or hid them.
    """
    return fit.data.rounded is not None and fit.data.rounded != rounded(fit)


def _likelihood(error: Array, noise: Array, turns: Array, least: float) -> float:
    """Return the largest log likelihood of errors (n, 3) [m] with the covariance v I + x_0 w I + sum_j x_j J_j J_j^T.

    Args:
        noise: (n,) v [m^2]; w is the mean square error. turns: (n, 3, 6) J. least: lower bound of x_j.
    """
    from scipy.optimize import minimize

    typical = float(np.mean(error**2))
    outer = np.einsum("nij,nkj->njik", turns, turns)

    def cost(x: Array) -> tuple[float, Array]:
        """Return minus the log likelihood at x, and its derivative (7,)."""
        C = (noise + typical * x[0])[:, None, None] * np.eye(3) + np.einsum("j,njik->nik", x[1:], outer)
        inverse = np.linalg.inv(C)
        seen = (inverse @ error[:, :, None])[:, :, 0]
        slope = inverse - seen[:, :, None] * seen[:, None, :]
        value = np.sum(error * seen) + np.sum(np.linalg.slogdet(C)[1])
        along = np.concatenate(
            [[typical * np.trace(slope, axis1=1, axis2=2).sum()], np.einsum("nik,njik->j", slope, outer)]
        )
        return 0.5 * float(value), 0.5 * along

    start = np.concatenate([[0.1], np.full(6, 1.0)])
    bounds = [(1e-6, None), *[(least, None)] * 6]
    return -float(minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds).fun)
