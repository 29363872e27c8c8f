"""Patterns of two signals together: products, and waves whose size is another channel."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.fit.channels import shown
from postproc.patterns.cycles import EIGHTHS, GEAR, LOW, crest
from postproc.patterns.formula import Pattern
from postproc.patterns.shapes import levels, line
from postproc.patterns.signals import Signal


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
        if side.name.startswith(("dir", "v")) and size.name.startswith("load"):
            form = f"side of {side.name} times size of {size.name}"
            yield Pattern((side, size), form, lambda x, y: np.sign(x) * np.abs(y), "product")


def swelling(angle: Signal, size: Signal, orders: Iterable[int]) -> Iterator[Pattern]:
    """Waves of an angle, or of a sum of some, whose size is another channel."""
    middle = float(size.values.mean())
    # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
    for mean in (0.0, middle) if abs(middle) > 0.3 * size.values.std() else (0.0,):
        for order in orders:
            for phase in (0.0, np.pi / 2):
                yield _swelling(angle, size, mean, order, phase)


def _waves(first: Signal, second: Signal, orders: tuple[float, float], phases: tuple[float, float]) -> Pattern:
    """Two waves, one times the other."""
    (k, j), (p, r) = orders, phases

    def finer() -> list[Pattern]:
        return [replace(_waves(first, second, orders, (s, t)), finer=None) for s in EIGHTHS for t in EIGHTHS]

    def law(x: Any, y: Any) -> Any:
        return np.cos(k * x - p) * np.cos(j * y - r)

    waves = (f"{s.name}, {o} times a turn {crest(s, o, q)}" for s, o, q in ((first, k, p), (second, j, r)))
    form = f"wave of {', times one of '.join(waves)}"
    return Pattern((first, second), form, law, "product of waves", finer=finer)


def _swelling(angle: Signal, size: Signal, mean: float, order: float, phase: float) -> Pattern:
    """A wave of an angle whose size is another channel: low ones anywhere, a gear's lines at its own joint."""
    where = None if order <= max(LOW) else f"joint {angle.name[1:]}"

    def finer() -> list[Pattern]:
        # Less than a wave a turn is hardly more than the other channel alone.
        orders = np.arange(1.0, 4.01, 0.25) if where is None else order + 0.25 * np.arange(-2, 3)
        some = [_swelling(angle, size, mean, k, p) for k in orders for p in EIGHTHS]
        return [replace(p, where=where, finer=None) for p in some]

    wave = Pattern(
        (angle,), f"wave {order:.3g} times a turn {crest(angle, order, phase)}", lambda x: np.cos(order * x - phase)
    )
    part = line(size, mean)

    def law(x: Any, y: Any) -> Any:
        return wave.law(x) * part.law(y)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        return (wave, size.name), (part, angle.name)

    form = f"{part.named} times a wave of {angle.label}, {wave.form.removeprefix('wave ')}"
    return Pattern((angle, size), form, law, "swelling wave", where=where, finer=finer, factors=factors)
