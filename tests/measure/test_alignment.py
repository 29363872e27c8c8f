"""The arm as the instrument sees it, from flange poses that are known here in plain numpy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.measure.alignment import align

NOISE = 3e-5
TURN = Rotation.from_rotvec([0.3, 0.2, 1.0]).as_matrix()


def scene(spread: tuple[float, float, float], turned: float) -> tuple[np.ndarray, np.ndarray]:
    """Flange poses within a box of half widths [m], turned by up to an angle [rad], and the points measured there."""
    g = np.random.default_rng(3)
    flange = np.tile(np.eye(4), (60, 1, 1))
    flange[:, :3, 3] = [1.2, 0.3, 0.8] + g.uniform(-1, 1, (60, 3)) * spread
    flange[:, :3, :3] = Rotation.from_rotvec(g.uniform(-turned, turned, (60, 3))).as_matrix()
    point = flange[:, :3, 3] + flange[:, :3, :3] @ [0.1, 0.0, 0.3]
    return flange, point @ TURN.T + [1.0, 2.0, 0.5] + NOISE * g.normal(size=(60, 3))


@pytest.mark.parametrize("turned", [1e-7, 0.4])
@pytest.mark.parametrize("spread", [(0.4, 0.3, 0.2), (0.4, 0.3, 0.0), (0.4, 0.0, 0.0)], ids=["box", "plane", "line"])
def test_points_on_a_plane_or_a_line_are_found_as_well(spread, turned):
    found = align(*scene(spread, turned))
    assert found.typical < 3 * NOISE and found.scale == pytest.approx(1, abs=0.01) and not found.mirrored
    assert found.tool == pytest.approx([0.1, 0.0, 0.3], abs=1e-3) if turned > 0.1 else np.linalg.norm(found.tool) < 0.01


def test_a_mirror_is_seen_where_points_tell_it():
    flange, seen = scene((0.4, 0.3, 0.2), 0.4)
    assert align(flange, seen * [1, 1, -1]).mirrored


@pytest.mark.parametrize("around", [0.0, 0.0005], ids=["a point", "a ball"])
@pytest.mark.parametrize("seed", [5, 6, 7, 8])
def test_flanges_that_turn_about_one_point_are_placed_by_how_they_turn(around, seed):
    g = np.random.default_rng(seed)
    flange = np.tile(np.eye(4), (60, 1, 1))
    flange[:, :3, :3] = Rotation.from_rotvec(g.uniform(-0.6, 0.6, (60, 3))).as_matrix()
    flange[:, :3, 3] = [1.2, 0.3, 0.8] + around * g.normal(size=(60, 3)) - flange[:, :3, :3] @ [0.0, 0.0, 0.3]
    point = flange[:, :3, 3] + flange[:, :3, :3] @ [0.04, -0.03, 0.25]
    found = align(flange, point @ TURN.T + [1.0, 2.0, 0.5] + 3e-4 * g.normal(size=(60, 3)))
    assert found.typical < 1e-3 and found.scale == pytest.approx(1, abs=0.05) and not found.mirrored
    assert found.tool == pytest.approx([0.04, -0.03, 0.25], abs=2e-3)
    assert found.T_instrument_base[:3, :3] == pytest.approx(TURN, abs=0.01)
