"""Acceleration that lasts: what a quasi-static correction may follow.

Joint acceleration has two parts, qdd = q'' sd^2 + q' sdd. The first comes from the shape of the path and lasts as long
as the curve does. The second comes from speeding up and slowing down; where it is shorter than the period T1 of the
arm's first natural frequency it shakes the arm instead of bending it. The morphological opening in time with a flat
window of length T1 removes such bursts and keeps what lasts longer:

    kept = open(max(a, 0)) - open(max(-a, 0)),  open(f) = dilate(erode(f)).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.arrays import Array, blocks, distinct

_STEPS = 8  # time steps per natural period
_LEVELS = np.log(1.1)  # periods within 10 % share a window


def sustained(acceleration: Callable[[Array], Array], duration: float, t: Array, period: Array) -> Array:
    """Part of the joint accelerations that lasts at least one natural period, at times t.

    Args:
        acceleration: (k, c) [rad/s^2] at times (k,) [s] in [0, duration]; at rest before and after.
        t: (n,) ascending [s]; period: (n,) first natural period T1 [s].

    Returns:
        (n, c) between 0 and the acceleration.
    """
    columns = acceleration(np.zeros(1)).shape[1]
    result = np.zeros((len(t), columns))
    if not len(t):
        return result
    level = np.round(np.log(period) / _LEVELS).astype(int)
    # A step of the exact period would move every instant of a long program with the last digit of the model.
    step = float(np.exp(level.min() * _LEVELS)) / _STEPS
    # Only the surroundings of the instants are looked at, in blocks: memory does not grow with the program.
    for block in blocks(len(t)):
        rows = np.arange(block.start, block.stop)
        reach = int(np.ceil(1.05 * period[rows].max() / step)) + 2  # a window is rounded up
        near = distinct(np.rint(t[rows] / step).astype(int)[:, None] + np.arange(-reach, reach + 1))
        even = np.asarray(near * step, dtype=float)
        inside = (even >= 0.0) & (even <= duration)
        a = np.zeros((len(even), columns))
        a[inside] = acceleration(even[inside])
        for n in distinct(level[rows]):
            size = max(1, int(np.ceil(np.exp(n * _LEVELS) / step)))
            opened = [_opening(part, size) for part in (np.maximum(a, 0.0), np.maximum(-a, 0.0))]
            chosen = rows[level[rows] == n]
            for j in range(columns):
                result[chosen, j] = np.interp(t[chosen], even, opened[0][:, j] - opened[1][:, j])
    return result


def _opening(values: Array, size: int) -> Array:
    """Columns (k, c) of which every peak narrower than ``size`` rows is cut down: the largest of the smallest.

    Beyond both ends the values are mirrored.
    """
    for take, ahead in ((np.minimum, size // 2), (np.maximum, size - 1 - size // 2)):
        wide = np.pad(values, ((ahead, size - 1 - ahead), (0, 0)), mode="symmetric")
        values = wide[: len(values)].copy()
        for shift in range(1, size):
            take(values, wide[shift : shift + len(values)], out=values)
    return values
