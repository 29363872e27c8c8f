"""Rows that measure no position: which set-up each of them reads, and what it reads there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, numbered
from postproc.diagnostics import PostprocError
from postproc.measure.kinds.base import ReadingKind, Readings
from postproc.measure.kinds.observed import READING_KINDS
from postproc.measure.measurements import FEWEST_ROWS_JUDGED, Measurements
from postproc.measure.read import columns as names
from postproc.measure.read.lookup import Table
from postproc.measure.read.values import EMPTY_CELLS

TRACKER_M = 3e-5
"""Standard deviation [m] per axis of positions beside other readings, where nobody states one."""


def with_setups(data: Measurements, table: Table, measured: bool) -> Measurements:
    """Return rows with what they read of tips, planes, anchors, gauges and other rows; unchanged without such columns.

    A distance between two rows becomes two rows, one at each end; the other end stands behind all rows of the table.

    Args:
        measured: False for rows that have yet to be measured: they may lack their reading.

    Raises:
        PostprocError: DAT041 where a row reads two things, or lacks what its kind needs.
    """
    if not {*names.SETUPS} & table.place.keys():
        return data
    n = len(data)
    setups, which = [""] * n, np.full(n, -1)
    numbers, direction = np.full((n, 3), np.nan), _directions(table)
    for k, kind in enumerate(READING_KINDS):
        words = [word if word.lower() not in EMPTY_CELLS else "" for word in table.text(kind.column)]
        rows = np.flatnonzero([bool(word) for word in words])
        if not len(rows):
            continue
        twice = [int(i) for i in rows if which[i] >= 0 or np.isfinite(data.position[i]).any()]
        if twice:
            other = f"`{READING_KINDS[which[twice[0]]].column}`" if which[twice[0]] >= 0 else "`x_mm`, `y_mm`, `z_mm`"
            message = f"this row has a `{kind.column}` and {other}: what did it measure?"
            raise _refused(table, twice[0], message, "give each reading a row of its own")
        which[rows], numbers[rows, : kind.each] = k, _read(table, kind, rows, measured)
        undirected = rows[~np.isfinite(direction[rows]).all(axis=1)]
        if kind.column == "gauge" and len(undirected):
            message = "this row has a `gauge` and no direction `nx`, `ny`, `nz` in which its reading grows"
            help_ = "write it along axes of the base: 0,0,1 for a gauge that counts upwards"
            raise _refused(table, int(undirected[0]), message, help_)
        for i in rows:
            # A distance between two rows is called as its row: no other row, of any table, shares its unknown.
            setups[i] = f"{kind.column} {words[i] if kind.lasting else f'{data.row[i]} {table.cells.source.path}'}"
    index, every = numbered(["", *setups])
    assert index is not None
    touches = any(READING_KINDS[k].touches for k in which if k >= 0)
    state = data.state.with_(setup=index[1:] - 1, setup_names=every[1:], touches=touches)
    pairs = np.flatnonzero([k >= 0 and not READING_KINDS[k].lasting for k in which])
    sigma = _deviations(data, which, numbers, table)
    sigma[pairs] /= np.sqrt(2)
    readings = Readings(numbers, direction, np.zeros(n), table.layout.anchor_offset == "free")
    stated = data.sigma is not None
    data = replace(data, state=state, readings=readings, sigma=sigma, sigma_stated=stated)
    return _with_far_ends(data, table, pairs) if len(pairs) else data


def _refused(table: Table, row: int, message: str, help_: str) -> PostprocError:
    """Return DAT041 at a row, by its index."""
    return PostprocError(table.cells.finding("DAT041", "error", message, help_, row))


def _read(table: Table, kind: ReadingKind, rows: NDArray[np.intp], measured: bool) -> Array:
    """Return the numbers (m, k) [m] of rows of one kind: those of its column, else 0.

    Raises:
        PostprocError: DAT041 without that column.
    """
    values = table.column(kind.reading[0]) if kind.reading else np.zeros(len(table.cells.rows))
    if values is None and measured:
        message = f"there are rows of a `{kind.column}` and no column `{kind.reading[0]}`"
        raise _refused(table, int(rows[0]), message, "add what was read")
    return np.full((len(rows), 1), np.nan) if values is None else values[rows, None]


def _directions(table: Table) -> Array:
    """Return (n, 3) unit vectors of the columns nx, ny, nz; NaN where a row has none."""
    vector = table.vector(names.DIRECTION, partial=True)
    if vector is None:
        return np.full((len(table.cells.rows), 3), np.nan)
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    return np.asarray(vector / np.where(length > 0, length, np.nan))


def _deviations(data: Measurements, which: NDArray[np.int_], numbers: Array, table: Table) -> Array:
    """Return (n,) standard deviations [m]: as stated, else by repeats of the kind, else what is usual for it.

    A reading is no better than the step of its scale allows: s / sqrt(12).

    Args:
        which: (n,) number of the kind of each row; numbers: (n, 3) [m].
    """
    from postproc.measure.checks.repeats import pooled_scatter, without_strays

    known = np.full(len(data), np.nan) if data.sigma is None else data.sigma
    sigma, assumed = np.where(np.isfinite(known), known, TRACKER_M), []
    for k, kind in enumerate(READING_KINDS):
        rows = (which == k) & ~np.isfinite(known)
        if not rows.any():
            continue
        repeats = data.repeats[rows]
        square, dof = pooled_scatter(without_strays(numbers[rows], repeats), repeats) if kind.reading else (0.0, 0.0)
        value = np.sqrt(square) if dof >= FEWEST_REPEATS else kind.noise
        value = max(float(value), scale_step(numbers[rows, 0]) / np.sqrt(12) if kind.reading else 0.0)
        assumed += [] if dof >= FEWEST_REPEATS else [f"{1e3 * value:.3g} mm for `{kind.column}`"]
        sigma[rows] = value
    if assumed:
        message = f"there is no `sigma_mm`: {', '.join(assumed)} is assumed"
        table.say("DAT015", "info", message, "state it in a column `sigma_mm`, or repeat readings")
    return sigma


FEWEST_REPEATS = 9
"""Degrees of freedom from which on repeats tell the noise of a kind."""
STEPS_M = (1e-3, 5e-4, 1e-4, 1e-5, 1e-6)
"""Steps [m] of scales: a rule, a caliper, a dial gauge, a probe."""


def scale_step(values: Array) -> float:
    """Return the largest usual step [m] of which all readings (m,) are multiples; 0 for none."""
    seen = values[np.isfinite(values)]
    if len(seen) < FEWEST_ROWS_JUDGED:
        return 0.0
    return next((step for step in STEPS_M if np.abs(seen / step - np.round(seen / step)).max() < 1e-3), 0.0)


def _with_far_ends(data: Measurements, table: Table, pairs: NDArray[np.intp]) -> Measurements:
    """Return the rows with half of each distance, and behind them the other half at the rows that they name.

    Args:
        pairs: (m,) indices of rows that are measured from another one.
    """
    row_of = {label: i for i, label in reversed([*enumerate(data.pose_id)])}
    far = []
    for i, name in zip(pairs.tolist(), np.array(table.text("from"))[pairs].tolist(), strict=True):
        far.append(row_of.get(name, -1))
        if far[-1] in (-1, i):
            message = f"`from` names `{name}`, which is {'this row' if far[-1] == i else 'the `pose_id` of no row'}"
            raise _refused(table, i, message, "name another row by its `pose_id`")
    n = len(data)
    # The arm stands as in the rows that are named, which is all that these ends have of them.
    stands, read = (data.rows(np.concatenate([np.arange(n), rows])) for rows in (far, pairs))
    assert read.readings is not None
    sign, empty = np.zeros(len(read)), np.where(np.arange(len(read)) < n, 1.0, np.nan)
    sign[pairs], sign[n:] = 1.0, -1.0
    numbers = read.readings.numbers * np.where(sign, 0.5, 1.0)[:, None]
    return replace(
        read,
        state=stands.state.with_(setup=read.state.setup),
        readings=replace(read.readings, numbers=numbers, sign=sign),
        rotation=None if read.rotation is None else read.rotation * empty[:, None, None],
        joint=None if read.joint is None else read.joint * empty[:, None],
        pose_id=stands.pose_id,
    )
