"""Laws of what a straight line lacks between two targets: it bends evenly, so it goes with squares of the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement

import numpy as np

from postproc.arrays import Array
from postproc.compensate.text.laws import APART, CANCELLING, STEEPEST, OffsetLaw
from postproc.compensate.text.values import UNCHANGED_MM
from postproc.rapid.data.records import Vec3

BEND_DECIMALS = 4
PAIRS = tuple(combinations_with_replacement("xyz", 2))


def squares_of(start: str, end: str, ways: Array) -> dict[str, Array]:
    """Squares [m^2] of the ways (n, 3) [mm], as RAPID writes them: of the length, and of the parts along the axes."""
    way = {axis: f"{start}.trans.{axis}-{end}.trans.{axis}" for axis in "xyz"}
    part = dict(zip("xyz", 1e-3 * ways.T, strict=True))
    found: dict[str, Array] = {f"Pow(Distance({start}.trans,{end}.trans)/1000,2)": 1e-6 * np.sum(ways**2, axis=1)}
    for a, b in PAIRS:
        term = f"Pow(({way[a]})/1000,2)" if a == b else f"({way[a]})*({way[b]})/1000000"
        found[term] = part[a] * part[b]
    return found


def fit_bend(squares: Mapping[str, Array], bent: Array, least: float) -> tuple[OffsetLaw, Array]:
    """What is off aside (n, 3) [mm] by squares of the ways, and what is left of it.

    The length does for ways in like directions; a square of axes has to take half of what is left.
    """

    def fitted(names: Sequence[str]) -> tuple[dict[str, Array], Array]:
        matrix = np.stack([squares[name] for name in names], axis=1)
        bends = np.round(np.linalg.lstsq(matrix, bent, rcond=APART)[0], BEND_DECIMALS)
        most = np.abs(matrix).max(axis=0)[:, None] * np.abs(bends)
        bends[most < UNCHANGED_MM] = 0.0
        steep = len(names) > 1 and most.max() > CANCELLING * np.abs(bent).max()
        steep = steep or is_steep(bends.tolist(), squares)
        return dict(zip(names, bends, strict=True)), np.full_like(bent, np.inf) if steep else bent - matrix @ bends

    best = fitted([next(iter(squares))])
    while np.abs(best[1]).max() > least and len(best[0]) < len(bent):
        more = [fitted([*best[0], name]) for name in squares if name not in best[0]]
        more.sort(key=lambda found: float(np.abs(found[1]).max()))
        if np.abs(more[0][1]).max() > np.abs(best[1]).max() / 2:
            break
        best = more[0]
    return OffsetLaw((0.0, 0.0, 0.0), tuple((name, _vec(bend)) for name, bend in best[0].items())), best[1]


def is_steep(bends: Sequence[Sequence[float]], squares: Mapping[str, Array]) -> bool:
    """Whether one millimetre of a longer way changes what squares of it add by more than any correction changes.

    Args:
        bends: what each square adds along the axes [mm / m^2]; squares: see ``squares_of``, the length first.
    """
    most = max((abs(value) for bend in bends for value in bend), default=0.0)
    return bool(squares) and 2e-3 * most * float(np.sqrt(next(iter(squares.values())).max())) > STEEPEST


def _vec(values: Array) -> Vec3:
    x, y, z = np.asarray(values).tolist()
    return x, y, z
