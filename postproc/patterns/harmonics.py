"""Shapes that come again: waves, saw teeth, folded waves and pulses, by the turn of a joint or in time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from postproc.arrays import Array, finest
from postproc.fit.channels import shown
from postproc.patterns.formula import Edge, Family, Pattern, family, together
from postproc.patterns.signals import Movable, Signal

LOW, GEAR, TEETH = (1, 2, 3), 12, 128
"""Orders of what tilts, bends or hangs; the highest of most gears; of pole pairs, teeth and marks on one turn."""
SWAYS = 12
"""Most periods in time over the whole measurement."""
THIRDS, QUARTERS = np.pi / 3 * np.arange(3), np.pi / 4 * np.arange(4)
"""Phases of a wave: the other half turn is the same wave with the other sign."""
EIGHTHS = np.pi / 8 * np.arange(8)
DUTIES = (0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
"""Share of a period that a pulse takes; what is longer is a pulse the other way."""


def waves(signal: Signal, orders: Iterable[float]) -> Family:
    """Waves of an angle; their shape is that of a saw tooth or a pulse where it turns out so."""
    some = told_apart(signal, orders)
    return _waves(signal, ((order, phase) for order in some for phase in (QUARTERS if order <= GEAR else THIRDS)))


def told_apart(signal: Signal, orders: Iterable[float]) -> list[float]:
    """Orders that are no other names of lower ones at the values of an angle; those of what is no angle as they are."""
    highest = finest(signal.values) if turns(signal) else np.inf
    return [order for order in orders if order <= highest]


def comes_again(signal: Signal) -> bool:
    """Whether it may come again though it is no angle: time, a rail or a turntable of the table's own."""
    return signal.name == "time" or "channels[" in signal.code


def periods(signal: Signal) -> list[float]:
    """Orders of what is no angle: at most so many periods over the whole, and more than two values a period."""
    whole, apart = float(np.ptp(signal.values)), float(np.median(np.diff(np.unique(signal.values))))
    many = range(2, min(2 * SWAYS + 1, round(whole / apart))) if whole > 4 * apart else ()
    return [np.pi * k / whole for k in many]


def sways(signal: Signal) -> Family:
    """Waves of what is no angle."""
    return _waves(signal, product(periods(signal), QUARTERS))


def _waves(signal: Signal, some: Iterable[tuple[float, float]]) -> Family:
    return family((signal,), cosine, lambda order, phase: _wave(signal, order, phase), some)


def cosine(x: Any, order: Any, phase: Any) -> Any:
    if np.ndim(order) == 0:
        return np.cos(order * x - phase)
    # Of many waves in single precision, which is many times as fast; within half a turn it is exact enough for that.
    turns = (order / (2 * np.pi)) * x - phase / (2 * np.pi)
    return np.cos(2 * np.pi * (turns - np.rint(turns)).astype(np.float32))


def neighbours(signal: Signal, order: float) -> Array:
    """Orders beside one that a range of values tells apart, 2 pi / range.

    What turns comes again, however little of a turn was seen; what does not is no wave before it has come once.
    """
    apart = 2 * np.pi / max(float(np.ptp(signal.values)), 1e-300)
    near = order + apart * np.linspace(-0.5, 0.5, 11)
    return np.asarray(near[near > (0.4 if turns(signal) else 0.999) * apart])


def _close(signal: Signal, order: float) -> list[float]:
    """Orders closer by; a gear or a disc has a whole number of teeth."""
    near = order + (neighbours(signal, order) - order) / 4
    return [*near.tolist(), *np.arange(np.ceil(near[0]), near[-1] + 1e-9).tolist()]


def _wave(signal: Signal, order: float, phase: float) -> Pattern:
    def finer() -> Family:
        near = product(neighbours(signal, order), EIGHTHS)
        return family((signal,), cosine, lambda k, p: _shaped(_wave(signal, k, p), signal, k), near)

    verb = "swaying" if signal.name == "time" else "wave"
    kind = "sway" if not turns(signal) else "wave" if order <= GEAR else "fine wave"
    form = f"{verb} {each(signal, order)}{signal.of}, {crest(signal, order, phase)}"
    rounder, ways = partial(_ellipse, signal, order, kind), ways_of(signal, order, phase)
    return Pattern((signal,), form, lambda x: cosine(x, *ways), kind, finer=finer, rounder=rounder)


def ways_of(signal: Signal, order: float, phase: float) -> tuple[float, float]:
    """Order and phase as a fit may move them; what turns a whole number of times does so."""
    whole = turns(signal) and float(order).is_integer()
    return order if whole else Movable(order, "order", signal), Movable(phase, "phase", signal)


def _ellipse(signal: Signal, order: float, kind: str) -> Pattern:
    """What goes round: an oval seat, a disc that wobbles."""

    def law(x: Any) -> list[Any]:
        return [np.cos(order * x), np.sin(order * x)]

    return Pattern((signal,), f"wave {each(signal, order)}{signal.of}, round an ellipse", law, kind, wide=True)


