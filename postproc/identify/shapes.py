"""Shapes of one channel without a physical name: steps, kinks, ramps, waves, saw teeth, windows, settling, swaying."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import shown

STEPS, KINKS, HARMONICS = 24, 9, (1, 2, 3)
SWAYS = 12
"""Most periods of a sway in time over the whole measurement."""
FOLDED = (0.5, 1.0, 2.0)
"""Orders of a wave that only goes one way: an eccentric that pushes, a bearing that gives."""
TEETH = 128
"""Most teeth of a saw on one turn: pole pairs and marks of an encoder at the joint."""
GAP = 0.08
"""Share of a channel's range in which nothing was measured: a step there is what any smooth function does as well."""
FINE = 400
PHASES = np.pi / 8 * np.arange(8)
"""Of a wave: the other half turn is the same wave with the other sign."""


@dataclass(frozen=True)
class Pattern:
    """A function of channels, (n,) values without physical unit.

    Args:
        channels: names; text: such as ``step near 22 deg``.
        where: the only place at which it makes sense, None for all.
        finer: makes the same with its edge, knot, period or phase at many finer places.
    """

    channels: tuple[str, ...]
    text: str
    values: Array
    where: str | None = None
    finer: Callable[[], list[Pattern]] | None = field(default=None, repr=False, compare=False)


def sharper(pattern: Pattern) -> list[Pattern]:
    """The same with its edge, knot, period or phase at many finer places; none where nothing can be moved."""
    return [] if pattern.finer is None else pattern.finer()


def of_channel(name: str, values: Array) -> Iterator[Pattern]:
    """All shapes of one channel."""
    distinct = np.unique(values)
    if len(distinct) <= 4:
        # Approach sides, payloads, sessions: their own value, and being one of them.
        yield Pattern((name,), "proportional", values)
        if len(distinct) > 2:
            for value in distinct:
                yield Pattern((name,), f"at {shown(name, float(value))}", (values == value).astype(float))
        return
    centre, half = float(np.median(values)), 0.5 * float(np.ptp(values))
    scaled = (values - centre) / half
    yield Pattern((name,), "proportional", scaled)
    yield Pattern((name,), "curved", scaled**2)
    yield Pattern((name,), "s-shaped", scaled**3)
    sides = values.min() < 0 < values.max()
    if sides:
        yield Pattern((name,), "with the square of its size, by its side", unit(values * np.abs(values)))
    yield from breaks(name, values)
    if name.startswith("q"):
        yield from waves(name, values)
        for order in FOLDED:
            yield from _folds(name, values, order, PHASES)
        yield from _teeth(name, values)
    if name == "time":
        since = (values - values.min()) / max(float(np.ptp(values)), 1e-300)
        for share in (0.05, 0.1, 0.2, 0.4):
            yield _settling(name, since, share, 2 * half)
        for k in range(2, 2 * SWAYS + 1):
            for phase in (0.0, np.pi / 2):
                yield _sway(values, k / 2, phase)
    span = _span(values)
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4, 8, 14):
            if k + width < STEPS:
                yield _window(name, values, float(span[k]), float(span[k + width]))


def breaks(name: str, values: Array) -> Iterator[Pattern]:
    """Steps, kinks, and what grows on one side of a knot."""
    distinct = np.unique(values)
    across = [0.0] if values.min() < 0 < values.max() else []
    for edge in [*_span(values), *across]:
        if _measured(distinct, float(edge)):
            yield _step(name, values, float(edge))
    for knot in [*np.quantile(values, np.linspace(0.1, 0.9, KINKS)), *across]:
        yield _kink(name, values, float(knot))
        for side in (1, -1):
            yield _ramp(name, values, float(knot), side)


def waves(name: str, values: Array) -> Iterator[Pattern]:
    """Low waves of an angle."""
    for k in HARMONICS:
        for phase in (0.0, np.pi / 2):
            yield _wave(name, values, k, phase)


def _span(values: Array) -> Array:
    return np.asarray(np.quantile(values, np.linspace(0.04, 0.96, STEPS)))


def of_sum(pattern: Pattern, names: tuple[str, ...], label: str) -> Pattern:
    """A shape of a sum of channels that the label spells out."""
    finer = None if pattern.finer is None else lambda: [of_sum(p, names, label) for p in sharper(pattern)]
    return replace(pattern, channels=names, text=f"{pattern.text} of {label}", finer=finer)


def of_size(name: str, values: Array) -> Iterator[Pattern]:
    """All shapes of the size of a channel that goes both ways: speeds, accelerations, loads."""
    if name[0] in "val" and values.min() < 0 < values.max():
        yield from map(_sized, of_channel(name, np.abs(values)))


def _sized(pattern: Pattern) -> Pattern:
    finer = None if pattern.finer is None else lambda: [_sized(p) for p in sharper(pattern)]
    return replace(pattern, text=f"{pattern.text} of its size", finer=finer)


def unit(values: Array) -> Array:
    """Values by their largest size."""
    return np.asarray(values / max(float(np.abs(values).max()), 1e-300), dtype=np.float64)


def _step(name: str, values: Array, edge: float) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_step(name, values, e), finer=None) for e in edges(values)]

    return Pattern((name,), f"step near {shown(name, edge)}", (values > edge).astype(float), finer=finer)


