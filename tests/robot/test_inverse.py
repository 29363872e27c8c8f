"""Inverse kinematics: branches, confdata, turns, singular wrists, failures."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.robot.arm import Robot
from postproc.robot.catalogue import load_robot
from postproc.robot.closed_form import inverse
from postproc.robot.configuration import branch, confdata
from postproc.robot.inverse import beyond_limits, joint_solution, nearest_solution, selects
from postproc.robot.kinematics import forward
from postproc.robot.track import track
from tests.build import refused
from tests.independent import arm as A
from tests.independent import inverse as other_inverse

ABB = ["irb4600_60_205", "irb4600_60_205_seed", "irb4600_20_250", "irb4600_40_255"]


def random_joints(robot: Robot, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (n, 6))


@pytest.mark.parametrize("name", ABB)
def test_every_branch_and_turn_comes_back(name: str) -> None:
    robot = load_robot(name)
    q = random_joints(robot, 3000)
    conf = confdata(robot, q)
    solution = joint_solution(robot, forward(robot, q), conf)
    assert not solution.failures
    assert np.abs(solution.q - q).max() < 1e-8
    assert set(conf[:, 3]) == set(range(8))
    assert set(conf[:, 1]) == {-5, -4, -3, -2, -1, 0, 1, 2, 3, 4}


def test_all_solutions_reach_the_pose_and_have_different_branches() -> None:
    robot = load_robot("irb4600_60_205")
    q = random_joints(robot, 500, seed=1)
    T = forward(robot, q)
    solutions = inverse(robot, T)
    exists = np.isfinite(solutions).all(axis=-1)
    rows, slots = np.nonzero(exists)
    assert np.abs(forward(robot, solutions[rows, slots]) - T[rows]).max() < 1e-8
    cfx = branch(robot.opw, solutions)  # type: ignore[arg-type]
    for i in range(len(q)):
        found = cfx[i][exists[i]]
        assert len(set(found)) == len(found)
    assert exists.all(axis=1).any()


def test_solutions_agree_with_an_independent_inverse() -> None:
    robot, other = load_robot("irb4600_60_205"), A.irb4600()
    T = forward(robot, random_joints(robot, 200, seed=2))
    ours, theirs = inverse(robot, T), other_inverse.inverse(other, T)
    gap = np.abs(other_inverse.wrap(ours[:, :, None] - theirs[:, None])).max(axis=-1)
    gap = np.where(np.isnan(gap), np.inf, gap)
    exists = np.isfinite(ours).all(axis=-1)
    assert gap.min(axis=2)[exists].max() < 1e-7
    assert (exists.sum(axis=1) == np.isfinite(theirs).all(axis=-1).sum(axis=1)).all()


def test_a_lateral_offset_of_the_arm_is_solved() -> None:
    robot = load_robot("irb4600_60_205")
    link = robot.link.copy()
    link[1, 1, 3] = 0.05
    from postproc.robot.opw import derive

    robot = replace(robot, link=link, opw=derive(link, robot.axis))
    q = random_joints(robot, 300, seed=3)
    T = forward(robot, q)
    gap = np.abs(other_inverse.wrap(inverse(robot, T) - q[:, None])).max(axis=-1)
    assert np.nanmin(gap, axis=1).max() < 1e-8


@pytest.mark.parametrize(
    ("degrees", "conf"),
    [
        ((0, 0, 0, 0, 30, 0), (0, 0, 0, 0)),
        ((90, 0, 0, 0, 30, 0), (1, 0, 0, 0)),
        ((-150, 0, 0, 0, 30, 0), (-2, 0, 0, 0)),
        ((0, 0, 0, -185, 30, 0), (0, -3, 0, 0)),
        ((0, 0, 0, 0, 30, 350), (0, 0, 3, 0)),
        ((-1e-12, 0, 0, 0, 30, 0), (0, 0, 0, 0)),
        ((0, 0, 0, -90, -30, -0.01), (0, -1, -1, 1)),
        ((0, 0, -85, 0, 30, 0), (0, 0, 0, 2)),
        ((0, 40, -85, 0, 30, 0), (0, 0, 0, 2)),
        ((0, -60, -85, 0, -30, 0), (0, 0, 0, 7)),
        ((0, 0, -75, 0, 30, 0), (0, 0, 0, 0)),
        ((0, -90, 0, 0, 30, 0), (0, 0, 0, 4)),
        ((0, -90, 0, 0, -30, 0), (0, 0, 0, 5)),
    ],
)
def test_confdata_of_known_arms(degrees: tuple[float, ...], conf: tuple[int, ...]) -> None:
    robot = load_robot("irb4600_60_205")
    assert tuple(confdata(robot, np.radians([degrees]))[0]) == conf


def test_lower_arm_bit_changes_where_the_wrist_crosses_the_lower_arm() -> None:
    """An arm with the lengths of the IRB 6700 changes from front to behind at axis 3 = -81.8 deg, whatever axis 2 is."""
    robot = load_robot("irb4600_60_205")
    link = robot.link.copy()
    link[0, 2, 3], link[1, 0, 3], link[2, 2, 3], link[3, 2, 3], link[4, 0, 3] = 0.78, 0.32, 1.125, 0.2, 1.3925
    from postproc.robot.opw import derive

    robot = replace(robot, link=link, opw=derive(link, robot.axis))
    for q2 in (-60, 0, 40):
        q = np.radians([[0, q2, -81.7, 0, 30, 0], [0, q2, -81.9, 0, 30, 0]])
        assert (confdata(robot, q)[:, 3] & 2).tolist() == [0, 2]


@pytest.mark.parametrize("wrist", [0.0, 1e-12, 1e-9, 1e-6, 1e-4])
def test_a_straight_wrist_is_solved_exactly(wrist: float) -> None:
    robot = load_robot("irb4600_60_205")
    q = random_joints(robot, 300, seed=4)
    q[:, 3], q[:, 4], q[:, 5] = 0.0, wrist, 0.3
    T = forward(robot, q)
    solution = joint_solution(robot, T, confdata(robot, q))
    assert not solution.failures
    assert np.abs(forward(robot, solution.q) - T).max() < 1e-9
    if wrist == 0.0:
        assert np.abs(solution.q - q).max() < 1e-9


@pytest.mark.parametrize(
    "conf", [(0, 0, 0, 0), (0, 0, -1, 0), (0, 1, -1, 0), (0, -1, 0, 0), (0, -1, 1, 0), (0, 2, -2, 0)]
)
def test_a_straight_wrist_taught_with_six_digits_takes_the_quadrants_of_its_confdata(conf: tuple[int, ...]) -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[10.0, 20, 10, 100, 0, -99.9]]) + np.array([0, 0, 0, 0, 4e-7, 0])
    T = forward(robot, q)
    solution = joint_solution(robot, T, np.array([conf]))
    assert not solution.failures
    assert tuple(confdata(robot, solution.q)[0]) == conf
    assert np.abs(forward(robot, solution.q) - T).max() < 1e-6


@pytest.mark.parametrize("beside", [(1, 0, 0, 0), (-1, 0, 0, 0), (0, 1, -1, 0), (1, 1, 1, 0)])
def test_a_configuration_within_one_quadrant_is_that_of_the_target(beside: tuple[int, ...]) -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[10.0, 20, 10, 30, 40, 50]])
    solution = joint_solution(robot, forward(robot, q), np.array([beside]))
    assert not solution.failures and solution.q == pytest.approx(q)
    for other in ((0, 0, 0, 1), (2, 0, 0, 0), (0, -2, 0, 0)):
        assert joint_solution(robot, forward(robot, q), np.array([other])).failures


def test_impossible_configuration_names_the_nearest() -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[10.0, 20, 10, 30, 40, 50], [10.0, 20, 10, 30, 40, 50]])
    solution = joint_solution(robot, forward(robot, q), np.array([[0, 0, 0, 0], [2, 0, 0, 0]]))
    assert np.abs(solution.q[0] - q[0]).max() < 1e-9
    assert np.isnan(solution.q[1]).all()
    (failure,) = solution.failures
    assert (failure.index, failure.reason) == (1, "configuration")
    assert "[0, 0, 0, 0] at joints (10, 20, 10, 30, 40, 50) deg (nearest)" in failure.help
    assert "[2, 0, 0, 0]" in failure.diagnostic().render()


@pytest.mark.parametrize(
    ("degrees", "wanted", "branch_named"),
    [
        ((10.0, 20, 10, 30, 40, 50), (1, 2, -2, 0), 0),  # turns are nearer with the wrist turned over, the arm is not
        ((10.0, 86, 85, 30, 40, 50), (2, 0, 0, 0), 5),  # joint 3 is beyond its limit, the arm can only reach backwards
    ],
)
def test_the_nearest_configuration_is_one_of_the_same_branch_within_the_limits(
    degrees: tuple[float, ...], wanted: tuple[int, ...], branch_named: int
) -> None:
    robot = load_robot("irb4600_60_205")
    T = forward(robot, np.radians([degrees]))
    (failure,) = joint_solution(robot, T, np.array([wanted])).failures
    nearest = np.array([json.loads(failure.help[failure.help.index("[") : failure.help.index("]") + 1])])
    assert nearest[0, 3] == branch_named
    again = joint_solution(robot, T, nearest)
    assert not again.failures and np.allclose(forward(robot, again.q), T)


def test_a_configuration_that_does_not_exist_is_answered_with_all_that_do() -> None:
    robot = load_robot("irb4600_60_205")
    T = forward(robot, np.radians([[10.0, 20, 10, 30, 40, 50]]))
    (failure,) = joint_solution(robot, T, np.array([[1, 2, -2, 0]])).failures
    listed = re.findall(r"(\[[-\d, ]+\]) at joints \(([^)]+)\) deg( \(nearest\))?", failure.help)
    assert len(listed) >= 2 and [bool(mark) for _, _, mark in listed].count(True) == 1 and listed[0][2]
    for conf, degrees, _ in listed:
        again = joint_solution(robot, T, np.array([json.loads(conf)]))
        assert not again.failures
        assert np.abs(again.q[0] - np.radians([float(x) for x in degrees.split(",")])).max() < np.radians(0.051)


@pytest.mark.parametrize(("beyond", "failing"), [(0.09, False), (-0.09, False), (0.12, True), (0.4, True)])
def test_a_posture_recorded_at_a_limit_stands_at_it(beyond: float, failing: bool) -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[0, 10, 10, 0, 120.0 + beyond, 0]])
    found = beyond_limits(robot, q)
    solved = joint_solution(robot, forward(robot, q), confdata(robot, q))
    assert [bool(found), bool(solved.failures)] == [failing, failing]
    for failure in found:
        reached, limit = re.findall(r"[\d.]+", failure.message.split("reaches")[1])
        assert float(reached) > float(limit)


def test_the_limit_in_a_message_is_not_rounded_to_the_angle_beyond_it() -> None:
    robot = load_robot("irb4600_60_205")
    robot = replace(robot, upper=np.where(np.arange(6) == 4, np.radians(119.6), robot.upper))
    (failure,) = beyond_limits(robot, np.radians([[0, 10, 10, 0, 119.8, 0]]))
    assert failure.message == "joint 5 reaches 119.8 deg, limit 119.6 deg"


def test_unreachable_and_limits_are_told_apart() -> None:
    robot = load_robot("irb4600_60_205")
    far = np.eye(4)
    far[:3, 3] = [5.0, 0, 0]
    beyond = np.radians([[0, 10, 10, 0, 125.0, 0]])
    solution = joint_solution(robot, np.stack([far, forward(robot, beyond)[0]]), np.array([[0, 0, 0, 0], [0, 0, 0, 0]]))
    first, second = solution.failures
    assert (first.reason, first.index) == ("unreachable", 0)
    assert second.reason == "limit"
    assert second.message == "joint 5 reaches 125.0 deg, limit 120 deg"
    assert np.isnan(solution.q).all()


def test_a_taught_target_a_hair_outside_its_quadrant_is_accepted() -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[20.0, 20, 10, -0.01, 40, 50]])
    solution = joint_solution(robot, forward(robot, q), np.array([[0, 0, 0, 0]]))
    assert np.abs(solution.q - q).max() < 1e-9


@pytest.mark.parametrize("name", ["irb4600_60_205", "ur10"])
def test_tracking_is_continuous_over_turns_and_through_a_straight_wrist(name: str) -> None:
    robot = load_robot(name)
    u = np.linspace(0, 1, 301)[:, None]
    q = np.array([0.3, -0.4, 0.6, -0.5, 0.8, 5.0]) + u * np.array([0.5, 0.3, -0.3, 7.0, 0.4, -9.0])
    assert np.abs(track(robot, forward(robot, q), q[0]) - q).max() < 1e-8


def test_tracking_passes_a_straight_wrist_without_changing_branch() -> None:
    robot = load_robot("irb4600_60_205")
    u = np.linspace(0, 1, 201)[:, None]
    q = np.array([0.3, 0.1, 0.2, 0.4, -0.5, 6.4]) + u * np.array([0.5, 0.3, -0.3, 0, 1, 0])
    assert np.abs(q[:, 4]).min() < 1e-12
    assert np.abs(track(robot, forward(robot, q), q[0]) - q).max() < 1e-7
    straight = np.array([0.3, 0.1, 0.2, 0.0, 0.0, 0.0]) + u * np.array([0.5, 0.3, -0.3, 0, 0, 0])
    assert np.abs(track(robot, forward(robot, straight), straight[0]) - straight).max() < 1e-7


def test_an_arm_keeps_shoulder_and_elbow_where_its_wrist_turns_by_half_a_turn() -> None:
    robot = load_robot(ABB[0])
    start = np.radians([0.0, -20, 20, 0, 60, 0])
    goals = random_joints(robot, 400, 7)
    goals = goals[branch(robot.opw, goals) >> 1 == branch(robot.opw, start) >> 1]  # type: ignore[arg-type]
    reached = np.array([track(robot, T, start)[0] for T in forward(robot, goals)])
    # Axes 1 to 3 of a pose are one by branch; those of the wrist may be its twin.
    away = reached[:, :3] - goals[:, :3]
    assert len(goals) > 50 and np.abs((away + np.pi) % (2 * np.pi) - np.pi).max() < 1e-8


def test_a_path_that_begins_with_a_straight_elbow_goes_on_either_way() -> None:
    robot = load_robot(ABB[0])
    assert robot.opw is not None
    edge = robot.opw.offsets[2] - np.arctan2(robot.opw.a2, robot.opw.c3)
    for way in (1, -1):
        q = np.radians([10.0, 20, 0, 15, 40, -30]) + np.outer(np.linspace(0, 0.3, 30), [0.2, 0, way, 0.1, 0, 0])
        q[:, 2] += edge
        assert np.abs(track(robot, forward(robot, q[1:]), q[0]) - q[1:]).max() < 1e-6


def test_tracking_normalises_rotations() -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[10.0, 20, 10, 30, 40, 50]])
    T = forward(robot, q)
    T[:, :3, :3] *= 1.0 + 1e-4
    assert np.abs(track(robot, T, q[0]) - q).max() < 1e-9


def test_failures_are_counted_over_the_blocks_in_which_poses_are_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load_robot("irb4600_60_205")
    poses = np.tile(forward(robot, np.radians([[0.0, 20, 10, 5, 40, 5]])), (7, 1, 1))
    whole = joint_solution(robot, poses, np.zeros((7, 4)))
    poses[4, 0, 3] = 9.0
    monkeypatch.setattr("postproc.arrays.BLOCK", 3)
    parts = joint_solution(robot, poses, np.zeros((7, 4)))
    assert [f.index for f in parts.failures] == [4]
    assert np.abs(np.delete(parts.q - whole.q, 4, axis=0)).max() == 0.0
    assert "pose 4 of it" in refused(lambda: track(robot, poses, whole.q[0]))[0].message


def test_a_confdata_selects_what_is_within_one_quadrant_of_it() -> None:
    robot = load_robot("irb4600_60_205")
    q = np.radians([[10.0, 20, 10, 30, 40, 50]] * 7)
    q[2, 3], q[3, 3] = np.radians([95.0, 185.0])  # one quadrant beyond, and two
    q[4:, 4] = 0.0, 0.0, 5e-4
    q[6, 3] = np.radians(140.0)  # the other wrist is as near to the quadrant
    conf = np.zeros((7, 4), dtype=int)
    conf[1, 3] = conf[5, 3] = 1
    assert selects(robot, conf, q).tolist() == [True, False, True, False, True, True, False]
    bent = selects(robot, conf, q) & (q[:, 4] != 0)  # at a straight wrist only the sum of axes 4 and 6 is defined
    assert np.abs(joint_solution(robot, forward(robot, q), conf).q - q)[bent].max() < 1e-6


def test_leaving_the_working_range_is_a_finding() -> None:
    robot = load_robot("irb4600_60_205")
    T = np.tile(forward(robot, np.radians([[0.0, 20, 10, 0, 40, 0]])), (5, 1, 1))
    T[:, 0, 3] += np.linspace(0, 2, 5)
    assert refused(lambda: track(robot, T, np.radians([0.0, 20, 10, 0, 40, 0])))[0].code == "KIN004"


def test_arms_without_spherical_wrist_say_so() -> None:
    robot = load_robot("ur10")
    error = refused(lambda: confdata(robot, np.zeros((1, 6))))
    assert error[0].code == "KIN005"
    assert "axes 4, 5 and 6" in error[0].message or "axes are not" in error[0].message


def test_a_path_with_a_straight_wrist_and_rounded_orientations_does_not_spin_axis_4() -> None:
    robot = load_robot("irb4600_60_205")
    u = np.linspace(0, 1, 200)[:, None]
    q = np.array([0.1, 0.1, 0.2, 0.3, 0.0, -0.2]) + u * np.array([0.3, 0.2, -0.2, 0, 0, 0])
    T = forward(robot, q)
    T[:, :3, :3] = T[:, :3, :3] @ A.rotation_vector(np.random.default_rng(0).normal(size=(200, 3)) * 2e-7)
    tracked = track(robot, T, q[0])
    assert np.abs(tracked - q).max() < 1e-5
    assert np.abs(forward(robot, tracked) - T).max() < 2e-6


def test_out_of_reach_says_by_how_much() -> None:
    """Stretched along x the wrist centre is at 0.175 + 0.9 + hypot(0.175, 0.96) m, the flange 0.135 m below it."""
    robot = load_robot("irb4600_60_205")
    T = np.eye(4)
    T[:3, :3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    T[:3, 3] = 0.175 + 0.9 + np.hypot(0.175, 0.96) + 0.25, 0.0, 0.495 - 0.135
    (failure,) = joint_solution(robot, T[None], np.zeros((1, 4), dtype=int)).failures
    assert failure.reason == "unreachable" and "250 mm too far away" in failure.message


def test_the_nearest_posture_does_not_turn_the_arm_round_for_a_few_degrees_of_axis_6() -> None:
    robot = load_robot("irb4600_60_205")
    meant = np.radians([-11.0, 13, 17, -4, 82, 170])
    assert np.allclose(nearest_solution(robot, forward(robot, meant[None])[0], np.zeros(6)), meant, atol=1e-6)
