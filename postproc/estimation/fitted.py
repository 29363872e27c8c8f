"""A fitted model, and what the data says about it: how much of the residual is noise, how sure parameters are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Array
from postproc.estimation.leftover import Leftover, split_residual
from postproc.estimation.solution import Solution
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


@dataclass(frozen=True)
class Fit(Solution):
    """A fitted model and what the data says about it."""

    @cached_property
    def leftover(self) -> Leftover:
        """How much of the residual is noise, and how far free functions of the channels would bring it."""
        return split_residual(self)

    @property
    def smooth_bound(self) -> float:
        """How far any smooth function of the channels, without physics, would bring the held-out error [m], [rad].

        `compare`, `diagnose` and `add` tell that of the model as it came, fitted on all rows: one bound for one table.
        """
        return self.leftover.held_out

    @property
    def parts(self) -> NoiseParts:
        """What the noise consists of: the instrument's, the arm's."""
        return NoiseParts(self.noise, self._square, lambda: self.leftover.noise)

    @cached_property
    def unexplained(self) -> float:
        """Standard deviation per axis [m], [rad] of angles, of what the model leaves of the true pose.

        The residual variance less the noise, where significant (F test, 1 %); less what follows no channel without one.
        """
        own, noise = self.surer * self._square, self.noise.sigma
        if noise is None:
            return float(np.sqrt(own * (1 - self.leftover.noise)))
        from scipy.special import fdtrc

        dof = self.noise.dof if np.isfinite(self.noise.dof) else 1e6
        if own <= noise**2 or fdtrc(max(self.freedom, 1.0), dof, own / noise**2) > 0.01:
            return 0.0
        return float(np.sqrt(own - noise**2))

    @cached_property
    def undecided(self) -> float:
        """Standard deviation per axis [m] of what a law worse by odds of 50 to 1 may leave; 0 where none is drafted."""
        if not any(e.drafted and not e.is_null for e in self.model.effects):
            return 0.0
        numbers = self.serial * self.told * len(self.problem.residual)
        return float(np.sqrt(2 * np.log(50) * self.surer * self._square / numbers))

    @cached_property
    def covariance(self) -> Array:
        """(p, p) of the fitted parameters: variance (A^T A + penalty)^-1 over the share of independent rows.

        The variance is that of poses that the fit has not seen, where they tell a larger one. What the model misses,
        repeats of a pose have in common: with its share s of the variance, m of them count as m / (1 + (m - 1) s).
        """
        return np.asarray(self.scatter_of_parameters * self.inverse)

    @cached_property
    def scatter_of_parameters(self) -> float:
        """How many times larger the covariance of the parameters is than (A^T A + penalty)^-1."""
        each = np.bincount(self.data.repeats)
        share = self.unexplained**2 / max(self._square, 1e-300) if each.max() > 1 else 0.0
        apart = float(np.sum(each / (1 + (each - 1) * share))) / len(self.data)
        return self.surer * self.variance / (self.serial * apart)

    @cached_property
    def sigma(self) -> dict[tuple[str, int], float]:
        """Standard deviation of each parameter that was fitted, by effect and index in its vector."""
        deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return dict(zip(self.parameters, deviations.tolist(), strict=True))

    @cached_property
    def intervals(self) -> dict[str, Array]:
        """Half width of the 95 % interval of each parameter by effect (Student's t), NaN where it was not fitted."""
        from scipy.special import stdtrit

        wide = float(stdtrit(max(self.freedom, 1.0), 0.975))
        result = {e.key: np.full(len(e.vector()), np.nan) for e in self.model.effects}
        for (key, i), deviation in self.sigma.items():
            result[key][i] = wide * deviation
        return result