def edges(values: Array, most: int = FINE) -> list[float]:
    """Places between two measured values where a step can be seen."""
    distinct = np.unique(values)
    between = 0.5 * (distinct[1:] + distinct[:-1])
    between = between[:: -(-len(between) // most)]
    return [float(e) for e in between if _measured(distinct, float(e))]


def knots(values: Array, most: int = FINE) -> list[float]:
    """Places of a knot: a step lies between two rows, a kink anywhere."""
    low, high = np.quantile(values, [0.02, 0.98])
    return [float(e) for e in np.linspace(low, high, most)]


def _kink(name: str, values: Array, knot: float) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_kink(name, values, e), finer=None) for e in knots(values)]

    return Pattern((name,), f"kink near {shown(name, knot)}", unit(np.abs(values - knot)), finer=finer)


def _ramp(name: str, values: Array, knot: float, side: int) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_ramp(name, values, e, side), finer=None) for e in knots(values)]

    text = f"growing {'above' if side > 0 else 'below'} {shown(name, knot)}"
    return Pattern((name,), text, unit(np.maximum(side * (values - knot), 0.0)), finer=finer)


def _wave(name: str, values: Array, order: float, phase: float) -> Pattern:
    def finer() -> list[Pattern]:
        orders = np.arange(0.5, 6.01, 0.25)
        return [replace(_wave(name, values, k, p), finer=None) for k in orders for p in PHASES]

    value = np.asarray(np.cos(order * values - phase), dtype=np.float64)
    return Pattern((name,), f"wave {order:g} times a turn", value, finer=finer)


def _folds(name: str, values: Array, order: float, phases: Iterable[float]) -> Iterator[Pattern]:
    """The waves of an order that fold within the range: the others are waves."""

    def finer() -> list[Pattern]:
        return [replace(p, finer=None) for p in _folds(name, values, order, np.linspace(0, np.pi, 60, endpoint=False))]

    for phase in phases:
        wave_ = np.cos(order * values - phase)
        if wave_.min() < 0 < wave_.max():
            yield Pattern((name,), f"folded wave {order:g} times a turn", np.abs(wave_), finer=finer)


def _teeth(name: str, values: Array) -> Iterator[Pattern]:
    """What an encoder does that repeats on each of its marks: saw teeth of interpolation, at its own joint."""
    for count in range(2, TEETH + 1):
        for phase in 0.25 * np.arange(4):
            yield _tooth(name, values, count, phase)


def _tooth(name: str, values: Array, count: float, phase: float, exact: bool = False) -> Pattern:
    def finer() -> list[Pattern]:
        # A range of angles tells orders apart that differ by 2 pi / range; a jump in the wrong place costs most.
        apart = 2 * np.pi / max(float(np.ptp(values)), 1e-300)
        if exact:
            orders, phases = count + apart * np.linspace(-0.08, 0.08, 17), phase + np.linspace(-0.05, 0.05, 31)
            return [replace(_tooth(name, values, k, p), finer=None) for k in orders for p in phases]
        orders, phases = count + apart * np.linspace(-0.5, 0.5, 11), np.linspace(0.0, 1.0, 24, endpoint=False)
        return [_tooth(name, values, k, p, True) for k in orders for p in phases]

    tooth = np.asarray(np.mod(count * values / (2 * np.pi) - phase, 1.0) - 0.5, dtype=np.float64)
    return Pattern((name,), f"saw tooth {count:.3g} times a turn", tooth, f"joint {name[1:]}", finer)


def _settling(name: str, since: Array, share: float, whole: float) -> Pattern:
    def finer() -> list[Pattern]:
        shares = np.geomspace(0.01, 3.0, 60)
        return [replace(_settling(name, since, float(s), whole), finer=None) for s in shares]

    return Pattern((name,), f"settling within {shown(name, share * whole)}", np.exp(-since / share), finer=finer)


def _sway(values: Array, periods: float, phase: float) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_sway(values, k, p), finer=None) for k in np.arange(0.6, SWAYS, 0.1) for p in PHASES]

    span = max(float(np.ptp(values)), 1e-300)
    text = f"swaying with a period of {shown('time', span / periods)}"
    angle = 2 * np.pi * periods * (values - values.min()) / span - phase
    return Pattern(("time",), text, np.asarray(np.cos(angle)), finer=finer)


def _window(name: str, values: Array, low: float, high: float, exact: bool = False) -> Pattern:
    def close() -> list[Pattern]:
        between = edges(values, len(values))
        lows, highs = (_nearest(between, edge) for edge in (low, high))
        return [replace(_window(name, values, a, b, True), finer=None) for a in lows for b in highs if a < b]

    def finer() -> list[Pattern]:
        some = edges(values, 48)
        windows = [_window(name, values, a, b, True) for i, a in enumerate(some) for b in some[i + 1 :]]
        widths = [float(np.ptp(values)) * share for share in np.geomspace(0.01, 0.2, 10)]
        return windows + [_bump(name, values, e, w) for e in knots(values, 100) for w in widths]

    text = f"only between {shown(name, low)} and {shown(name, high)}"
    inside = ((values > low) & (values < high)).astype(float)
    return Pattern((name,), text, inside, finer=close if exact else finer)


def _nearest(places: list[float], edge: float) -> list[float]:
    """The places next to an edge, as far as the neighbouring one of 48 and ten at most."""
    at = int(np.searchsorted(places, edge))
    reach = min(max(2, len(places) // 24), 10)
    return places[max(0, at - reach) : at + reach]


def _bump(name: str, values: Array, centre: float, width: float) -> Pattern:
    text = f"bump near {shown(name, centre)}, {shown(name, 2 * width)} wide"
    return Pattern((name,), text, unit(np.asarray(np.exp(-0.5 * ((values - centre) / width) ** 2), dtype=np.float64)))


def _measured(distinct: Array, edge: float) -> bool:
    at = int(np.searchsorted(distinct, edge))
    if not 0 < at < len(distinct):
        return False
    return bool(distinct[at] - distinct[at - 1] < GAP * (distinct[-1] - distinct[0]))
