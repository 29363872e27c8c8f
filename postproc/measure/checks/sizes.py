"""Channels whose numbers no arm, load or instrument has: most likely another unit, or a mark for "not known"."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic, Severity
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.robot.arm import Robot

OVERLOAD = 5.0
"""Nobody hangs so many times the rated payload on an arm."""
NEAR_M = 2e-3
"""A load whose centre is nearer to the flange than this in every row is none."""
SHOP_C = (-30.0, 60.0)
INSTRUMENT_M = (5e-7, 5e-3)
"""Standard deviations of instruments that reach over an arm, with a wide margin."""
MISREAD_DEG = 5.0
"""An angle measured on the output side is no farther from the commanded one."""


def check_sizes(data: Measurements, robot: Robot, cells: Cells) -> list[Diagnostic]:
    """Return DAT009 for implausible masses, their centres, temperatures, stated noise and measured joint angles."""
    return [
        Diagnostic(
            "DAT009", severity, f"{message}{_more(row)}", cells.source, cells.span(int(np.flatnonzero(row)[0])), help_
        )
        for severity, row, message, help_ in _wrong(data, robot)
        if row.any()
    ]


def _wrong(data: Measurements, robot: Robot) -> Iterator[tuple[Severity, NDArray[np.bool_], str, str]]:
    """Yield severity, (n,) mask of the rows concerned (may be empty), message about the first of them, and help."""
    state, n = data.state, len(data)
    unit = "give the unit in a column map"
    if state.payload_mass is not None:
        mass = state.payload_mass
        yield (
            "error",
            mass < 0,
            f"`payload_kg` is {mass.min(initial=0):g}: no mass is negative",
            "leave out what is not known",
        )
        rated = robot.payload or np.inf
        message = f"`payload_kg` is {mass.max(initial=0):g}, and `{robot.name}` carries {rated:g} kg"
        severity: Severity = "error" if mass.max(initial=0) > OVERLOAD * rated else "warning"
        yield severity, mass > rated, message, f"is it in grams, pounds or newtons? {unit}, or divide newtons by 9.81"
        if state.payload_center is not None:
            away = np.linalg.norm(state.payload_center, axis=1) * (mass > 0)
            near = (away > 0) & (away.max(initial=0) < NEAR_M)
            message = f"the payload's centre is {1e3 * away.max(initial=0):.2g} mm from the flange at the most"
            yield "error", near, message, f"does `payload_z_mm` hold metres? {unit}: {{name = .., unit = 'm'}}"
    if state.temperature is not None:
        low, high = SHOP_C
        odd = (state.temperature < low) | (state.temperature > high)
        message = f"`temperature_C` is {state.temperature[odd][0] if odd.any() else 0:g}"
        yield "warning", odd, message, "is it in kelvin or Fahrenheit, or does it mean `not known`?"
    if data.sigma is not None:
        low, high = INSTRUMENT_M
        odd = (data.sigma < low) | (data.sigma > high)
        message = f"`sigma_mm` is {1e3 * data.sigma[odd][0] if odd.any() else 0:g}"
        yield "error", odd, message, f"is it in micrometres or metres? {unit}"
    if data.joint is not None:
        off = np.degrees(np.abs(data.joint - state.q))
        for j in range(6):
            typical = float(np.nanmedian(off[:, j])) if np.isfinite(off[:, j]).any() else 0.0
            message = f"`mq{j + 1}_deg` is {typical:.0f} deg from `q{j + 1}_deg` in the median row"
            help_ = "check its unit, its zero and its sign, and the order of the columns"
            yield "error", np.full(n, typical > MISREAD_DEG), message, help_


def _more(row: NDArray[np.bool_]) -> str:
    """Return `` (rows 3 and 5 more)`` for a mask (n,) of rows; empty text where it marks one row or all."""
    count = int(row.sum())
    return f" (rows {int(np.flatnonzero(row)[0]) + 1} and {count - 1} more)" if 1 < count < len(row) else ""
