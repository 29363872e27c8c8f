"""Patterns of two channels together: products, and waves whose size is another channel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.identify.cycles import EIGHTHS, GEAR, LOW
from postproc.identify.shapes import Pattern, unit


def of_two(first: str, a: Array, second: str, b: Array) -> Iterator[Pattern]:
    text = f"{first} times {second}"
    names = (first, second)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        return (_line(first, a), second), (_line(second, b), first)

    yield Pattern(names, text, unit(a * b), "product", factors=factors)
    yield Pattern(names, text, unit((a - a.mean()) * (b - b.mean())), "product", factors=factors)
    if first[0] == second[0] == "q":
        for k in LOW:
            for j in LOW:
                for f, g in ((np.sin, np.sin), (np.sin, np.cos), (np.cos, np.sin), (np.cos, np.cos)):
                    form = f"wave of {first}, {k} times a turn, times one of {second}, {j} times a turn"
                    yield Pattern(names, form, f(k * a) * g(j * b), "product of waves")
    elif first[0] == "q" and second not in ("x", "y", "z"):
        # A gear's line of any order may grow with a load; what tilts or bends does so with the angle itself.
        # Where a channel hardly leaves one side, its part that does not change is a wave of its own.
        sizes = (b, b - b.mean()) if abs(b.mean()) > 0.3 * b.std() else (b,)
        for k in range(1, GEAR + 1):
            for phase in (0.0, np.pi / 2):
                for size in sizes:
                    yield _swelling(names, a, unit(size), k, phase)
    for sign, size, order in ((a, b, names), (b, a, names[::-1])):
        if order[0].startswith(("dir", "v")) and order[1].startswith("load"):
            value = unit(np.sign(sign) * np.abs(size))
            yield Pattern(order, f"side of {order[0]} times size of {order[1]}", value, "product")


def _swelling(names: tuple[str, str], angle: Array, size: Array, order: float, phase: float) -> Pattern:
    """A wave of an angle whose size is another channel: low ones anywhere, a gear's lines at its own joint."""
    where = None if order <= max(LOW) else f"joint {names[0][1:]}"

    def finer() -> list[Pattern]:
        # Less than a wave a turn is hardly more than the other channel alone.
        orders = np.arange(1.0, 4.01, 0.25) if where is None else order + 0.25 * np.arange(-2, 3)
        some = [_swelling(names, angle, size, k, p) for k in orders for p in EIGHTHS]
        return [replace(p, where=where, finer=None) for p in some]

    value = np.asarray(np.cos(order * angle - phase), dtype=np.float64)

    def factors() -> tuple[tuple[Pattern, str], ...]:
        wave = Pattern(names[:1], f"wave {order:.3g} times a turn", value, "wave")
        return (wave, names[1]), (_line(names[1], size), names[0])

    text, kind = f"{names[1]} times a wave of {names[0]}, {order:.3g} times a turn", "swelling wave"
    return Pattern(names, text, value * size, kind, where=where, finer=finer, factors=factors)


def _line(name: str, values: Array) -> Pattern:
    return Pattern((name,), "proportional", unit(values), "line")
