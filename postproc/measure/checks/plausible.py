"""Checks that need no fit of the arm: empty cells, copied rows, rounded angles, limits, sizes that nothing has."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, Severity, joined
from postproc.measure.checks.repeats import pooled_scatter, without_strays
from postproc.measure.errors import CHANCE
from postproc.measure.measurements import Measurements
from postproc.measure.read.cells import Cells
from postproc.measure.read.columns import JOINT_COLUMNS, MEASURED
from postproc.measure.read.values import EMPTY_CELLS
from postproc.robot.arm import Robot

SHOWN_ROWS = 5
COARSE = 0.99 * np.radians(0.01)
"""Step of angles [rad] whose rounding stands beside the noise of an instrument."""
OVERLOAD = 5.0
"""Nobody hangs so many times the rated payload on an arm."""
NEAR_M = 2e-3
"""A load whose centre is nearer to the flange than this in every row is none."""
SHOP_C = (-30.0, 60.0)
INSTRUMENT_M = (5e-7, 5e-3)
"""Standard deviations of instruments that reach over an arm, with a wide margin."""
MISREAD_DEG = 5.0
"""An angle measured on the output side is no farther from the commanded one."""
UNTOLD = 3e-5
"""Scatter [m], [rad] of readings of one pose where no two that differ tell it: that of an ordinary arm and tracker."""
ZERO_READING = "; write 0 where a gauge was set to zero"
ROUNDING_STEPS = [float(f"{digit}e{power}") for power in range(1, -8, -1) for digit in (5, 2, 1)]
"""Steps in which an instrument may count [mm], [mrad], the coarsest first."""


def check_plausible(data: Measurements, robot: Robot, cells: Cells, measured: bool) -> list[Diagnostic]:
    """Return findings about empty cells, copied rows, rounded angles and sizes that nothing has.

    Args:
        cells: the table as text, for places in the file; measured: False for poses that have yet to be measured.
    """
    findings = [*_check_cells(data, cells, measured), *_check_copies(data, cells)]
    return [*findings, *_check_rounding(data, cells), *_check_sizes(data, robot, cells)]


def usable_rows(data: Measurements, measured: bool) -> NDArray[np.bool_]:
    """Return (n,) mask of rows that can be used: with commanded angles and, if ``measured``, with a measured pose."""
    return data.usable if measured else np.asarray(np.isfinite(data.state.q).all(axis=1))


def _check_cells(data: Measurements, cells: Cells, measured: bool) -> Iterator[Diagnostic]:
    """Yield DAT005 for rows without angles or measurements."""
    commanded = usable_rows(data, measured=False)
    ends = np.isin(data.pose_id, cells.text("from")) if "from" in cells.header else np.zeros(len(data), dtype=bool)
    unmeasured = commanded & ~usable_rows(data, measured) & ~data.off_arm & ~ends
    cases = ((~commanded, "no joint angles", JOINT_COLUMNS), (unmeasured, "nothing measured", MEASURED))
    for lacking, what, wanted in cases:
        if lacking.any():
            message = f"{_listed(lacking)} of {len(data)} {'has' if lacking.sum() == 1 else 'have'} {what}: not used"
            first = int(np.flatnonzero(lacking)[0])
            if empty := empty_columns(cells, first, wanted):
                message = message.replace(": not used", f" ({empty}): not used")
            help_ = "fill in the empty cells if the values are known"
            help_ += ZERO_READING * ("`reading_mm`" in empty)
            yield cells.finding("DAT005", "warning", message, help_, first)


def empty_columns(cells: Cells, row: int, wanted: Sequence[str]) -> str:
    """Return which of some columns are empty in a row: `` `reading_mm` of `G03` is empty``; or an empty text."""
    by_name = dict(zip(cells.header, cells.rows[row], strict=True))
    empty = [name for name in wanted if by_name.get(name, name).lower() in EMPTY_CELLS]
    if not empty:
        return ""
    label = by_name.get("pose_id")
    at = f"`{label}`" if label else f"line {cells.lines[row]}"
    listed = joined([f"`{name}`" for name in empty]) if len(empty) < 4 else f"`{empty[0]}` .. `{empty[-1]}`"
    return f"{listed} of {at} {'is' if len(empty) == 1 else 'are'} empty"


def _listed(mask: NDArray[np.bool_]) -> str:
    """Return the rows that a mask (n,) marks in words, counted from 1: ``rows 1, 4, 9``; the first five of many."""
    rows = [str(i + 1) for i in np.flatnonzero(mask)]
    others = f" and {len(rows) - SHOWN_ROWS} more" if len(rows) > SHOWN_ROWS else ""
    return f"row{'s' if rows[1:] else ''} {', '.join(rows[:SHOWN_ROWS])}{others}"


def _check_rounding(data: Measurements, cells: Cells) -> list[Diagnostic]:
    """Return DAT010 where all joint angles are multiples of 0.01 deg or of a coarser step."""
    step = data.rows(np.flatnonzero(np.isfinite(data.state.q).all(axis=1))).step
    if step < COARSE:
        return []
    # A rounding error is uniform: its standard deviation is step / sqrt(12); 1.5 m is the lever of a middle-sized arm.
    error = step / np.sqrt(12) * 1.5e3
    message = f"all joint angles are multiples of {np.rad2deg(step):g} deg"
    message += f"; if rounded, that alone is an error of {error:.2f} mm"
    help_ = "export the angles with four decimals; ignore this if the poses were commanded with these round angles"
    return [cells.finding("DAT010", "warning", message, help_)]


def check_limits(data: Measurements, robot: Robot, cells: Cells) -> Iterator[Diagnostic]:
    """Yield DAT011 for the first five rows with a joint over 1 deg outside its limits."""
    margin = np.deg2rad(1.0)
    beyond = (data.state.q > robot.upper + margin) | (data.state.q < robot.lower - margin)
    for i in np.flatnonzero(beyond.any(axis=1))[:SHOWN_ROWS]:
        j = int(np.flatnonzero(beyond[i])[0])
        message = f"joint {j + 1} stands at {np.rad2deg(data.state.q[i, j]):.1f} deg, outside its limits "
        message += f"{np.rad2deg(robot.lower[j]):.0f} .. {np.rad2deg(robot.upper[j]):.0f} deg"
        yield cells.finding("DAT011", "warning", message, "check the angle and the arm's name", int(i))


def _check_sizes(data: Measurements, robot: Robot, cells: Cells) -> Iterator[Diagnostic]:
    """Yield DAT009 for implausible masses, their centres, temperatures, stated noise and measured joint angles."""
    for severity, wrong, message, help_ in _wrong_sizes(data, robot):
        rows = np.flatnonzero(wrong)
        others = f" (rows {rows[0] + 1} and {len(rows) - 1} more)" if 1 < len(rows) < len(wrong) else ""
        if len(rows):
            yield cells.finding("DAT009", severity, message + others, help_, int(rows[0]))


def _wrong_sizes(data: Measurements, robot: Robot) -> Iterator[tuple[Severity, NDArray[np.bool_], str, str]]:
    """Yield severity, (n,) mask of the rows concerned (may be empty), message about the first of them, and help."""
    state, n = data.state, len(data)
    unit = "give the unit in a column map"
    if state.payload_mass is not None:
        mass = state.payload_mass
        message = f"`payload_kg` is {mass.min(initial=0):g}: no mass is negative"
        yield "error", mass < 0, message, "leave out what is not known"
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
    if data.sigma is not None and data.sigma_stated:
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


def _check_copies(data: Measurements, cells: Cells) -> list[Diagnostic]:
    """Return DAT006 for up to five rows that repeat another digit by digit, if readings would not agree so by chance.

    Two readings of a pose with the scatter s agree in all digits of a coordinate that counts in steps r with the chance
    r / (2 sqrt(pi) s). So a gauge of one coordinate in hundredths reads the same often, a tracker of three never.
    """
    measured = data.usable
    skipped = [k for k, name in enumerate(cells.header) if name in ("pose_id", "time_s")]
    seen: dict[tuple[str, ...], int] = {}
    pairs = []
    for i, row in enumerate(cells.rows):
        key = tuple(cell for k, cell in enumerate(row) if k not in skipped)
        first = seen.setdefault(key, i)
        if first != i and measured[i]:
            pairs.append((i, first))
    if not pairs or _by_chance(data, [i for i, _ in pairs]):
        return []
    help_ = "if it was copied, remove it: copied rows make the noise look smaller than it is"
    message = "row {} repeats row {} digit by digit: readings with noise do not agree so by chance"
    shown = pairs[:SHOWN_ROWS]
    return [cells.finding("DAT006", "warning", message.format(i + 1, first + 1), help_, i) for i, first in shown]


def _by_chance(data: Measurements, copies: Sequence[int]) -> bool:
    """Return whether so many rows may repeat others by chance (Poisson, 1 in 1,000).

    Args:
        copies: index of each row that repeats an earlier one.
    """
    from scipy.special import pdtrc

    numbers = data.numbers(data.observed)
    numbers = numbers[:, np.isfinite(numbers).any(axis=0)]
    if not numbers.size:
        return False
    different = np.delete(np.arange(len(data)), copies)
    repeats = data.repeats[different]
    square, dof = pooled_scatter(without_strays(numbers[different], repeats), repeats)
    scatter = float(np.sqrt(square)) if dof > 0 and square > 0 else UNTOLD
    agreeing = np.prod([min(1.0, _step(column) / (2 * np.sqrt(np.pi) * scatter)) for column in numbers.T])
    each = np.bincount(data.repeats)
    return bool(pdtrc(len(copies) - 1, agreeing * np.sum(each * (each - 1)) / 2) > CHANCE)


def _step(column: Array) -> float:
    """Return the step [m], [rad] in which a column (n,) counts: the coarsest of which all its numbers are multiples."""
    thousandths = 1e3 * column[np.isfinite(column)]
    for step in ROUNDING_STEPS:
        if np.allclose(thousandths, np.round(thousandths / step) * step, rtol=0, atol=1e-8):
            return 1e-3 * step
    return 0.0
