"""A path on a grid and what limits the speed along it, as toppra takes them; to be imported where toppra is needed."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.motion.values import Flags


@contextmanager
def _without_plots() -> Iterator[None]:
    """Lets toppra be imported without matplotlib, which it needs for plots alone: a quarter of a second."""
    names = ("matplotlib", "matplotlib.pyplot")
    spared = [name for name in names if not any(n in sys.modules for n in ("toppra", *names))]
    sys.modules.update({name: ModuleType(name) for name in spared})
    try:
        yield
    finally:
        for name in spared:
            del sys.modules[name]


with _without_plots():
    from toppra.algorithm import TOPPRA as _Toppra
    from toppra.constraint import JointVelocityConstraint, LinearConstraint
    from toppra.constraint.linear_constraint import canlinear_colloc_to_interpolate
    from toppra.interpolator import AbstractGeometricPath

__all__ = ["TOPPRA", "GridPath", "JointLimits", "JointVelocityConstraint", "SpeedBounds"]

logging.getLogger("toppra").setLevel(logging.ERROR)
FIRST, NEARLY = -1e-9, (-1e-6, 1e-3, -1e-3)  # weights of the path acceleration beside that of the squared speed


class TOPPRA(_Toppra):  # type: ignore[misc]
    """The algorithm of toppra, with fewer linear programs, and another way where one ends without solution.

    Where the arm may rest at a grid point and at the next, rest is the slowest speed: no program has to find it.
    toppra starts each program from the constraints that were active before. Where a joint turns back (its row of the
    path's first derivative is next to zero) that start may end in NaN although there is a solution. A program with next
    to the same objective is led another way, to the same corner.

    Args:
        may_rest: (g,) whether the arm may rest at the grid points.
    """

    def __init__(self, may_rest: Flags, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.may_rest = may_rest.tolist()
        self.objective = np.zeros(self.solver_wrapper.get_no_vars())
        self.double_steps = (-2.0 * self.solver_wrapper.get_deltas()).tolist()

    def compute_controllable_sets(self, sdmin: float, sdmax: float) -> Array:
        """Slowest and fastest squared speeds (g, 2) from which the end can be reached; NaN before a point without."""
        K = np.zeros((self._N + 1, 2))
        low, high = sdmin**2, sdmax**2
        K[self._N] = low, high
        self.solver_wrapper.setup_solver()
        for i in range(self._N - 1, -1, -1):
            ends = low, high
            high = self._end(i, -1.0, ends)
            low = 0.0 if ends[0] <= 0.0 and self.may_rest[i] else max(self._end(i, 1.0, ends), 0.0)
            K[i] = low, high
            if low != low or high != high:
                K[: i + 1] = np.nan
                break
        self.solver_wrapper.close_solver()
        return K

    def _end(self, i: int, sign: float, ends: tuple[float, float]) -> float:
        """The slowest (sign 1) or fastest (-1) squared speed at a grid point that leads to between ``ends``."""
        found = np.nan
        for weight in (FIRST if sign > 0 else -FIRST, *NEARLY):
            self.objective[:2] = weight, sign
            found = self.solver_wrapper.solve_stagewise_optim(i, None, self.objective, np.nan, np.nan, *ends)[1]
            if found == found:
                break
        return found

    def _forward_step(self, i: int, x: float, K_next: Array) -> Array:
        self.objective[:2] = self.double_steps[i], -1.0
        found: Array = self.solver_wrapper.solve_stagewise_optim(i, None, self.objective, x, x, *K_next)
        return found


class GridPath(AbstractGeometricPath):  # type: ignore[misc]
    """A path that is known at the grid points alone: its coordinates and their derivatives, (g, c) each."""

    waypoints = None

    def __init__(self, values: Sequence[Array], interval: Array) -> None:
        self.values, self.interval = values, interval

    @property
    def dof(self) -> int:
        return int(self.values[0].shape[1])

    @property
    def path_interval(self) -> Array:
        return self.interval

    def __call__(self, positions: Array, order: int = 0) -> Array:
        return self.values[order]


class SpeedBounds(LinearConstraint):  # type: ignore[misc]
    """Bounds (g,) of the squared path speed."""

    def __init__(self, low: Array, high: Array, dof: int) -> None:
        super().__init__()
        self.dof = dof
        self.bounds = np.column_stack([low, high])

    def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
        return None, None, None, None, None, None, self.bounds


class JointLimits(LinearConstraint):  # type: ignore[misc]
    """a u + b x + c within limits (k,), coefficients (g, k) of a path with ``dof`` coordinates."""

    def __init__(self, terms: tuple[Array, Array, Array], limit: Array, dof: int) -> None:
        super().__init__()
        self.dof = dof
        self.identical = True
        self.terms, self.limit = terms, np.tile(limit, 2)

    def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
        one = np.eye(self.terms[0].shape[1])
        F = np.vstack([one, -one])
        return canlinear_colloc_to_interpolate(*self.terms, F, self.limit, None, None, gridpoints, identical=True)
