"""Parameters of an effect declared as data: value, unit, bounds, ordinary size and the value at which it vanishes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

Number = float | Sequence[float]
META = "postproc"
XYZ = ("x", "y", "z")
"""Labels of the numbers of a vector."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number or an array that a fit may move.

    Args:
        unit: SI unit, ``"rad/(N m)"``; ``"1"`` for a pure number. The name of the field ends in it: ``.._rad_per_Nm``.
        shape: lengths; a word is the length (or the value) of the structural field of that name.
        low, high: bounds; typical: ordinary size, which also scales the fit.
        least: lowest value that an arm can have, where a fit may scatter below it: a spring that data does not see.
        most: how far from null an arm can be, in ordinary sizes of such an arm: a diagnosis names nothing beyond.
        null: value at which the effect vanishes.
        amplitude: False for a parameter that only forms the effect (a knee, a point): its value says nothing
            while the amplitudes are null.
        labels: names of the entries along the last axis; numbers from 1 where none are given.
    """

    unit: str = ""
    shape: tuple[int | str, ...] = ()
    low: Number = -np.inf
    high: Number = np.inf
    typical: Number = 1.0
    null: Number = 0.0
    amplitude: bool = True
    labels: tuple[str, ...] = ()
    least: Number = -np.inf
    most: float = np.inf


@dataclass(frozen=True, slots=True)
class Structure:
    """A choice that is searched, not fitted: a harmonic order, a body, a law.

    Args:
        low, high: range of the number (of every number of a tuple).
        choices: the allowed words, for a choice among words.
    """

    low: float = -np.inf
    high: float = np.inf
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Layout:
    """What is declared for every entry of an effect's vector: (p,) arrays, parameters one after another.

    Args:
        parts: where each parameter stands, and its shape. parameter: number of the one that an entry belongs to; the
            others as in `Parameter`.
    """

    parts: tuple[tuple[slice, tuple[int, ...]], ...]
    parameter: NDArray[np.int_]
    low: Array
    high: Array
    typical: Array
    null: Array
    amplitude: NDArray[np.bool_]
    least: Array
    most: Array


def param(
    *,
    unit: str = "",
    shape: int | str | tuple[int | str, ...] = (),
    low: Number = -np.inf,
    high: Number = np.inf,
    typical: Number = 1.0,
    null: Number = 0.0,
    amplitude: bool = True,
    labels: tuple[str, ...] = (),
    least: Number = -np.inf,
    most: float = np.inf,
) -> Any:
    """Declare a parameter of an effect (see `Parameter`); its default value is the null value."""
    lengths = shape if isinstance(shape, tuple) else (shape,)
    meta = Parameter(unit, lengths, low, high, typical, null, amplitude, labels, least, most)
    return dataclasses.field(default=None, metadata={META: meta})


def structure(default: Any, *, low: float = -np.inf, high: float = np.inf, choices: tuple[str, ...] = ()) -> Any:
    """Declare a structural choice of an effect (see `Structure`): a number, a word, or a tuple of numbers."""
    return dataclasses.field(default=default, metadata={META: Structure(low, high, choices)})


def unit_suffix(unit: str) -> str:
    """Return the ending of a parameter's name for a unit: ``_rad_per_Nm`` for ``rad/(N m)``, empty for ``1``."""
    over, _, under = unit.replace(" ", "").replace("^", "").replace("(", "").replace(")", "").partition("/")
    words = [w for w in ("" if over == "1" else over, f"per_{under}" if under else "") if w]
    return "".join(f"_{w}" for w in words)


def broadcast(value: Number, shape: tuple[int, ...]) -> Array:
    """Return an array of a parameter's shape, filled with one number or with numbers along its last axis."""
    array = np.asarray(value, dtype=float)
    return array if array.shape == shape else np.full(shape, array)


@cache
def layout_of(effect: Any, shapes: tuple[tuple[int, ...], ...]) -> Layout:
    """Return the layout of an effect class whose parameters have these shapes, in the order of declaration."""
    declared = effect.parameters().values()

    def spread(values: Iterable[Number]) -> Array:
        """Return one value a parameter, spread over all its entries, as a read-only vector (p,)."""
        parts = [broadcast(value, shape).ravel() for value, shape in zip(values, shapes, strict=True)]
        vector = np.concatenate([np.zeros(0), *parts])
        vector.setflags(write=False)
        return vector

    ends = np.cumsum([0, *map(math.prod, shapes)])
    return Layout(
        tuple((slice(a, b), shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)),
        spread(range(len(declared))).astype(int),
        spread(p.low for p in declared),
        spread(p.high for p in declared),
        spread(p.typical for p in declared),
        spread(p.null for p in declared),
        spread(float(p.amplitude) for p in declared) > 0.5,
        spread(p.least for p in declared),
        spread(p.most for p in declared),
    )
