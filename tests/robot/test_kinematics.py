"""Forward kinematics against an independent arm and the closed forms of the maker's drawing."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.robot.catalogue import list_robots, load_robot
from postproc.robot.kinematics import body_poses, forward, jacobian
from tests.independent import arm as A

RNG = np.random.default_rng(11)


@pytest.mark.parametrize("name", sorted(set(list_robots()) & set(A.ARMS)))
def test_forward_agrees_with_an_independent_arm(name: str) -> None:
    robot, other = load_robot(name), A.ARMS[name]()
    q = RNG.uniform(-6, 6, (200, 6))
    assert np.abs(forward(robot, q) - other.forward(q, np.eye(4)).flange).max() < 1e-12


def test_zero_pose_and_reach_of_the_shipped_arm() -> None:
    robot = load_robot("irb4600_60_205")
    T = forward(robot, np.zeros((1, 6)))[0]
    expected = [[0, 0, 1, 1.270], [0, 1, 0, 0], [-1, 0, 0, 1.570], [0, 0, 0, 1]]
    assert np.abs(T - expected).max() < 1e-15
    stretched = np.array([[0, np.pi / 2, -np.arctan2(0.960, 0.175), 0, 0, 0]])
    wrist = body_poses(robot, stretched)[0, 5, :3, 3]
    assert wrist == pytest.approx([0.175 + 0.900 + np.hypot(0.960, 0.175), 0, 0.495], abs=1e-12)


@pytest.mark.parametrize("name", ["irb4600_60_205", "ur10"])
def test_jacobian_is_the_derivative_of_the_pose(name: str) -> None:
    robot = load_robot(name)
    q = RNG.uniform(-2, 2, (50, 6))
    tool = np.eye(4)
    tool[:3, 3] = [0.1, -0.2, 0.3]
    J = jacobian(robot, q, tool)
    h = 1e-6
    for j in range(6):
        up, down = (forward(robot, q + s * h * np.eye(6)[j]) @ tool for s in (1, -1))
        linear = (up - down)[:, :3, 3] / (2 * h)
        spin = (up - down)[:, :3, :3] @ np.swapaxes(up[:, :3, :3], 1, 2) / (2 * h)
        angular = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        assert np.abs(J[:, :3, j] - linear).max() < 1e-8
        assert np.abs(J[:, 3:, j] - angular).max() < 2e-6
