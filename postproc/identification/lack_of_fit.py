"""Whether a fit leaves more than the noise, as far as the data and the user tell how large that is."""

from __future__ import annotations

import numpy as np

from postproc.estimation.findings import larger_noise, outlying_rows
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import weighed_by
from postproc.measure.checks.repeats import scatters
from postproc.measure.significance import CHANCE, chance_of_excess

MATTERING_RATIO = 1.5
"""Residual variance over that of the noise below which nobody would notice that more is left."""
FEWEST_DEGREES = 3
"""Degrees of freedom of a scatter that is looked at: what few of them say, F allows for."""


def lacks_fit(fit: Fit) -> bool | None:
    """Return whether a fit leaves more than the noise; None where the noise is not known.

    The scatter of repeats in one visit, and that of all repeats, do not depend on the model; the latter contains drift
    as well, so that the noise is at most that. The residual variance is tested against each of them (F test, and a
    margin that matters); a noise stated by the user counts in their place, unless repeats scatter more. Without repeats
    or a stated noise, what is left is within the noise where it is no more than the instrument and the arm's data sheet
    say; where it is more, it counts as more than noise only if both are known.
    """
    if fit.freedom <= 0:
        return None
    stated = larger_noise(fit)
    if fit.noise.origin == "user":
        known = [(float(stated.sigma or 0.0), stated.dof)]
    else:
        rounding = fit.noise.rounding
        some = scatters(fit.data, fit.observed_error, fit.model.robot)
        known = [
            (float(np.hypot(np.sqrt(square), rounding)), dof)
            for square, dof in some
            if dof >= FEWEST_DEGREES and square > 0
        ]
    if known:
        return any(_exceeds(fit, sigma, dof, CHANCE / len(known)) for sigma, dof in known)
    instrument, arm = fit.noise.instrument, _repeatability(fit)
    most = float(np.hypot(instrument or 0.0, arm or 0.0))
    if most > 0 and not _exceeds(fit, most, np.inf, CHANCE):
        return False
    return None if instrument is None or arm is None else True


def _exceeds(fit: Fit, sigma: float, dof: float, chance: float) -> bool:
    """Return whether the residual variance is significantly above that of a noise; a few rows far off are left out.

    Args:
        sigma: of the noise [m], [rad]; dof: degrees of freedom from which it is known.
        chance: probability of a false alarm.
    """
    single = outlying_rows(fit)
    alone = np.isin(fit.linear.row, single if len(single) <= max(1, len(fit.data) // 20) else [])
    freedom = max(fit.freedom - int(alone.sum()), 1.0)
    square = fit.variance * fit.freedom - float(np.sum(fit.linear.projected_residual[alone] ** 2))
    ratio = square / freedom * (weighed_by(fit.noise) / sigma) ** 2
    return bool(ratio > MATTERING_RATIO and chance_of_excess(ratio, freedom, dof) < chance)


def _repeatability(fit: Fit) -> float | None:
    """Return the arm's repeatability by its data sheet as an upper bound per axis [m]; None where none is stated.

    RP of ISO 9283 is the mean distance from the mean position plus three of its standard deviations: 3.6 standard
    deviations per axis. Only that it is a distance in space is used, for arms that have become worse than their data
    sheet.
    """
    stated = fit.model.robot.repeatability
    return None if stated is None or fit.observed.name != "position" else stated / np.sqrt(3)
