"""Shapes of one channel without a physical name: lines, steps, kinks, ramps, windows, bumps, settling."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import shown, within

STEPS, KINKS = 24, 9
GAP = 0.08
"""Share of a channel's range in which nothing was measured: a step there is what any smooth function does as well."""
FINE, KNOTS = 400, 150
CLOSER = 4.0
"""As much less likely is one of the many finer places of a pattern: neighbours are hardly different."""

Edge = tuple[float, float]
"""Between which values an edge lies."""


@dataclass(frozen=True)
class Pattern:
    """A function of channels, (n,) values without physical unit.

    Args:
        channels: names; form: what it looks like, such as ``step near {}``, with a place for each of its edges.
        kind: patterns of one kind are as likely as those of any other, however many there are.
        at: its edges, knots, ..; of: the channel whose unit they have.
        where: the only place at which it makes sense, None for all.
        finer: makes the same with its edge, knot, period or phase at many finer places.
        gate: how it is said of something else that acts only there, only elsewhere, and there the other way round.
        factors: makes what it is a product of, each with the channel that may switch it.
        tries: how many times as many as of its kind were tried.
    """

    channels: tuple[str, ...]
    form: str
    values: Array
    kind: str = ""
    at: tuple[Edge, ...] = ()
    of: str = ""
    where: str | None = None
    finer: Callable[[], list[Pattern]] | None = field(default=None, repr=False, compare=False)
    gate: tuple[str, ...] = ()
    factors: Callable[[], tuple[tuple[Pattern, str], ...]] | None = field(default=None, repr=False, compare=False)
    tries: float = 1.0

    @property
    def text(self) -> str:
        return self.told()

    def told(self, alike: Sequence[Pattern] = ()) -> str:
        """What it looks like, its edges no closer than patterns that do the same have theirs."""
        if not self.at:
            return self.form
        every = np.array([p.at for p in (self, *alike) if p.form == self.form]).reshape(-1, len(self.at), 2)
        spans = (within(self.of, float(e[:, 0].min()), float(e[:, 1].max())) for e in every.transpose(1, 0, 2))
        return self.form.format(*spans)


def only(there: str, elsewhere: str = "") -> tuple[str, str, str]:
    """How it is said of a gate's channel that something acts only there, only elsewhere, or there the other way."""
    elsewhere = elsewhere or f"not {there}"
    return f"only where {{0}} is {there}", f"only where {{0}} is {elsewhere}", f"the other way where {{0}} is {there}"


def sharper(pattern: Pattern) -> list[Pattern]:
    """The same with its edge, knot, period or phase at many finer places; none where nothing can be moved."""
    return [] if pattern.finer is None else pattern.finer()


def of_channel(name: str, values: Array) -> Iterator[Pattern]:
    """All shapes of one channel but those that repeat."""
    distinct = np.unique(values)
    if len(distinct) <= 4:
        # Approach sides, payloads, sessions: their own value, and being one of them.
        yield Pattern((name,), "proportional", values, "line")
        if len(distinct) > 2:
            # Every way to split them in two; of four, the halves as well.
            pairs = [distinct[[0, k]] for k in (1, 2, 3)] if len(distinct) == 4 else []
            for some in [*distinct[:, None], *pairs]:
                inside = np.isin(values, some).astype(float)
                form = f"at {' or '.join(shown(name, float(value)) for value in some)}"
                yield Pattern((name,), form, inside, "level", gate=only(form))
        return
    centre, half = float(np.median(values)), 0.5 * float(np.ptp(values))
    scaled = (values - centre) / half
    yield Pattern((name,), "proportional", scaled, "line")
    yield Pattern((name,), "curved", scaled**2, "curve")
    yield Pattern((name,), "s-shaped", scaled**3, "curve")
    if values.min() < 0 < values.max():
        signed = unit(values * np.abs(values))
        yield Pattern((name,), "with the square of its size, by its side", signed, "curve")
    yield from breaks(name, values)
    if name == "time":
        since = (values - values.min()) / max(float(np.ptp(values)), 1e-300)
        for share in (0.05, 0.1, 0.2, 0.4):
            yield _settling(name, since, share, 2 * half)
    span = np.quantile(values, np.linspace(0.04, 0.96, STEPS))
    for k in range(1, STEPS - 2, 2):
        for width in (2, 4, 8, 14):
            if k + width < STEPS:
                yield _window(name, values, gap(distinct, span[k]), gap(distinct, span[k + width]))


def breaks(name: str, values: Array) -> Iterator[Pattern]:
    """Steps, kinks, and what grows on one side of a knot."""
    distinct = np.unique(values)
    across = [0.0] if values.min() < 0 < values.max() else []
    for place in [*np.quantile(values, np.linspace(0.04, 0.96, STEPS)), *across]:
        edge = gap(distinct, place)
        if _measured(distinct, edge):
            yield _step(name, values, edge)
    for knot in [*np.quantile(values, np.linspace(0.1, 0.9, KINKS)), *across]:
        yield _kink(name, values, float(knot))
        for side in (1, -1):
            yield _ramp(name, values, float(knot), side)


def of_sum(pattern: Pattern, names: tuple[str, ...], label: str) -> Pattern:
    """A shape of a sum of channels that the label spells out."""
    return renamed(pattern, f" of {label}", names)


