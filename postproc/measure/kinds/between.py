"""A distance between the TCPs of two rows: an artefact of known length, two balls."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import UNKNOWNS, ZERO, Read, ReadingKind, Seen, unknown

LEAST_M = 1e-6


class Between(ReadingKind):
    """A distance |p - p'| between two rows: half of it is read at each of its ends.

    With u along p - p', one end reads u.p - s and the other s - u.p': their sum is the distance whatever s is. With s
    unknown to each pair, both readings together tell what the distance tells.
    """

    column = "from"
    reading = ("distance_mm",)
    zero = True
    noise = 2e-5
    lasting = False

    def read(self, seen: Seen) -> Read:
        """Return half of |p - p'| (m, 1) at each end, which is what s makes of it; NaN without the other end."""
        away = seen.point - seen.other
        length = np.linalg.norm(away, axis=1)
        along = np.nan_to_num(away) / np.maximum(np.nan_to_num(length), LEAST_M)[:, None]
        by_unknown = np.zeros((len(away), 1, UNKNOWNS))
        by_unknown[:, 0, ZERO] = -seen.sign
        return Read(0.5 * length[:, None], along[:, None], by_unknown)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return no unknown: s is eliminated."""
        return unknown()
