"""Shapes of one signal without a physical name: lines, steps, kinks, ramps, windows, bumps, settling."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, partial, reduce
from operator import or_
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import shown
from postproc.patterns.formula import Edge, Pattern, sharper
from postproc.patterns.signals import Signal

STEPS, KINKS, SOME, FINE, KNOTS = 24, 9, 30, 400, 150
GAP = 0.08
"""Share of a channel's range in which nothing was measured: a step there is what any smooth function does as well."""
FINEST = 2
"""How often places and widths of a smooth shape are tried closer by."""
CLOSER = 4.0
"""As much less likely is one of the many finer places of a pattern: neighbours are hardly different."""


def only(there: str, signal: Signal, elsewhere: str = "") -> tuple[str, str, str]:
    """How it is said of something else that it acts only there, only elsewhere, or there the other way."""
    is_ = f"where {signal.label} is"
    return f"only {is_} {there}", f"only {is_} {elsewhere or f'not {there}'}", f"the other way {is_} {there}"


def line(signal: Signal, origin: float = 0.0) -> Pattern:
    """The signal itself, as far as it is from an origin."""
    label = f"{signal.label}, counted from {shown(signal.unit, origin)}," if origin else signal.label
    form = f"proportional to {signal.label}" if signal.of else "proportional"
    return Pattern((signal,), form, lambda x: x - origin if origin else x, "line", label=label)


def of_signal(signal: Signal) -> Iterator[Pattern]:
    """All shapes of one signal but those that repeat."""
    values, one, of = signal.values, (signal,), signal.of
    distinct = np.unique(values)
    if len(distinct) <= 4:
        # Approach sides, payloads, sessions: their own value, and being one of them.
        yield line(signal)
        yield from levels(signal)
        return
    centre, half = float(np.median(values)), 0.5 * float(np.ptp(values))
    yield line(signal, centre)
    yield Pattern(one, f"curved{of}", lambda x: ((x - centre) / half) ** 2, "curve")
    yield Pattern(one, f"s-shaped{of}", lambda x: ((x - centre) / half) ** 3, "curve")
    if values.min() < 0 < values.max():
        yield Pattern(one, f"growing with the square of {signal.label}, to its side", lambda x: x * np.abs(x), "curve")
        root = f"growing with the root of {signal.label}, to its side"
        yield Pattern(one, root, lambda x: np.sign(x) * np.sqrt(np.abs(x)), "curve")
    elif values.min() >= 0:
        yield Pattern(one, f"growing with the root of {signal.label}", lambda x: np.sqrt(np.abs(x)), "curve")
    yield from breaks(signal)
    if signal.name == "time" or "channels[" in signal.code:
        for share in (0.05, 0.1, 0.2, 0.4):
            yield _settling(signal, share * 2 * half)
    span = np.quantile(values, np.linspace(0.04, 0.96, STEPS))
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4, 8, 14):
            low, high = (gap(distinct, span[min(edge, STEPS - 1)]) for edge in (k, k + width))
            if k + width < STEPS and low < high:
                yield _window(signal, low, high)


def levels(signal: Signal) -> Iterator[Pattern]:
    """Every way to split three or four values in two; of four, the halves as well."""
    distinct = np.unique(signal.values)
    if not 2 < len(distinct) <= 4:
        return
    pairs = [distinct[[0, k]] for k in (1, 2, 3)] if len(distinct) == 4 else []
    for some in [*distinct[:, None], *pairs]:
        yield _level(signal, some, 0.5 * float(np.diff(distinct).min()))


def breaks(signal: Signal) -> Iterator[Pattern]:
    """Steps, kinks, and what grows on one side of a knot."""
    values = signal.values
    distinct = np.unique(values)
    across = [0.0] if values.min() < 0 < values.max() else []
    for place in [*np.quantile(values, np.linspace(0.04, 0.96, STEPS)), *across]:
        edge = gap(distinct, place)
        if _measured(distinct, edge):
            yield _step(signal, edge)
    for knot in [*np.quantile(values, np.linspace(0.1, 0.9, KINKS)), *across]:
        yield _kink(signal, float(knot))
        for side in (1, -1) if distinct[0] < knot < distinct[-1] else ():
            yield _ramp(signal, float(knot), side)


def of_channel(signal: Signal) -> Iterator[Pattern]:
    """Shapes of a channel, and of the size of one that goes both ways: angles, speeds, accelerations, loads.

    What grows from a size on may do so to the same side, or each way to its own: stops, free play.
    """
    yield from of_signal(signal)
    if signal.name[0] in "qval" and signal.values.min() < 0 < signal.values.max():
        yield Pattern((signal,), side := f"side of {signal.label}", np.sign, "side", label=side)
        for pattern in of_signal(signal.size):
            yield pattern
            if pattern.kind == "ramp":
                yield _sided(pattern, signal)


