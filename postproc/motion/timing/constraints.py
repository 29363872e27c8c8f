"""A path on a grid and what limits the speed along it, as toppra takes them; to be imported where toppra is needed."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.motion.values import Flags
from postproc.process import putting_off

# For plots and for paths of its own, which are not used here: 0.3 s.
with putting_off("matplotlib", "matplotlib.pyplot", "scipy.interpolate", "scipy.sparse"):
    from toppra.algorithm import TOPPRA as _Toppra
    from toppra.constraint import JointVelocityConstraint, LinearConstraint
    from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate
    from toppra.interpolator import AbstractGeometricPath

__all__ = ["TOPPRA", "GridPath", "JointLimits", "JointVelocityConstraint", "SpeedBounds"]

logging.getLogger("toppra").setLevel(logging.ERROR)
FIRST, NEARLY = -1e-9, (-1e-6, 1e-3, -1e-3)  # weights of the path acceleration beside that of the squared speed


class TOPPRA(_Toppra):  # type: ignore[misc]
    """The algorithm of toppra with fewer linear programs, and with a second try where one ends without solution.

    At a grid point and its successor where the arm may rest, zero is the slowest speed and no program has to find it.
    toppra starts each program from the constraints that were active before. Where a joint turns back (its row of the
    path's first derivative is next to zero) that start may end in NaN although there is a solution. A program with
    almost the same objective then takes another way to the same corner of the feasible set.

    Args:
        may_stop: (g,) whether the arm may rest at the grid points.
    """

    def __init__(self, may_stop: Flags, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.may_stop = may_stop.tolist()
        self.objective = np.zeros(self.solver_wrapper.get_no_vars())
        self.double_steps = (-2.0 * self.solver_wrapper.get_deltas()).tolist()

    def compute_controllable_sets(self, sdmin: float, sdmax: float) -> Array:
        """Slowest and fastest squared speeds (g, 2) from which the end can be reached.

        NaN at the last grid point from which nothing leads on, and at all points before it.

        Args:
            sdmin, sdmax: bounds of the speed at the end.
        """
        K = np.zeros((self._N + 1, 2))
        low, high = sdmin**2, sdmax**2
        K[self._N] = low, high
        self.solver_wrapper.setup_solver()
        for i in range(self._N - 1, -1, -1):
            ends = low, high
            high = self._end(i, -1.0, ends)
            low = 0.0 if ends[0] <= 0.0 and self.may_stop[i] else max(self._end(i, 1.0, ends), 0.0)
            K[i] = low, high
            if low != low or high != high:
                K[: i + 1] = np.nan
                break
        self.solver_wrapper.close_solver()
        return K

    def _end(self, i: int, sign: float, ends: tuple[float, float]) -> float:
        """Slowest (sign 1) or fastest (-1) squared speed at grid point i that leads into ``ends`` (2,) at the next.

        NaN if none of the linear programs has a solution.
        """
        square = np.nan
        for weight in (FIRST if sign > 0 else -FIRST, *NEARLY):
            self.objective[:2] = weight, sign
            square = self.solver_wrapper.solve_stagewise_optim(i, None, self.objective, np.nan, np.nan, *ends)[1]
            if square == square:
                break
        return square

    def _forward_step(self, i: int, x: float, K_next: Array) -> Array:
        """Optimum (u, x) at grid point i: the path acceleration u that leads fastest on from the squared speed x.

        Args:
            K_next: (2,) range of the squared speed at the next grid point.
        """
        self.objective[:2] = self.double_steps[i], -1.0
        optimum: Array = self.solver_wrapper.solve_stagewise_optim(i, None, self.objective, x, x, *K_next)
        return optimum


class GridPath(AbstractGeometricPath):  # type: ignore[misc]
    """A path known only at the grid points: its coordinates and their first two derivatives, (g, c) each."""

    waypoints = None

    def __init__(self, values: Sequence[Array], interval: Array) -> None:
        self.values, self.interval = values, interval

    @property
    def dof(self) -> int:
        """Number of coordinates."""
        return int(self.values[0].shape[1])

    @property
    def path_interval(self) -> Array:
        """First and last path parameter (2,)."""
        return self.interval

    def __call__(self, positions: Array, order: int = 0) -> Array:
        """The coordinates (order 0), or their derivative of that order, (g, c) at all grid points.

        Args:
            positions: not used; toppra passes the grid points.
        """
        return self.values[order]


class SpeedBounds(LinearConstraint):  # type: ignore[misc]
    """Constraint of the squared path speed between bounds (g,); dof: number of coordinates of the path."""

    def __init__(self, low: Array, high: Array, dof: int) -> None:
        super().__init__()
        self.dof = dof
        self.bounds = np.column_stack([low, high])

    def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
        """What toppra asks of a constraint: bounds (g, 2) of the squared path speed last, None for all else."""
        return None, None, None, None, None, None, self.bounds


class JointLimits(LinearConstraint):  # type: ignore[misc]
    """Constraint |a u + b x + c| <= limit (k,), with path acceleration u and squared path speed x.

    Args:
        terms: a, b and c, each (g, k).
        dof: number of coordinates of the path.
    """

    def __init__(self, terms: tuple[Array, Array, Array], limit: Array, dof: int) -> None:
        super().__init__()
        self.dof = dof
        self.identical = True
        self.terms, self.limit = terms, np.tile(limit, 2)

    def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
        """What toppra asks of a constraint: coefficients and limits of both signs, to hold between grid points, too."""
        one = np.eye(self.terms[0].shape[1])
        F = np.vstack([one, -one])
        return canlinear_colloc_to_interpolate(*self.terms, F, self.limit, None, None, gridpoints, identical=True)
