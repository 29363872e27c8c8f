"""Shapes of one signal without a physical name: lines, steps, kinks, ramps, windows, bumps, settling."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property, partial, reduce
from itertools import combinations, product
from operator import or_
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import shown
from postproc.patterns.change_points import (
    FINEST,
    STEPS,
    above,
    around,
    bow,
    breaks,
    edges,
    gaps,
    knots,
    nearest,
    only,
    step,
)
from postproc.patterns.formula import Edge, Family, Pattern, family, sharper, together
from postproc.patterns.signals import Movable, Signal

SOME = 30
"""Places of a bump, and of steps among bumps."""
CLOSER = 4.0
"""As much less likely is one of the many finer places of a pattern: neighbours are hardly different."""


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
    yield bow(signal, centre)
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
    span = gaps(distinct, np.quantile(values, np.linspace(0.04, 0.96, STEPS)))
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4, 8, 14):
            if k + width < STEPS and span[k] < span[k + width]:
                yield _window(signal, span[k], span[k + width])


def _fading(since: Any) -> Any:
    return np.exp(-since)


def levels(signal: Signal) -> Iterator[Pattern]:
    """Every way to split three or four values in two; of four, the halves as well."""
    distinct = np.unique(signal.values)
    if not 2 < len(distinct) <= 4:
        return
    pairs = [distinct[[0, k]] for k in (1, 2, 3)] if len(distinct) == 4 else []
    for some in [*distinct[:, None], *pairs]:
        yield _level(signal, some, 0.5 * float(np.diff(distinct).min()))


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

    def finer() -> Family:
        return sharper(pattern).times(lambda p: _sided(p, signal), np.sign(signal.values))

    form = f"{pattern.form}, to the side of {signal.label}"
    move = None if pattern.finer is None else finer
    return replace(pattern, signals=(signal,), form=form, law=law, finer=move, gate=())


def _level(signal: Signal, some: Array, near: float) -> Pattern:
    """At one of a few values, or at two of them."""

    def law(x: Any) -> Any:
        return reduce(or_, (np.abs(x - float(value)) < near for value in some))

    form = f"at {' or '.join(shown(signal.unit, float(value)) for value in some)}"
    return Pattern((signal,), f"{form}{signal.of}", law, "level", gate=only(form, signal))


def _slowing(x: Any) -> Any:
    """Begins at 0: a draft is asked for states before the first that was measured, too."""
    return np.log1p(np.maximum(x, 0.0))


def _settling(signal: Signal, within_: float, law: Callable[[Any], Any] = _fading) -> Pattern:
    """What settles, or goes on ever more slowly."""
    start, whole = float(signal.values.min()), float(np.ptp(signal.values))

    def after(law: Callable[[Any], Any], x: Any, time: Any) -> Any:
        return law((x - start) / time)

    def finer() -> Family:
        near = [(share * whole,) for share in np.geomspace(0.01, 3.0, 60)]
        laws = (_fading, _slowing)
        every = (family((signal,), partial(after, one), partial(_settling, signal, law=one), near) for one in laws)
        return together([some.settled() for some in every])

    said = "settling within" if law is _fading else "growing with the logarithm, bent at"
    form, at, time = f"{said} {{}}{signal.of}", ((within_, within_),), Movable(within_, "width", signal)
    return Pattern((signal,), form, lambda x: after(law, x, time), "settling", at, None, finer)


def _window(signal: Signal, low: Edge, high: Edge, exact: bool = False) -> Pattern:
    values = signal.values

    def close() -> Family:
        between = edges(values, len(values))
        return _between(signal, product(nearest(between, low), nearest(between, high))).settled()

    gate, move = only("between {} and {}", signal), close if exact else partial(_windows, signal)
    form, at = f"only between {{}} and {{}}{signal.of}", (low, high)
    return Pattern((signal,), form, lambda x: _inside(x, *low, *high), "window", at, None, move, gate)


def _inside(x: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    return (x > 0.5 * (a + b)) & (x < 0.5 * (c + d))


def _between(signal: Signal, some: Iterable[tuple[Edge, Edge]]) -> Family:
    """Windows between exact edges."""
    ends = ((*low, *high) for low, high in some if low < high)
    return family((signal,), _inside, lambda a, b, c, d: _window(signal, (a, b), (c, d), True), ends)


def _windows(signal: Signal) -> Family:
    """Between many edges, and such as fade out."""
    widths = float(np.ptp(signal.values)) * np.geomspace(0.01, 0.2, 7)
    some = combinations(edges(signal.values, 36), 2)
    return together([_between(signal, some), _bumps(signal, product(knots(signal.values, 60), widths))])


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
            return self._step(*self.steps[k - 1])
        return _bump(self.signal, *self.bumps[k - 1 - len(self.steps)], smooth=True)

    def _step(self, *edge: float) -> Pattern:
        def closer() -> Family:
            return family((self.signal,), above, self._step, nearest(self.every, (edge[0], edge[1])))

        return step(self.signal, (edge[0], edge[1]), closer)

    @cached_property
    def values(self) -> Array:
        """(n, P), by their largest size."""
        x = self.signal.values[:, None]
        centre, width = np.array(self.bumps).T
        steps = x > np.mean(self.steps, axis=1) if self.steps else np.zeros((len(x), 0))
        # In single precision a bump far from all values is nothing, and no spike at the nearest.
        raw = np.hstack([x, steps, np.exp(-0.5 * ((x - centre) / width) ** 2)]).astype(np.float32)
        return np.asarray(raw / np.maximum(np.abs(raw).max(axis=0), 1e-30), dtype=float)


def _bumps(signal: Signal, some: Iterable[tuple[float, float]], fine: int = 0) -> Family:
    return family((signal,), _bell, lambda centre, width: _bump(signal, centre, width, fine), some)


def _bell(x: Any, centre: Any, width: Any) -> Any:
    return np.exp(-0.5 * ((x - centre) / width) ** 2)


def _bump(signal: Signal, centre: float, width: float, fine: int = 0, smooth: bool = False) -> Pattern:
    """Smooth: one that stays a bump; others may turn out to be a window with edges."""

    def finer() -> Family:
        between = edges(signal.values, len(signal.values)) if fine == 0 and not smooth else []
        lows, highs = (nearest(between, (end, end)) for end in (centre - width, centre + width))
        bumps = _bumps(signal, around(signal.values, centre, width, 60, fine), fine + 1)
        return together([_between(signal, product(lows, highs)), bumps])

    at, near = ((centre, centre), (2 * width, 2 * width)), "near {}, {} wide"
    gate, move = only(near, signal)[:1], finer if fine < FINEST else None
    ways = Movable(centre, "knot", signal), Movable(width, "width", signal)
    return Pattern((signal,), f"bump {near}{signal.of}", lambda x: _bell(x, *ways), "window", at, None, move, gate)
