"""A dial gauge, or a line laser, on a stand: how far the TCP moves in one direction."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import ZERO, Read, ReadingKind, Seen, single, unknown


class Gauge(ReadingKind):
    """A reading r = n.p - z in a stated direction n; the zero z of the set-up is unknown: its differences count."""

    column = "gauge"
    reading = ("reading_mm",)
    zero = True
    noise = 1e-5
    item = "set-ups of a gauge"

    def read(self, seen: Seen) -> Read:
        """Return n.p - z (m, 1)."""
        return single(np.sum(seen.direction * seen.point, axis=1) - seen.unknown[:, ZERO], seen.direction)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the median of n.p - r as the zero."""
        return unknown(zero=float(np.median(np.sum(seen.direction * seen.point, axis=1) - numbers[:, 0])))
