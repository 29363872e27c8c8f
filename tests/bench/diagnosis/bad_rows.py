"""Rows of a table that cannot be right, as hands and programs make them, and whether a message names them."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

SORTS = ("rotated", "block", "inches", "metres", "swapped", "others")
SHARES = (0.02, 0.06, 0.12, 0.18, 0.25)


def spoil(g: np.random.Generator, sort: str, share: float, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) [m] some of which are wrong, and which (n,).

    Args:
        sort: turned axes, a run of rows that is shifted, another unit, columns swapped, points of other rows.
    """
    n = len(position)
    count = max(1, round(share * n))
    wrong = np.zeros(n, dtype=bool)
    if sort == "block":
        wrong[(start := int(g.integers(n - count))) : start + count] = True
    else:
        wrong[g.choice(n, count, replace=False)] = True
    bad, new = position[wrong], position.copy()
    if sort == "rotated":
        axis = g.normal(size=3)
        turned = Rotation.from_rotvec(axis / np.linalg.norm(axis) * g.uniform(0.2, 3.0)).as_matrix()
        new[wrong] = bad @ turned.T
    elif sort == "block":
        way = g.normal(size=3)
        new[wrong] = bad + way / np.linalg.norm(way) * g.uniform(0.03, 0.6)
    elif sort == "swapped":
        new[wrong] = bad[:, g.permutation([[1, 0, 2], [2, 1, 0], [0, 2, 1]])[0]]
    elif sort == "others":
        new[wrong] = np.roll(bad, 1, axis=0) if count > 1 else bad + np.array([0.0, 0.25, 0.0])
    else:
        new[wrong] = bad / {"inches": 25.4, "metres": 1000.0}[sort]
    return new, wrong


def named_rows(text: str) -> set[int]:
    """Numbers of rows that messages name: ``row 3``, ``rows 3, 7 to 9``, ``lines 4, 5`` are none."""
    found: set[int] = set()
    for some in re.findall(r"\brows? ((?:\d+(?: to \d+)?(?:, | and )?)+)", text):
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", some):
            found |= set(range(int(first), int(last or first) + 1))
    return found
