"""Where a linear or circular move needs added targets, so that the path between them stays within tolerance.

Between two corrected targets the controller interpolates; the correction in between is then the chord of the exact
correction. Only what is perpendicular to the path counts: a shift along it does not move the seam.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from postproc.arrays import Array
from postproc.motion.values import Flags

_PLACING_ROUNDS = 6  # of bisection: the largest deviation is then within 2 % of the smallest possible


def perpendicular(vectors: Array, direction: Array) -> Array:
    """Components of vectors (k, 3) perpendicular to unit directions (3,) or (k, 3); unchanged for zero."""
    return vectors - np.sum(vectors * direction, axis=-1, keepdims=True) * direction


def chord_gaps(u: Array, across: Array, weight: Array, a: int, b: int) -> float:
    """Largest weighted distance [m] between the exact correction and its chord from sample a to sample b.

    Args:
        u: (k,) increasing fractions along the move.
        across: (k, 3) exact correction perpendicular to the path [m].
        weight: (k,) how much a distance counts.
    """
    if b - a < 2:
        return 0.0
    w = ((u[a + 1 : b] - u[a]) / (u[b] - u[a]))[:, None]
    gap = (across[a] + (across[b] - across[a]) * w - across[a + 1 : b]) * weight[a + 1 : b, None]
    return math.sqrt(float(np.einsum("ij,ij->i", gap, gap).max()))


def _farthest(deviation: Callable[[int, int], float], a: int, last: int, tolerance: float) -> int:
    """Largest index b in (a, last] for which deviation(a, b) is within tolerance, but at least a + 1.

    It is found by bisection, on the assumption that the deviation grows with b.
    """
    low, high = a + 1, last
    while low < high:
        middle = (low + high + 1) // 2
        if deviation(a, middle) <= tolerance:
            low = middle
        else:
            high = middle - 1
    return low


def _greedy(
    deviation: Callable[[int, int], float], allowed: Flags, last: int, tolerance: float
) -> tuple[list[int], bool]:
    """Indices of the fewest samples as vertices, each as far along as the tolerance allows; whether that is kept.

    Args:
        deviation: function of two sample indices, the deviation [m] of a path without vertices between them.
        allowed: (k,) samples that may be vertices.
        last: index of the last sample.
        tolerance: allowed deviation [m].
    """
    places = np.flatnonzero(allowed[:last])
    places = places[places > 0]
    vertices: list[int] = []
    a, reached = 0, True
    while deviation(a, last) > tolerance:
        reach = _farthest(deviation, a, last, tolerance)
        k = int(np.searchsorted(places, reach, side="right")) - 1
        if k < 0 or places[k] <= a:
            # No target may stand as near as it should: the next one that may.
            reached, k = False, k + 1
            if k >= len(places):
                break
        a = int(places[k])
        vertices.append(a)
    return vertices, reached


def _fewest(deviation: Callable[[int, int], float], allowed: Flags, last: int, tolerance: float) -> list[int]:
    """Indices of the fewest samples as vertices, with the largest deviation made small.

    Args:
        deviation: function of two sample indices, the deviation [m] of a path without vertices between them.
        allowed: (k,) samples that may be vertices.
        last: index of the last sample.
        tolerance: allowed deviation [m].
    """
    best, reached = _greedy(deviation, allowed, last, tolerance)
    low, high = 0.0, tolerance
    for _ in range(_PLACING_ROUNDS if best and reached else 0):
        middle = 0.5 * (low + high)
        tighter, also = _greedy(deviation, allowed, last, middle)
        if also and len(tighter) <= len(best):
            best, high = tighter, middle
        else:
            low = middle
    return best


def place_vertices(u: Array, across: Array, allowed: Flags, tolerance: float, weight: Array) -> list[int]:
    """Indices of the fewest samples at which a line gets an added target, so that all chords deviate about equally.

    Args:
        u: (k,) fractions along the move.
        across: (k, 3) exact correction perpendicular to its direction [m].
        allowed: (k,) bool, samples that may become targets (outside the neighbours' zones).
        tolerance: allowed chord deviation [m].
        weight: (k,) how much a deviation counts.
    """
    last = len(u) - 1

    def deviation(a: int, b: int) -> float:
        """Largest weighted chord deviation [m] between samples a and b."""
        return chord_gaps(u, across, weight, a, b)

    return _fewest(deviation, allowed, last, tolerance)


def circle_gaps(points: Array, a: Array, via: Array, b: Array) -> Array:
    """Distances (k,) [m] of points (k, 3) from the circle through a, via and b (3,), or from their line."""
    ab, av = b - a, via - a
    normal = _cross(av, ab)
    size = float(normal @ normal)
    if size < 1e-24:
        return np.linalg.norm(perpendicular(points - a, ab / np.linalg.norm(ab)), axis=1)
    center = a + (_cross(normal, av) * (ab @ ab) + _cross(ab, normal) * (av @ av)) / (2 * size)
    radius = float(np.linalg.norm(a - center))
    axis = normal / np.sqrt(size)
    height = (points - center) @ axis
    radial = np.linalg.norm(points - center - height[:, None] * axis, axis=1) - radius
    return np.hypot(height, radial)


def _cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3,); ``np.cross`` takes twenty times as long for one."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def place_arcs(commanded: Array, tolerance: float, shortest: int, beyond: Flags, weight: Array) -> list[int]:
    """Indices of the samples between the fewest arcs whose circles stay within tolerance of the commanded points.

    The circle point of each is its middle sample.

    Args:
        commanded: (k, 3) exact commanded TCP positions along the arc [m].
        tolerance: allowed distance [m].
        shortest: number of intervals that an arc spans at least (MoveC's limits on length and angle).
        beyond: (k,) samples that may become targets (outside the neighbours' zones).
        weight: (k,) how much a deviation counts.
    """
    last = len(commanded) - 1

    def deviation(a: int, b: int) -> float:
        """Largest weighted distance [m] of points a to b from the circle through a, b and the middle one."""
        if b - a < 2:
            return 0.0
        gaps = circle_gaps(commanded[a : b + 1], commanded[a], commanded[(a + b) // 2], commanded[b])
        return float((weight[a : b + 1] * gaps).max())

    allowed = np.arange(last + 1) % shortest == 0
    allowed[max(0, last - shortest + 1) :] = False
    allowed &= beyond
    return _fewest(deviation, allowed, last, tolerance)
