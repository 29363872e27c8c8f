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
from postproc.robot.configuration import branch, confdata, derive
from postproc.robot.inverse import NONE_INSIDE, JointSolution, beyond_limits, joint_solution, nearest_solution, selects
from postproc.robot.kinematics import forward
from postproc.robot.track import track
from tests.build import refused
from tests.independent import arm as A
from tests.independent import inverse as other_inverse

ROBOT = load_robot("irb4600_60_205")
PLAIN = np.radians([[10.0, 20, 10, 30, 40, 50]])


def random_joints(robot: Robot, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (n, 6))


def changed(**lengths: float) -> Robot:
    """The arm with other lengths [m]; ``z2`` is that of link 2 along z."""
    link = ROBOT.link.copy()
    for name, value in lengths.items():
        link[int(name[1]), "xyz".index(name[0]), 3] = value
    return replace(ROBOT, link=link, opw=derive(link, ROBOT.axis))


def solved(q: np.ndarray, conf: tuple[int, ...]) -> JointSolution:
    """The solution of the pose at joint angles (n, 6) with one configuration for all."""
    return joint_solution(ROBOT, forward(ROBOT, q), np.tile(conf, (len(q), 1)))


@pytest.mark.parametrize("name", ["irb4600_60_205", "irb4600_60_205_seed", "irb4600_20_250", "irb4600_40_255"])
def test_every_branch_and_turn_comes_back(name: str) -> None:
    robot = load_robot(name)
    q = random_joints(robot, 3000)
    conf = confdata(robot, q)
    solution = joint_solution(robot, forward(robot, q), conf)
    assert not solution.failures and np.abs(solution.q - q).max() < 1e-8
    assert set(conf[:, 3]) == set(range(8)) and set(conf[:, 1]) == set(range(-5, 5))


def test_all_solutions_are_those_of_an_independent_inverse_one_in_each_branch() -> None:
    T = forward(ROBOT, random_joints(ROBOT, 300, seed=1))
    ours, theirs = inverse(ROBOT, T), other_inverse.inverse(A.irb4600(), T)
    gap = np.abs(other_inverse.wrap(ours[:, :, None] - theirs[:, None])).max(axis=-1)
    exists = np.isfinite(ours).all(axis=-1)
    assert np.where(np.isnan(gap), np.inf, gap).min(axis=2)[exists].max() < 1e-7
    assert (exists.sum(axis=1) == np.isfinite(theirs).all(axis=-1).sum(axis=1)).all() and exists.all(axis=1).any()
    assert ROBOT.opw is not None
    cfx = branch(ROBOT.opw, ours)
    assert all(len(set(cfx[i][exists[i]])) == exists[i].sum() for i in range(len(T)))


def test_a_lateral_offset_of_the_arm_is_solved() -> None:
    robot = changed(y1=0.05)
    q = random_joints(robot, 300, seed=3)
    gap = np.abs(other_inverse.wrap(inverse(robot, forward(robot, q)) - q[:, None])).max(axis=-1)
    assert np.nanmin(gap, axis=1).max() < 1e-8


@pytest.mark.parametrize(
    ("degrees", "conf"),
    [
        ((0, 0, 0, 0, 30, 0), (0, 0, 0, 0)), ((90, 0, 0, 0, 30, 0), (1, 0, 0, 0)), ((-150, 0, 0, 0, 30, 0), (-2, 0, 0, 0)),
        ((0, 0, 0, -185, 30, 0), (0, -3, 0, 0)), ((0, 0, 0, 0, 30, 350), (0, 0, 3, 0)),
        ((-1e-12, 0, 0, 0, 30, 0), (0, 0, 0, 0)), ((0, 0, 0, -90, -30, -0.01), (0, -1, -1, 1)),
        ((0, 0, -85, 0, 30, 0), (0, 0, 0, 2)), ((0, 40, -85, 0, 30, 0), (0, 0, 0, 2)),
        ((0, -60, -85, 0, -30, 0), (0, 0, 0, 7)), ((0, 0, -75, 0, 30, 0), (0, 0, 0, 0)),
        ((0, -90, 0, 0, 30, 0), (0, 0, 0, 4)), ((0, -90, 0, 0, -30, 0), (0, 0, 0, 5)),
    ],
)  # fmt: skip
def test_confdata_of_known_arms(degrees: tuple[float, ...], conf: tuple[int, ...]) -> None:
    assert tuple(confdata(ROBOT, np.radians([degrees]))[0]) == conf


