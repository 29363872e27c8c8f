"""Whether a fit leaves more than the noise, as far as the data and the user tell how large that is."""

from __future__ import annotations

import numpy as np

from postproc.estimation.findings import larger_noise, standing_out
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import weighed_by
from postproc.measure.checks.repeats import scatters
from postproc.measure.significance import CHANCE, chance_of_excess

MATTERS = 1.5
"""Residual variance over that of the noise below which nobody would notice that more is left."""
FEWEST = 3
"""Degrees of freedom of a scatter that is looked at: what few of them say, F allows for."""


def lacks_fit(fit: Fit) -> bool | None:
    """Return whether a fit leaves more than the noise; None where the noise is not known.

    The scatter of repeats does not depend on the model, in one visit or at any time. At other times they differ by
    drift as well, so that the noise is at most what all of them scatter by. What is left is tested against each of
    these (F test of the residual variance, and by a margin that matters); a user's own figure counts in their place,
    unless repeats scatter more. Without either, what is left is within the noise where it is no more than the
    instrument and the arm's data sheet say; where it is more, only both of them say that it is no noise.
    """
    if fit.freedom <= 0:
        return None
    stated = larger_noise(fit)
    if fit.noise.origin == "user":
        known = [(float(stated.sigma or 0.0), stated.dof)]
    else:
        rounding = fit.noise.rounding
        some = scatters(fit.data, fit.observed_error)
        known = [
            (float(np.hypot(np.sqrt(square), rounding)), dof) for square, dof in some if dof >= FEWEST and square > 0
        ]
    if known:
        return any(_exceeds(fit, sigma, dof, CHANCE / len(known)) for sigma, dof in known)
    instrument, arm = fit.noise.instrument, _repeatability(fit)
    most = float(np.hypot(instrument or 0.0, arm or 0.0))
    if most > 0 and not _exceeds(fit, most, np.inf, CHANCE):
        return False
    return None if instrument is None or arm is None else True


def _exceeds(fit: Fit, sigma: float, dof: float, chance: float) -> bool:
    """Return whether the residual variance is significantly above that of a noise, a few rows far off left out.

    Args:
        sigma: of the noise [m], [rad]; dof: degrees of freedom behind it. chance: of a false alarm.
    """
    single = standing_out(fit)
    alone = np.isin(fit.linear.row, single if len(single) <= max(1, len(fit.data) // 20) else [])
    freedom = max(fit.freedom - int(alone.sum()), 1.0)
    square = fit.variance * fit.freedom - float(np.sum(fit.linear.rest[alone] ** 2))
    ratio = square / freedom * (weighed_by(fit.noise) / sigma) ** 2
    return bool(ratio > MATTERS and chance_of_excess(ratio, freedom, dof) < chance)


def _repeatability(fit: Fit) -> float | None:
    """Return the arm's repeatability by its data sheet as an upper bound per axis [m]; None where none is stated.

    RP of ISO 9283 is the mean distance from the mean place and three of its standard deviations: 3.6 per axis. Only
    that it is a distance in space is taken from it, for arms that are older than their data sheet.
    """
    stated = fit.model.robot.repeatability
    return None if stated is None or fit.observed.name != "position" else stated / np.sqrt(3)
