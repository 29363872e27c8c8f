"""What earlier rows leave behind: play, delay, creep, and the row before; each follows the rows in their order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array


def play(x: Array, reach: float | Array) -> Array:
    """Return what a signal drags along before it slips: z + dx / reach from row to row, within -1 and 1, first z = 0.

    It describes play, and dry friction that sets in before it slips: the stop operator (Prandtl 1928, Z. angew. Math.
    Mech. 8, 85).

    Args:
        x: (n,) values in the order of measuring.
        reach: change of x after which it slips from zero; (P, 1) for P of them at once.

    Returns:
        (n,), or (P, n) for P reaches.
    """
    steps = np.diff(x) / reach
    z = np.zeros((*steps.shape[:-1], len(x)))
    for i in range(len(x) - 1):
        z[..., i + 1] = np.clip(z[..., i] + steps[..., i], -1.0, 1.0)
    return z


def lag(x: Array, time: Array, constant: float | Array, settled: bool = True) -> Array:
    """Return the first-order lag z of a signal x, T dz/dt = x - z: a casting that follows the air's temperature.

    It is exact for a signal that is linear between the times.

    Args:
        x: (n,) values; time: (n,) of each, in any order.
        constant: T in the unit of time, (P, 1) for P of them at once.
        settled: whether z = x at the earliest time; else z = 0 there, as of a load that was just applied (creep).

    Returns:
        (n,), or (P, n) for P time constants.
    """
    order = np.argsort(time, kind="stable")
    steps = np.diff(time[order], prepend=time[order[0]])
    constant = np.asarray(constant)[..., 0] if np.ndim(constant) else constant
    before = x[order[0]]
    z = np.broadcast_to(before if settled else 0.0 * before, np.shape(constant))
    lagged = np.empty((*np.shape(constant), len(x)))
    for i, step in zip(order, steps.tolist(), strict=True):
        now = x[i]
        if step > 0:
            ahead = (now - before) * constant / step
            z = now - ahead + (z - before + ahead) * np.exp(-step / constant)
        lagged[..., i] = z
        before = now
    return lagged


def rows_before(q: Array, session: Array | None) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return (n,) index of the last row in which a joint moved, and of the row before that one.

    A row in which no joint moved takes its values from the last row in which one did; the first row of a session has no
    row before it, and is its own.

    Args:
        q: (n, 6) joint angles [rad] in the order of measuring; session: (n,) session of each row.
    """
    moved = np.any(np.diff(q, axis=0, prepend=q[:1]) != 0, axis=1)
    fresh = moved & False if session is None else np.diff(session, prepend=session[:1]) != 0
    last = np.maximum.accumulate(np.where(moved | fresh, np.arange(len(moved)), 0))
    first = np.maximum.accumulate(np.where(fresh, np.arange(len(moved)), 0))
    return last, np.maximum(last - 1, first)
