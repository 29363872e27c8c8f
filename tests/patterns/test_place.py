"""Patterns at a place, many at once and a value a pose, against least squares with all columns written out."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from postproc.fit.linear import Linear
from postproc.patterns.formula import values_of
from postproc.patterns.pattern_prior import ROOMS, sort
from postproc.patterns.place import Place
from postproc.patterns.shapes import Abrupt
from postproc.patterns.signals import channel_signal
from postproc.patterns.suspects import places
from tests.identify.cells import base_fit, cell

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
    gram, along = place.products(values)
    inside = place.linear.project(np.hstack(every))
    np.testing.assert_allclose(gram.reshape(5 * moves, -1), inside.T @ inside, atol=1e-10)
    np.testing.assert_allclose(along.ravel(), inside.T @ y, atol=1e-10)


@pytest.mark.parametrize("gaps", [False, True])
def test_a_place_beside_further_columns_is_that_of_a_fit_with_them(gaps):
    _, place = seen(3, 3, gaps)
    columns = np.random.default_rng(8).normal(size=(len(place.place), 2))
    values = np.random.default_rng(9).normal(size=(POSES, 5)).astype(np.float32)
    expected = Place(place.linear.extended(columns), place.place).falls(values)
    np.testing.assert_allclose(place.beside(columns).falls(values), expected, rtol=1e-5)
    np.testing.assert_allclose(place.beside(0 * columns).falls(values), place.falls(values), rtol=1e-5)


def test_shapes_side_by_side_have_the_values_of_their_laws():
    # Far from all values a bump is nothing.
    wear = np.append(np.random.default_rng(4).uniform(-1.0, 3.0, POSES - 1), 30.0)
    signal = channel_signal("wear", wear)
    some = Abrupt(signal, 200)
    shapes = [some[k] for k in range(len(some.kinds))]
    assert [shape.kind for shape in shapes] == some.kinds.tolist()
    np.testing.assert_array_equal(some.values, values_of(shapes))
    assert (some.values == 0.0).all(axis=0).any()


def test_every_place_is_counted_in_its_sort() -> None:
    """The odds of a pattern are one in all places where it makes sense."""
    data, _ = cell(seed=71, poses=40)
    turned = replace(data, rotation=base_fit(data).problem.rest.T_base_tcp[:, :3, :3])
    names = places(base_fit(turned).problem)
    count = Counter(map(sort, names))
    assert {None: len(names), **{kind: count[kind] for kind in ROOMS if kind is not None}} == ROOMS
