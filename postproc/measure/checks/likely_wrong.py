"""What is likely wrong with a table: units, columns, single rows. Nothing is removed; every finding names its row."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, has_errors
from postproc.measure.checks.plausible import ZERO_READING, check_limits, check_plausible, empty_columns, usable_rows
from postproc.measure.checks.readings import (
    MISMATCH_M,
    RADIANS,
    RADIANS_BELOW,
    SUSPICIOUS_M,
    PlacedArm,
    align_arm,
    fits,
    other_arms,
    other_lengths,
    other_reading,
    slipped,
    zero_errors,
)
from postproc.measure.consensus import FEWEST_PLACED, LEAST_M, TIMES, Agreement, largest, poses_among, sessions_of
from postproc.measure.measurements import FEWEST_ROWS_JUDGED, Measurements
from postproc.measure.read.cells import Cells
from postproc.measure.read.columns import JOINT_COLUMNS, MEASURED
from postproc.measure.read.turns import LARGEST_FLANGE_TURN_RAD, Turns
from postproc.robot.arm import Robot

MANY_FAR = 20
"""Single typing errors are fewer than one row in so many."""
NOMINAL_M, NOMINAL_TURN = 1e-5, 1e-4
"""No arm is so exactly where its nominal kinematics says, nor an instrument's axes so exactly those of its base."""


def check_measurements(
    data: Measurements,
    robot: Robot,
    cells: Cells,
    turns: Turns | None,
    agreed: Agreement,
    *,
    measured: bool = True,
    unit: str = "mm",
) -> list[Diagnostic]:
    """Check a table that has been read against the arm; return the findings, errors included.

    Args:
        cells: the table as text, for places in the file; turns: measured orientations as the table writes them, if any.
        agreed: which rows cannot be right. measured: False for poses that have yet to be measured.
        unit: unit of length in which the positions were read.
    """
    if not usable_rows(data, measured).any():
        message = "no row can be used: none has commanded joint angles" + (" and a measured pose" if measured else "")
        empty = empty_columns(cells, 0, (*JOINT_COLUMNS, *MEASURED) if measured else JOINT_COLUMNS)
        message += f"; {empty}, and so on" * bool(empty)
        help_ = "fill in what was read, in the unit at the end of the column's name" if empty else "fill in the columns"
        help_ += ZERO_READING * ("`reading_mm`" in empty)
        return [cells.finding("DAT001", "error", message, help_)]
    findings = check_plausible(data, robot, cells, measured)
    # The reflector of most rows: one point of the tool.
    names = data.state.reflector_of_rows[agreed.rows]
    rows = agreed.rows[names == largest(names)] if len(names) else agreed.rows
    single = [*check_limits(data, robot, cells)]
    if data.tool_known or poses_among(data.state.q[rows]) < FEWEST_ROWS_JUDGED:
        small = len(data) >= FEWEST_ROWS_JUDGED and np.nanmax(np.abs(data.state.q), initial=0) < RADIANS_BELOW
        readings = [cells.finding("DAT009", "warning", *RADIANS)] if small else []
    else:
        arm = PlacedArm(robot, data.state.T_reference_base)
        readings = _check_readings(data, arm, replace(agreed, rows=rows), cells, unit=unit, turns=turns)
        if has_errors(readings):
            return findings + readings
        single = [] if readings else single
    turned = _check_orientations(data, robot, rows, cells, turns)
    return findings + readings + turned + single + _check_points(data, agreed, cells, unit)


