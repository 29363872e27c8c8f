"""What the rows before have left behind: the row before, a slide dragged along, late warmth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from postproc.arrays import Array
from postproc.channels.memory import lag, play, rows_before
from postproc.identification.curves.form import Block, SignalFunction, block
from postproc.identification.curves.functions import LOW, ORIGIN, fixed, of_signal, waves
from postproc.identification.curves.signal import Signal

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
    angles = [s.values for s in signals.values() if s.leading[0] == "q" and s.leading[1:].isdigit()]
    if not angles:
        return
    last, earlier = rows_before(np.stack(angles, axis=1), session)
    for name, signal in signals.items():
        before = signal.values[earlier]
        way = replace(signal, values=signal.values[last] - before, name=f"rise({signal.name})", column=False)
        yield block(fixed("side", "whether it rose or fell since the row before", "way"), way)
        yield block(fixed("line", "by how much it rose since the row before", "way", numbers=ORIGIN), way)
        yield block(fixed("size", "by how much it rose or fell since the row before", "way"), way)
        if name == "payload" or name[0] == "q":
            label = f"{name} in the row before"
            then = replace(signal, values=before, name=f"before({signal.name})", label=label, column=False)
            some = [b for b in of_signal(then) if b.like.kind in BEFORE]
            for one in [*some, waves(then, LOW)] if name[0] == "q" else some:
                yield one.with_(kind="before")
        if name[0] == "q" or name.startswith("load"):
            sentence = f"dragged along by {name}, and slipping after {{n0}} to either side, from row to row"
            unit = "mrad" if name[0] == "q" else "N m"
            curve = SignalFunction("line", sentence, "dragged", ("reach",), derived=("play", unit, play))
            yield block(curve, signal, [(share * np.ptp(signal.values),) for share in REACHES])


def lags(signals: Mapping[str, Signal]) -> Iterator[Block]:
    """Yield patterns that follow a temperature or an own column of the table with a time lag; none without ``time``.

    Args:
        signals: of all channels, by name.
    """
    warm = [s for s in signals.values() if s.leading == "temperature" or s.column]
    for signal in warm if "time" in signals else ():
        time, sentence = signals["time"].values, f"following {signal.leading} with a lag of {{n0}}"
        delayed = ("lag", "s", partial(_delayed, time))
        curve = SignalFunction("line", sentence, "late", ("reach",), derived=delayed)
        yield block(curve, replace(signal, unit="time"), [(share * np.ptp(time),) for share in LAGS])


def creeps(signals: Mapping[str, Signal]) -> Iterator[Block]:
    """Yield patterns that follow a joint's load late, from zero on; none without ``time``.

    Args:
        signals: of all channels, by name.
    """
    for signal in (s for name, s in signals.items() if name.startswith("load")) if "time" in signals else ():
        time, sentence = signals["time"].values, f"creeping after {signal.leading} with a time constant of {{n0}}"
        derived = ("creep", "s", lambda x, constant, time=time: lag(x, time, constant, settled=False))
        curve = SignalFunction("line", sentence, "creep", ("reach",), derived=derived)
        yield block(curve, replace(signal, unit="time"), [(share * np.ptp(time),) for share in LAGS])


def _delayed(time: Array, x: Array, constant: float | Array) -> Array:
    """Return the first-order lag of a signal, (n,) or (P, n) for time constants (P, 1)."""
    return lag(x, time, constant)
