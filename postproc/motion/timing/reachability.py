"""The fastest path speed in numpy, where toppra is not installed: reachability analysis (Pham and Pham 2018, TOPP-RA).

It gives the names of `constraints`, with the same arguments. The linear programs of a grid point have two variables,
path acceleration u and squared path speed x. Constraints are bands |a u + b x + c| <= limit: u is eliminated (Fourier
and Motzkin), and what remains are bounds of x.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.motion.values import Flags

_SMALL = 1e-12  # coefficients below this share of the largest are zero
_ROUNDING = 1e-9  # of an empty range of x that rounding alone has emptied


class SpeedLimits:
    """Bounds of the squared path speed from the speeds (k,) of the coordinates."""

    def __init__(self, speed: Array) -> None:
        self.speed = speed

    def squared(self, slope: Array) -> Array:
        """Return the bounds (g, 2) of the squared path speed for a path with this derivative (g, k)."""
        with np.errstate(divide="ignore"):
            return np.column_stack([np.zeros(len(slope)), ((self.speed / np.abs(slope)) ** 2).min(axis=1)])


class SquaredSpeedBounds:
    """Bounds (g,) of the squared path speed."""

    def __init__(self, low: Array, high: Array, dof: int) -> None:
        self.bounds = np.column_stack([low, high])


class LinearBands:
    """Constraint |a u + b x + c| <= limit (k,); terms: a, b and c, (g, k) each."""

    def __init__(self, terms: tuple[Array, Array, Array], limit: Array, dof: int) -> None:
        self.terms, self.limit = terms, limit


class SampledPath:
    """A path known only at the grid points: its coordinates and their first two derivatives, (g, c) each."""

    def __init__(self, values: Sequence[Array], interval: Array) -> None:
        self.values = values


Constraint = SpeedLimits | SquaredSpeedBounds | LinearBands


class Reachability:
    """Controllable sets from the end of a path backward, then the fastest speed forward.

    Args:
        may_stop: (g,) whether the arm may rest at the grid points.
        constraints: limits hold at a grid point and, taken as linear, at the next.
        path: along which. gridpoints: (g,) path parameter.
    """

    def __init__(
        self, may_stop: Flags, constraints: Sequence[Constraint], path: SampledPath, *, gridpoints: Array, **_: Any
    ) -> None:
        n, self.may_stop = len(gridpoints), may_stop.tolist()
        step = 2 * np.diff(gridpoints)
        low, high = np.zeros(n), np.full(n, np.inf)
        bands: list[tuple[Array, ...]] = []
        for one in constraints:
            if isinstance(one, LinearBands):
                a, b, c = one.terms
                limit = np.broadcast_to(one.limit, a[1:].shape)
                bands += [(a[:-1], b[:-1], c[:-1], limit), (a[1:] + step[:, None] * b[1:], b[1:], c[1:], limit)]
                continue
            bounds = one.bounds if isinstance(one, SquaredSpeedBounds) else one.squared(path.values[1])
            low, high = np.maximum(low, bounds[:, 0]), np.minimum(high, bounds[:, 1])
        a, b, c, limit = (np.concatenate(parts, axis=1) for parts in zip(*bands, strict=True))
        flat = np.abs(a) <= _SMALL * np.maximum(np.abs(a).max(axis=1, keepdims=True), 1e-300)
        with np.errstate(divide="ignore", invalid="ignore"):
            # u is between lower - tilt x and upper - tilt x.
            self.tilt = np.where(flat, 0.0, b / a)
            self.lower, self.upper = (np.where(flat, s * np.inf, s * limit / np.abs(a) - c / a) for s in (-1, 1))
            ends = np.sort([(-limit - c) / b, (limit - c) / b], axis=0)
            level = flat & (b != 0)
            low[:-1] = np.maximum(low[:-1], np.where(level, ends[0], -np.inf).max(axis=1))
            high[:-1] = np.minimum(high[:-1], np.where(level, ends[1], np.inf).min(axis=1))
        for k in range(a.shape[1]):
            below, above = self._crossing(slice(None), self.tilt[:, k], self.lower[:, k], self.upper[:, k])
            low[:-1], high[:-1] = np.maximum(low[:-1], below), np.minimum(high[:-1], above)
        self.low, self.high, self.step = low, high, step

    def _crossing(self, i: Any, tilt: Any, lower: Any, upper: Any) -> tuple[Any, Any]:
        """Return the smallest and largest x at which one more band of u leaves room with all bands of the stages ``i``.

        Args:
            tilt, lower, upper: of the band, one for each stage.
        """
        tilt, lower, upper = (np.asarray(value)[..., None] for value in (tilt, lower, upper))
        d = tilt - self.tilt[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (lower - self.upper[i]) / d, (upper - self.lower[i]) / d
        below, above = np.where(d > 0, first, second), np.where(d > 0, second, first)
        none = np.abs(d) <= _SMALL * (np.abs(tilt) + np.abs(self.tilt[i]))
        below, above = np.where(none, -np.inf, below), np.where(none, np.inf, above)
        return below.max(axis=-1), above.min(axis=-1)

    def compute_controllable_sets(self, low: float, high: float) -> Array:
        """Return the ranges (g, 2) of the squared speed from which a squared speed at the end can be reached.

        NaN at the last grid point from which nothing leads on, and at all points before it.
        """
        K = np.full((len(self.low), 2), np.nan)
        K[-1] = low, high
        for i in range(len(self.step) - 1, -1, -1):
            step = self.step[i]
            standstill = low <= 0.0 and self.may_stop[i]
            below, above = self._crossing(i, 1 / step, low / step, high / step)
            low, high = max(below, self.low[i], 0.0), min(above, self.high[i])
            if standstill:
                low = 0.0
            if low > high:
                if low > high + _ROUNDING * max(1.0, abs(low)):
                    break
                low = high
            K[i] = low, high
        return K

    def compute_parameterization(
        self, start: float, end: float, return_data: bool = True
    ) -> tuple[None, Array | None, None, Array]:
        """Return the fastest path speeds (g,), None where there are none, and the controllable sets, as toppra does.

        Args:
            start, end: path speeds at both ends.
        """
        K = self.compute_controllable_sets(end**2, end**2)
        x = start**2
        if np.isnan(K).any() or not K[0, 0] - 1e-8 <= x <= K[0, 1] + 1e-8:
            return None, None, None, K
        squares = np.empty(len(K))
        squares[0] = x
        for i, step in enumerate(self.step.tolist()):
            u = float((self.upper[i] - self.tilt[i] * x).min())
            x = min(max(x + step * u, K[i + 1, 0]), K[i + 1, 1])
            squares[i + 1] = x
        return None, np.sqrt(squares), None, K


TOPPRA, GridPath, JointLimits, JointVelocityConstraint, SpeedBounds = (
    *(Reachability, SampledPath, LinearBands, SpeedLimits, SquaredSpeedBounds),
)
