"""Laws of two joint angles that no effect of the library has: waves of a sum, products of waves and of curves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.independent import arm as A
from tests.independent.cells import DEG, Hidden, States, column

Law = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _of_two(g: np.random.Generator, kind: str, law: Law, size: float) -> Hidden:
    """A joint that is off by a law of two angles, centred and of that standard deviation [rad] on poses at random."""
    a, b = (int(x) for x in g.choice(5, size=2, replace=False))
    j = int(g.choice([0, 1, 2, 4]))
    some = law(*np.random.default_rng(0).uniform(-1.2, 1.2, (2, 4000)))
    middle, by = some.mean(), size / some.std()

    def joint(s: States, tau: np.ndarray) -> np.ndarray:
        return column(j, by * (law(s.q[:, a], s.q[:, b]) - middle))

    note = f"joint {j + 1} by q{a + 1} and q{b + 1}"
    return Hidden(kind, "unknown", channels=(f"q{a + 1}", f"q{b + 1}"), note=note, joint=joint)


def _size(g: np.random.Generator) -> float:
    """Standard deviation [rad]: 0.08 to 0.5 mm at a lever of 1.5 m."""
    return float(np.exp(g.uniform(*np.log([0.003, 0.02])))) * DEG


def wave_of_a_sum(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """sin(a q_i + b q_j + c)"""
    a, b, c = g.integers(2, 12), g.integers(2, 12) * g.choice([-1, 1]), g.uniform(0, 2 * np.pi)
    return _of_two(g, "wave_of_a_sum", lambda x, y: np.sin(a * x + b * y + c), _size(g))


def product_of_waves(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """sin(a q_i + c) sin(b q_j + d)"""
    a, b, c, d = *g.integers(1, 8, 2), *g.uniform(0, 2 * np.pi, 2)
    return _of_two(g, "product_of_waves", lambda x, y: np.sin(a * x + c) * np.sin(b * y + d), _size(g))


def product_of_curves(g: np.random.Generator, arm: A.Arm) -> Hidden:
    """A bump of one angle times a square, a kink or a step of the other."""
    at, width, edge, other = g.uniform(-0.5, 0.5), g.uniform(0.25, 0.7), g.uniform(-0.5, 0.5), int(g.integers(3))

    def law(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        curve = ((y - edge) ** 2, np.abs(y - edge), np.tanh((y - edge) / 0.2))[other]
        return np.asarray(np.exp(-0.5 * ((x - at) / width) ** 2) * curve)

    return _of_two(g, "product_of_curves", law, _size(g))


TWO_JOINTS = [wave_of_a_sum, product_of_waves, product_of_curves]