@pytest.mark.parametrize("q2", [-60, 0, 40])
def test_lower_arm_bit_changes_where_the_wrist_crosses_the_lower_arm(q2: float) -> None:
    """An arm with the lengths of the IRB 6700 changes from front to behind at axis 3 = -81.8 deg, whatever axis 2 is."""
    robot = changed(z0=0.78, x1=0.32, z2=1.125, z3=0.2, x4=1.3925)
    q = np.radians([[0, q2, -81.7, 0, 30, 0], [0, q2, -81.9, 0, 30, 0]])
    assert (confdata(robot, q)[:, 3] & 2).tolist() == [0, 2]


@pytest.mark.parametrize("wrist", [0.0, 1e-12, 1e-9, 1e-6, 1e-4])
def test_a_straight_wrist_is_solved_exactly(wrist: float) -> None:
    q = random_joints(ROBOT, 300, seed=4)
    q[:, 3:] = 0.0, wrist, 0.3
    T = forward(ROBOT, q)
    solution = joint_solution(ROBOT, T, confdata(ROBOT, q))
    assert not solution.failures and np.abs(forward(ROBOT, solution.q) - T).max() < 1e-9
    assert wrist or np.abs(solution.q - q).max() < 1e-9


@pytest.mark.parametrize(
    "conf", [(0, 0, 0, 0), (0, 0, -1, 0), (0, 1, -1, 0), (0, -1, 0, 0), (0, -1, 1, 0), (0, 2, -2, 0)]
)
def test_a_straight_wrist_taught_with_six_digits_takes_the_quadrants_of_its_confdata(conf: tuple[int, ...]) -> None:
    q = np.radians([[10.0, 20, 10, 100, 0, -99.9]]) + np.array([0, 0, 0, 0, 4e-7, 0])
    solution = solved(q, conf)
    assert not solution.failures and tuple(confdata(ROBOT, solution.q)[0]) == conf
    assert np.abs(forward(ROBOT, solution.q) - forward(ROBOT, q)).max() < 1e-6


@pytest.mark.parametrize("near", [(1, 0, 0, 0), (-1, 0, 0, 0), (0, 1, -1, 0), (1, 1, 1, 0)])
def test_a_configuration_within_one_quadrant_is_that_of_the_target(near: tuple[int, ...]) -> None:
    assert not solved(PLAIN, near).failures and solved(PLAIN, near).q == pytest.approx(PLAIN)
    assert all(solved(PLAIN, other).failures for other in ((0, 0, 0, 1), (2, 0, 0, 0), (0, -2, 0, 0)))


def test_a_taught_target_a_hair_outside_its_quadrant_is_accepted() -> None:
    q = np.radians([[20.0, 20, 10, -0.01, 40, 50]])
    assert np.abs(solved(q, (0, 0, 0, 0)).q - q).max() < 1e-9


def test_a_confdata_selects_what_is_within_one_quadrant_of_it() -> None:
    q = np.repeat(PLAIN, 7, axis=0)
    q[2, 3], q[3, 3] = np.radians([95.0, 185.0])  # one quadrant beyond, and two
    q[4:, 4] = 0.0, 0.0, 5e-4
    q[6, 3] = np.radians(140.0)  # the other wrist is as near to the quadrant
    conf = np.zeros((7, 4), dtype=int)
    conf[1, 3] = conf[5, 3] = 1
    assert selects(ROBOT, conf, q).tolist() == [True, False, True, False, True, True, False]
    bent = selects(ROBOT, conf, q) & (q[:, 4] != 0)  # at a straight wrist only the sum of axes 4 and 6 is defined
    assert np.abs(joint_solution(ROBOT, forward(ROBOT, q), conf).q - q)[bent].max() < 1e-6


