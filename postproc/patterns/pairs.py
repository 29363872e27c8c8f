"""Patterns of two signals together: products, and waves whose size is another channel."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import shown
from postproc.patterns.cycles import EIGHTHS, GEAR, LOW, comes_again, crest, each, neighbours, periods, turns
from postproc.patterns.formula import Pattern
from postproc.patterns.shapes import FINEST, levels, line
from postproc.patterns.signals import Signal

SWAYED = ("q", "dir", "payload", "x", "y", "z")
"""Channels that may be the size of what comes again in time or along a column of the table's own."""


def of_two(first: Signal, second: Signal) -> Iterator[Pattern]:
    a, b = float(first.values.mean()), float(second.values.mean())
    text, both = f"{first.name} times {second.name}", (first, second)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        pairs = ((first, second.name), (second, first.name))
        return tuple((part, other) for one, other in pairs for part in (line(one), *levels(one)))

    yield Pattern(both, text, lambda x, y: x * y, "product", factors=factors)
    about = f"{text}, counted from {shown(first.unit, a)} and {shown(second.unit, b)}"
    yield Pattern(both, about, lambda x, y: (x - a) * (y - b), "product", factors=factors)
    if first.name[0] == second.name[0] == "q":
        for k in LOW:
            for j in LOW:
                for p in (0.0, np.pi / 2):
                    for r in (0.0, np.pi / 2):
                        yield _waves(first, second, (k, j), (p, r))
    elif first.name[0] == "q" and second.name not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        yield from swelling(first, second, range(1, GEAR + 1))
    for side, size in ((first, second), (second, first)):
        if comes_again(side) and size.name.rstrip("123456") in SWAYED:
            yield from swelling(side, size, periods(side))
        if side.name.startswith(("dir", "v")) and size.name.startswith("load"):
            form = f"side of {side.name} times size of {size.name}"
            yield Pattern((side, size), form, lambda x, y: np.sign(x) * np.abs(y), "product")


def swelling(angle: Signal, size: Signal, orders: Iterable[float]) -> Iterator[Pattern]:
    """Waves of an angle, of a sum of some or of what comes again otherwise, whose size is another channel."""
    middle = float(size.values.mean())
    # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
    for mean in (0.0, middle) if abs(middle) > 0.3 * size.values.std() else (0.0,):
        part = line(size, mean)
        for order in orders:
            for phase in (0.0, np.pi / 2):
                yield _swelling(angle, part, order, phase)


def _waves(
    first: Signal, second: Signal, orders: tuple[float, float], phases: tuple[float, float], fine: int = 0
) -> Pattern:
    """Two waves, one times the other."""
    (k, j), (p, r) = orders, phases

    def finer() -> list[Pattern]:
        some = [_near(phase, fine) for phase in phases]
        return [_waves(first, second, orders, (s, t), fine + 1) for s in some[0] for t in some[1]]

    def law(x: Any, y: Any) -> Any:
        return np.cos(k * x - p) * np.cos(j * y - r)

    waves = (f"{s.name}, {o} times a turn {crest(s, o, q)}" for s, o, q in ((first, k, p), (second, j, r)))
    form = f"wave of {', times one of '.join(waves)}"
    return Pattern((first, second), form, law, "product of waves", finer=finer if fine <= FINEST else None)


def _near(phase: float, fine: int) -> Array:
    """Phases all around, then closer by."""
    return np.asarray(phase + EIGHTHS[1] / 4**fine * np.arange(-2, 3) if fine else EIGHTHS)


def _swelling(angle: Signal, part: Pattern, order: float, phase: float, fine: int = 0) -> Pattern:
    """A wave of an angle whose size is the line of another channel: low ones anywhere, a gear's at its own joint."""
    [size] = part.signals
    where = None if order <= max(LOW) or not turns(angle) else f"joint {angle.name[1:]}"

    def finer() -> list[Pattern]:
        # Less than a wave a turn is hardly more than the other channel alone.
        low = np.arange(1.0, 4.01, 0.25) if turns(angle) else neighbours(angle.values, order)
        orders = low if where is None else order + 0.25 * np.arange(-2, 3)
        if fine:
            orders = order + (neighbours(angle.values, order) - order) / 4**fine
        some = [_swelling(angle, part, k, p, fine + 1) for k in orders for p in _near(phase, fine)]
        return [replace(p, where=where) for p in some]

    wave = Pattern(
        (angle,), f"wave {each(angle, order)} {crest(angle, order, phase)}", lambda x: np.cos(order * x - phase)
    )

    def law(x: Any, y: Any) -> Any:
        return wave.law(x) * part.law(y)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        return (wave, size.name), (part, angle.name)

    form = f"{part.named} times a wave of {angle.label}, {wave.form.removeprefix('wave ')}"
    kind = "swelling wave" if turns(angle) else "swelling sway"
    return Pattern(
        (angle, size), form, law, kind, where=where, finer=finer if fine <= FINEST else None, factors=factors
    )
