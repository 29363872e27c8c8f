"""Shapes that come again: waves, saw teeth, folded waves and pulses, by the turn of a joint or in time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import shown
from postproc.identify.shapes import Edge, Pattern

LOW, GEAR, TEETH = (1, 2, 3), 12, 128
"""Orders of what tilts, bends or hangs; the highest of most gears; of pole pairs, teeth and marks on one turn."""
SWAYS = 12
"""Most periods in time over the whole measurement."""
THIRDS, QUARTERS = np.pi / 3 * np.arange(3), np.pi / 4 * np.arange(4)
"""Phases of a wave: the other half turn is the same wave with the other sign."""
EIGHTHS = np.pi / 8 * np.arange(8)
DUTIES = (0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
"""Share of a period that a pulse takes; what is longer is a pulse the other way."""


def waves(name: str, values: Array, orders: Iterable[float]) -> Iterator[Pattern]:
    """Waves of an angle; their shape is that of a saw tooth or a pulse where it turns out so."""
    for order in orders:
        for phase in QUARTERS if order <= GEAR else THIRDS:
            yield _wave(name, values, order, phase)


def sways(values: Array) -> Iterator[Pattern]:
    """Waves in time, of at most so many periods over the whole."""
    for k in range(2, 2 * SWAYS + 1):
        for phase in QUARTERS:
            yield _wave("time", values, np.pi * k / max(float(np.ptp(values)), 1e-300), phase)


def neighbours(values: Array, order: float) -> Array:
    """Orders beside one that a range of values tells apart: 2 pi / range."""
    apart = 2 * np.pi / max(float(np.ptp(values)), 1e-300)
    near = order + apart * np.linspace(-0.5, 0.5, 11)
    return np.asarray(near[near > 0.4 * apart])


def _close(values: Array, order: float) -> list[float]:
    """Orders closer by; a gear or a disc has a whole number of teeth."""
    near = order + (neighbours(values, order) - order) / 4
    return [*near.tolist(), *np.arange(np.ceil(near[0]), near[-1] + 1e-9).tolist()]


def _wave(name: str, values: Array, order: float, phase: float) -> Pattern:
    def finer() -> list[Pattern]:
        near = neighbours(values, order)
        return [_shaped(_wave(name, values, k, p), name, values, k) for k in near for p in EIGHTHS]

    value = np.asarray(np.cos(order * values - phase), dtype=np.float64)
    verb = "swaying" if name == "time" else "wave"
    kind = "sway" if name == "time" else "wave" if order <= GEAR else "fine wave"
    return Pattern((name,), f"{verb} {_each(name, order)}", value, kind, finer=finer)


def _each(name: str, order: float) -> str:
    if name == "time":
        return f"with a period of {shown(name, 2 * np.pi / order)}"
    return f"{order:.3g} times a turn"


def _shaped(wave: Pattern, name: str, values: Array, order: float) -> Pattern:
    """A wave that may turn out to be another shape of its period."""

    def finer() -> list[Pattern]:
        phases, middle = np.linspace(0.0, 1.0, 36, endpoint=False), float(np.median(values))
        fine = [replace(_wave(name, values, order, np.pi * p), finer=None) for p in phases]
        fine += [p for start in phases for p in _folds(name, values, middle, order, start)]
        if order * np.ptp(values) > 4 * np.pi:
            # What does not come twice is a step, or acts in a window.
            fine += [_tooth(name, values, middle, order, p) for p in phases]
            fine += [_pulse(name, values, middle, order, p, duty) for p in phases for duty in DUTIES]
        return fine

    return replace(wave, finer=finer)


def _cycle(values: Array, order: float, start: float) -> Array:
    return np.asarray(np.mod(order * values / (2 * np.pi) - start, 1.0), dtype=np.float64)


def _again(middle: float, order: float, share: float) -> Edge:
    """The place next to the middle of the values at which a share of a period is over."""
    period = 2 * np.pi / order
    place = (share + round(middle / period - share)) * period
    return place, place


def _tooth(name: str, values: Array, middle: float, order: float, start: float) -> Pattern:
    """What an encoder does that repeats on each of its marks; a jump in the wrong place costs most."""

    def finer() -> list[Pattern]:
        starts = start + np.linspace(-0.05, 0.05, 21)
        return [replace(_tooth(name, values, middle, k, s), finer=None) for k in _close(values, order) for s in starts]

    form = f"saw tooth {_each(name, order)}, with a jump near {{}}"
    return Pattern(
        (name,), form, _cycle(values, order, start) - 0.5, "wave", (_again(middle, order, start),), name, finer=finer
    )


def _folds(name: str, values: Array, middle: float, order: float, start: float) -> Iterator[Pattern]:
    """Waves that only go one way: an eccentric that pushes, a bearing that gives."""
    turn = 2 * np.pi * _cycle(values, order, start)
    for word, value in (("folded", np.abs(np.cos(turn / 2))), ("halved", np.maximum(np.cos(turn), 0.0))):
        form = f"{word} wave {_each(name, order)}, highest near {{}}"
        yield Pattern((name,), form, np.asarray(value), "wave", (_again(middle, order, start),), name)


def _pulse(name: str, values: Array, middle: float, order: float, start: float, duty: float) -> Pattern:
    """On for a share of each period."""

    def finer() -> list[Pattern]:
        move = np.linspace(-0.03, 0.03, 9)
        return [
            replace(_pulse(name, values, middle, k, start + a, duty - a + b), finer=None)
            for k in _close(values, order)
            for a in move
            for b in move
            if duty - a + b > 0.02
        ]

    on, _ = _again(middle, order, start)
    off = on + duty * 2 * np.pi / order
    at = (on, on), (off, off)
    form = f"pulses {_each(name, order)}, one from {{}} to {{}}"
    inside = (_cycle(values, order, start) < duty).astype(float)
    return Pattern((name,), form, inside, "wave", at, name, finer=finer)
