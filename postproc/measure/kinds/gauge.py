"""A dial gauge, or a line laser, on a stand: how far the TCP moves in one direction."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.measure.kinds.base import UNKNOWNS, ZERO, Read, ReadingKind, Seen, unknown


class Gauge(ReadingKind):
    """A reading r = n.p - z in a stated direction n; the zero z of the set-up is unknown: its differences count."""

    column = "gauge"
    reading = ("reading_mm",)
    zero = True
    noise = 1e-5

    def read(self, seen: Seen) -> Read:
        """Return n.p - z (m, 1)."""
        by_unknown = np.zeros((len(seen.point), 1, UNKNOWNS))
        by_unknown[:, 0, ZERO] = -1.0
        value = np.einsum("mi,mi->m", seen.direction, seen.point) - seen.unknown[:, ZERO]
        return Read(value[:, None], seen.direction[:, None], by_unknown)

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the median of n.p - r as the zero."""
        return unknown(zero=float(np.median(np.einsum("mi,mi->m", seen.direction, seen.point) - numbers[:, 0])))
