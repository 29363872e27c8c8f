"""Distances: from a fixed point (a ball bar, a wire sensor), or between the TCPs of two rows (two balls)."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import POINT, ZERO, Read, ReadingKind, Seen, single, unknown

SHORTEST_M = 1e-6
"""Length [m] below which a distance has no direction."""


class Distance(ReadingKind):
    """A distance |p - c| = r + b from an anchor c, which is unknown; so is the offset b where a column map frees it."""

    column = "anchor"
    reading = ("distance_mm",)
    point = zero_may_open = True
    noise = 2e-5
    item = "distances"

    def read(self, seen: Seen) -> Read:
        """Return |p - c| - b (m, 1)."""
        away = seen.point - seen.unknown[:, POINT]
        length = np.maximum(np.linalg.norm(away, axis=1), SHORTEST_M)
        along = away / length[:, None]
        return single(length - seen.unknown[:, ZERO], along, point=-along)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the anchor where the distances cross, of least absolute misses, from several first guesses."""
        from scipy.optimize import least_squares

        p, r = seen.point, numbers[:, 0]
        centre, reach = np.median(p, axis=0), float(np.median(r))

        def misses(c: Array) -> Array:
            """Return the errors (m,) [m] of the distances from an anchor at c (3,) [m]."""
            return np.asarray(np.linalg.norm(p - c, axis=1) - r)

        guesses = [centre + reach * side * axis for axis in np.eye(3) for side in (-1.0, 1.0)]
        best = [least_squares(misses, c, loss="soft_l1", f_scale=1e-3, max_nfev=60) for c in (centre, *guesses)]
        return unknown(min(best, key=lambda one: float(one.cost)).x)


class Between(ReadingKind):
    """A distance |p - p'| between two rows: half of it is read at each of its ends.

    With u along p - p', one end reads u.p - s and the other s - u.p': their sum is the distance whatever s is. With s
    unknown to each pair, both readings together tell what the distance tells.
    """

    column = "from"
    reading = ("distance_mm",)
    zero = True
    item = "distances"
    noise = 2e-5
    lasting = False

    def read(self, seen: Seen) -> Read:
        """Return half of |p - p'| (m, 1) at each end, which is what s makes of it; NaN without the other end."""
        away = seen.point - seen.other
        length = np.linalg.norm(away, axis=1)
        along = np.nan_to_num(away) / np.maximum(np.nan_to_num(length), SHORTEST_M)[:, None]
        return single(0.5 * length, along, zero=-seen.sign)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return no unknown: s is eliminated."""
        return unknown()
