"""What an instrument reads, against spherical coordinates."""

import numpy as np
import pytest

from postproc.identification.curves.derived import SEEN, WAYS, Sight
from postproc.identification.curves.signal import text_of
from tests.identification.cells import base_fit, cell
from tests.independent import unknown_effects as kinds


def cartesian(azimuth, elevation, distance):
    level = distance * np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], axis=1)


@pytest.fixture(scope="module")
def sight():
    data, _ = cell(kinds.encoder, seed=311, noise=0.02, poses=40)
    problem = base_fit(data).problem
    sight = Sight.of(problem.equilibrium)
    assert sight.point == pytest.approx(data.position - problem.error[:, :3], abs=1e-12)
    return sight, problem.equilibrium.state


@pytest.mark.parametrize("reading", WAYS)
def test_an_error_of_a_reading_moves_the_point_as_its_derivative_does(sight, reading):
    found, _ = sight
    distance = np.linalg.norm(found.point, axis=1)
    read = [np.arctan2(found.point[:, 1], found.point[:, 0]), np.arcsin(found.point[:, 2] / distance), distance]
    number, size = {"azimuth": (0, 1.0), "elevation": (1, 1.0), "distance": (2, 1.0), "scale": (2, distance)}[reading]
    high, low = (cartesian(*(x + sign * (k == number) * size for k, x in enumerate(read))) for sign in (1e-6, -1e-6))
    moved = found.moves()[reading]
    assert moved == pytest.approx((high - low) / 2e-6, abs=1e-8)
    assert eval(WAYS[reading][0], {"np": np, SEEN: found.point}) == pytest.approx(moved)


def test_the_text_of_a_reading_has_its_values(sight):
    found, state = sight
    seen = eval(found.code, {"np": np, "state": state})
    assert seen == pytest.approx(found.point, abs=1e-3)
    for pattern in (p for some in found.blocks() for p in list(some)[::3]):
        said = eval(text_of(pattern.drafts[0]), {"np": np, "state": state, SEEN: found.point}) * 1.0
        assert said == pytest.approx(pattern.values, abs=2e-3), pattern.text
