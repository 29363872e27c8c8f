"""Sizes of errors, of rows and of all of them; when chance is ruled out; accuracy and repeatability by ISO 9283."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

CHANCE = 1e-3
"""Chance of a false alarm, after counting all that was tried, in whatever is said of a table or of an arm."""
DOUBTFUL_CHANCE = 1e-2
"""Chance below which an assumption that costs nothing to drop is dropped: that a stated noise is right."""


def distances(error: Array) -> Array:
    """Return (n,) length of errors (n, 3) over the coordinates that were measured; NaN where none was."""
    seen = np.isfinite(error)
    length = np.linalg.norm(np.where(seen, error, 0.0), axis=1)
    return np.asarray(np.where(seen.any(axis=1), length, np.nan))


def rms(error: Array) -> float:
    """Return the root mean square of all finite numbers; 0 where there are none."""
    good = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0


def chance_of_excess(ratio: float, dof: float, than: float) -> float:
    """Return the chance that one variance exceeds another, of the same normal numbers, so many times (F test).

    Args:
        dof, than: degrees of freedom of the one and of the other, infinite for a variance that is known.
    """
    from scipy.special import fdtrc

    return float(fdtrc(dof, min(than, 1e6), ratio))


@dataclass(frozen=True, slots=True)
class Iso9283:
    """Pose figures of ISO 9283 in mm.

    Args:
        accuracy: AP, distance of the mean of the attained positions from the commanded one: mean and maximum over the
            poses.
        repeatability: RP = mean distance from the barycentre + 3 standard deviations of that distance: median and
            maximum over the poses measured at least three times, None without repeats.
        poses: number of poses behind the repeatability.
    """

    accuracy_mean: float
    accuracy_max: float
    repeatability_median: float | None
    repeatability_max: float | None
    poses: int


def iso9283(error: Array, groups: NDArray[np.int_]) -> Iso9283:
    """Return the ISO 9283 figures in mm of position errors.

    Args:
        error: (n, 1 to 3) measured minus commanded [m]; groups: (n,) number of the pose of each row.
    """
    good = np.isfinite(error).all(axis=1)
    accuracy, repeatability = [], []
    for group in np.unique(groups[good]):
        member = error[good & (groups == group)] * 1e3
        mean = member.mean(axis=0)
        accuracy.append(float(np.linalg.norm(mean)))
        if len(member) >= 3:
            distance = np.linalg.norm(member - mean, axis=1)
            repeatability.append(float(distance.mean() + 3 * distance.std(ddof=1)))
    return Iso9283(
        accuracy_mean=float(np.mean(accuracy)) if accuracy else 0.0,
        accuracy_max=float(np.max(accuracy)) if accuracy else 0.0,
        repeatability_median=float(np.median(repeatability)) if repeatability else None,
        repeatability_max=float(np.max(repeatability)) if repeatability else None,
        poses=len(repeatability),
    )
