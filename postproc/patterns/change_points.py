"""Where what follows a signal breaks: steps, and such as take their time, kinks, ramps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.patterns.formula import Edge, Family, Pattern, family, together
from postproc.patterns.signals import Movable, Signal

STEPS, KINKS, FINE, KNOTS = 24, 9, 400, 150
GAP, GRID = 0.08, 1.5
"""Share of a channel's range in which nothing was measured: a step there is what any smooth function does as well,
unless all values are as far apart, but for so many times; a rail with nine stations has steps, too."""
FINEST = 2
"""How often places and widths of a smooth shape are tried closer by."""


def only(there: str, signal: Signal, elsewhere: str = "") -> tuple[str, str, str]:
    """How it is said of something else that it acts only there, only elsewhere, or there the other way."""
    is_ = f"where {signal.label} is"
    return f"only {is_} {there}", f"only {is_} {elsewhere or f'not {there}'}", f"the other way {is_} {there}"


def breaks(signal: Signal) -> Iterator[Pattern]:
    """Steps, kinks, and what grows on one side of a knot."""
    values = signal.values
    distinct = np.unique(values)
    across = [0.0] if values.min() < 0 < values.max() else []
    for edge in dict.fromkeys(gaps(distinct, [*np.quantile(values, np.linspace(0.04, 0.96, STEPS)), *across])):
        if _measured(distinct, edge):
            yield step(signal, edge)
    for knot in [*np.quantile(values, np.linspace(0.1, 0.9, KINKS)), *across]:
        yield _kink(signal, float(knot))
        for side in (1, -1) if distinct[0] < knot < distinct[-1] else ():
            yield _ramp(signal, float(knot), side)


def edges(values: Array, most: int = FINE) -> list[Edge]:
    """Neighbouring measured values between which a step can be seen."""
    distinct = np.unique(values)
    between = list(zip(distinct[:-1].tolist(), distinct[1:].tolist(), strict=True))
    return [e for e in between[:: max(1, -(-len(between) // most))] if _measured(distinct, e)]


def gaps(distinct: Array, places: Sequence[float] | Array) -> list[Edge]:
    """The neighbouring measured values between which each of some places lies."""
    at = np.clip(np.searchsorted(distinct, places), 1, len(distinct) - 1)
    return list(zip(distinct[at - 1].tolist(), distinct[at].tolist(), strict=True))


def knots(values: Array, most: int = KNOTS) -> list[float]:
    """Places of a knot: a step lies between two rows, a kink anywhere."""
    low, high = np.quantile(values, [0.02, 0.98])
    return [float(e) for e in np.linspace(low, high, most)]


def step(signal: Signal, edge: Edge, closer: Callable[[], Family] | None = None) -> Pattern:
    gate, finer = only("above {}", signal, "below {}"), closer or partial(_steps, signal)
    return Pattern(
        (signal,), f"step near {{}}{signal.of}", lambda x: above(x, *edge), "step", (edge,), None, finer, gate
    )


def above(x: Any, low: Any, high: Any) -> Any:
    return x > 0.5 * (low + high)


def _steps(signal: Signal) -> Family:
    """At many edges, and such as take their time."""
    widths = float(np.ptp(signal.values)) * np.geomspace(0.02, 0.3, 6)
    steps = family((signal,), above, lambda *edge: step(signal, edge), edges(signal.values)).settled()
    return together([steps, _rises(signal, product(knots(signal.values, 40), widths))])


def _rises(signal: Signal, some: Iterable[tuple[float, float]], fine: int = 0) -> Family:
    """Steps that take their time: friction that sets in, a seat that lets go."""
    return family((signal,), _rising, lambda centre, width: _rise(signal, centre, width, fine), some)


def _rising(x: Any, centre: Any, width: Any) -> Any:
    return np.tanh((x - centre) / width)


def _rise(signal: Signal, centre: float, width: float, fine: int) -> Pattern:
    def finer() -> Family:
        return _rises(signal, around(signal.values, centre, width, 40, fine), fine + 1)

    at = ((centre, centre), (2 * width, 2 * width))
    ways = Movable(centre, "knot", signal), Movable(width, "width", signal)
    form, move = f"rising about {{}}, over {{}}{signal.of}", finer if fine < FINEST else None
    return Pattern((signal,), form, lambda x: _rising(x, *ways), "step", at, finer=move)


def around(values: Array, centre: float, width: float, places: int, fine: int) -> list[tuple[float, float]]:
    """Centres and widths between those of a grid of so many places, a third of its steps apart, a ninth .."""
    low, high = np.quantile(values, [0.02, 0.98])
    share = np.linspace(-1.0, 1.0, 7) / 3.0**fine
    centres, widths = centre + (high - low) / places * share, width * 1.7**share
    return list(product(centres.tolist(), widths.tolist()))


def _kink(signal: Signal, knot: float) -> Pattern:
    def finer() -> Family:
        near = ((place,) for place in knots(signal.values))
        return family((signal,), _bent, partial(_kink, signal), near).settled()

    form, bend = f"kink near {{}}{signal.of}", Movable(knot, "knot", signal)
    return Pattern((signal,), form, lambda x: _bent(x, bend), "kink", ((knot, knot),), None, finer)


def _bent(x: Any, knot: Any) -> Any:
    return np.abs(x - knot)


def _ramp(signal: Signal, knot: float, side: int, power: int = 1) -> Pattern:
    """What grows from a knot on, or with the square: a rubber stop."""

    def finer() -> Family:
        near = product(knots(signal.values), (1, 2))
        one_sided = family((signal,), growing, lambda k, n: _ramp(signal, k, side, int(n)), near)
        return together([one_sided.settled(), _bows(signal)])

    def growing(x: Any, knot: Any, power: Any) -> Any:
        grown = np.maximum((x - knot) * side, 0.0)
        return grown if np.ndim(power) == 0 and power == 1 else grown**power

    over = ("below {}" if side < 0 else "above {}") + (", with the square" if power > 1 else "")
    gate = only(f"{over}, growing", signal)[:1]
    form, at, bend = f"growing {over}{signal.of}", ((knot, knot),), Movable(knot, "knot", signal)
    return Pattern((signal,), form, lambda x: growing(x, bend, power), "ramp", at, None, finer, gate)


def bow(signal: Signal, knot: float) -> Pattern:
    """The square of the distance from a value."""
    form, bend = f"growing to either side of {{}}, with the square{signal.of}", Movable(knot, "knot", signal)
    return Pattern((signal,), form, lambda x: _bowed(x, bend), "curve", ((knot, knot),), None, partial(_bows, signal))


def _bows(signal: Signal) -> Family:
    return family((signal,), _bowed, partial(bow, signal), ((place,) for place in knots(signal.values))).settled()


def _bowed(x: Any, knot: Any) -> Any:
    return (x - knot) ** 2


def nearest(places: list[Edge], edge: Edge) -> list[Edge]:
    """The places next to an edge, as far as the neighbouring one of 36 and ten at most."""
    at = int(np.searchsorted([e[0] for e in places], edge[0]))
    reach = min(max(2, len(places) // 18), 10)
    return places[max(0, at - reach) : at + reach]


def _measured(distinct: Array, edge: Edge) -> bool:
    apart = edge[1] - edge[0]
    return bool(apart < GAP * (distinct[-1] - distinct[0]) or apart < GRID * np.median(np.diff(distinct)))
