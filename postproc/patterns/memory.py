"""What the rows before have left behind: the row before, a slide dragged along, late warmth. No state has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.patterns.curves import LOW, fixed, of_signal, waves
from postproc.patterns.formula import Block, SignalCurve, block
from postproc.patterns.signals import Signal

REACHES = np.geomspace(0.03, 0.6, 7)
"""How far something is dragged before it slips, in the range of what drags it."""
LAGS = np.geomspace(0.02, 1.0, 7)
"""How late something follows a channel, in the time of the whole measurement."""
BEFORE = ("line", "level", "curve", "step")
"""Kinds of curves of where the arm stood in the row before."""


def memories(signals: Mapping[str, Signal], session: Array | None = None) -> Iterator[Block]:
    """Yield blocks of patterns that depend on the row before: channel values there, their change, and what drags along.

    A row in which no joint moved takes its values from the last row in which one did.

    Args:
        signals: channels by name, rows in the order of measuring.
        session: (n,) session of each row; the first row of a session has no row before it.
    """
    angles = [s.values for name, s in signals.items() if name[0] == "q" and name[1:].isdigit()]
    if not angles:
        return
    whole = np.stack(angles, axis=1)
    moved = np.any(np.diff(whole, axis=0, prepend=whole[:1]) != 0, axis=1)
    fresh = moved & False if session is None else np.diff(session, prepend=session[:1]) != 0
    last = np.maximum.accumulate(np.where(moved | fresh, np.arange(len(moved)), 0))
    first = np.maximum.accumulate(np.where(fresh, np.arange(len(moved)), 0))
    for name, signal in signals.items():
        before = signal.values[np.maximum(last - 1, first)]
        way = replace(signal, values=signal.values[last] - before, code="")
        yield block(fixed(np.sign, "whether it rose or fell since the row before", "way"), way)
        yield block(fixed(lambda x: x, "by how much it rose since the row before", "way"), way)
        yield block(fixed(np.abs, "by how much it rose or fell since the row before", "way"), way)
        if name == "payload" or name[0] == "q":
            then = replace(signal, values=before, code="", label=f"{name} in the row before")
            some = [b for b in of_signal(then) if b.like.kind in BEFORE]
            for one in [*some, waves(then, LOW)] if name[0] == "q" else some:
                yield one.with_(kind="before")
        if name[0] == "q" or name.startswith("load"):
            said = f"dragged along by {name}, and slipping after {{n0}} to either side, from row to row"
            curve = SignalCurve(dragged, said, "dragged", ("reach",))
            yield block(curve, replace(signal, code=""), [(share * np.ptp(signal.values),) for share in REACHES])


def lags(signals: Mapping[str, Signal]) -> Iterator[Block]:
    """Yield patterns that follow a temperature or an own column of the table with a time lag; none without ``time``.

    Args:
        signals: of all channels, by name.
    """
    warm = [s for s in signals.values() if s.name == "temperature" or s.of_table]
    for signal in warm if "time" in signals else ():
        time, said = signals["time"].values, f"following {signal.name} with a lag of {{n0}}"
        curve = SignalCurve(lambda x, lag, time=time: late(x, time, lag), said, "late", ("reach",))
        after = replace(signal, code="", unit="time")
        yield block(curve, after, [(share * np.ptp(time),) for share in LAGS])


def dragged(x: Array, reach: float | Array) -> Array:
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
    found = np.zeros((*steps.shape[:-1], len(x)))
    for i in range(len(x) - 1):
        found[..., i + 1] = np.clip(found[..., i] + steps[..., i], -1.0, 1.0)
    return found


def late(x: Array, time: Array, lag: float | Array) -> Array:
    """Return the first-order lag z of a signal x, lag dz/dt = x - z: a casting that follows the air's temperature.

    It is exact for a signal that is linear between the times, and starts settled (z = x) at the earliest time.

    Args:
        x: (n,) values; time: (n,) of each, in any order.
        lag: time constant in the unit of time, (P, 1) for P of them at once.

    Returns:
        (n,), or (P, n) for P lags.
    """
    order = np.argsort(time, kind="stable")
    steps, lag = np.diff(time[order], prepend=time[order[0]]), np.asarray(lag)[..., 0] if np.ndim(lag) else lag
    z = before = np.broadcast_to(x[order[0]], np.shape(lag))
    found = np.empty((*np.shape(lag), len(x)))
    for i, step in zip(order, steps.tolist(), strict=True):
        now = x[i]
        if step > 0:
            ahead = (now - before) * lag / step
            z = now - ahead + (z - before + ahead) * np.exp(-step / lag)
        found[..., i] = z
        before = now
    return found
