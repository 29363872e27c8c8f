"""The residual of a fit against every channel, in space and at the joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.fitted import Fit

FEWEST, MOST, IN_EACH = 12, 48, 30
"""Bins of a channel, and the rows wanted in each: long records show finer patterns."""
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
        member, centre = _bins(values[good])
        if space:
            along = _trend(name, "space", error[:, seen] * 1e3, good, member, centre)
            trends.append(replace(along, direction=np.eye(3)[seen].T @ along.direction))
        at_joint = name[:-1] in ("q", "v", "dir", "load", "a") and name[-1] in "123456"
        for j in [int(name[-1]) - 1] if at_joint else []:
            if not (space or seen[j]):
                continue
            trends.append(_trend(name, f"joint {j + 1}", joint[:, j : j + 1] * 1e3, good, member, centre))
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


def _trend(
    name: str, where: str, rows: Array, good: NDArray[np.bool_], member: NDArray[np.int_], centre: Array
) -> Trend:
    """Return the trend of a residual over the bins of one channel.

    Args:
        name: of the channel; where: as in `Trend`; rows: (n, d) residual [mm], [mrad], d = 1 at a joint.
        good: (n,) mask of the m rows that count; member: (m,) bin of each; centre: the channel in each bin.
    """
    values = rows[good] - rows[good].mean(axis=0)
    direction = np.linalg.svd(values, full_matrices=False)[2][0]
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    main = values @ direction
    bins = range(len(centre))
    means = np.array([values[member == k].mean(axis=0) for k in bins])
    count = np.bincount(member)
    total = float(np.sum(values**2))
    between = float(np.sum(count[:, None] * means**2))
    share = between / total if total > 0 else 0.0
    chance = (len(bins) - 1) / max(1, len(values) - 1)
    share = max(0.0, (share - chance) / (1 - chance)) if chance < 1 else 0.0
    spread = np.array([main[member == k].std() for k in bins]) / np.sqrt(count)
    mean = np.array([main[member == k].mean() for k in bins])
    every = np.full(len(rows), np.nan)
    every[good] = main
    return Trend(name, where, share, every, direction, centre, mean, spread)
