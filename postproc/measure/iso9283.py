"""Accuracy and repeatability of poses by ISO 9283."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array


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
