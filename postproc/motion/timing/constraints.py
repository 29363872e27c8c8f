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
NEARLY = (-1e-6, 1e-3, -1e-3)  # weights of the path acceleration beside that of the squared speed


class TOPPRA(_Toppra):  # type: ignore[misc]
    """The algorithm of toppra, with another way to the squared speeds where a linear program ends without solution.

    toppra starts each program from the constraints that were active before. Where a joint turns back (its row of the
    path's first derivative is next to zero) that start may end in NaN although there is a solution. A program with next
    to the same objective is led another way, to the same corner.
    """

    def _one_step(self, i: int, K_next: Array) -> Array:
        found: Array = super()._one_step(i, K_next)
        for end, sign in ((0, 1.0), (1, -1.0)):
            for weight in NEARLY if np.isnan(found[end]) and np.isfinite(K_next).all() else ():
                objective = np.array([weight, sign])
                found[end] = self.solver_wrapper.solve_stagewise_optim(i, None, objective, np.nan, np.nan, *K_next)[1]
                if np.isfinite(found[end]):
                    break
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