def crest(signal: Signal, order: float, phase: float) -> str:
    """Where a wave is highest."""
    return f"with a crest near {shown(signal.unit, _again(signal, order, phase / (2 * np.pi))[0])}"


def each(signal: Signal, order: float) -> str:
    return f"{order:.3g} times a turn" if turns(signal) else f"with a period of {shown(signal.unit, 2 * np.pi / order)}"


def turns(signal: Signal) -> bool:
    return signal.unit.rstrip("123456") == "q"


def _shaped(wave: Pattern, signal: Signal, order: float) -> Pattern:
    """A wave that may turn out to be another shape of its period."""

    def finer() -> Family:
        phases = np.linspace(0.0, 1.0, 36, endpoint=False)
        fine = [_waves(signal, product([order], np.pi * phases)).settled()]
        fine += [_folds(signal, product([order], phases), fold) for fold in FOLDS]
        if order * np.ptp(signal.values) > 4 * np.pi:
            # What does not come twice is a step, or acts in a window.
            fine += [_teeth(signal, product([order], phases)), _pulses(signal, product([order], phases, DUTIES))]
        return together(fine)

    return replace(wave, finer=finer)


def _cycle(x: Any, order: Any, start: Any) -> Any:
    return (order / (2 * np.pi) * x - start) % 1.0


def _again(signal: Signal, order: float, share: float) -> Edge:
    """The place next to the middle of the values at which a share of a period is over."""
    period = 2 * np.pi / order
    place = (share + round(signal.middle / period - share)) * period
    return place, place


def _teeth(signal: Signal, some: Iterable[tuple[float, float]]) -> Family:
    """What an encoder does that repeats on each of its marks; a jump in the wrong place costs most."""
    return family((signal,), _jumping, lambda order, start: _tooth(signal, order, start), some)


def _jumping(x: Any, order: Any, start: Any) -> Any:
    return 2 * _cycle(x, order, start) - 1


def _tooth(signal: Signal, order: float, start: float) -> Pattern:
    def finer() -> Family:
        return _teeth(signal, product(_close(signal, order), start + np.linspace(-0.05, 0.05, 21))).settled()

    form, at = f"saw tooth {each(signal, order)}{signal.of}, with a jump near {{}}", (_again(signal, order, start),)
    return Pattern((signal,), form, lambda x: _jumping(x, order, start), "wave", at, finer=finer)


def _folded(x: Any, order: Any, start: Any) -> Any:
    return np.abs(np.cos(0.5 * (order * x - 2 * np.pi * start)))


def _halved(x: Any, order: Any, start: Any) -> Any:
    return np.maximum(np.cos(order * x - 2 * np.pi * start), 0.0)


def _triangular(x: Any, order: Any, start: Any) -> Any:
    return np.abs(2 * _cycle(x, order, start) - 1)


FOLDS = {"folded": _folded, "halved": _halved, "triangular": _triangular}
"""Waves that only go one way, or straight up and down: an eccentric that pushes, a bearing that gives, magnets."""


def _folds(signal: Signal, some: Iterable[tuple[float, float]], word: str) -> Family:
    return family((signal,), FOLDS[word], lambda order, start: _fold(signal, order, start, word), some)


def _fold(signal: Signal, order: float, start: float, word: str) -> Pattern:
    def finer() -> Family:
        near = list(product(_close(signal, order), start + np.linspace(-0.02, 0.02, 9)))
        return together(_folds(signal, near, word).settled() for word in FOLDS)

    form, at = f"{word} wave {each(signal, order)}{signal.of}, highest near {{}}", (_again(signal, order, start),)
    return Pattern((signal,), form, lambda x: FOLDS[word](x, order, start), "wave", at, finer=finer)


def _pulses(signal: Signal, some: Iterable[tuple[float, float, float]]) -> Family:
    """On for a share of each period."""
    return family((signal,), _on, lambda order, start, duty: _pulse(signal, order, start, duty), some)


def _on(x: Any, order: Any, start: Any, duty: Any) -> Any:
    return _cycle(x, order, start) < duty


def _pulse(signal: Signal, order: float, start: float, duty: float) -> Pattern:
    def finer() -> Family:
        near = product(_close(signal, order), *(np.linspace(-0.03, 0.03, 9),) * 2)
        some = ((k, start + a, duty - a + b) for k, a, b in near if duty - a + b > 0.02)
        return _pulses(signal, some).settled()

    on, _ = _again(signal, order, start)
    off = on + duty * 2 * np.pi / order
    at = (on, on), (off, off)
    form = f"pulses {each(signal, order)}{signal.of}, one from {{}} to {{}}"
    return Pattern((signal,), form, lambda x: _on(x, order, start, duty), "wave", at, finer=finer)
