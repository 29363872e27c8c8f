"""Patterns of the table's own columns with few values: tools, docks, shifts, reflectors, in words or numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import shown
from postproc.fit.words.wording import joined
from postproc.patterns.change_points import only
from postproc.patterns.formula import Pattern
from postproc.patterns.signals import Signal

MOST = 12
"""Values of a column that may each have a shift of its own."""


def words(signals: Mapping[str, Signal]) -> dict[str, list[Signal]]:
    """The columns that hold words: for each word where it stands, as the table is read (``shift=night``)."""
    found: dict[str, list[Signal]] = {}
    for name, signal in signals.items():
        column, sign, word = name.partition("=")
        if sign and set(np.unique(signal.values)) <= {0.0, 1.0}:
            found.setdefault(column, []).append(replace(signal, names=(column,), unit="", label=word))
    return found


def of_words(column: Sequence[Signal]) -> Iterator[Pattern]:
    """Each word, of two the first, and a shift for every one of them; cells that are empty are one, too."""
    nothing = 1 - np.sum([s.values for s in column], axis=0)
    if nothing.any():
        code = f"(1 - {' - '.join(s.code for s in column)})"
        column = [*column, replace(column[0], values=nothing, code=code, label="empty")]
    for signal in column[:1] if len(column) == 2 else column:
        form = f"where {signal.name} is {signal.label}"
        gate = only(signal.label, replace(signal, label=signal.name))
        yield Pattern((signal,), form, lambda x: x, "level", gate=gate, label=form)
    if len(column) > 2:
        form = f"another value at each of {joined([s.label for s in column])}"
        yield Pattern(tuple(column[1:]), form, lambda *x: list(x), "levels", wide=True)


def of_few(signal: Signal) -> Iterator[Pattern]:
    """A shift for each of a few numbers that a column holds, all of them more than once."""
    distinct, count = np.unique(signal.values, return_counts=True)
    if 2 < len(distinct) <= MOST and count.min() > 1:
        form = f"another value at each of {joined([shown(signal.unit, float(v)) for v in distinct])}"
        yield Pattern(
            (signal,), form, lambda x: [_at(x, distinct, k) for k in range(1, len(distinct))], "levels", wide=True
        )


def _at(x: Any, distinct: Array, k: int) -> Any:
    near = 0.5 * float(np.diff(distinct).min())
    return np.abs(x - float(distinct[k])) < near
