"""Patterns of two signals together: products, and waves whose size is another channel."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import shown
from postproc.patterns.change_points import FINEST
from postproc.patterns.formula import Family, Pattern, family
from postproc.patterns.harmonics import (
    EIGHTHS,
    GEAR,
    LOW,
    comes_again,
    cosine,
    crest,
    each,
    neighbours,
    periods,
    told_apart,
    turns,
    ways_of,
)
from postproc.patterns.shapes import levels, line
from postproc.patterns.signals import Signal

SWAYED = ("q", "dir", "payload", "x", "y", "z")
"""Channels that may be the size of what comes again in time or along a column of the table's own."""


def of_two(first: Signal, second: Signal) -> Iterator[Pattern | Family]:
    a, b = float(first.values.mean()), float(second.values.mean())
    text, both = f"{first.name} times {second.name}", (first, second)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        pairs = ((first, second.name), (second, first.name))
        return tuple((part, other) for one, other in pairs for part in (line(one), *levels(one)))

    yield Pattern(both, text, lambda x, y: x * y, "product", factors=factors)
    about = f"{text}, counted from {shown(first.unit, a)} and {shown(second.unit, b)}"
    yield Pattern(both, about, lambda x, y: (x - a) * (y - b), "product", factors=factors)
    if first.name[0] == second.name[0] == "q":
        yield _waves(first, second, product(LOW, LOW, *((0.0, np.pi / 2),) * 2))
    elif first.name[0] == "q" and second.name not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        yield from swelling(first, second, range(1, GEAR + 1))
    for side, size in ((first, second), (second, first)):
        if comes_again(side) and size.name.rstrip("123456") in SWAYED:
            yield from swelling(side, size, periods(side))
        if side.name.startswith(("dir", "v")) and size.name.startswith("load"):
            form = f"side of {side.name} times size of {size.name}"
            yield Pattern((side, size), form, lambda x, y: np.sign(x) * np.abs(y), "product")


def swelling(angle: Signal, size: Signal, orders: Iterable[float]) -> Iterator[Family]:
    """Waves of an angle, of a sum of some or of what comes again otherwise, whose size is another channel.

    Low ones anywhere, a gear's at its own joint.
    """
    middle, every = float(size.values.mean()), list(product(told_apart(angle, orders), (0.0, np.pi / 2)))
    low = [(order, phase) for order, phase in every if order <= max(LOW) or not turns(angle)]
    # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
    for mean in (0.0, middle) if abs(middle) > 0.3 * size.values.std() else (0.0,):
        for where, some in ((None, low), (f"joint {angle.name[1:]}", every[len(low) :])):
            if some:
                yield _swell(angle, line(size, mean), some, where)


def _waves(first: Signal, second: Signal, some: Iterable[tuple[float, float, float, float]], fine: int = 0) -> Family:
    """Two waves, one times the other, of some orders and phases."""
    both = (first, second)
    return family(both, _crossed, lambda k, j, p, r: _wave(first, second, (k, j), (p, r), fine), some)


def _crossed(x: Any, y: Any, k: Any, j: Any, p: Any, r: Any) -> Any:
    return cosine(x, k, p) * cosine(y, j, r)


def _wave(
    first: Signal, second: Signal, orders: tuple[float, float], phases: tuple[float, float], fine: int
) -> Pattern:
    def finer() -> Family:
        near = product(*([order] for order in orders), *(_near(phase, fine) for phase in phases))
        return _waves(first, second, near, fine + 1)

    each_ = zip((first, second), orders, phases, strict=True)
    waves = (f"{s.name}, {o:g} times a turn {crest(s, o, p)}" for s, o, p in each_)
    form = f"wave of {', times one of '.join(waves)}"
    move = finer if fine <= FINEST else None
    ((k, p), (j, r)) = (ways_of(*way) for way in zip((first, second), orders, phases, strict=True))
    return Pattern((first, second), form, lambda x, y: _crossed(x, y, k, j, p, r), "product of waves", finer=move)


def _near(phase: float, fine: int) -> Array:
    """Phases all around, then closer by."""
    return np.asarray(phase + EIGHTHS[1] / 4**fine * np.arange(-2, 3) if fine else EIGHTHS)


def _swell(
    angle: Signal, part: Pattern, some: Iterable[tuple[float, float]], where: str | None, fine: int = 0
) -> Family:
    """Waves of an angle, of some orders and phases, whose size is the line of another channel."""

    def law(x: Any, y: Any, order: Any, phase: Any) -> Any:
        return cosine(x, order, phase) * part.law(y)

    both = (angle, part.signals[0])
    return family(both, law, lambda order, phase: _swelling(angle, part, order, phase, where, fine), some)


def _swelling(angle: Signal, part: Pattern, order: float, phase: float, where: str | None, fine: int) -> Pattern:
    [size] = part.signals

    def finer() -> Family:
        # Less than a wave a turn is hardly more than the other channel alone.
        low = np.arange(1.0, 4.01, 0.25) if turns(angle) else neighbours(angle, order)
        orders = low if where is None else order + 0.25 * np.arange(-2, 3)
        if fine:
            orders = order + (neighbours(angle, order) - order) / 4**fine
        return _swell(angle, part, product(orders, _near(phase, fine)), where, fine + 1)

    ways = ways_of(angle, order, phase)
    wave = Pattern((angle,), f"wave {each(angle, order)} {crest(angle, order, phase)}", lambda x: cosine(x, *ways))

    def law(x: Any, y: Any) -> Any:
        return wave.law(x) * part.law(y)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        return (wave, size.name), (part, angle.name)

    form = f"{part.named} times a wave of {angle.label}, {wave.form.removeprefix('wave ')}"
    kind = "swelling wave" if turns(angle) else "swelling sway"
    return Pattern(
        (angle, size), form, law, kind, where=where, finer=finer if fine <= FINEST else None, factors=factors
    )