@pytest.mark.parametrize(
    ("degrees", "wanted", "nearest"),
    [
        ((10.0, 20, 10, 30, 40, 50), (2, 0, 0, 0), "[0, 0, 0, 0] at joints (10, 20, 10, 30, 40, 50) deg (nearest)"),
        # Turns are nearer with the wrist turned over, the arm is not.
        (
            (10.0, 20, 10, 30, 40, 50),
            (1, 2, -2, 0),
            "[0, 4, -4, 0] at joints (10, 20, 10, 390, 40, -310) deg (nearest)",
        ),
        # Joint 3 is beyond its limit, the arm can only reach backwards.
        ((10.0, 86, 85, 30, 40, 50), (2, 0, 0, 0), "[-2, 1, 0, 5] at joints"),
    ],
)
def test_a_configuration_that_does_not_exist_is_answered_with_all_that_do(
    degrees: tuple[float, ...], wanted: tuple[int, ...], nearest: str
) -> None:
    q = np.radians([degrees])
    solution = solved(q, wanted)
    (failure,) = solution.failures
    assert np.isnan(solution.q).all() and (failure.index, failure.reason) == (0, "configuration")
    assert str([*wanted]) in failure.diagnostic().render() and f"exists: {nearest}" in failure.help
    listed = re.findall(r"(\[[-\d, ]+\]) at joints \(([^)]+)\) deg", failure.help)
    assert len(listed) >= 2 and failure.help.count("(nearest)") == 1
    for conf, angles in listed:
        again = solved(q, json.loads(conf))
        assert not again.failures
        assert np.abs(again.q[0] - np.radians([float(x) for x in angles.split(",")])).max() < np.radians(0.051)
    # Where none keeps the limits, another confdata is no way out: the place is not the one that was meant.
    still = replace(ROBOT, lower=ROBOT.lower * 1e-3, upper=ROBOT.upper * 1e-3)
    (none,) = joint_solution(still, forward(still, q), np.array([wanted])).failures
    assert none.help == NONE_INSIDE and "no other one keeps the limits" in none.message


@pytest.mark.parametrize(("beyond", "failing"), [(0.09, False), (-0.09, False), (0.12, True), (0.4, True)])
def test_a_posture_recorded_at_a_limit_stands_at_it(beyond: float, failing: bool) -> None:
    q = np.radians([[0, 10, 10, 0, 120.0 + beyond, 0]])
    assert [bool(beyond_limits(ROBOT, q)), bool(solved(q, (0, 0, 0, 0)).failures)] == [failing, failing]


@pytest.mark.parametrize(
    ("limit", "angle", "message"),
    [(120.0, 125.0, "reaches 125.0 deg, limit 120 deg"), (119.6, 119.8, "reaches 119.8 deg, limit 119.6 deg")],
)
def test_a_limit_in_a_message_is_not_rounded_to_the_angle_beyond_it(limit: float, angle: float, message: str) -> None:
    robot = replace(ROBOT, upper=np.where(np.arange(6) == 4, np.radians(limit), ROBOT.upper))
    (failure,) = beyond_limits(robot, np.radians([[0, 10, 10, 0, angle, 0]]))
    assert (failure.reason, failure.message) == ("limit", f"joint 5 {message}")


@pytest.mark.parametrize(
    ("robot", "wrist", "message"),
    [
        # Stretched along x the wrist is at 0.175 + 0.9 + hypot(0.175, 0.96) m; with a short forearm it cannot be on axis 2.
        (ROBOT, 0.175 + 0.9 + np.hypot(0.175, 0.96) + 0.25, "250 mm too far away"),
        (changed(x4=0.3), 0.175, f"{1e3 * (0.9 - np.hypot(0.175, 0.3)):.0f} mm too near"),
    ],
)
def test_out_of_reach_says_by_how_much(robot: Robot, wrist: float, message: str) -> None:
    T = np.diag([1.0, -1, -1, 1])
    T[:3, 3] = wrist, 0.0, 0.495 - 0.135  # the flange is below its wrist
    solution = joint_solution(robot, np.stack([T, T]), np.zeros((2, 4), dtype=int))
    assert [(f.index, f.reason) for f in solution.failures] == [(0, "unreachable"), (1, "unreachable")]
    assert message in solution.failures[0].message and np.isnan(solution.q).all()


def test_the_nearest_posture_does_not_turn_the_arm_round_for_a_few_degrees_of_axis_6() -> None:
    meant = np.radians([-11.0, 13, 17, -4, 82, 170])
    assert np.allclose(nearest_solution(ROBOT, forward(ROBOT, meant[None])[0], np.zeros(6)), meant, atol=1e-6)


assert ROBOT.opw is not None
ELBOW = ROBOT.opw.offsets[2] - np.arctan2(ROBOT.opw.a2, ROBOT.opw.c3)  # of axis 3 where the elbow is straight


