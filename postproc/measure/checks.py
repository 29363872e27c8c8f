"""What is likely wrong with a table: units, columns, single rows. Nothing is removed; every finding names its row."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.measure.alignment import Alignment, align
from postproc.measure.cells import Cells
from postproc.measure.measurements import Measurements
from postproc.robot.arm import Robot
from postproc.robot.kinematics import forward

SUSPICIOUS_M = 0.010
"""No arm with its zeros set misses its nominal kinematics by more than this in the median row."""
CLEARER = 5.0
"""Another reading of a column is named only where it explains the points this many times better."""
SHOWN = 5


def check_measurements(data: Measurements, robot: Robot, cells: Cells) -> list[Diagnostic]:
    """All findings about a table."""
    found = [*_check_cells(data, cells), *_check_rounding(cells)]
    rows = np.flatnonzero(np.isfinite(data.position).all(axis=1) & np.isfinite(data.state.q).all(axis=1))
    if data.tool_known or len(rows) < 8:
        return found
    readings = _check_readings(data, robot, rows, cells)
    if readings:
        return found + readings
    return found + _check_limits(data, robot, cells) + _check_points(data, robot, rows, cells)


def _check_cells(data: Measurements, cells: Cells) -> list[Diagnostic]:
    found = []
    for i in np.flatnonzero(~data.usable)[:SHOWN]:
        message = "this row has no commanded joint angles or nothing measured; it is not used"
        found.append(
            Diagnostic("DAT005", "warning", message, cells.source, cells.span(int(i)), "fill in the empty cells")
        )
    skipped = [k for k, name in enumerate(cells.header) if name in ("pose_id", "time_s")]
    seen: dict[tuple[str, ...], int] = {}
    repeated = 0
    for i, row in enumerate(cells.rows):
        key = tuple(cell for k, cell in enumerate(row) if k not in skipped)
        first = seen.setdefault(key, i)
        if first != i and repeated < SHOWN:
            repeated += 1
            message = f"row {i + 1} repeats row {first + 1} digit by digit; no instrument measures the same twice"
            help_ = "if it was copied, remove it: copied rows make the noise look smaller than it is"
            found.append(Diagnostic("DAT006", "warning", message, cells.source, cells.span(i), help_))
    return found


def _check_rounding(cells: Cells) -> list[Diagnostic]:
    columns = [name for name in (f"q{j}_deg" for j in range(1, 7)) if name in cells.header]
    if not columns or len(cells.rows) < 8:
        return []
    digits = 0
    for name in columns:
        for cell in cells.text(name):
            text = cell.replace(",", ".").rstrip("0")
            digits = max(digits, len(text.partition(".")[2]) if "e" not in text.lower() else 9)
    if digits > 2:
        return []
    step = 10.0**-digits
    # A rounding error is uniform: its standard deviation is step / sqrt(12); 1.5 m is the lever of a middle-sized arm.
    error = np.deg2rad(step) / np.sqrt(12) * 1.5e3
    message = f"all joint angles are multiples of {step:g} deg; if rounded, that alone is an error of {error:.2f} mm"
    help_ = "export the angles with four decimals; ignore this if the poses were commanded with these round angles"
    return [Diagnostic("DAT010", "warning", message, cells.source, cells.span(0), help_)]


def _check_readings(data: Measurements, robot: Robot, rows: NDArray[np.int_], cells: Cells) -> list[Diagnostic]:
    """Radians for degrees, metres or inches for millimetres, swapped columns.

    Whichever reading makes the points fit.
    """
    some = rows[:: max(1, len(rows) // 120)]
    q, y = data.state.q[some], data.position[some]
    as_read = align(forward(robot, q), y)
    for factor, unit in ((1e-3, "metres"), (1e3, "micrometres"), (1 / 25.4, "inches")):
        if abs(as_read.scale / factor - 1) < 0.05:
            message = (
                f"the positions are {factor:.4g} times as large as the arm: they look like {unit}, not millimetres"
            )
            return [_reading(cells, message, "give the unit in a column map: x_mm = {name = ..., unit = ...}")]
    if as_read.typical < SUSPICIOUS_M and not as_read.mirrored and abs(as_read.scale - 1) < 0.05:
        return []
    best = as_read.typical / CLEARER
    reading = None
    for q_other, text, help_ in _readings_of_joints(q):
        other = align(forward(robot, q_other), y)
        if other.typical < best and not other.mirrored and abs(other.scale - 1) < 0.05:
            best, reading = (
                other.typical,
                _reading(cells, f"{text}: the points then fit to {1e3 * other.typical:.2f} mm", help_),
            )
    for y_other, text, help_ in _readings_of_points(y):
        other = align(forward(robot, q), y_other)
        if other.typical < best and not other.mirrored and abs(other.scale - 1) < 0.05:
            best, reading = (
                other.typical,
                _reading(cells, f"{text}: the points then fit to {1e3 * other.typical:.2f} mm", help_),
            )
    if reading is not None:
        return [reading]
    if as_read.typical > SUSPICIOUS_M:
        size = (
            "more than a metre"
            if not np.isfinite(as_read.typical)
            else f"{1e3 * as_read.typical:.0f} mm in the median row"
        )
        message = f"the measured points do not fit the nominal arm `{robot.name}`: {size}"
        help_ = "check the robot's name, the joint zeros and signs, and that joints and points belong to the same rows"
        return [Diagnostic("DAT009", "warning", message, cells.source, cells.span(0), help_)]
    return []


def _readings_of_joints(q: Array) -> list[tuple[Array, str, str]]:
    rename = "rename the columns, or give the right ones in a column map"
    other: list[tuple[Array, str, str]] = []
    if np.nanmax(np.abs(q)) < np.deg2rad(7):
        text = "the joint angles are all below 7 deg: they look like radians, not degrees"
        other.append((np.rad2deg(q), text, "give the unit in a column map: q1_deg = {name = ..., unit = 'rad'}"))
    for i, j in combinations(range(6), 2):
        order = list(range(6))
        order[i], order[j] = j, i
        other.append((q[:, order], f"columns `q{i + 1}_deg` and `q{j + 1}_deg` look swapped", rename))
    for i in range(6):
        sign = np.ones(6)
        sign[i] = -1
        other.append((q * sign, f"column `q{i + 1}_deg` looks negated", "give `sign = -1` in a column map"))
    coupled = q.copy()
    coupled[:, 2] -= q[:, 1]
    other.append((coupled, "column `q3_deg` looks like the angle of the forearm to the ground (q3 + q2)", rename))
    return other


def _readings_of_points(y: Array) -> list[tuple[Array, str, str]]:
    # The instrument may stand anyhow, so every swap and every sign gives the same mirror image.
    text = "the points are mirrored: two of `x_mm`, `y_mm`, `z_mm` are swapped, or one has the wrong sign"
    return [(y[:, [1, 0, 2]], text, "rename the columns, or give `sign = -1` in a column map")]


def _reading(cells: Cells, message: str, help_: str) -> Diagnostic:
    return Diagnostic("DAT009", "error", message, cells.source, cells.span(0), help_)


def _check_limits(data: Measurements, robot: Robot, cells: Cells) -> list[Diagnostic]:
    margin = np.deg2rad(1.0)
    beyond = (data.state.q > robot.upper + margin) | (data.state.q < robot.lower - margin)
    found = []
    for i in np.flatnonzero(beyond.any(axis=1))[:SHOWN]:
        j = int(np.flatnonzero(beyond[i])[0])
        message = (
            f"joint {j + 1} stands at {np.rad2deg(data.state.q[i, j]):.1f} deg, outside its limits "
            f"{np.rad2deg(robot.lower[j]):.0f} .. {np.rad2deg(robot.upper[j]):.0f} deg"
        )
        found.append(
            Diagnostic(
                "DAT011", "warning", message, cells.source, cells.span(int(i)), "check the angle and the arm's name"
            )
        )
    return found


def _check_points(data: Measurements, robot: Robot, rows: NDArray[np.int_], cells: Cells) -> list[Diagnostic]:
    """Single rows far from where the nominal arm would be: typing errors, another target, a lost beam."""
    aligned: Alignment = align(forward(robot, data.state.q[rows]), data.position[rows])
    error = np.linalg.norm(aligned.residual, axis=1)
    limit = max(0.005, 8 * aligned.typical)
    found = []
    for k in np.argsort(-error)[:20]:
        if not error[k] > limit:
            break
        i, worst = int(rows[k]), int(np.argmax(np.abs(aligned.residual[k])))
        size = 1e3 * aligned.residual[k, worst]
        alone = np.abs(aligned.residual[k, worst]) > 0.95 * error[k]
        cause = (
            f"`{'xyz'[worst]}_mm` alone is off by {size:.1f} mm: a typing error?"
            if alone
            else "another point, or a wrong joint angle?"
        )
        message = (
            f"row {i + 1} lies {1e3 * error[k]:.1f} mm from where the arm should be "
            f"(others {1e3 * aligned.typical:.2f} mm); {cause}"
        )
        help_ = "correct the row; until then the fit sets it aside and says so"
        found.append(Diagnostic("DAT007", "warning", message, cells.source, cells.span(i), help_))
    return found
