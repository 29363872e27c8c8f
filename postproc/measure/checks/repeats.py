"""The noise of an instrument, by what repeats of a pose say of it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.measure.errors import CHANCE, chance_of_excess
from postproc.measure.measurements import Measurements
from postproc.robot.arm import Robot

RP_PER_AXIS = float(np.sqrt(8 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi))
"""RP of ISO 9283, l + 3 S of distances in space, over the standard deviation per axis: 3.62 (Maxwell)."""
STANDING_RATIO = 0.25
"""No arm that moved comes back to a pose so many times better than its data sheet says: it stood still."""


@dataclass(frozen=True, slots=True)
class Noise:
    """How far the measurement scatters by itself.

    Args:
        sigma: standard deviation of one number of what is observed [m], [rad] where only angles were measured, with the
            arm's own repeatability in it; None where nothing tells it. dof: degrees of freedom behind it.
        rotation: standard deviation per axis [rad] of orientations beside positions, None where none was repeated.
        origin: where the figure comes from. rounding: what of ``sigma`` comes from joint angles that are rounded.
        instrument: the instrument's own share of ``sigma`` [m], None where it is not known. It is the least that the
            noise can be: how well the arm repeats a pose is added to it. stated_instrument: whether `sigma_mm` says so.
    """

    sigma: float | None
    dof: float
    rotation: float | None
    origin: Literal["repeats", "user", "none"]
    rounding: float = 0.0
    instrument: float | None = None
    stated_instrument: bool = True

    @property
    def stated(self) -> float | None:
        """Standard deviation that the user has stated [m], without the share of rounding; None where not stated."""
        known = self.sigma is not None and self.origin == "user"
        return float(np.sqrt((self.sigma or 0.0) ** 2 - self.rounding**2)) if known else None

    @property
    def repeatability(self) -> float | None:
        """Standard deviation of the arm's own repeatability [m]; None where its sum with `sigma_mm` is not known."""
        if self.instrument is None or self.sigma is None:
            return None
        return float(np.sqrt(max(self.sigma**2 - self.rounding**2 - self.instrument**2, 0.0)))


def estimate_noise(data: Measurements, robot: Robot, stated: float | None = None, error: Array | None = None) -> Noise:
    """Return the noise that the user states, else the pooled scatter of repeats about the mean of each group.

    Repeats of one visit count where they have 9 degrees of freedom: those of a later visit differ by drift and heat as
    well. All repeats count where these are too few, or where all scatter significantly less. What a linear function of
    the user's own columns explains within repeats is no noise. Column ``sigma_mm`` gives the share of the instrument.

    Args:
        robot: whose repeatability counts where it did not move between repeats (`scatters`).
        stated: [m], or [rad] where only angles were measured.
        error: (n, k) residuals of a model, whose scatter counts in place of that of the observed numbers.
    """
    values = _values(data) if error is None else error
    positions = data.observed.name == "position"
    rotation = _rotation_scatter(data, data.repeats) if positions else None
    share: float | None = None
    if data.sigma is not None and positions:
        share = float(np.sqrt(np.nanmean(data.sigma**2)))
    instrument = share, data.sigma_stated
    if stated is not None:
        return Noise(stated, np.inf, rotation, "user", 0.0, *instrument)
    noise: Noise | None = None
    for square, dof in scatters(data, values, robot):
        if dof >= 9 and square > 0 and (noise is None or significantly_below(square, dof, noise)):
            noise = Noise(float(np.sqrt(square)), dof, rotation, "repeats", 0.0, *instrument)
    return noise or Noise(None, 0.0, rotation, "none", 0.0, *instrument)


def scatters(data: Measurements, values: Array, robot: Robot) -> list[tuple[float, float]]:
    """Return (pooled variance, degrees of freedom) of values (n, k), twice: of repeats of one visit, of all repeats.

    Several readings of a standing arm are repeats of the instrument alone. Positions that scatter by less than a
    quarter of the arm's repeatability on its data sheet are such: its square is added, no pose is attained better.
    """
    arm = (robot.repeatability or 0.0) / RP_PER_AXIS if data.observed.name == "position" else 0.0
    some = (visits(data), data.repeats)
    variances = [_unexplained_scatter(data, without_strays(values, groups), groups) for groups in some]
    return [(square + arm**2 * (0 < square < (STANDING_RATIO * arm) ** 2), dof) for square, dof in variances]


def _values(data: Measurements) -> Array:
    """Return (n, k) observed numbers; orientations as rotation vectors [rad] from the first repeat of each pose."""
    if data.observed.name == "orientation":
        return _turned(data, data.repeats)
    return data.numbers(data.observed)


def significantly_below(square: float, dof: float, than: Noise) -> bool:
    """Return whether the variance ``square`` with its degrees of freedom is significantly below a noise's (F test)."""
    return chance_of_excess(float(than.sigma or 0.0) ** 2 / square, than.dof, dof) < CHANCE


def visits(data: Measurements) -> NDArray[np.int_]:
    """Return (n,) number of the visit of each row: repeats of a pose at nearly the same temperature and time."""
    groups = data.repeats
    for channel, least in ((data.state.temperature, 0.3), (data.state.time, 0.0)):
        groups = groups if channel is None else _split(groups, channel, least)
    return groups


