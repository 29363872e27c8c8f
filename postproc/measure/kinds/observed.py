"""What all rows of a table read off the TCP, whatever their kinds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.measure.kinds.base import UNKNOWNS, Read, ReadingKind, Readings, Seen
from postproc.measure.kinds.distance import Between, Distance
from postproc.measure.kinds.gauge import Gauge
from postproc.measure.kinds.plane import Plane
from postproc.measure.kinds.tip import Tip

READING_KINDS: tuple[ReadingKind, ...] = (Tip(), Plane(), Distance(), Gauge(), Between())
_BY_COLUMN: Mapping[str, ReadingKind] = {kind.column: kind for kind in READING_KINDS}


def kind_of(setup: str) -> ReadingKind:
    """Return the kind of a set-up by its name, ``plane table``, whose first word is the column that names it."""
    return _BY_COLUMN[setup.partition(" ")[0]]


def rows_of(state: State, kind: ReadingKind) -> NDArray[np.intp]:
    """Return the indices of the rows of one kind."""
    names = [i for i, name in enumerate(state.setup_names) if kind_of(name) is kind]
    return np.flatnonzero(np.isin(-1 if state.setup is None else state.setup, names))


def observed(state: State, readings: Readings, point: Array, unknown: Array) -> Read:
    """Return what rows with a set-up read; rows without one are NaN.

    Args:
        point: (n, 3) TCP in the frame of measured points [m]; unknown: (n, 6) unknowns of the set-up of each row.
    """
    n = len(state)
    result = Read(np.full((n, 3), np.nan), np.zeros((n, 3, 3)), np.zeros((n, 3, UNKNOWNS)))
    for kind in dict.fromkeys(map(kind_of, state.setup_names)):
        rows = rows_of(state, kind)
        if len(rows):
            read = kind.read(_seen(state, readings, point, unknown, rows))
            result.value[rows, : kind.each] = read.value
            result.by_point[rows, : kind.each] = read.by_point
            result.by_unknown[rows, : kind.each] = read.by_unknown
    return result


def start_of(state: State, readings: Readings, point: Array, setup: str) -> Array:
    """Return the unknowns (6,) of one set-up by the TCPs of the nominal arm (n, 3) [m]."""
    rows = np.flatnonzero(np.isfinite(readings.numbers[:, 0]) & (state.setup_of_rows == setup))
    seen = _seen(state, readings, point, np.zeros((len(state), UNKNOWNS)), rows)
    return kind_of(setup).start(seen, readings.numbers[rows])


def _seen(state: State, readings: Readings, point: Array, unknown: Array, rows: NDArray[np.intp]) -> Seen:
    """Return some rows of one kind as it sees them: directions in the frame of measured points, the other ends."""
    direction = readings.direction[rows]
    if state.T_reference_base is not None:
        direction = (state.T_reference_base[rows, :3, :3] @ direction[:, :, None])[:, :, 0]
    ends = [*zip(state.setup_of_rows[rows].tolist(), readings.sign[rows].tolist(), strict=True)]
    row_of = dict(zip(ends, rows, strict=True))
    far = np.array([row_of.get((name, -sign), -1) for name, sign in ends])
    other = np.where(far[:, None] < 0, np.nan, point[far])
    return Seen(point[rows], unknown[rows], direction, readings.sign[rows], other)
