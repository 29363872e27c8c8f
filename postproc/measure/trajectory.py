"""What rows in their order tell: one clock that goes on, and speeds, accelerations and sides from the angles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view as windows
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, Source

PAUSE_S = 1.0
"""Between clocks that were set back: what follows the time goes on, and no record spans them."""
FEWEST_ROWS_IN_LINE = 10
"""Rows of a stretch, and of a line of times."""
CLOCK_STEPS = 10.0 ** np.arange(0, -7, -1)
"""Decimal places [s] to which stamps may be written."""
GAP_S = 0.25
"""Rows farther apart in time than this do not belong to one record."""
SMOOTH = 0.2
"""Share of a step by which the next one may differ in the median row: poses that only follow each other jump about."""
FASTEST_SPEED = 15.0
"""Joint speed [rad/s] that no arm reaches: the times cannot be seconds."""
STANDING_SPEED = 1e-3
"""Joint speed [rad/s] below which a joint stands; it keeps the side from which it came."""
GAP_RAD = 2e-4
"""Turn [rad] between poses below which a joint keeps its side: a smaller move leaves an ordinary gap open."""
POINTS = 5
"""Rows whose polynomial gives a speed: at 25 a second, the parabola of three misses 0.5 % of a joint that swings at
0.7 Hz, and a lag by as much, more than its standard deviation in a record of ten seconds."""
AROUND_S = 0.04
"""Accelerations are taken from the rows so near at least on both sides: rounded angles of 1 kHz tell none from three.

