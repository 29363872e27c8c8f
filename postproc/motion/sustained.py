"""Acceleration that lasts: what a quasi-static correction may follow.

Joint acceleration shorter than the period T1 of the arm's first natural frequency shakes the arm instead of bending it.
The morphological opening in time with a flat window of length T1 removes such bursts and keeps what lasts longer:

    a_sustained = open(max(a, 0)) - open(max(-a, 0)),  open(f) = dilate(erode(f)).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import grey_opening

from postproc.arrays import Array

_STEPS = 12  # time steps per natural period
_LEVELS = np.log(1.1)  # periods within 10 % share a window


def sustained(t: Array, a: Array, period: Array) -> Array:
    """Part of the accelerations that lasts at least one natural period.

    Args:
        t: (k,) evenly spaced times [s]; a: (k, 6) joint accelerations [rad/s^2], at rest before and after.
        period: (k,) first natural period T1 [s].

    Returns:
        (k, 6) between 0 and a.
    """
    result = np.zeros_like(a)
    if len(t) < 2:
        return result
    dt = (t[-1] - t[0]) / (len(t) - 1)
    level = np.round(np.log(period) / _LEVELS).astype(int)
    rise, fall = np.maximum(a, 0.0), np.maximum(-a, 0.0)
    for n in np.unique(level):
        rows = level == n
        size = (max(1, int(np.ceil(np.exp(n * _LEVELS) / dt))), 1)
        opened = [grey_opening(part, size=size, mode="constant", cval=0.0)[rows] for part in (rise, fall)]
        result[rows] = opened[0] - opened[1]
    return result


def time_steps(duration: float, period: Array) -> Array:
    """Evenly spaced times [s] over a motion, fine enough for its shortest natural period."""
    steps = int(np.ceil(duration * _STEPS / float(period.min()))) if duration > 0 else 0
    return np.linspace(0.0, duration, steps + 1)
