"""Where a model fails on measurements: figures, worst poses, the residual against every channel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.measure.errors import Iso9283, distances, iso9283
from postproc.measure.measurements import Measurements
from postproc.measure.observations import Observation
from postproc.model.arm import Model

FEWEST, MOST, IN_EACH = 12, 48, 30
"""Bins of a channel, and the rows wanted in each: long records show finer curves."""
CELLS = 200
"""So many values a channel has: what is nearer is one (levels of a grid, a thermometer's steps) and never parted."""

LEAST_LEVER_M = 0.05
"""Lever [m] below which no joint is blamed for what it could hardly cause."""


@dataclass(frozen=True)
class Trend:
    """The residual against one channel.

    Args:
        channel: name; where: ``space`` or ``joint 2``.
        share: of the residual's variance that the means of bins of the channel explain, less what as many bins would
            explain of noise.
        values: (n,) the residual less its mean, mm along ``direction`` or mrad at the joint, NaN where not measured and
            in rows that the fit left out.
        direction: (3,) unit vector in instrument axes, (1,) at a joint.
        centre, mean, spread: per bin: the channel, the mean of the values, its standard error.
    """

    channel: str
    where: str
    share: float
    values: Array
    direction: Array
    centre: Array
    mean: Array
    spread: Array


def joint_errors(fit: Fit) -> Array:
    """Return (n, 6) smallest joint errors [rad] that would move the TCP by its position error e, dq = J^+ e."""
    e = np.nan_to_num(fit.problem.error[:, :3])
    return np.asarray((joint_inverse(fit) @ e[:, :, None])[:, :, 0])


def joint_inverse(fit: Fit) -> Array:
    """Return (n, 6, 3) J^+ = J^T (J J^T + s^2)^-1 [rad/m] for the measured coordinates, damped with s = LEAST_LEVER_M.

    Near singular directions no joint is blamed for what it could hardly cause.
    """
    J = fit.problem.sensitivity.matrix[:, :3, :6] * np.isfinite(fit.problem.error[:, :3, None])
    square = J @ np.swapaxes(J, 1, 2) + LEAST_LEVER_M**2 * np.eye(3)
    return np.asarray(np.swapaxes(np.linalg.solve(square, J), 1, 2))


def residual_trends(fit: Fit) -> tuple[Trend, ...]:
    """Return the residual against every channel, in space and at the channel's joint, the largest share first."""
    error, named = fit.observed_error.copy(), fit.problem.channels
    error[list(fit.excluded)] = np.nan
    seen = np.asarray(np.isfinite(error).any(axis=0))
    good = np.asarray(np.isfinite(error[:, seen]).all(axis=1))
    if not seen.any() or good.sum() < 3 * FEWEST or fit.observed.name == "orientation":
        return ()
    space = fit.observed.name == "position"
    joint = joint_errors(fit) if space else error
    trends: list[Trend] = []
    for name, values in named.items():
        bins = _bins(values[good])
        if space:
            along = _trend(name, "space", error[:, seen] * 1e3, good, bins)
            trends.append(replace(along, direction=np.eye(3)[seen].T @ along.direction))
        at_joint = name[:-1] in ("q", "v", "dir", "load", "a") and name[-1] in "123456"
        j = int(name[-1]) - 1 if at_joint else 0
        if at_joint and (space or seen[j]):
            trends.append(_trend(name, f"joint {j + 1}", joint[:, j : j + 1] * 1e3, good, bins))
    return tuple(sorted(trends, key=lambda t: -t.share))


def _bins(values: Array) -> tuple[NDArray[np.int_], Array]:
    """Return (n,) index of the bin of every value, and the median of each bin.

    Bins have about as many values each and are not empty; a channel of few values has a bin for each.
    """
    cell = np.round((values - values.min()) / (float(np.ptp(values)) / CELLS or 1.0))
    count = int(np.clip(len(values) // IN_EACH, FEWEST, MOST))
    if len(np.unique(cell)) > count:
        cell = np.searchsorted(np.quantile(cell, np.linspace(0, 1, count + 1)[1:-1]), cell)
    member = np.unique(cell, return_inverse=True)[1]
    return member, np.array([np.median(values[member == k]) for k in range(member.max() + 1)])


def _trend(name: str, where: str, rows: Array, good: NDArray[np.bool_], bins: tuple[NDArray[np.int_], Array]) -> Trend:
    """Return the trend of a residual over the bins of one channel.

    Args:
        name: of the channel; where: as in `Trend`; rows: (n, d) residual [mm], [mrad], d = 1 at a joint.
        good: (n,) mask of the m rows that count; bins: (m,) bin of each, and the channel in each bin, of `_bins`.
    """
    member, centre = bins
    values = rows[good] - rows[good].mean(axis=0)
    direction = np.linalg.svd(values, full_matrices=False)[2][0]
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    main = values @ direction
    each = range(len(centre))
    means = np.array([values[member == k].mean(axis=0) for k in each])
    count = np.bincount(member)
    total = float(np.sum(values**2))
    between = float(np.sum(count[:, None] * means**2))
    share = between / total if total > 0 else 0.0
    chance = (len(each) - 1) / max(1, len(values) - 1)
    share = max(0.0, (share - chance) / (1 - chance)) if chance < 1 else 0.0
    spread = np.array([main[member == k].std() for k in each]) / np.sqrt(count)
    mean = np.array([main[member == k].mean() for k in each])
    every = np.full(len(rows), np.nan)
    every[good] = main
    return Trend(name, where, share, every, direction, centre, mean, spread)


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
    try:  # as it was placed: a model without frames of its own would miss by where the instrument stands
        fitted = fit_model(fit.model, data, noise=noise)
    except PostprocError:  # too few rows for a fit
        fitted = fit
    bound, trends = fitted.smooth_bound, residual_trends(fit)
    # The noise of a table is that of a fit to it, which has judged how its angles were rounded.
    return Comparison(replace(fit, noise=fitted.noise), error, iso, trends, bound, before)


def sizes(error: Array, kind: Observation) -> Array:
    """Return (n,) length of each row's error, for joints the largest absolute one; NaN where nothing was measured.

    Args:
        error: (n, k) [m], [rad]; kind: what was measured.
    """
    if kind.name != "joint":
        return distances(error)
    seen = np.isfinite(error)
    return np.asarray(np.where(seen.any(axis=1), np.max(np.abs(np.where(seen, error, 0.0)), axis=1), np.nan))
