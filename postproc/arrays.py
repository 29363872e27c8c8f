"""The array type of the package, the inverse of poses, whole turns and orders of angles, and rows a block at a time.

Everything physical takes n poses at once; shapes stand in docstrings, units are SI and radians.
Six-vectors have the linear part before the angular part, as in pinocchio.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME = 2e-3
"""Angles [rad] that are readings of one place differ by no more."""


def invert(T: Array) -> Array:
    """Inverse poses, (..., 4, 4)."""
    result = np.array(T, dtype=float)
    R = result[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    result[..., :3, 3] = -(R @ T[..., :3, 3:])[..., 0]
    return result


def constant(values: Array) -> Array:
    """The same values (n, ..), of which only one row is kept where all rows are alike; not to be written to."""
    if not len(values) or not np.array_equal(values, np.broadcast_to(values[:1], values.shape), equal_nan=True):
        return values
    return np.broadcast_to(values[:1].copy(), values.shape)


def whole_turns(angle: Array, near: NDArray[np.floating]) -> Array:
    """The whole turns [rad] that bring angles nearest to others; both broadcast."""
    turns: Array = 2 * np.pi * np.round((near - angle) / (2 * np.pi))
    return turns


def finest(angle: Array) -> float:
    """Highest order of a wave that (n,) angles [rad] tell from every lower one: half of one between the nearest two.

    On a grid, order n and order 2 pi / step - n are the same wave (Nyquist). Readings of one place count once.
    """
    steps = np.diff(np.sort(angle))
    return float(np.pi / np.min(steps[steps > SAME], initial=np.inf))


def blocks(n: int, size: int) -> Iterator[slice]:
    """Rows 0 to n, so many at a time: what is held at once does not grow with a long program."""
    for start in range(0, n, size):
        yield slice(start, min(start + size, n))