def _sided(pattern: Pattern, signal: Signal) -> Pattern:
    """What grows with the size of a signal, to the side on which that is."""

    def law(x: Any) -> Any:
        return pattern.law(np.abs(x)) * np.sign(x)

    finer = None if pattern.finer is None else lambda: [_sided(p, signal) for p in sharper(pattern)]
    form = f"{pattern.form}, to the side of {signal.label}"
    return replace(pattern, signals=(signal,), form=form, law=law, finer=finer, gate=())


def edges(values: Array, most: int = FINE) -> list[Edge]:
    """Neighbouring measured values between which a step can be seen."""
    distinct = np.unique(values)
    between = list(zip(distinct[:-1].tolist(), distinct[1:].tolist(), strict=True))
    return [e for e in between[:: max(1, -(-len(between) // most))] if _measured(distinct, e)]


def gap(distinct: Array, place: float) -> Edge:
    """The neighbouring measured values between which a place lies."""
    at = min(max(int(np.searchsorted(distinct, place)), 1), len(distinct) - 1)
    return float(distinct[at - 1]), float(distinct[at])


def knots(values: Array, most: int = KNOTS) -> list[float]:
    """Places of a knot: a step lies between two rows, a kink anywhere."""
    low, high = np.quantile(values, [0.02, 0.98])
    return [float(e) for e in np.linspace(low, high, most)]


def _level(signal: Signal, some: Array, near: float) -> Pattern:
    """At one of a few values, or at two of them."""

    def law(x: Any) -> Any:
        return reduce(or_, (np.abs(x - float(value)) < near for value in some))

    form = f"at {' or '.join(shown(signal.unit, float(value)) for value in some)}"
    return Pattern((signal,), f"{form}{signal.of}", law, "level", gate=only(form, signal))


def _step(signal: Signal, edge: Edge, closer: Callable[[], list[Pattern]] | None = None) -> Pattern:
    middle = 0.5 * (edge[0] + edge[1])

    gate, finer = only("above {}", signal, "below {}"), closer or partial(_steps, signal)
    return Pattern((signal,), f"step near {{}}{signal.of}", lambda x: x > middle, "step", (edge,), None, finer, gate)


def _steps(signal: Signal) -> list[Pattern]:
    """At many edges, and such as take their time."""
    widths = [float(np.ptp(signal.values)) * share for share in np.geomspace(0.02, 0.3, 6)]
    rises = [_rise(signal, e, w) for e in knots(signal.values, 40) for w in widths]
    return [replace(_step(signal, e), finer=None) for e in edges(signal.values)] + rises


def _rise(signal: Signal, centre: float, width: float, fine: int = 0) -> Pattern:
    """A step that takes its time: friction that sets in, a seat that lets go."""

    def finer() -> list[Pattern]:
        return [_rise(signal, c, w, fine + 1) for c, w in _around(signal.values, centre, width, 40, fine)]

    at = ((centre, centre), (2 * width, 2 * width))
    form, move = f"rising about {{}}, over {{}}{signal.of}", finer if fine < FINEST else None
    return Pattern((signal,), form, lambda x: np.tanh((x - centre) / width), "step", at, finer=move)


def _around(values: Array, centre: float, width: float, places: int, fine: int) -> list[tuple[float, float]]:
    """Centres and widths between those of a grid of so many places, a third of its steps apart, a ninth .."""
    low, high = np.quantile(values, [0.02, 0.98])
    share = np.linspace(-1.0, 1.0, 7) / 3.0**fine
    centres, widths = centre + (high - low) / places * share, width * 1.7**share
    return [(float(c), float(w)) for c in centres for w in widths]


def _kink(signal: Signal, knot: float) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_kink(signal, e), finer=None) for e in knots(signal.values)]

    form = f"kink near {{}}{signal.of}"
    return Pattern((signal,), form, lambda x: np.abs(x - knot), "kink", ((knot, knot),), None, finer)


def _ramp(signal: Signal, knot: float, side: int, power: int = 1) -> Pattern:
    """What grows from a knot on, or with the square: a rubber stop."""

    def finer() -> list[Pattern]:
        return [replace(_ramp(signal, e, side, n), finer=None) for e in knots(signal.values) for n in (1, 2)]

    def law(x: Any) -> Any:
        grown = np.maximum(x - knot if side > 0 else knot - x, 0.0)
        return grown if power == 1 else grown**power

    over = ("above {}" if side > 0 else "below {}") + (", with the square" if power > 1 else "")
    gate = only(f"{over}, growing", signal)[:1]
    return Pattern((signal,), f"growing {over}{signal.of}", law, "ramp", ((knot, knot),), None, finer, gate)


def _settling(signal: Signal, within_: float) -> Pattern:
    start, whole = float(signal.values.min()), float(np.ptp(signal.values))

    def finer() -> list[Pattern]:
        return [replace(_settling(signal, s * whole), finer=None) for s in np.geomspace(0.01, 3.0, 60)]

    def law(x: Any) -> Any:
        return np.exp((start - x) / within_)

    at = ((within_, within_),)
    return Pattern((signal,), f"settling within {{}}{signal.of}", law, "settling", at, None, finer)


def _window(signal: Signal, low: Edge, high: Edge, exact: bool = False) -> Pattern:
    values = signal.values
    start, stop = 0.5 * (low[0] + low[1]), 0.5 * (high[0] + high[1])

    def close() -> list[Pattern]:
        between = edges(values, len(values))
        lows, highs = (_nearest(between, edge) for edge in (low, high))
        return [replace(_window(signal, a, b, True), finer=None) for a in lows for b in highs if a < b]

    def law(x: Any) -> Any:
        return (x > start) & (x < stop)

    gate, move = only("between {} and {}", signal), close if exact else partial(_windows, signal)
    return Pattern((signal,), f"only between {{}} and {{}}{signal.of}", law, "window", (low, high), None, move, gate)


def _windows(signal: Signal) -> list[Pattern]:
    """Between many edges, and such as fade out."""
    some = edges(signal.values, 36)
    widths = [float(np.ptp(signal.values)) * share for share in np.geomspace(0.01, 0.2, 7)]
    bumps = [_bump(signal, e, w) for e in knots(signal.values, 60) for w in widths]
    return [_window(signal, a, b, True) for i, a in enumerate(some) for b in some[i + 1 :]] + bumps


class Abrupt:
    """The line, bumps and steps of a signal, about so many; each of these finds those close by."""

    def __init__(self, signal: Signal, most: int) -> None:
        self.signal, x = signal, signal.values
        self.every = edges(x, len(x))
        widths = float(np.ptp(x)) * np.geomspace(0.01, 0.2, 7)
        self.bumps = [(centre, float(width)) for centre in knots(x, SOME) for width in widths]
        self.steps = edges(x, max(SOME, most - len(self.bumps)))
        self.kinds = np.array(["line", *["step"] * len(self.steps), *["window"] * len(self.bumps)])

    def __getitem__(self, k: int) -> Pattern:
        if k == 0:
            return line(self.signal)
        if k <= len(self.steps):
            return self._step(self.steps[k - 1])
        return _bump(self.signal, *self.bumps[k - 1 - len(self.steps)], smooth=True)

    def _step(self, edge: Edge) -> Pattern:
        return _step(self.signal, edge, lambda: [self._step(e) for e in _nearest(self.every, edge)])

    @cached_property
    def values(self) -> Array:
        """(n, P), by their largest size."""
        x = self.signal.values[:, None]
        centre, width = np.array(self.bumps).T
        steps = x > np.mean(self.steps, axis=1) if self.steps else np.zeros((len(x), 0))
        # In single precision a bump far from all values is nothing, and no spike at the nearest.
        raw = np.hstack([x, steps, np.exp(-0.5 * ((x - centre) / width) ** 2)]).astype(np.float32)
        return np.asarray(raw / np.maximum(np.abs(raw).max(axis=0), 1e-30), dtype=float)


def _nearest(places: list[Edge], edge: Edge) -> list[Edge]:
    """The places next to an edge, as far as the neighbouring one of 36 and ten at most."""
    at = int(np.searchsorted([e[0] for e in places], edge[0]))
    reach = min(max(2, len(places) // 18), 10)
    return places[max(0, at - reach) : at + reach]


def _bump(signal: Signal, centre: float, width: float, fine: int = 0, smooth: bool = False) -> Pattern:
    """Smooth: one that stays a bump; others may turn out to be a window with edges."""

    def finer() -> list[Pattern]:
        between = edges(signal.values, len(signal.values)) if fine == 0 and not smooth else []
        lows, highs = (_nearest(between, (end, end)) for end in (centre - width, centre + width))
        windows = [_window(signal, a, b, True) for a in lows for b in highs if a < b]
        return windows + [_bump(signal, c, w, fine + 1) for c, w in _around(signal.values, centre, width, 60, fine)]

    def law(x: Any) -> Any:
        return np.exp(-0.5 * ((x - centre) / width) ** 2)

    at, near = ((centre, centre), (2 * width, 2 * width)), "near {}, {} wide"
    gate, move = only(near, signal)[:1], finer if fine < FINEST else None
    return Pattern((signal,), f"bump {near}{signal.of}", law, "window", at, finer=move, gate=gate)


def _measured(distinct: Array, edge: Edge) -> bool:
    return bool(edge[1] - edge[0] < GAP * (distinct[-1] - distinct[0]))
