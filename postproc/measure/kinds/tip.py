"""One tip: all rows of its name have the TCP at one fixed point."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import POINT, UNKNOWNS, Read, ReadingKind, Seen, unknown


class Tip(ReadingKind):
    """A spike, a ball or a hole that is touched: p - c = 0, c unknown."""

    column = "tip"
    point = touches = True
    noise = 5e-5
    each = 3

    def read(self, seen: Seen) -> Read:
        """Return p - c (m, 3)."""
        by_unknown = np.zeros((len(seen.point), 3, UNKNOWNS))
        by_unknown[:, :, POINT] = -np.eye(3)
        by_point = np.broadcast_to(np.eye(3), (len(seen.point), 3, 3))
        return Read(seen.point - seen.unknown[:, POINT], by_point, by_unknown)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the point nearest to most TCPs, coordinate by coordinate."""
        return unknown(np.median(seen.point, axis=0))
