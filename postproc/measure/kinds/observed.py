"""What all rows of a table read off the TCP, whatever their kinds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.measure.kinds.base import UNKNOWNS, ReadingKind, Readings, Seen
from postproc.measure.kinds.between import Between
from postproc.measure.kinds.distance import Distance
from postproc.measure.kinds.gauge import Gauge
from postproc.measure.kinds.plane import Plane
from postproc.measure.kinds.tip import Tip

KINDS: tuple[ReadingKind, ...] = (Tip(), Plane(), Distance(), Gauge(), Between())


@dataclass(frozen=True)
class Observed:
    """What n rows read, in three columns a row, NaN where a row reads no such number; its derivatives are 0 there.

    Args:
        value: (n, 3) predicted numbers [m]. by_point: (n, 3, 3) by the TCP, axes of the frame of measured points.
            by_unknown: (n, 3, 6) by the unknowns of each row's set-up.
    """

    value: Array
    by_point: Array
    by_unknown: Array


def kind_of(setup: str) -> ReadingKind:
    """Return the kind of a set-up by its name, ``plane table``, whose first word is the column that names it."""
    return next(kind for kind in KINDS if kind.column == setup.partition(" ")[0])


def rows_of(state: State, kind: ReadingKind) -> NDArray[np.intp]:
    """Return the indices of the rows of one kind."""
    names = [i for i, name in enumerate(state.setup_names) if kind_of(name) is kind]
    return np.flatnonzero(np.isin(np.full(len(state), -1) if state.setup is None else state.setup, names))


def observed(state: State, readings: Readings, point: Array, unknown: Array) -> Observed:
    """Return what rows with a set-up read; rows without one are NaN.

    Args:
        point: (n, 3) TCP in the frame of measured points [m]; unknown: (n, 6) unknowns of the set-up of each row.
    """
    n = len(state)
    result = Observed(np.full((n, 3), np.nan), np.zeros((n, 3, 3)), np.zeros((n, 3, UNKNOWNS)))
    for kind in KINDS:
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
    sign, names = readings.sign[rows], np.full(len(state), -1) if state.setup is None else np.asarray(state.setup)
    ends = {(name, end): i for name, end, i in zip(names[rows].tolist(), sign.tolist(), rows, strict=True) if end}
    at = [ends.get((name, -end), -1) for name, end in zip(names[rows].tolist(), sign.tolist(), strict=True)]
    other = np.where(np.array(at)[:, None] < 0, np.nan, point[at])
    return Seen(point[rows], unknown[rows], direction, sign, other)
