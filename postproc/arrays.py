"""The array type of the package, the inverse of poses, gravity, largest and distinct values, turns, angles, blocks.

Everything physical takes n poses at once; shapes stand in docstrings, units are SI and radians.
Six-vectors have the linear part before the angular part, as in pinocchio.
"""

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
N = TypeVar("N", bound=np.number[Any])

GRAVITY = 9.81
"""Acceleration [m/s^2] by which every mass weighs (on the ground it is 9.780 to 9.832): fitted weights hold with it."""
SAME_PLACE_RAD = 2e-3
"""Angles [rad] that are readings of one place differ by no more."""
BLOCK = 2000
"""Poses or instants taken at once: their arrays stay in the processor's cache."""


def invert(T: Array) -> Array:
    """Return the inverse of poses (..., 4, 4)."""
    result = np.array(T, dtype=float)
    R = result[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    result[..., :3, 3] = -(R @ T[..., :3, 3:])[..., 0]
    return result


def gravity_in(R: Array) -> Array:
    """Return gravity (3,) [m/s^2] in the axes of a frame whose orientation in the world is R (3, 3)."""
    return np.asarray(R.T @ np.array([0.0, 0.0, -GRAVITY]))


def largest_of_rows(values: Array) -> Array:
    """Return the largest value (n,) of each row of (n, c), several times as fast as numpy where columns are few."""
    return np.asarray(np.ascontiguousarray(values.T).max(axis=0))


def distinct(values: NDArray[N]) -> NDArray[N]:
    """Return the values that occur, ascending; ``numpy.unique`` loads masked arrays for it, a hundredth of a second."""
    values = np.sort(values, axis=None)
    first = np.ones(len(values), dtype=bool)
    first[1:] = values[1:] != values[:-1]
    return values[first]


def numbered(labels: Sequence[str]) -> tuple[Array | None, tuple[str, ...]]:
    """Return the place (n,) of each label among the different ones, and these as they appear; None without labels."""
    names = {label: k for k, label in enumerate(dict.fromkeys(labels))}
    return np.array([names[label] for label in labels]) if labels else None, tuple(names)


def constant(values: Array) -> Array:
    """Return values (n, ..) that take the memory of one row if all are equal; the result must not be written to."""
    if not len(values) or not np.array_equal(values, np.broadcast_to(values[:1], values.shape), equal_nan=True):
        return values
    return np.broadcast_to(values[:1].copy(), values.shape)


def full_turns(angle: Array, near: NDArray[np.floating]) -> Array:
    """Return the whole turns [rad] to add to angles [rad] so that they are nearest to others; both broadcast.

    Args:
        near: the others [rad].
    """
    turns: Array = 2 * np.pi * np.round((near - angle) / (2 * np.pi))
    return turns


def finest(angle: Array) -> float:
    """Return the highest order of a wave that (n,) angles [rad] distinguish: pi over the smallest step between two.

    On a grid, order n and order 2 pi / step - n are the same wave (Nyquist). Angles within 2 mrad count as one.
    """
    steps = np.diff(np.sort(angle))
    return float(np.pi / np.min(steps[steps > SAME_PLACE_RAD], initial=np.inf))


def blocks(n: int, size: int = 0) -> Iterator[slice]:
    """Yield slices of at most ``size`` rows that cover rows 0 to n, to bound the memory that long programs need.

    Args:
        size: 0 for ``BLOCK``; less for rows that hold matrices of the whole arm.
    """
    size = size or BLOCK
    for start in range(0, n, size):
        yield slice(start, min(start + size, n))
