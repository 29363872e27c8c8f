"""The arm as the instrument sees it, from flange poses that are known here in plain numpy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.measure.alignment import align
from postproc.measure.checks.readings import PlacedArm, zero_errors
from tests.measure.tables import ARM, TOOL, flanges, points, poses

NOISE = 3e-5
TURN = Rotation.from_rotvec([0.3, 0.2, 1.0]).as_matrix()


def matrices(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    T = np.tile(np.eye(4), (len(p), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = R, p
    return T


def scene(spread: tuple[float, float, float], turned: float) -> tuple[np.ndarray, np.ndarray]:
    """Flange poses within a box of half widths [m], turned by up to an angle [rad], and the points measured there."""
    g = np.random.default_rng(3)
    p = [1.2, 0.3, 0.8] + g.uniform(-1, 1, (60, 3)) * spread
    flange = matrices(Rotation.from_rotvec(g.uniform(-turned, turned, (60, 3))).as_matrix(), p)
    point = p + flange[:, :3, :3] @ [0.1, 0.0, 0.3]
    return flange, point @ TURN.T + [1.0, 2.0, 0.5] + NOISE * g.normal(size=(60, 3))


def test_frame_and_tool_are_found_without_a_guess():
    q = poses(60, seed=3)
    result = align(matrices(*flanges(q)), points(q) * 1e-3)
    np.testing.assert_allclose(result.tool, TOOL, atol=1e-9)
    np.testing.assert_allclose(result.T_instrument_base[:3, 3], [1.5, -2.0, 0.3], atol=1e-9)
    assert result.scale == pytest.approx(1.0, abs=1e-9) and not result.mirrored


@pytest.mark.parametrize("turned", [1e-7, 0.4])
@pytest.mark.parametrize("spread", [(0.4, 0.3, 0.2), (0.4, 0.3, 0.0), (0.4, 0.0, 0.0)], ids=["box", "plane", "line"])
def test_points_on_a_plane_or_a_line_are_found_as_well(spread, turned):
    result = align(*scene(spread, turned))
    assert result.typical < 3 * NOISE and result.scale == pytest.approx(1, abs=0.01) and not result.mirrored
    assert (
        result.tool == pytest.approx([0.1, 0.0, 0.3], abs=1e-3) if turned > 0.1 else np.linalg.norm(result.tool) < 0.01
    )


@pytest.mark.parametrize("around", [0.0, 0.0005], ids=["a point", "a ball"])
@pytest.mark.parametrize("seed", [5, 6, 7, 8])
def test_flanges_that_turn_about_one_point_are_placed_by_how_they_turn(around, seed):
    g = np.random.default_rng(seed)
    R = Rotation.from_rotvec(g.uniform(-0.6, 0.6, (60, 3))).as_matrix()
    p = [1.2, 0.3, 0.8] + around * g.normal(size=(60, 3)) - R @ [0.0, 0.0, 0.3]
    seen = (p + R @ [0.04, -0.03, 0.25]) @ TURN.T + [1.0, 2.0, 0.5] + 3e-4 * g.normal(size=(60, 3))
    result = align(matrices(R, p), seen)
    assert result.typical < 1e-3 and result.scale == pytest.approx(1, abs=0.05) and not result.mirrored
    assert result.tool == pytest.approx([0.04, -0.03, 0.25], abs=2e-3)
    assert result.T_instrument_base[:3, :3] == pytest.approx(TURN, abs=0.01)


def test_joint_zeros_that_are_turns_of_instrument_or_tool_stay_where_they_are():
    """Nothing tells joint 1 from the instrument or joint 6 from the tool: rounding must not carry them away."""
    rng = np.random.default_rng(8)
    q, zeros = rng.uniform(-70, 70, (40, 6)), np.array([0.0, -2.0, 0.0, 0.0, 1.0, 0.0])
    seen = 1e-3 * points(q + zeros) + rng.normal(scale=NOISE, size=(40, 3))
    offset, typical = zero_errors(PlacedArm(ARM), np.radians(q), seen)
    np.testing.assert_allclose(np.degrees(offset), zeros, atol=0.02)
    assert typical < 1e-4
