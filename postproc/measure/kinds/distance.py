"""A distance from a fixed point: a ball bar, a wire sensor, an inside micrometer."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import POINT, UNKNOWNS, ZERO, Read, ReadingKind, Seen, unknown

LEAST_M = 1e-6


class Distance(ReadingKind):
    """A distance |p - c| = r + b from an anchor c, which is unknown; so is the offset b where a column map frees it."""

    column = "anchor"
    reading = ("distance_mm",)
    point = True
    noise = 2e-5

    @classmethod
    def unknowns(cls, zero_open: bool) -> tuple[bool, bool, bool]:
        """Return that a set-up has an unknown point, no plane, and a zero where the column map frees it."""
        return True, False, zero_open

    def read(self, seen: Seen) -> Read:
        """Return |p - c| - b (m, 1)."""
        away = seen.point - seen.unknown[:, POINT]
        length = np.maximum(np.linalg.norm(away, axis=1), LEAST_M)
        along = away / length[:, None]
        by_unknown = np.zeros((len(away), 1, UNKNOWNS))
        by_unknown[:, 0, POINT], by_unknown[:, 0, ZERO] = -along, -1.0
        return Read((length - seen.unknown[:, ZERO])[:, None], along[:, None], by_unknown)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the anchor where the distances cross, of least absolute misses, from several first guesses."""
        from scipy.optimize import least_squares

        p, r = seen.point, numbers[:, 0]
        centre, reach = np.median(p, axis=0), float(np.median(r))

        def misses(c: Array) -> Array:
            return np.asarray(np.linalg.norm(p - c, axis=1) - r)

        guesses = [centre + reach * side * axis for axis in np.eye(3) for side in (-1.0, 1.0)]
        found = [least_squares(misses, c, loss="soft_l1", f_scale=1e-3, max_nfev=60) for c in (centre, *guesses)]
        return unknown(min(found, key=lambda one: float(one.cost)).x)
