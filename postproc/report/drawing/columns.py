"""Arrays of numbers inside a page, few bytes each, and the chain of an arm, read by the page's own scripts."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from postproc.arrays import Array
from postproc.robot.arm import Robot

QUANTISED_STEPS = 65_000  # of a packed column between its smallest and its largest value


def exact(values: ArrayLike) -> dict[str, Any]:
    """Encode an array for a page's scripts: floats in single precision, whole numbers in 32 bits."""
    array = np.asarray(values)
    integral = array.dtype.kind in "biu"
    return _column(array.astype("<i4" if integral else "<f4"), "i4" if integral else "f4")


def packed(values: ArrayLike) -> dict[str, Any]:
    """Encode an array for a page's scripts in two bytes a number, to a 65,000th of their range; NaN stays NaN."""
    array = np.asarray(values, dtype=float)
    known = np.isfinite(array)
    low, high = (float(array[known].min()), float(array[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / QUANTISED_STEPS or 1.0
    steps = np.where(known, np.round((np.where(known, array, low) - low) / step) + 1, 0)  # 0 is NaN
    return {**_column(steps.astype("<u2"), "u2"), "low": low - step, "step": step}


def _column(array: np.ndarray, kind: str) -> dict[str, Any]:
    """Return an array as base64 with its type and its number of columns.

    Args:
        kind: its type as scripts know it: ``f4``, ``i4`` or ``u2``.
    """
    return {
        "type": kind,
        "width": array.shape[-1] if array.ndim > 1 else 1,
        "data": b64encode(array.tobytes()).decode(),
    }


def chain_of(robot: Robot, T_flange_tcp: Array) -> dict[str, Any]:
    """Return what a page's scripts draw an arm from, by key.

    ``name``, ``link`` and ``axis`` are those of the nominal arm, ``tools`` the different tools in the flange (4 x 4)
    [m], and ``tool`` the number of each row's tool among them.

    Args:
        T_flange_tcp: (m, 4, 4) tool of each row.
    """
    tools, tool = np.unique(T_flange_tcp, axis=0, return_inverse=True)
    return {
        "name": robot.name,
        "link": robot.link.tolist(),
        "axis": robot.axis.tolist(),
        "tools": tools.tolist(),
        "tool": exact(tool.reshape(-1)),
    }
