"""Laws of an offset: constant, or affine in numbers that the statement names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log10

import numpy as np

from postproc.arrays import Array
from postproc.rapid.data.records import Vec3

LEAST_INDEPENDENCE = 0.03
"""Share of their spread by which regressors must differ from one another to be told apart: a coordinate that is a
rounded multiple of a loop's index differs from it by its rounding, and what goes with that is chance."""

CANCELLING = 2.0
"""How much more than what the offsets differ by one regressor may contribute: what takes that back again is other
regressors, and with nearly as many of them as runs that is chance, by which a target that is taught anew would go far
off."""

STEEPEST = 0.05
"""By how much [mm] a correction may change with one millimetre of a coordinate: that of an arm changes by some
thousandths; what is steeper is chance, and carries a target off when the coordinate is another."""

SLOPE_DECIMALS = 7  # at most, of what a displacement adds by unit of a number that may go into the thousands
ROUNDING = 1e-4
"""Of an offset [mm], by the decimals of one coefficient: a tenth of the last decimal of a target."""

Regressors = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class OffsetLaw:
    """Formula for an offset [mm]: a constant plus the sum of numbers, named by their text, times coefficients."""

    constant: Vec3 = (0.0, 0.0, 0.0)
    coefficients: tuple[tuple[str, Vec3], ...] = ()

    def at(self, regressors: Regressors) -> Vec3:
        """The offset [mm] for these values of the named numbers."""
        x, y, z = self.constant
        for name, (dx, dy, dz) in self.coefficients:
            value = regressors[name]
            x, y, z = x + value * dx, y + value * dy, z + value * dz
        return x, y, z


def nearest_law(laws: Iterable[tuple[OffsetLaw, Array]], most: Array) -> OffsetLaw | None:
    """The formula that leaves least; None if none is within the error that each run may keep.

    A formula that changes by more than 0.05 mm per mm of a coordinate is passed over.

    Args:
        laws: formulas, the simplest first, each with the error (n, 3) that it leaves in each run [mm].
        most: (n,) largest length of that error in each run [mm].
    """
    nearest, least = None, np.inf
    for law, residuals in laws:
        if any(
            ".trans." in text and max(map(abs, slope)) > STEEPEST for text, slope in law.coefficients if "(" not in text
        ):
            continue
        off = np.linalg.norm(residuals, axis=1)
        if off.max() < least and (off <= most).all():
            nearest, least = law, float(off.max())
    return nearest


def midrange(values: Array) -> Array:
    """The point (k,) half-way between the least and the largest of values (n, k) along every axis."""
    middle: Array = (values.min(axis=0) + values.max(axis=0)) / 2
    return middle


def constant_law(offsets: Array) -> tuple[OffsetLaw, Array]:
    """The constant half-way between the extremes of offsets (n, 3) [mm], and the error (n, 3) that it leaves."""
    middle = midrange(offsets)
    x, y, z = middle.tolist()
    return OffsetLaw((x, y, z)), offsets - middle


def fit_affine(regressors: Sequence[Regressors], offsets: Array, least: float) -> OffsetLaw:
    """The formula nearest to the offsets of n runs, affine in as few regressors as possible.

    Args:
        regressors: named values in each run.
        offsets: (n, 3) [mm] that the runs require.
        least: error along an axis that may remain to use one regressor fewer [mm].
    """
    names = sorted(set(regressors[0]).intersection(*regressors[1:]), key=lambda name: _dispensable(name, regressors))
    best, off, part = _fit(names, regressors, offsets)
    while part > CANCELLING:
        fewer = [[other for other in names if other != name] for name in names]
        best, off, part = min((_fit(chosen, regressors, offsets) for chosen in fewer), key=lambda fit: fit[1])
        names = [name for name, _ in best.coefficients]
    for name in tuple(names):
        without = [other for other in names if other != name]
        simpler, remaining, part = _fit(without, regressors, offsets)
        if remaining <= max(1.01 * off, least) and part <= CANCELLING:
            names, best = without, simpler
    coefficients = [(name, _rounded(slope, [run[name] for run in regressors])) for name, slope in best.coefficients]
    return OffsetLaw(best.constant, tuple(coefficients))


def _rounded(slope: Vec3, values: Sequence[float]) -> Vec3:
    """A coefficient with as few decimals as change no offset of the runs by more than `ROUNDING` [mm].

    Args:
        values: of its regressor in the runs.
    """
    most = max(map(abs, values))
    decimals = min(max(ceil(log10(0.5 * most / ROUNDING)), 0), SLOPE_DECIMALS) if most > 0 else SLOPE_DECIMALS
    x, y, z = (round(value, decimals) for value in slope)
    return x, y, z


def _dispensable(name: str, regressors: Sequence[Regressors]) -> tuple[bool, float, int, str]:
    """Sort key for the order in which regressors are left out: coordinates first, the smallest range foremost.

    Coordinates are taught and measured; one with a small range would mean much in another run. Of other numbers, those
    with the longest text come first.

    Args:
        name: text of the regressor.
        regressors: named values in each run.
    """
    values = [run[name] for run in regressors]
    coordinate = ".trans." in name
    return not coordinate, max(values) - min(values) if coordinate else 0.0, -len(name), name


def _fit(names: Sequence[str], regressors: Sequence[Regressors], offsets: Array) -> tuple[OffsetLaw, float, float]:
    """Least-squares formula in the named regressors, whose constant centres the residuals.

    Returns:
        The formula, its largest residual along an axis [mm], and the largest contribution of one regressor as a
        multiple of the range of the offsets.
    """
    values = np.array([[run[name] for name in names] for run in regressors]).reshape(len(regressors), len(names))
    size = np.ptp(values, axis=0)
    size[size == 0.0] = np.inf  # it tells the runs apart in nothing
    scaled = (values - values.mean(axis=0)) / size
    slopes = np.linalg.lstsq(scaled, offsets - offsets.mean(axis=0), rcond=LEAST_INDEPENDENCE)[0] / size[:, None]
    residuals = offsets - values @ slopes
    x, y, z = midrange(residuals).tolist()
    by_name = tuple((name, (a, b, c)) for name, (a, b, c) in zip(names, slopes.tolist(), strict=True))
    size[np.isinf(size)] = 0.0
    part = np.abs(slopes * size[:, None]).max(initial=0.0) / max(np.ptp(offsets, axis=0).max(), 1e-9)
    return OffsetLaw((x, y, z), by_name), float(np.ptp(residuals, axis=0).max()) / 2, float(part)
