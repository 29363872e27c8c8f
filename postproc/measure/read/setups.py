"""Rows that measure no position: which set-up each of them reads, and what it reads there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.measure.kinds.base import ReadingKind, Readings
from postproc.measure.kinds.observed import KINDS
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
    for k, kind in enumerate(KINDS):
        words = [word if word.lower() not in EMPTY_CELLS else "" for word in table.text(kind.column)]
        rows = np.flatnonzero([bool(word) for word in words])
        if not len(rows):
            continue
        _check_alone(data, table, kind, rows, which)
        which[rows], numbers[rows, : kind.each] = k, _read(table, kind, rows, measured)
        for i in rows:
            # The name of a distance between two rows is that of its row: no other row shares its unknown.
            setups[i] = f"{kind.column} {words[i] if kind.lasting else _label(table, data, int(i))}"
    _check_directions(table, direction, which)
    every = tuple(dict.fromkeys(name for name in setups if name))
    index = np.array([every.index(name) if name else -1 for name in setups])
    touches = any(KINDS[k].touches for k in which if k >= 0)
    state = data.state.with_(setup=index, setup_names=every, touches=touches)
    sigma = _deviations(data, which, numbers, table)
    readings = Readings(numbers, direction, np.zeros(n), table.layout.anchor_offset == "free")
    data = replace(data, state=state, readings=readings, sigma=sigma)
    pairs = np.flatnonzero([k >= 0 and not KINDS[k].lasting for k in which])
    return _with_far_ends(data, table, pairs) if len(pairs) else data


def _label(table: Table, data: Measurements, index: int) -> str:
    """Return a name for a row of a table that no row of another table has."""
    return f"{data.row[index]} {table.cells.source.path}"


def _read(table: Table, kind: ReadingKind, rows: NDArray[np.intp], measured: bool) -> Array:
    """Return the numbers (m, k) [m] of rows of one kind: those of its column, else 0.

    Raises:
        PostprocError: DAT041 without that column.
    """
    if not kind.reading:
        return np.zeros((len(rows), kind.each))
    values = table.column(kind.reading[0])
    if values is None:
        if measured:
            message = f"there are rows of a `{kind.column}` and no column `{kind.reading[0]}`"
            raise PostprocError(table.cells.finding("DAT041", "error", message, "add what was read", int(rows[0])))
        return np.full((len(rows), 1), np.nan)
    return np.asarray(values[rows, None])


def _check_alone(
    data: Measurements, table: Table, kind: ReadingKind, rows: NDArray[np.intp], which: NDArray[np.int_]
) -> None:
    """Raise DAT041 where rows of one kind also read another, or measure a position.

    Args:
        rows: indices; which: (n,) kind of each row so far, by number, -1 for none.
    """
    twice = [i for i in rows if which[i] >= 0 or np.isfinite(data.position[i]).any()]
    if not twice:
        return
    other = f"`{KINDS[which[twice[0]]].column}`" if which[twice[0]] >= 0 else "`x_mm`, `y_mm`, `z_mm`"
    message = f"this row has a `{kind.column}` and {other}: what did it measure?"
    help_ = "give each reading a row of its own"
    raise PostprocError(table.cells.finding("DAT041", "error", message, help_, int(twice[0])))


def _directions(table: Table) -> Array:
    """Return (n, 3) unit vectors of the columns nx, ny, nz; NaN where a row has none."""
    vector = table.vector(names.DIRECTION, partial=True)
    if vector is None:
        return np.full((len(table.cells.rows), 3), np.nan)
    length = np.linalg.norm(vector, axis=1)
    return np.asarray(np.where(length > 0, vector.T / np.where(length > 0, length, 1.0), np.nan).T)


def _check_directions(table: Table, direction: Array, which: NDArray[np.int_]) -> None:
    """Raise DAT041 where a gauge has no direction.

    Args:
        direction: (n, 3); which: (n,) number of the kind of each row.
    """
    gauges = [k for k, kind in enumerate(KINDS) if kind.column == "gauge"]
    lacking = np.flatnonzero(np.isin(which, gauges) & ~np.isfinite(direction).all(axis=1))
    if len(lacking):
        message = "this row has a `gauge` and no direction `nx`, `ny`, `nz` in which its reading grows"
        help_ = "write it along axes of the base: 0,0,1 for a gauge that counts upwards"
        raise PostprocError(table.cells.finding("DAT041", "error", message, help_, int(lacking[0])))


def _deviations(data: Measurements, which: NDArray[np.int_], numbers: Array, table: Table) -> Array:
    """Return (n,) standard deviations [m]: as stated, else by repeats of the kind, else what is usual for it.

    A reading is no better than the step of its scale allows: s / sqrt(12).

    Args:
        which: (n,) number of the kind of each row; numbers: (n, 3) [m].
    """
    from postproc.measure.checks.repeats import pooled_scatter

    known = np.full(len(data), np.nan) if data.sigma is None else data.sigma
    sigma, assumed = np.where(np.isfinite(known), known, TRACKER_M), []
    for k, kind in enumerate(KINDS):
        rows = (which == k) & ~np.isfinite(known)
        if not rows.any():
            continue
        square, dof = pooled_scatter(numbers[rows], data.repeats[rows]) if kind.reading else (0.0, 0.0)
        value = np.sqrt(square) if dof >= FEWEST_REPEATS else kind.noise
        value = max(float(value), scale_step(numbers[rows, 0]) / np.sqrt(12) if kind.reading else 0.0)
        assumed += [] if dof >= FEWEST_REPEATS else [f"{1e3 * value:.3g} mm for `{kind.column}`"]
        sigma[rows] = value
    if assumed:
        message = f"there is no `sigma_mm`: {', '.join(assumed)} is assumed"
        table.say("DAT015", "info", message, "state it in a column `sigma_mm`, or repeat readings")
    ends = np.array([k >= 0 and not KINDS[k].lasting for k in which])
    return np.asarray(np.where(ends, sigma / np.sqrt(2), sigma))


FEWEST_REPEATS = 9
"""Degrees of freedom from which on repeats tell the noise of a kind."""
STEPS_M = (1e-3, 5e-4, 1e-4, 1e-5, 1e-6)
"""Steps [m] of scales: a rule, a caliper, a dial gauge, a probe."""


def scale_step(values: Array) -> float:
    """Return the largest usual step [m] of which all readings (m,) are multiples; 0 for none."""
    seen = values[np.isfinite(values)]
    whole = (
        step
        for step in STEPS_M
        if len(seen) >= FEWEST_ROWS_JUDGED and np.abs(seen / step - np.round(seen / step)).max() < 1e-3
    )
    return next(whole, 0.0)


def _with_far_ends(data: Measurements, table: Table, pairs: NDArray[np.intp]) -> Measurements:
    """Return the rows with half of each distance, and behind them the other half at the rows that they name.

    Args:
        pairs: (m,) indices of rows that are measured from another one.
    """
    place: dict[str, int] = {}
    for i, label in enumerate(data.pose_id):
        place.setdefault(label, i)
    far = []
    for i in pairs:
        name = table.text("from")[i]
        at = place.get(name)
        if at is None or at == i:
            message = f"`from` names `{name}`, which is {'this row' if at == i else 'the `pose_id` of no row'}"
            help_ = "name another row by its `pose_id`"
            raise PostprocError(table.cells.finding("DAT041", "error", message, help_, int(i)))
        far.append(at)
    every = np.concatenate([np.arange(len(data)), far])
    both, n = data.rows(every), len(data)
    assert both.readings is not None and both.state.setup is not None
    setup, numbers, sign = (np.array(x) for x in (both.state.setup, both.readings.numbers, both.readings.sign))
    numbers[pairs, 0] /= 2
    numbers[n:], sign[pairs], sign[n:] = numbers[pairs], 1.0, -1.0
    setup[n:] = setup[pairs]
    sigma = None if both.sigma is None else np.concatenate([both.sigma[:n], both.sigma[pairs]])
    position, rotation, joint = (
        None if x is None else np.concatenate([x[:n], np.full_like(x[n:], np.nan)])
        for x in (both.position, both.rotation, both.joint)
    )
    assert position is not None
    return replace(
        both,
        state=both.state.with_(setup=setup),
        readings=replace(both.readings, numbers=numbers, sign=sign),
        position=position,
        rotation=rotation,
        joint=joint,
        sigma=sigma,
        row=data.row + tuple(data.row[i] for i in pairs),
        line=data.line + tuple(data.line[i] for i in pairs) if data.line else (),
    )