@pytest.mark.parametrize(
    ("name", "start", "travel", "within"),
    [
        ("irb4600_60_205", [0.3, -0.4, 0.6, -0.5, 0.8, 5.0], [0.5, 0.3, -0.3, 7.0, 0.4, -9.0], 1e-8),
        ("ur10", [0.3, -0.4, 0.6, -0.5, 0.8, 5.0], [0.5, 0.3, -0.3, 7.0, 0.4, -9.0], 1e-8),
        # Through a straight wrist, along one, and from a straight elbow either way.
        ("irb4600_60_205", [0.3, 0.1, 0.2, 0.4, -0.5, 6.4], [0.5, 0.3, -0.3, 0, 1, 0], 1e-7),
        ("irb4600_60_205", [0.3, 0.1, 0.2, 0.0, 0.0, 0.0], [0.5, 0.3, -0.3, 0, 0, 0], 1e-7),
        ("irb4600_60_205", [0.2, 0.3, ELBOW, 0.3, 0.7, -0.5], [0.06, 0, 0.3, 0.03, 0, 0], 1e-6),
        ("irb4600_60_205", [0.2, 0.3, ELBOW, 0.3, 0.7, -0.5], [0.06, 0, -0.3, 0.03, 0, 0], 1e-6),
    ],
)
def test_tracking_is_continuous(name: str, start: list[float], travel: list[float], within: float) -> None:
    robot = load_robot(name)
    q = np.array(start) + np.linspace(0, 1, 301)[:, None] * np.array(travel)
    assert np.abs(track(robot, forward(robot, q[1:]), q[0]) - q[1:]).max() < within


def test_tracking_is_not_disturbed_by_rounded_rotations() -> None:
    q = np.array([0.1, 0.1, 0.2, 0.3, 0.0, -0.2]) + np.linspace(0, 1, 200)[:, None] * [0.3, 0.2, -0.2, 0, 0, 0]
    T = forward(ROBOT, q)
    T[:, :3, :3] = T[:, :3, :3] @ A.rotation_vector(np.random.default_rng(0).normal(size=(200, 3)) * 2e-7)
    tracked = track(ROBOT, T, q[0])
    assert np.abs(tracked - q).max() < 1e-5 and np.abs(forward(ROBOT, tracked) - T).max() < 2e-6
    scaled = forward(ROBOT, PLAIN)
    scaled[:, :3, :3] *= 1.0 + 1e-4
    assert np.abs(track(ROBOT, scaled, PLAIN[0]) - PLAIN).max() < 1e-9


def test_an_arm_keeps_shoulder_and_elbow_where_its_wrist_turns_by_half_a_turn() -> None:
    start, goals = np.radians([0.0, -20, 20, 0, 60, 0]), random_joints(ROBOT, 400, 7)
    assert ROBOT.opw is not None
    goals = goals[branch(ROBOT.opw, goals) >> 1 == branch(ROBOT.opw, start) >> 1]
    reached = np.array([track(ROBOT, T, start)[0] for T in forward(ROBOT, goals)])
    # Axes 1 to 3 of a pose are one by branch; those of the wrist may be its twin.
    assert len(goals) > 50 and np.abs(other_inverse.wrap(reached[:, :3] - goals[:, :3])).max() < 1e-8


def test_failures_are_counted_over_the_blocks_in_which_poses_are_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.tile(forward(ROBOT, np.radians([[0.0, 20, 10, 5, 40, 5]])), (7, 1, 1))
    full = joint_solution(ROBOT, poses, np.zeros((7, 4)))
    poses[4, 0, 3] = 9.0
    monkeypatch.setattr("postproc.arrays.BLOCK", 3)
    parts = joint_solution(ROBOT, poses, np.zeros((7, 4)))
    assert [f.index for f in parts.failures] == [4] and (np.delete(parts.q - full.q, 4, axis=0) == 0.0).all()
    (finding,) = refused(lambda: track(ROBOT, poses, full.q[0]))
    assert finding.code == "KIN004" and "pose 4 of it" in finding.message


def test_arms_without_spherical_wrist_say_so() -> None:
    (finding,) = refused(lambda: confdata(load_robot("ur10"), np.zeros((1, 6))))
    assert finding.code == "KIN005" and "at zero its axes are not z, y, y, x, y, x" in finding.message