Angles rounded to 0.001 deg then leave a standard deviation below 0.01 rad/s^2, whatever the rate.
"""


def going_on(times: Sequence[Array | None]) -> list[Array | None]:
    """Return times [s] of consecutive tables or records as one clock, None for those without times.

    Times that begin before the end of those in front are moved to `PAUSE_S` behind it; others stay.

    Args:
        times: (n,) of each [s], or None.
    """
    end, result = -np.inf, []
    for time in times:
        if time is not None and len(time):
            time = time if time.min() > end else time - time.min() + end + PAUSE_S
            end = float(time.max())
        result.append(time)
    return result


def without_restarts(time: Array) -> tuple[Array, int]:
    """Return times (n,) [s] in file order as one clock that never restarts, and how often it had restarted.

    A clock that is set back repeats some of the times before; stretches that stand in another order do not, and stay.
    """
    parts = np.split(time, np.flatnonzero(np.diff(time) < 0) + 1)
    overlaps = [b.min() <= a.max() and b.max() >= a.min() for a, b in pairwise(parts)]
    if not any(overlaps) or min(map(len, parts)) < FEWEST_ROWS_IN_LINE:
        return time, 0
    return np.concatenate([part for part in going_on(parts) if part is not None]), sum(overlaps)


def evenly_spaced(time: Array) -> Array | None:
    """Return (n,) evenly spaced times [s] in place of coarse stamps; None where stamps are fine or not so spaced.

    Rounded stamps are off a line by half of their last decimal place; so are stamps that are cut, all to one side.
    """
    if len(time) < FEWEST_ROWS_IN_LINE:
        return None
    row = np.arange(len(time))
    line = time[0] + np.polyval(np.polyfit(row, time - time[0], 1), row)
    apart = np.diff(np.unique(time))
    step = next((s for s in CLOCK_STEPS if np.abs(time / s - np.round(time / s)).max() < 1e-3), 0.0)
    # Rows that share a stamp tell how coarse the clock is, whatever its decimals.
    step = max(step, float(apart.min(initial=np.inf)) if len(apart) < len(time) - 1 else 0.0)
    off = float(np.abs(time - line).max())
    return line if 1e-9 < off <= 0.75 * step else None


def with_motion(state: State, source: Source) -> tuple[State, list[Diagnostic]]:
    """Return the state with speeds, accelerations and approach sides, where rows with times record moving joints.

    Speeds are those of the polynomial through the `POINTS` nearest rows of a record. Accelerations are those of the
    parabola through the rows around (Savitzky & Golay 1964). Sides are signs of the difference of the rows before and
    behind, which rounded angles of a slow joint do not turn round. What the table states itself is kept. A clock that
    restarts is continued, and coarse stamps of evenly spaced rows are replaced by their count. DAT014 on ``source``
    reports that.
    """
    derived = {"joint speeds": state.v, "accelerations": state.a, "approach sides": state.approach}
    lacking = [name for name, channel in derived.items() if channel is None]
    if not {"joint speeds", "accelerations"} & set(lacking) or state.time is None or not np.isfinite(state.q).all():
        return state, []
    clock, restarts = without_restarts(state.time)
    order = np.argsort(clock, kind="stable")
    q, time = state.q[order], clock[order]
    session = np.zeros(len(q)) if state.session is None else state.session[order]
    same_session = session[1:] == session[:-1]
    lines = [(run, evenly_spaced(time[run])) for run in _runs((np.diff(time) <= GAP_S) & same_session)]
    counted = [(run, line) for run, line in lines if line is not None]
    for run, line in counted:
        time[run] = line
    joined = (np.diff(time) > 0) & (np.diff(time) <= GAP_S) & same_session
    v, side, known = _speeds(q, time, joined)
    if known.sum() < max(FEWEST_ROWS_IN_LINE, 0.5 * len(q)) or not _moves(q, v, joined):
        return state, []
    back = np.argsort(order)
    rate = 1 / float(np.median(np.diff(time)[joined]))
    what = " and ".join([*([", ".join(lacking[:-1])] if lacking[1:] else []), lacking[-1]])
    message = f"{int(known.sum())} of {len(q)} rows are a record of the moving arm ({rate:.3g} rows a second): "
    message += f"{what} are derived from `time_s` and the angles"
    message += f"; the clock begins anew {restarts} times and goes on" if restarts else ""
    message += "; it counts the rows, for which its stamps are coarse" if counted else ""
    help_ = "columns v1_deg_s .. and a1_deg_s2 .. from the controller are better, where it records them"
    finding = Diagnostic("DAT014", "info", message, source, help=help_)
    approach = _kept(side, joined)[back] if state.approach is None else state.approach
    a = _accelerations(q, time, joined, rate)[back] if state.a is None else state.a
    return state.with_(v=v[back] if state.v is None else state.v, a=a, approach=approach, time=time[back]), [finding]


def sides_from_before(state: State, clock: Array) -> Array:
    """Return (n, 6) side from which each joint came to a pose, by its angle in the pose measured before; 0 if unknown.

    Of poses that share a time nothing is known, nor of the first one of a session.

    Args:
        clock: (n,) time [s] or number of each row, by which rows follow each other.
    """
    clock = without_restarts(clock)[0]
    session = np.zeros(len(state)) if state.session is None else state.session
    order = np.lexsort((clock, session))
    step = np.diff(state.q[order], axis=0)
    moved = np.where(np.abs(step) > GAP_RAD, np.sign(step), 0.0)
    timed = (np.diff(clock[order]) > 0) | ~moved.any(axis=1)
    joined = timed & np.isfinite(step).all(axis=1) & (np.diff(session[order]) == 0)
    sides = np.zeros_like(state.q)
    sides[order] = _kept(np.vstack([np.zeros(6), moved * joined[:, None]]), joined)
    return sides


def is_record(state: State) -> bool:
    """Return whether rows record a moving arm: in the median at most `GAP_S` apart, and with a joint moving."""
    if state.v is None or state.time is None or not len(state):
        return False
    close = np.median(np.diff(np.sort(state.time), prepend=-np.inf)) <= GAP_S
    return bool(close and np.median(np.abs(state.v).max(axis=1)) > STANDING_SPEED)


def _runs(joined: NDArray[np.bool_]) -> list[slice]:
    """Return each record as a slice of rows; ``joined`` (n - 1,) says which rows belong to that of the row before."""
    starts = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(joined) + 1]])
    return [slice(first, end) for first, end in pairwise(starts.tolist())]


def _speeds(q: Array, time: Array, joined: NDArray[np.bool_]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return (n, 6) joint speeds of rows in time order, (n, 6) sides to which the joints move, and which rows have any.

    Speeds are 0 where a row has no neighbour, and sides also where a joint stands.

    Args:
        q: (n, 6); time: (n,); joined: (n - 1,) which rows follow the one before in a record.
    """
    v, side, known = np.zeros_like(q), np.zeros_like(q), np.zeros(len(q), dtype=bool)
    for run in _runs(joined):
        if run.stop - run.start > 1:
            v[run], known[run] = _slopes(q[run], time[run]), True
            between = np.gradient(q[run], time[run], axis=0)
            side[run] = np.where(np.abs(between) > STANDING_SPEED, np.sign(between), 0.0)
    return v, side, known


