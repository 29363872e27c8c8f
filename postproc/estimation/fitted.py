"""A fitted model, and what the data says about it: how much of the residual is noise, how sure parameters are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.roles import Role
from postproc.estimation.posterior import Posterior, posterior_of
from postproc.estimation.solution import Solution
from postproc.estimation.validation.regions import Regions
from postproc.estimation.validation.residual_split import ResidualSplit, split_residual
from postproc.measure.checks.repeats import Noise
from postproc.measure.errors import rms

NODES = 64
"""Values of the noise's variance that stand for its uncertainty."""


@dataclass(frozen=True)
class NoiseParts:
    """The noise of one measured number and its parts.

    Args:
        noise: as known before a fit. square: residual variance of what was observed [m^2], [rad^2].
        noise_share: share of that variance that follows no channel (restricted likelihood); used where repeats
            say nothing.
    """

    noise: Noise
    square: float
    noise_share: Callable[[], float]

    @property
    def channel_independent(self) -> float:
        """Standard deviation [m], [rad] of angles, of the part of the residual that depends on no channel."""
        return float(np.sqrt(self.noise_share() * self.square))

    @property
    def repeatability(self) -> float | None:
        """Standard deviation per axis [m] with which the arm returns to a pose; None where `sigma_mm` is not stated.

        Its square is the variance of repeats, or without them of the residual's part that depends on no channel, less
        that of the instrument.
        """
        if self.noise.instrument is None or self.noise.sigma is not None:
            return self.noise.repeatability
        return float(np.sqrt(max(self.channel_independent**2 - self.noise.instrument**2, 0.0)))

    @property
    def level(self) -> float | None:
        """Standard deviation of one measured number, instrument and arm together [m], [rad]; None where unknown."""
        if self.noise.sigma is not None or self.repeatability is None or self.noise.instrument is None:
            return self.noise.sigma
        return float(np.hypot(self.noise.instrument, self.repeatability))

    @property
    def origin(self) -> str:
        """Where the noise is known from: ``repeats``, ``user``, ``sigma_mm and the residual``, or ``none``.

        ``.. and rounded angles`` where half of its variance or more is what the table's rounded joint angles add.
        """
        if self.noise.sigma is not None and 2 * self.noise.rounding**2 > self.noise.sigma**2:
            return f"{self.noise.origin} and rounded angles"
        if self.noise.sigma is None and self.noise.instrument is not None:
            return f"{'sigma_mm' if self.noise.stated_instrument else 'what is usual for a reading'} and the residual"
        return self.noise.origin


