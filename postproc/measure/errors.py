"""Sizes of errors: of rows, and of all of them."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array


def distances(error: Array) -> Array:
    """(n,) length of (n, 3) errors along the coordinates that were measured; NaN where none was."""
    seen = np.isfinite(error)
    length = np.linalg.norm(np.where(seen, error, 0.0), axis=1)
    return np.asarray(np.where(seen.any(axis=1), length, np.nan))


def rms(error: Array) -> float:
    """Root mean square of all finite numbers, per axis."""
    good = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0


def mm(value: float) -> float:
    """Metres to millimetres, radians to milliradians, as documents have them."""
    return round(float(value) * 1e3, 6)
