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
    """Where the arm stood in the row before, what it bore there, and what has hung behind it since.

    What hangs behind knows no approach side; a row that repeats the one before has not moved.

    Args:
        signals: of rows in the order of measuring. session: (n,) of each row; nothing lies before its first one.
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
    """What follows a temperature or a column of the table's own with a lag."""
    warm = [s for s in signals.values() if s.name == "temperature" or s.of_table]
    for signal in warm if "time" in signals else ():
        time, said = signals["time"].values, f"following {signal.name} with a lag of {{n0}}"
        curve = SignalCurve(lambda x, lag, time=time: late(x, time, lag), said, "late", ("reach",))
        after = replace(signal, code="", unit="time")
        yield block(curve, after, [(share * np.ptp(time),) for share in LAGS])


def dragged(x: Array, reach: float | Array) -> Array:
    """(n,), or (P, n) for (P, 1) reaches, of what a signal drags along: z + dx / reach within -1 and 1, row by row.

    Play, and dry friction that sets in before it slips: the stop operator (Prandtl 1928, Z. angew. Math. Mech. 8, 85).
    """
    steps = np.diff(x) / reach
    found = np.zeros((*steps.shape[:-1], len(x)))
    for i in range(len(x) - 1):
        found[..., i + 1] = np.clip(found[..., i] + steps[..., i], -1.0, 1.0)
    return found


def late(x: Array, time: Array, lag: float | Array) -> Array:
    """(n,), or (P, n) for (P, 1) lags, of what follows a signal: lag dz/dt = x - z, a casting behind the air.

    Solved exactly for a signal that is straight from one time to the next; settled at the first of them.
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
