"""What the noise of a measurement consists of: the instrument's own, and how well the arm comes back to a pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from postproc.measure.checks.repeats import Noise


@dataclass(frozen=True)
class NoiseParts:
    """The noise of one measured number and its parts.

    Args:
        noise: as the data tells it before a fit. square: residual variance of what was observed [m^2], [rad^2].
        silent: share of that variance that follows no channel (restricted likelihood); asked for where repeats tell
            nothing.
    """

    noise: Noise
    square: float
    silent: Callable[[], float]

    @property
    def unfollowed(self) -> float:
        """Standard deviation of what of the residual follows no channel [m], [rad] of angles."""
        return float(np.sqrt(self.silent() * self.square))

    @property
    def repeatability(self) -> float | None:
        """How well the arm comes back to a pose, standard deviation per axis [m]; None where `sigma_mm` is not stated.

        What repeats scatter beyond the instrument; without repeats what of the residual follows no channel beyond it.
        """
        if self.noise.instrument is None or self.noise.sigma is not None:
            return self.noise.repeatability
        return float(np.sqrt(max(self.unfollowed**2 - self.noise.instrument**2, 0.0)))

    @property
    def level(self) -> float | None:
        """Standard deviation of one measured number [m], [rad] of angles: instrument and arm; None where unknown."""
        if self.noise.sigma is not None or self.repeatability is None or self.noise.instrument is None:
            return self.noise.sigma
        return float(np.hypot(self.noise.instrument, self.repeatability))

    @property
    def origin(self) -> str:
        """Where the noise is known from, as documents say it."""
        if self.noise.sigma is None and self.noise.instrument is not None:
            return "sigma_mm and the residual"
        return self.noise.origin
