"""Where a model fails on measurements: figures, worst poses, the residual against every channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.identification.trends import Trend, residual_trends
from postproc.measure.errors import distances
from postproc.measure.iso9283 import Iso9283, iso9283
from postproc.measure.measurements import Measurements
from postproc.measure.observations import Observation
from postproc.model.arm import Model


def worst_rows(size: Array) -> list[int]:
    """Return the indices of the at most ten largest sizes (n,), the largest first; NaN is left out."""
    return [int(i) for i in np.argsort(-np.nan_to_num(size, nan=-1.0))[:10] if np.isfinite(size[i])]


@dataclass(frozen=True)
class Comparison:
    """How far measured and predicted poses are apart.

    Args:
        fit: the model beside the data (nothing fitted but frames).
        error: (n, k) measured minus predicted of the observed kind [m], instrument axes, [rad] of angles; NaN in rows
            that were set aside.
        iso: pose accuracy and repeatability by ISO 9283; trends: the residual against every channel.
        bound: held-out rms that any smooth function of the channels reaches, everything fitted again [m], [rad].
        before: (6,) the model's own instrument frame, None where it has none.
    """

    fit: Fit
    error: Array
    iso: Iso9283
    trends: tuple[Trend, ...]
    bound: float
    before: Array | None = None

    @property
    def sizes(self) -> Array:
        """(n,) distance by which every row is off [m], [rad] of angles; NaN in rows that were set aside."""
        return sizes(self.error, self.fit.observed)

    @property
    def moved(self) -> list[Diagnostic]:
        """DAT031 where the instrument stood elsewhere than in the model, so that its place was fitted; else empty."""
        if self.before is None or not self.fit.free["instrument_frame"].any():
            return []
        now = self.fit.model.in_role(Role.INSTRUMENT_FRAME)
        assert now is not None
        far = 1e3 * float(np.linalg.norm((now.vector() - self.before)[:3]))
        message = f"the instrument stood {far:.1f} mm from where the model has it, or turned: these points place it"
        help_ = "nothing, if it was set up anew; else look for what moved"
        return [Diagnostic("DAT031", "info", message, self.fit.data.source, help=help_)]


def compare(model: Model, data: Measurements, *, noise: float | None = None) -> Comparison:
    """Return how far a model, as it is, and measurements are apart.

    Where the model has no instrument frame or tool frame of its own, or the instrument was set up elsewhere, the frames
    that bring the points nearest are used, so that the figures describe the arm.

    Args:
        noise: standard deviation per axis [m] stated by the user; that of repeats or ``sigma_mm`` by default.
    """
    frame = model.in_role(Role.INSTRUMENT_FRAME)
    fit = evaluate(model, data, noise=noise)
    error, place = fit.observed_error.copy(), fit.position_error
    error[list(fit.excluded)] = np.nan
    iso = iso9283(place[:, np.isfinite(place).any(axis=0)], fit.data.repeats)
    before = None if frame is None else frame.vector()
    moved = before is not None and fit.free["instrument_frame"].any()
    try:
        bound = fit_model(fit.model if moved else model, data, noise=noise).smooth_bound
    except PostprocError:  # too few rows for a fit
        bound = fit.smooth_bound
    return Comparison(fit, error, iso, residual_trends(fit), bound, before)


def sizes(error: Array, kind: Observation) -> Array:
    """Return (n,) length of each row's error, for joints the largest absolute one; NaN where nothing was measured.

    Args:
        error: (n, k) [m], [rad]; kind: what was measured.
    """
    if kind.name != "joint":
        return distances(error)
    seen = np.isfinite(error)
    return np.asarray(np.where(seen.any(axis=1), np.max(np.abs(np.where(seen, error, 0.0)), axis=1), np.nan))