@dataclass(frozen=True)
class Fit(Solution):
    """A fitted model and what the data says about it.

    Args:
        regions: what it is worth where no row is near, None where nobody asked.
    """

    regions: Regions | None = None

    @cached_property
    def residual_split(self) -> ResidualSplit:
        """How much of the residual is noise, and the held-out error that free functions of the channels would reach."""
        return split_residual(self)

    @property
    def smooth_bound(self) -> float:
        """Held-out error [m], [rad] of angles, that smooth functions of the channels reach without any physics.

        It is a comparison, no bound: a law that was searched for may be better.
        `compare`, `diagnose` and `add` all report the bound of the unchanged model fitted to all rows, so that a table
        has one.
        """
        return self.residual_split.held_out

    @property
    def parts(self) -> NoiseParts:
        """The noise split into the instrument's share and the arm's repeatability."""
        return NoiseParts(self.noise, self._square, lambda: self.residual_split.noise_share)

    @cached_property
    def unexplained(self) -> float:
        """Standard deviation per axis [m], [rad] of angles, of the model's error of the true pose, without the noise.

        It is the excess of the residual variance over that of the noise (`excess_variance`); without a known noise, it
        is the part of the residual that follows the channels.
        """
        variance, noise = self.overconfidence * self._square, self.noise.sigma
        if noise is None:
            return float(np.sqrt(variance * (1 - self.residual_split.noise_share)))
        return float(np.sqrt(excess_variance(variance, max(self.freedom, 1.0), noise**2, self.noise.dof)))

    @property
    def unnamed(self) -> bool:
        """Whether the model has a law without a name: its form was chosen on all rows, held-out ones too."""
        return any(e.role is Role.CURVE and not e.is_null for e in self.model.effects)

    @property
    def unseen_rms(self) -> float | None:
        """Root mean square error [m], [rad] of angles, of rows that neither parameters nor forms come from.

        With a law without a name, these are regions of the joint space that were left out with the whole search for it
        (`Regions`), and None where nobody asked for them.
        """
        if not self.unnamed:
            return self.held_out_rms
        return None if self.regions is None else rms(self.regions.after)

    @cached_property
    def posterior(self) -> Posterior:
        """What the rows and the priors say about the parameters together, at the parameters where the fit stands.

        Its scatter s^2 is the residual variance, or that on unseen poses where it is larger, over the share of
        independent rows.
        """
        return posterior_of(self, self.scatter_of_parameters)

    @property
    def covariance(self) -> Array:
        """(p, p) covariance of the fitted parameters in the order of ``parameters``, the unidentifiable ones known."""
        count = len(self.parameters)
        return self.posterior.covariance[:count, :count]

    @cached_property
    def scatter_of_parameters(self) -> float:
        """Factor between (A^T A + penalty^2)^-1 and the covariance of the fitted parameters by the rows alone.

        Errors of the model are common to repeats of a pose: with their share f of the variance, m repeats count as
        m / (1 + (m - 1) f) rows.
        """
        each = np.bincount(self.data.repeats)
        share = self.unexplained**2 / max(self._square, 1e-300) if each.max() > 1 else 0.0
        apart = float(np.sum(each / (1 + (each - 1) * share))) / len(self.data)
        return self.overconfidence * self.variance / (self.serial * apart)

    @cached_property
    def sigma(self) -> dict[tuple[str, int], float]:
        """Standard deviation of each parameter, by effect key and index in the effect's vector.

        It is that about the mean of the `posterior`, where `settled` puts the fit: what the rows alone hardly tell may
        stand many deviations from there.
        """
        names = (*self.posterior.names, *self.posterior.unidentifiable)
        return dict(zip(names, self.posterior.deviations.tolist(), strict=True))

    @cached_property
    def intervals(self) -> dict[str, Array]:
        """(p,) half widths of 95 % intervals of the parameters (Student's t), by effect key; NaN where not fitted."""
        from scipy.special import stdtrit

        wide = float(stdtrit(max(self.freedom, 1.0), 0.975))
        result = {e.key: np.full(len(e.vector()), np.nan) for e in self.model.effects}
        for (key, i), deviation in self.sigma.items():
            result[key][i] = wide * deviation
        return result


def excess_variance(total: float, dof: float, noise: float, noise_dof: float) -> float:
    """Return the posterior mean of the variance u^2 that a residual has in addition to the noise's n^2.

    A residual variance s^2 with nu degrees of freedom is (n^2 + u^2) chi^2_nu / nu, and that of the noise as estimated
    n^2 chi^2_d / d. Before, something is lacking at even odds, and if so, n^2 / (n^2 + u^2) is uniform in 0 .. 1;
    else u = 0. With k = nu / 2, x = k s^2 / n^2 and g_a = e^x x^-a gamma(a, x) (the lower incomplete gamma
    function) that is

        E[u^2] / n^2 = (g_k - g_(k+1)) / (1 + g_(k+1)),

    averaged over n^2 with the weight n^-nu e^-x (1 + g_(k+1)). It goes to s^2 - n^2 where that is many times its own
    uncertainty, and to 0 as many rows agree with the noise, but is not 0 because few rows prove nothing.

    Args:
        total: s^2; dof: nu > 0. noise: the estimate of n^2 > 0, in the same unit; noise_dof: d, infinite where known.
    """
    from scipy.special import chdtri

    variance = np.array([noise])
    if np.isfinite(noise_dof):
        variance = noise * noise_dof / chdtri(noise_dof, (np.arange(NODES) + 0.5) / NODES)
    k = 0.5 * dof
    x = k * total / variance
    first, second = (_log_scaled_gamma(a, x) for a in (k, k + 1.0))
    mean = variance * np.expm1(np.maximum(first - second, 0.0)) / (1.0 + np.exp(-second))
    weight = -k * np.log(variance) - x + np.logaddexp(0.0, second)
    weight = np.exp(weight - weight.max())
    return float(np.sum(weight * mean) / np.sum(weight))


def _log_scaled_gamma(a: float, x: Array) -> Array:
    """Return log(e^x x^-a gamma(a, x)) of x (m,) > 0, with the lower incomplete gamma function."""
    from scipy.special import gammainc, gammaln, hyp1f1

    small: NDArray[np.bool_] = x < a
    direct = x - a * np.log(x) + gammaln(a) + np.log(gammainc(a, np.where(small, a, x)))
    return np.where(small, np.log(hyp1f1(1.0, a + 1.0, np.where(small, x, 0.0)) / a), direct)
