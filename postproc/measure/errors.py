"""Sizes of errors: of rows, and of all of them."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array


def distances(error: Array) -> Array:
    """Return (n,) length of errors (n, 3) over the coordinates that were measured; NaN where none was."""
    seen = np.isfinite(error)
    length = np.linalg.norm(np.where(seen, error, 0.0), axis=1)
    return np.asarray(np.where(seen.any(axis=1), length, np.nan))


def rms(error: Array) -> float:
    """Return the root mean square of all finite numbers; 0 where there are none."""
    good = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0
