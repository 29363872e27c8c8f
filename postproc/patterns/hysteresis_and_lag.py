"""Patterns of what the rows before have left behind: the row before, a slide that is dragged along, late warmth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.patterns.change_points import FINEST
from postproc.patterns.formula import Pattern
from postproc.patterns.harmonics import LOW, waves
from postproc.patterns.shapes import of_signal
from postproc.patterns.signals import Signal

REACHES = np.geomspace(0.03, 0.6, 7)
"""How far something is dragged before it slips, in the range of what drags it."""

LAGS = np.geomspace(0.02, 1.0, 7)
"""How late something follows a channel, in the time of the whole measurement."""


def memories(signals: Mapping[str, Signal], session: Array | None = None) -> Iterator[Pattern]:
    """Where the arm stood in the row before, what it bore there, and what has hung behind it since.

    What hangs behind knows no approach side; a row that repeats the one before has not moved. No state tells it.

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
        label = f"the change of {name} since the row before"
        way = replace(signal, values=signal.values[last] - before, code="", label=label)
        yield Pattern((way,), "whether it rose or fell since the row before", np.sign, "way")
        yield Pattern((way,), "by how much it rose since the row before", lambda x: x, "way")
        yield Pattern((way,), "by how much it rose or fell since the row before", np.abs, "way")
        if name == "payload" or name[0] == "q":
            then = replace(signal, values=before, code="", label=f"{name} in the row before")
            cycles = waves(then, LOW) if name[0] == "q" else ()
            shapes = (p for p in of_signal(then) if p.kind in ("line", "level", "curve", "step"))
            for pattern in (*shapes, *cycles):
                yield replace(pattern, kind="before", gate=())
        if name[0] == "q" or name.startswith("load"):
            for share in REACHES:
                yield _dragged(signal, float(share * np.ptp(signal.values)))


def lags(signals: Mapping[str, Signal]) -> Iterator[Pattern]:
    """What follows a temperature or a column of the table's own with a lag. No state tells it."""
    warm = [s for s in signals.values() if s.name == "temperature" or "channels[" in s.code]
    for signal in warm if "time" in signals else ():
        time = signals["time"].values
        for share in LAGS:
            yield _late(signal, time, float(share * np.ptp(time)))


def dragged(x: Array, reach: float) -> Array:
    """(n,) of what a signal (n,) drags along: z + dx / reach within -1 and 1, from row to row.

    Play, and dry friction that sets in before it slips: the stop operator (Prandtl 1928, Z. angew. Math. Mech. 8, 85).
    """
    found = np.zeros(len(x))
    z = 0.0
    for i, step in enumerate((np.diff(x) / reach).tolist()):
        z = min(max(z + step, -1.0), 1.0)
        found[i + 1] = z
    return found


def _dragged(signal: Signal, reach: float, fine: int = 0) -> Pattern:
    def finer() -> list[Pattern]:
        shares = 1.3 ** (np.linspace(-1.0, 1.0, 9) / 4**fine)
        return [_dragged(signal, float(share * reach), fine + 1) for share in shares]

    behind = replace(signal, values=dragged(signal.values, reach), code="")
    form = f"dragged along by {signal.name}, and slipping after {{}} to either side, from row to row"
    move = finer if fine < FINEST else None
    return Pattern((behind,), form, lambda x: x, "dragged", ((reach, reach),), finer=move)


def late(x: Array, time: Array, lag: float) -> Array:
    """(n,) what follows a signal (n,) with a lag, lag dz/dt = x - z: a casting warms up after the air around it.

    Solved exactly for a signal that is straight from one time to the next; settled at the first of them.
    """
    order = np.argsort(time, kind="stable")
    found, (z, before) = np.empty(len(x)), (float(x[order[0]]),) * 2
    for i, step in zip(order, np.diff(time[order], prepend=time[order[0]]).tolist(), strict=True):
        now = float(x[i])
        if step > 0:
            ahead = (now - before) * lag / step
            z = now - ahead + (z - before + ahead) * float(np.exp(-step / lag))
        found[i] = z
        before = now
    return found


def _late(signal: Signal, time: Array, lag: float, fine: int = 0) -> Pattern:
    def finer() -> list[Pattern]:
        shares = 1.4 ** (np.linspace(-1.0, 1.0, 9) / 4**fine)
        return [_late(signal, time, float(share * lag), fine + 1) for share in shares]

    after = replace(signal, values=late(signal.values, time, lag), code="", unit="time")
    move = finer if fine < FINEST else None
    return Pattern(
        (after,), f"following {signal.name} with a lag of {{}}", lambda x: x, "late", ((lag, lag),), finer=move
    )