def _check_readings(
    data: Measurements, arm: PlacedArm, agreed: Agreement, cells: Cells, *, unit: str, turns: Turns | None
) -> list[Diagnostic]:
    """Return one DAT009 where the points do not fit the nominal arm, with what explains it if anything does; else [].

    Explanations are points beside the angles of another row, other units, signs or order of columns, another arm, and
    joint zeros. Other joint angles that measured orientations contradict are not proposed. Where nothing
    explains the rows of several sessions together, those of the largest are tried: they were seen from one place.

    Args:
        arm: the nominal arm at every row; agreed: which rows agree; unit: unit of length of the positions as read.
        turns: measured orientations, if any.
    """
    rows = agreed.rows
    sample = rows[:: max(1, len(rows) // 120)]
    q, y, placed, robot = data.state.q[sample], data.position[sample], arm.rows(sample), arm.robot
    as_read = align_arm(placed, q, y)
    turn = as_read.T_instrument_base[:3, :3]
    nominal = as_read.typical < NOMINAL_M and np.allclose(turn, np.eye(3), atol=NOMINAL_TURN)
    far = np.linalg.norm(as_read.residual, axis=1) > MISMATCH_M
    if fits(as_read) and not nominal and MANY_FAR * far.sum() < len(far):
        return []
    mismatch = partial(cells.finding, "DAT009")
    if nominal:
        message = f"the points are the nominal arm's own, to {1e3 * as_read.typical:.4f} mm: no arm is so exact"
        return [mismatch("warning", message, "are they the controller's, and the instrument's in other columns?")]
    if (slip := slipped(arm.rows(rows), data.state.q[rows], data.position[rows])) is not None:
        return [_slip(*slip, rows, cells)]
    if fits(as_read) or agreed.fits:
        return []
    oriented = None if turns is None else replace(turns, numbers=turns.numbers[sample])
    if other := other_reading(placed, q, y, as_read, unit=unit, allowed=partial(_agree, placed, oriented, q)):
        return [mismatch("error", *other)]
    if as_read.typical < SUSPICIOUS_M:
        # Few poses in a small part of space tell neither a scale nor a mirror.
        return []
    size = f"{1e3 * as_read.typical:.0f} mm" if np.isfinite(as_read.typical) else "more than a metre"
    message = f"the measured points do not fit the nominal arm `{robot.name}`: {size} in the median row"
    if names := other_arms(placed, q, y):
        return [mismatch("error", message, f"they fit {' or '.join(f'`{n}`' for n in names)}: check the robot's name")]
    offset, typical = zero_errors(placed, q, y) if np.isfinite(as_read.typical) else (np.zeros(6), np.inf)
    if typical < SUSPICIOUS_M:
        j = int(np.argmax(np.abs(offset)))
        zeros = f"joint {j + 1} by {np.rad2deg(offset[j]):.1f} deg"
        return [mismatch("warning", message, f"joint zeros explain it ({zeros}): the fit finds them")]
    session = sessions_of(data)[rows]
    if len(sessions := np.unique(session)) > 1:
        counts = [poses_among(data.state.q[rows[session == name]]) for name in sessions]
        poses, largest = max(counts), sessions[np.argmax(counts)]
        if poses >= FEWEST_PLACED:
            agreed = replace(agreed, rows=rows[session == largest])
            return _check_readings(data, arm, agreed, cells, unit=unit, turns=turns)
        message = f"no session has more than {poses} poses, and the points were not all seen from one place: "
        message += "nothing tells where the instrument stood"
        help_ = f"measure {FEWEST_ROWS_JUDGED} poses or more from each place of the instrument, in one session"
        return [mismatch("error", message, help_)]
    help_ = "check the robot's name, the joint zeros and signs, and that joints and points belong to the same rows"
    if arm.T_reference_base is not None:
        help_ += "; and that external axes stand as `eax_a` .. say, and run as the cell says"
    return [mismatch("error" if as_read.typical > MISMATCH_M else "warning", message, help_)]


def _agree(arm: PlacedArm, turns: Turns | None, as_read: Array, angles: Array) -> bool:
    """Return whether orientations follow other joint angles no worse than those that were read; True if none tell.

    Args:
        arm: at the n rows; as_read: (n, 6) [rad]; angles: (n, 6) the others [rad].
    """
    good = np.zeros(len(angles), dtype=bool) if turns is None else np.isfinite(turns.numbers).all(axis=1)
    if turns is None or good.sum() < FEWEST_ROWS_JUDGED:
        return True
    shown = replace(turns, numbers=turns.numbers[good])
    off, before = (shown.off(arm.rows(good).flange(q[good])[:, :3, :3], None) for q in (angles, as_read))
    return off is None or before is None or off < max(LARGEST_FLANGE_TURN_RAD, before)


def _slip(before: int, after: int, k: int, rows: NDArray[np.int_], cells: Cells) -> Diagnostic:
    """Return DAT009 for points that stand beside the joint angles of another row.

    Args:
        before, after: as `slipped` returns them for the rows before the k-th and for those from it on.
        rows: (m,) index in the table of the rows that ``k`` counts.
    """
    last, first = len(rows) - 1, int(rows[min(k, len(rows) - 1)])
    where = f"from row {first + 1} on every" if after else f"up to row {int(rows[k - 1]) + 1} every"
    every = k <= 1 if after else k >= last
    neighbour = "row before" if before + after > 0 else "next row"
    cause = "stands twice, or the angles of one are missing" if before + after > 0 else "is missing"
    message = f"{'every' if every else where} point belongs to the joint angles of the {neighbour}: so they fit the arm"
    help_ = f"a point {cause} there: put both side by side again, with empty cells for what is missing"
    return cells.finding("DAT009", "error", message, help_, first if after else 0)


def _check_orientations(
    data: Measurements, robot: Robot, rows: NDArray[np.int_], cells: Cells, turns: Turns | None
) -> list[Diagnostic]:
    """Return DAT009 where orientations do not follow the flange, with the form, order or unit in which they do.

    Args:
        rows: index of the rows with angles and positions, which place the base; turns: orientations, if any.
    """
    if turns is None:
        return []
    sample = np.flatnonzero(np.isfinite(turns.numbers).all(axis=1) & np.isfinite(data.state.q).all(axis=1))[:200]
    if len(sample) < FEWEST_ROWS_JUDGED:
        return []
    arm = PlacedArm(robot, data.state.T_reference_base)
    flange = arm.rows(sample).flange(data.state.q[sample])[:, :3, :3]
    placed = None
    if len(rows) >= FEWEST_ROWS_JUDGED:
        placed = align_arm(arm.rows(rows), data.state.q[rows], data.position[rows]).T_instrument_base[:3, :3]
    shown = replace(turns, numbers=turns.numbers[sample])
    off = shown.off(flange, placed)
    if off is None or off < LARGEST_FLANGE_TURN_RAD:
        return []
    message = f"the measured orientations do not follow the arm: they are {np.degrees(off):.0f} deg off in the "
    message += "median row"
    help_ = "check `form` and `unit` of `[orientation]` in the column map, or that `qw` comes first"
    meant = shown.better_reading(flange, placed)
    if meant is not None:
        what, help_, angle = meant
        message += f"; read as {what} they follow it to {np.degrees(angle):.2f} deg"
    return [cells.finding("DAT009", "error", message, help_)]


def _check_points(data: Measurements, agreed: Agreement, cells: Cells, unit: str) -> list[Diagnostic]:
    """Return findings on rows that cannot be right: DAT009 if they are in another unit or too many to be believed.

    Else DAT007: fits leave these rows out. Nothing is returned where the arm as a whole is elsewhere.
    """
    if not agreed.near or not agreed.wrong.any():
        return []
    if mixed := _check_mixed(data, agreed, unit):
        return [cells.finding("DAT009", "error", *mixed)]
    wrong = agreed.rows[agreed.wrong]
    if agreed.doubtful:
        sessions = "".join(f"session `{name}`, " for name in agreed.doubtful if name)
        message = f"{sessions}too many rows do not agree with the others on where the arm is: {numbered(wrong + 1)}"
        help_ = "leave these rows out, or give those that the instrument saw from elsewhere a `session` of their own"
        return [cells.finding("DAT009", "error", message, help_, int(wrong[0]))]
    error = np.linalg.norm(agreed.error, axis=1)
    far = np.flatnonzero(agreed.wrong)
    if MANY_FAR * len(far) > len(error):
        size = f"{1e3 * error[far].min():.0f} to {1e3 * error[far].max():.0f} mm"
        message = f"{len(far)} of {len(error)} rows lie {size} from where the arm should be (others "
        message += f"{1e3 * float(np.median(agreed.typical)):.2f} mm): {numbered(wrong + 1)}"
        help_ = "correct them, or give those that the instrument saw from elsewhere a `session` of their own; until "
        help_ += "then fits leave them out"
        return [cells.finding("DAT007", "warning", message, help_, int(wrong[0]))]
    return [_far(agreed, k, cells) for k in far[np.argsort(-error[far])]]


def _far(agreed: Agreement, k: int, cells: Cells) -> Diagnostic:
    """Return DAT007 for row ``k`` of ``agreed.rows``, with the coordinate that alone is off, if one is."""
    error, worst = float(np.linalg.norm(agreed.error[k])), int(np.argmax(np.abs(agreed.error[k])))
    size, i = agreed.error[k, worst], int(agreed.rows[k])
    cause = "another point, or a wrong joint angle?"
    if abs(size) > 0.95 * error:
        cause = f"`{'xyz'[worst]}_mm` alone is off by {1e3 * size:.1f} mm: a typing error?"
    message = f"row {i + 1} lies {1e3 * error:.1f} mm from where the arm should be "
    message += f"(others {1e3 * agreed.typical[k]:.2f} mm); {cause}"
    return cells.finding("DAT007", "warning", message, "correct the row; until then fits leave it out", i)


def _check_mixed(data: Measurements, agreed: Agreement, unit: str) -> tuple[str, str, int] | None:
    """Return (message, help, index of the first row) where many rows are in another unit of length; None otherwise."""
    limit = max(LEAST_M, TIMES * float(agreed.typical.min()))
    position = data.position[agreed.rows]
    for factor, look, short in other_lengths(unit):
        scaled = agreed.wrong & (np.linalg.norm(agreed.error + position / factor - position, axis=1) < limit)
        if MANY_FAR * scaled.sum() > len(scaled):
            rows = agreed.rows[scaled]
            message = f"{scaled.sum()} of {len(scaled)} rows {look}: they then fit the others; {numbered(rows + 1)}"
            help_ = f"write all rows in one unit, or those in {short} as a table of their own with a column map"
            return message, help_, int(rows[0])
    return None


def numbered(rows: NDArray[np.int_]) -> str:
    """Return row numbers in words, runs of them as ``4 to 9``: ``rows 1, 4 to 9``."""
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    listed = [f"{r[0]}" if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs]
    return f"row{'s' if len(rows) > 1 else ''} {', '.join(listed)}"
