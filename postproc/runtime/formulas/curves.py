"""Functions of one number as tables of equally spaced values, read with a cubic through the four nearest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

Singles = NDArray[np.float32]

COARSEST, FINEST = 8, 4096
"""Numbers of intervals that are tried, each twice the one before."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A table of a function.

    Args:
        name: of the RAPID array. low: argument of the second value; step: between values.
        values: (m,) single precision, from one step below the range to one step above.
    """

    name: str
    low: float
    step: float
    values: Singles


def at(curve: Curve, x: Singles) -> Singles:
    """Values at x (n,) by Lagrange's cubic through four neighbours, as `ppCurve` of the module does; level outside."""
    one = np.float32
    f, last = curve.values, np.float32(len(curve.values) - 3)
    u = np.clip((x - one(curve.low)) / one(curve.step), one(0.0), last)
    i = np.minimum(np.trunc(u), last - one(1.0))
    u = u - i
    k = np.nan_to_num(i).astype(int)
    a, b, c, d = f[k], f[k + 1], f[k + 2], f[k + 3]
    # The line between the neighbours, and what the second and third differences add.
    second, third = a - one(2.0) * b + c, d - one(3.0) * c + one(3.0) * b - a
    bent = second + third * (u + one(1.0)) / one(3.0)
    return b + u * (c - b) + u * (u - one(1.0)) * bent / one(2.0)


def tabulated(name: str, function: Callable[[Array], Array], low: float, high: float, tolerance: float) -> Curve:
    """The coarsest table whose cubic is nowhere farther from the function than the tolerance, as far as that goes.

    Args:
        function: (n,) to (n,). low, high: the range in which it is read. tolerance: in the unit of the values.
    """
    count = COARSEST
    between = np.linspace(low, high, 4 * FINEST + 1)
    wanted = function(between)
    while True:
        step = (high - low) / count
        knots: Array = low + step * np.arange(-1.0, count + 2.0)
        curve = Curve(name, low, step, np.asarray(function(knots), dtype=np.float32))
        worst = np.abs(at(curve, between.astype(np.float32)) - wanted).max()
        if worst <= tolerance or count >= FINEST:
            return curve
        count *= 2