def _split(groups: NDArray[np.int_], channel: Array, least: float = 0.0) -> NDArray[np.int_]:
    """Return groups (n,) split where a channel (n,) has a gap over a twentieth of its range and over ``least``."""
    if not np.isfinite(channel).all():
        return groups
    order = np.lexsort((channel, groups))
    wide = np.diff(channel[order]) > max(0.05 * float(np.ptp(channel)), least)
    fresh = np.concatenate([[True], (np.diff(groups[order]) != 0) | wide])
    split = np.empty_like(groups)
    split[order] = np.cumsum(fresh) - 1
    return split


def _unexplained_scatter(data: Measurements, values: Array, groups: NDArray[np.int_]) -> tuple[float, float]:
    """Return the pooled variance of values (n, k) within groups (n,) beside own columns, and its degrees of freedom.

    What a linear function of a user's own column explains in each group is taken out if it is significant (F test).
    """
    square, dof = pooled_scatter(values, groups)
    columns = np.zeros((len(data), 0))
    # The levels of one column of words stand side by side: `name=word`.
    for _, levels in groupby(data.state.channels.items(), lambda item: item[0].partition("=")[0]):
        trial = np.column_stack([columns, *(channel for _, channel in levels)])
        within, remaining = pooled_scatter(values, groups, trial)
        if remaining in (0, dof) or within <= 0:
            continue
        between = (square * dof - within * remaining) / (dof - remaining)
        if chance_of_excess(between / within, dof - remaining, remaining) < CHANCE:
            columns, square, dof = trial, within, remaining
    return square, dof


def without_strays(values: Array, groups: NDArray[np.int_]) -> Array:
    """Return the values (n, k) with NaN in rows over ten times as far from their group's median as the median repeat.

    One typing error among the repeats would pass for noise of the instrument.
    """
    result = values.copy()
    away = np.full(len(values), np.nan)
    for group in np.flatnonzero(np.bincount(groups) > 1):
        member = np.flatnonzero(groups == group)
        seen = values[member][:, np.isfinite(values[member]).all(axis=0)]
        if seen.size:
            away[member] = np.abs(seen - np.median(seen, axis=0)).max(axis=1)
    known = away[np.isfinite(away) & (away > 0)]
    if len(known):
        result[np.nan_to_num(away) > 10 * np.median(known)] = np.nan
    return result


def pooled_scatter(values: Array, groups: NDArray[np.int_], explaining: Array | None = None) -> tuple[float, float]:
    """Return the pooled variance of values (n, k) about their group's mean, and its degrees of freedom; NaN is ignored.

    Args:
        groups: (n,) number of the group of each row.
        explaining: (n, c) columns; the variance is then that about a linear function of them in each group.
    """
    good = np.isfinite(values)
    _, index = np.unique(groups, return_inverse=True)
    count, total = np.zeros((2, int(index.max(initial=-1)) + 1, values.shape[1]))
    np.add.at(count, index, good)
    np.add.at(total, index, np.where(good, values, 0.0))
    away = np.where(good, values - (total / np.maximum(count, 1))[index], 0.0)
    dof = float(np.maximum(count - 1, 0).sum())
    columns = np.zeros((len(values), 0)) if explaining is None else explaining
    for group in np.flatnonzero((count > 1).any(axis=1)) if columns.size else ():
        member = np.flatnonzero(index == group)
        centred = columns[member] - columns[member].mean(axis=0)
        U, size, _ = np.linalg.svd(centred, full_matrices=False)
        U = U[:, size > 1e-9 * float(np.abs(columns[member]).max())]
        away[member] -= U @ (U.T @ away[member])
        dof -= float(np.minimum(U.shape[1], np.maximum(count[group] - 1, 0)).sum())
    return (float(np.sum(away[good] ** 2)) / dof if dof > 0 else 0.0), dof


def _rotation_scatter(data: Measurements, groups: NDArray[np.int_]) -> float | None:
    """Return the pooled standard deviation per axis [rad] of orientations; None below 9 degrees of freedom."""
    if data.rotation is None:
        return None
    square, dof = pooled_scatter(_turned(data, groups), groups)
    return float(np.sqrt(square)) if dof >= 9 and square > 0 else None


def _turned(data: Measurements, groups: NDArray[np.int_]) -> Array:
    """Return (n, 3) rotation vectors [rad] of orientations from the first of their group, NaN where not measured."""
    from scipy.spatial.transform import Rotation

    assert data.rotation is not None
    turned = np.full((len(data), 3), np.nan)
    good = np.asarray(np.isfinite(data.rotation).all(axis=(1, 2)))
    if not good.any():
        return turned
    first = {int(g): i for i, g in reversed(list(enumerate(groups))) if good[i]}
    rows = np.flatnonzero(good)
    reference = np.array([data.rotation[first[int(groups[i])]] for i in rows])
    turned[rows] = Rotation.from_matrix(np.swapaxes(reference, 1, 2) @ data.rotation[rows]).as_rotvec()
    return turned