def _slopes(q: Array, time: Array) -> Array:
    """Return (n, 6) derivatives by time (n,) of the polynomials through the `POINTS` rows of q (n, 6) next to each row.

    Near the ends they are the first and the last rows, and all of a shorter record.
    """
    count = min(POINTS, len(q))
    first = np.clip(np.arange(len(q)) - count // 2, 0, len(q) - count)
    t = windows(time, count)[first] - time[:, None]
    unit = np.abs(t).max(axis=1)
    # The weights w of the rows with sum_k w_k t_k^m = 1 for m = 1, and 0 for the other powers.
    powers = (t / unit[:, None])[:, None, :] ** np.arange(count)[:, None]
    weight = np.linalg.solve(powers, np.eye(count)[1][:, None])[:, :, 0] / unit[:, None]
    return np.asarray(np.einsum("nk,njk->nj", weight, windows(q, count, axis=0)[first]))


def _accelerations(q: Array, time: Array, joined: NDArray[np.bool_], rate: float) -> Array:
    """Return (n, 6) joint accelerations of rows in time order, 0 in records too short for a parabola.

    Args:
        q, time, joined: as in `_speeds`; rate: rows a second.
    """
    size = 2 * max(1, int(np.ceil(AROUND_S * rate))) + 1
    a = np.zeros_like(q)
    for run in _runs(joined):
        first, end = run.start, run.stop
        rows = min(size, end - first)
        if rows < 3:
            continue
        # Rows near the ends of a record have the parabola of its first or last full window.
        t = windows(time[first:end], rows)
        t = t - t.mean(axis=1, keepdims=True)
        square = t**2
        # What is left of t^2 beside a constant and t: the weights of the parabola's curvature.
        share = np.sum(square * t, axis=1, keepdims=True) / np.sum(square, axis=1, keepdims=True)
        bend = square - square.mean(axis=1, keepdims=True) - share * t
        along = np.einsum("wk,wjk->wj", bend, windows(q[first:end], rows, axis=0))
        middle = 2 * along / np.sum(bend**2, axis=1, keepdims=True)
        a[first:end] = middle[np.clip(np.arange(end - first) - rows // 2, 0, len(middle) - 1)]
    return a


def _moves(q: Array, v: Array, joined: NDArray[np.bool_]) -> bool:
    """Return whether rows follow a path: something moves, at a possible speed, and steps resemble the ones before."""
    if np.abs(v).max() < 10 * STANDING_SPEED or np.abs(v).max() > FASTEST_SPEED:
        return False
    inside = joined[1:] & joined[:-1]
    step = np.diff(q, axis=0)
    size = np.linalg.norm(step[1:] + step[:-1], axis=1)[inside]
    bend = np.linalg.norm(step[1:] - step[:-1], axis=1)[inside]
    moving = size > 1e-9
    return bool(moving.sum() >= FEWEST_ROWS_IN_LINE and np.median(bend[moving] / size[moving]) < SMOOTH)


def _kept(side: Array, joined: NDArray[np.bool_]) -> Array:
    """Return (n, 6) sign of the last motion of each joint, kept while it stands; 0 before a record has moved it.

    Args:
        side: (n, 6) sign of the motion at each row, 0 of a joint that stands; joined: (n - 1,) as in `_speeds`.
    """
    first = np.concatenate([np.full(run.stop - run.start, run.start) for run in _runs(joined)])[:, None]
    last = np.maximum.accumulate(np.where(side != 0, np.arange(len(side))[:, None], -1), axis=0)
    return np.where(last >= first, np.take_along_axis(side, np.maximum(last, 0), axis=0), 0.0)
