"""What rows tell of the masses of the links, which no fit changes: for most arms they are estimates."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.linear import solve_positive
from postproc.estimation.posterior import objective_of
from postproc.estimation.priors import lognormal_deviation


def link_mass_directions(fit: Fit) -> Array:
    """Return directions (d, p + 6), one standard deviation each, of all p parameters and the logarithms of six masses.

    The fit takes the masses of the arm's file as they are (consider parameters; Schmidt 1966). With A and B the
    whitened derivatives of the rows by parameters and logarithms, s^2 the scatter, C the inverse covariance of the
    parameters for known masses and M_0 the covariance of the logarithms by `Robot.mass_factor`, masses that are off by
    m take the parameters with them by -C^-1 A^T B m / s^2, and after the rows the logarithms have the covariance
    (M_0^-1 + (B^T B - B^T A C^-1 A^T B / s^2) / s^2)^-1. A log-normal mass is farther from its median than the
    deviation of its logarithm says. Readings under a load and without it leave M_0 as it is; positions tell how far the
    arm sags.

    Returns:
        (0, 0) where the file states the masses as exact, or the model has no joint springs.
    """
    factor, spring = fit.model.robot.mass_factor, fit.model.in_role(Role.JOINT_SPRINGS)
    if factor is None or spring is None or fit.observed.name != "position":
        return np.zeros((0, 0))
    after, scatter = fit.posterior, fit.scatter_of_parameters
    at_rows = objective_of(fit, (*after.names, *after.unidentifiable), len(after.names), scatter)
    unit = np.where(at_rows.prior.log, after.mean, 1.0)
    A, B = at_rows.columns * unit, fit.problem.whiten(fit.problem.sensitivity.by_link_mass())
    taken = solve_positive(at_rows.curvature(unit, at_rows.prior.weight(after.mean)), A.T @ B / scatter)
    spread = np.log(factor[1:])
    information = (B.T @ B - (B.T @ A) @ taken) / scatter * np.outer(spread, spread)
    size, axes = np.linalg.eigh(0.5 * (information + information.T))
    lower = spread[:, None] * axes / np.sqrt(1.0 + np.maximum(size, 0.0))
    total = np.linalg.norm(lower, axis=1)
    lower *= (lognormal_deviation(total) / total)[:, None]
    return np.vstack([-unit[:, None] * (taken @ lower), lower]).T