def of_size(name: str, values: Array) -> Iterator[Pattern]:
    """Shapes of the size of a channel that goes both ways: angles, speeds, accelerations, loads.

    What grows from a size on may do so to the same side, or each way to its own: stops, free play.
    """
    if name[0] in "qval" and values.min() < 0 < values.max():
        for pattern in of_channel(name, np.abs(values)):
            yield renamed(pattern, " of its size", (name,))
            if pattern.kind == "ramp":
                yield _sided(renamed(pattern, " of its size, by its side", (name,)), np.sign(values))


def _sided(pattern: Pattern, side: Array) -> Pattern:
    finer = None if pattern.finer is None else lambda: [_sided(p, side) for p in sharper(pattern)]
    return replace(pattern, values=pattern.values * side, finer=finer, gate=())


def renamed(pattern: Pattern, suffix: str, names: tuple[str, ...]) -> Pattern:
    """The same of other channels, with more said about it."""
    finer = None if pattern.finer is None else lambda: [renamed(p, suffix, names) for p in sharper(pattern)]
    gate = tuple(f"{how} in size" for how in pattern.gate)
    return replace(pattern, channels=names, form=pattern.form + suffix, finer=finer, gate=gate)


def unit(values: Array) -> Array:
    """Values by their largest size."""
    return np.asarray(values / max(float(np.abs(values).max()), 1e-300), dtype=np.float64)


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


def _step(name: str, values: Array, edge: Edge) -> Pattern:
    def finer() -> list[Pattern]:
        widths = [float(np.ptp(values)) * share for share in np.geomspace(0.02, 0.3, 6)]
        rises = [_rise(name, values, e, w) for e in knots(values, 40) for w in widths]
        return [replace(_step(name, values, e), finer=None) for e in edges(values)] + rises

    above = (values >= edge[1]).astype(float)
    return Pattern((name,), "step near {}", above, "step", (edge,), name, None, finer, only("above {}", "below {}"))


def _rise(name: str, values: Array, centre: float, width: float) -> Pattern:
    """A step that takes its time: friction that sets in, a seat that lets go."""
    at = ((centre, centre), (2 * width, 2 * width))
    value = np.asarray(np.tanh((values - centre) / width), dtype=np.float64)
    return Pattern((name,), "rising about {}, over {}", value, "step", at, name)


def _kink(name: str, values: Array, knot: float) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_kink(name, values, e), finer=None) for e in knots(values)]

    return Pattern((name,), "kink near {}", unit(np.abs(values - knot)), "kink", ((knot, knot),), name, None, finer)


def _ramp(name: str, values: Array, knot: float, side: int) -> Pattern:
    def finer() -> list[Pattern]:
        return [replace(_ramp(name, values, e, side), finer=None) for e in knots(values)]

    over = "above {}" if side > 0 else "below {}"
    value = unit(np.maximum(side * (values - knot), 0.0))
    at = ((knot, knot),)
    return Pattern((name,), f"growing {over}", value, "ramp", at, name, None, finer, only(f"{over}, growing")[:1])


def _settling(name: str, since: Array, share: float, whole: float) -> Pattern:
    def finer() -> list[Pattern]:
        shares = np.geomspace(0.01, 3.0, 60)
        return [replace(_settling(name, since, float(s), whole), finer=None) for s in shares]

    within_ = (share * whole, share * whole)
    return Pattern((name,), "settling within {}", np.exp(-since / share), "settling", (within_,), name, None, finer)


def _window(name: str, values: Array, low: Edge, high: Edge, exact: bool = False) -> Pattern:
    def close() -> list[Pattern]:
        between = edges(values, len(values))
        lows, highs = (_nearest(between, edge) for edge in (low, high))
        return [replace(_window(name, values, a, b, True), finer=None) for a in lows for b in highs if a < b]

    def finer() -> list[Pattern]:
        some = edges(values, 36)
        windows = [_window(name, values, a, b, True) for i, a in enumerate(some) for b in some[i + 1 :]]
        widths = [float(np.ptp(values)) * share for share in np.geomspace(0.01, 0.2, 7)]
        return windows + [_bump(name, values, e, w) for e in knots(values, 60) for w in widths]

    inside = ((values >= low[1]) & (values <= high[0])).astype(float)
    sides = only("between {} and {}")
    at, move = (low, high), close if exact else finer
    return Pattern((name,), "only between {} and {}", inside, "window", at, name, None, move, sides)


def _nearest(places: list[Edge], edge: Edge) -> list[Edge]:
    """The places next to an edge, as far as the neighbouring one of 36 and ten at most."""
    at = int(np.searchsorted([e[0] for e in places], edge[0]))
    reach = min(max(2, len(places) // 18), 10)
    return places[max(0, at - reach) : at + reach]


def _bump(name: str, values: Array, centre: float, width: float) -> Pattern:
    value = np.asarray(np.exp(-0.5 * ((values - centre) / width) ** 2), dtype=np.float64)
    at, near = ((centre, centre), (2 * width, 2 * width)), "near {}, {} wide"
    return Pattern((name,), f"bump {near}", value, "window", at, name, gate=only(near)[:1])


def _measured(distinct: Array, edge: Edge) -> bool:
    return bool(edge[1] - edge[0] < GAP * (distinct[-1] - distinct[0]))
