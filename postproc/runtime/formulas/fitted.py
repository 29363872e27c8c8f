"""What is no sum of closed forms: a displacement of the flange, fitted by products of sines and cosines of angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from postproc.arrays import Array
from postproc.runtime.formulas.formula import ANGLES
from postproc.runtime.formulas.tape import Scalar, cosine, given, scalar, sine, total

HARMONICS = (1, 2)
FACTORS = 3
AT_ONCE = 8
TURN_M = 1.0
"""Lever [m] at which a rotation counts beside a translation."""

Wave = tuple[int, str, int]
"""Joint (from 0), ``Sin`` or ``Cos``, multiple of the angle."""
Term = tuple[Wave, ...]


@dataclass(frozen=True)
class Fitted:
    """A displacement (6,) [m, rad] as a sum of terms, each a product of waves.

    Args:
        terms: m products. weights: (m, 6).
    """

    terms: tuple[Term, ...]
    weights: Array

    def formulas(self) -> tuple[Scalar, ...]:
        """(6,) as formulas of the joint angles."""
        waves = {(j, k): given(ANGLES[j]) * float(k) for term in self.terms for j, _, k in term}
        every = {
            wave: (sine if wave[1] == "Sin" else cosine)(waves[wave[0], wave[2]])
            for term in self.terms
            for wave in term
        }
        products = []
        for term in self.terms:
            result = scalar(1.0)
            for wave in term:
                result = result * every[wave]
            products.append(result)
        columns = self.weights.T.tolist()
        return tuple(total(x * w for x, w in zip(products, column, strict=True)) for column in columns)


def fit(q: Array, wanted: Array, most: int, enough: float) -> Fitted:
    """Select terms one after another, those that go best with what is left (orthogonal matching pursuit).

    Pati, Rezaiifar and Krishnaprasad (1993).

    Args:
        q: (n, 6) [rad]. wanted: (n, 6) [m, rad]. most: number of terms. enough: largest residual that is left [m].
    """
    terms = _terms(q)
    columns = np.stack([_column(term, q) for term in terms], axis=1)
    length = np.linalg.norm(columns, axis=0)
    scaled = wanted * np.array([1.0] * 3 + [TURN_M] * 3)
    chosen: list[int] = []
    left, weights = scaled, np.zeros((0, 6))
    while len(chosen) < min(most, len(terms)) and np.abs(left).max(initial=0.0) > enough:
        score = np.linalg.norm(columns.T @ left, axis=1) / length
        score[chosen] = -1.0
        chosen += np.argsort(-score, kind="stable")[:AT_ONCE].tolist()
        weights = np.linalg.lstsq(columns[:, chosen], scaled, rcond=1e-9)[0]
        left = scaled - columns[:, chosen] @ weights
    return Fitted(tuple(terms[i] for i in chosen), weights / np.array([1.0] * 3 + [TURN_M] * 3))


def _terms(q: Array) -> list[Term]:
    """A constant, waves of joints that move, and their products."""
    moving = [j for j in range(6) if np.ptp(q[:, j]) > 1e-6]
    waves = {j: [(j, name, k) for k in HARMONICS for name in ("Sin", "Cos")] for j in moving}
    every: list[Term] = [()]
    for count in range(1, FACTORS + 1):
        for joints in combinations(moving, count):
            every += product(*(waves[j] for j in joints))
    return every


def _column(term: Sequence[Wave], q: Array) -> Array:
    result = np.ones(len(q))
    for j, name, k in term:
        result = result * (np.sin(k * q[:, j]) if name == "Sin" else np.cos(k * q[:, j]))
    return result
