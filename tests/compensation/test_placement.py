"""Where targets are added: closed forms of the chord of a parabola and of the circle through three points."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.compensation.correction.placement import (
    chord_gaps,
    circle_gaps,
    perpendicular,
    place_arcs,
    place_vertices,
)

X = np.array([1.0, 0.0, 0.0])


def parabola(height: float, samples: int = 1001) -> tuple[np.ndarray, np.ndarray]:
    u = np.linspace(0, 1, samples)
    shift = np.zeros((samples, 3))
    shift[:, 1] = 4 * height * u * (1 - u)
    return u, shift


def chord_deviation(u: np.ndarray, shift: np.ndarray, direction: np.ndarray, a: int, b: int) -> float:
    return chord_gaps(u, perpendicular(shift, direction), np.ones(len(u)), a, b)


def test_chord_of_a_parabola() -> None:
    u, shift = parabola(1e-3)
    assert chord_deviation(u, shift, X, 0, 1000) == pytest.approx(1e-3, rel=1e-6)
    assert chord_deviation(u, shift, X, 0, 500) == pytest.approx(1e-3 / 4, rel=1e-4)


@given(st.floats(1e-5, 2e-3))
def test_fewest_targets_on_a_parabola(height: float) -> None:
    """A parabola of height h needs ceil(sqrt(h / tolerance)) chords, whatever lies along the path."""
    u, shift = parabola(height)
    shift[:, 0] = 0.01 * np.sin(9 * u)  # along the path: moves nothing sideways
    tolerance = 1e-5
    vertices, reached = place_vertices(u, perpendicular(shift, X), np.ones(len(u), bool), tolerance, np.ones(len(u)))
    chords = math.sqrt(height / tolerance)
    assert reached
    # A target can only stand at a sample: up to 1 of 1000 is lost at every chord, of 70 and more.
    assert math.ceil(chords - 0.01) - 1 <= len(vertices) <= math.ceil(chords * 1.02) - 1
    edges = [0, *vertices, 1000]
    assert max(chord_deviation(u, shift, X, a, b) for a, b in pairwise(edges)) <= tolerance


def test_no_target_inside_a_zone() -> None:
    u, shift = parabola(1e-3)
    allowed = (u > 0.2) & (u < 0.8)
    vertices, reached = place_vertices(u, perpendicular(shift, X), allowed, 1e-5, np.ones(len(u)))
    assert not reached and all(allowed[v] for v in vertices)


def test_circle_through_three_points() -> None:
    angle = np.linspace(0, 2, 41)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert circle_gaps(circle, circle[0], circle[20], circle[40]).max() < 1e-14
    lifted = circle + np.array([0, 0, 1e-3]) * np.sin(angle * np.pi)[:, None]
    # The plane through the three chosen points stays (all have zero lift at 0, 1, 2 rad), so the lift is the distance.
    assert circle_gaps(lifted, circle[0], circle[20], circle[40]).max() == pytest.approx(1e-3, rel=1e-3)


def test_arc_is_split_until_it_fits() -> None:
    angle = np.linspace(0, 3, 201)
    bent = np.stack([(1 + 1e-3 * np.cos(4 * angle)) * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    arcs, reached = place_arcs(bent, 1e-5, 2, np.ones(201, bool), np.ones(201))
    assert reached and len(arcs) > 1 and arcs[-1][1] == 200
    few, reached = place_arcs(bent, 1e-5, 100, np.ones(201, bool), np.ones(201))
    assert not reached and 1 <= len(few) <= 2


@pytest.mark.parametrize("shortest", [7, 20, 30, 45])
def test_no_piece_of_an_arc_is_shorter_than_asked(shortest: int) -> None:
    angle = np.linspace(0, 3, 101)
    bent = np.stack([(1 + 3e-3 * np.cos(5 * angle)) * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    arcs, _ = place_arcs(bent, 1e-6, shortest, np.ones(101, bool), np.ones(101))
    ends = [0, *(end for _, end in arcs)]
    assert len(arcs) > 1 and min(np.diff(ends)) >= shortest
