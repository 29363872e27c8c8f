"""CurveForms at a place, many at once and a value a pose, against least squares with all columns written out."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from postproc.estimation.linear import Linear
from postproc.identification.curves.prior import ROOMS, sort_of_place
from postproc.identification.screen.place import Place
from postproc.identification.screen.suspects import places
from tests.identification.cells import base_fit, cell

POSES = 40


def seen(moves: int, numbers: int, gaps: bool):
    g = np.random.default_rng(moves)
    row = np.repeat(np.arange(POSES), numbers)
    row = row[g.uniform(size=len(row)) > 0.2] if gaps else row
    fitted, place = g.normal(size=(len(row), 4)), g.normal(size=(len(row), moves))
    return fitted, Place(Linear(g.normal(size=len(row)), np.linalg.qr(fitted)[0], row), place)


def left(columns, y):
    return float(np.sum((y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]) ** 2))


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize(("moves", "numbers"), [(1, 3), (3, 3), (3, 6)])
def test_a_pattern_takes_off_what_least_squares_with_its_columns_do(moves, numbers, gaps):
    fitted, place = seen(moves, numbers, gaps)
    values = np.random.default_rng(9).normal(size=(POSES, 5))
    y, row = place.linear.residual, place.linear.row
    every = [place.place * values[row, k, None] for k in range(5)]
    expected = [left(fitted, y) - left(np.hstack([fitted, columns]), y) for columns in every]
    np.testing.assert_allclose(place.falls(values.astype(np.float32)), expected, rtol=1e-4)


def test_every_place_is_counted_in_its_sort() -> None:
    """The odds of a pattern are one in all places where it makes sense."""
    data, _ = cell(seed=71, poses=40)
    turned = replace(data, rotation=base_fit(data).problem.equilibrium.T_base_tcp[:, :3, :3])
    names = places(base_fit(turned).problem)
    count = Counter(map(sort_of_place, names))
    assert {None: len(names), **{kind: count[kind] for kind in ROOMS if kind is not None}} == ROOMS
