"""The arms of the library beside an independent arm, an independent table (``arms.txt``) and plain trigonometry."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.motion.inertia import inertial_torque
from postproc.robot.arm import Robot
from postproc.robot.catalogue import describe_robot, doubts, list_robots, load_robot
from postproc.robot.closed_form import inverse
from postproc.robot.kinematics import body_poses, forward, jacobian
from postproc.robot.type_names import library_name
from tests.build import refused
from tests.independent import arm as A
from tests.independent.inverse import wrap


class Stated(NamedTuple):
    """Lengths d1, a1, a2, a3, d4, d6 [mm], reach of the data sheet [mm] with its marks, names that controllers use."""

    lengths: list[float]
    reach: float
    marks: str
    names: list[str]


LINES = (Path(__file__).parent / "arms.txt").read_text("utf-8").splitlines()
TABLE = {
    name: Stated([float(x) for x in lengths.split()], float(reach.rstrip("~=")), reach.lstrip("0123456789"), names.split(", "))
    for name, lengths, reach, names in (line.split(" | ") for line in LINES if not line.startswith("#"))
}  # fmt: skip
COMPUTED = [name for name, arm in TABLE.items() if "=" not in arm.marks]


def turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) by angles (n,) [rad]."""
    return Rotation.from_euler(axis, angle[:, None]).as_matrix()


def flange(lengths: list[float], q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place [m] and axes of the flange by trigonometry in the plane of the arm: no product of transforms."""
    d1, a1, a2, a3, d4, d6 = (x * 1e-3 for x in lengths)
    upper, fore = q[:, 1], q[:, 1] + q[:, 2]
    out = a1 + a2 * np.sin(upper) + a3 * np.sin(fore) + d4 * np.cos(fore)
    up = d1 + a2 * np.cos(upper) + a3 * np.cos(fore) - d4 * np.sin(fore)
    wrist = np.stack([out * np.cos(q[:, 0]), out * np.sin(q[:, 0]), up], axis=1)
    hand = turn("z", q[:, 0]) @ turn("y", fore) @ turn("x", q[:, 3]) @ turn("y", q[:, 4]) @ turn("x", q[:, 5])
    tool0 = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    return wrist + d6 * hand[:, :, 0], hand @ tool0


def horizontal_reach(lengths: list[float], robot: Robot) -> float:
    """Largest distance of the wrist centre from axis 1 within the limits of axes 2 and 3 [mm], on a grid of 0.25 deg."""
    _, a1, a2, a3, d4, _ = lengths
    upper = np.arange(robot.lower[1], robot.upper[1], np.radians(0.25))[:, None]
    pitch = np.arange(robot.lower[2], robot.upper[2], np.radians(0.25))
    fore = pitch if robot.parallelogram else upper + pitch
    return float((a1 + a2 * np.sin(upper) + a3 * np.sin(fore) + d4 * np.cos(fore)).max())


def test_the_library_holds_these_arms_and_no_other_of_abb() -> None:
    assert {n for n in list_robots() if n.startswith("irb")} == {*TABLE, "irb4600_60_205_seed"}
    assert load_robot("irb4600_60_205_seed").link[2, 2, 3] == pytest.approx(1.075)
    assert len(COMPUTED) >= 30


@pytest.mark.parametrize("name", COMPUTED)
def test_an_arm_stands_where_trigonometry_says(name: str) -> None:
    robot = load_robot(name)
    q = np.random.default_rng(5).uniform(robot.lower, robot.upper, (200, 6))
    place, axes = flange(TABLE[name].lengths, q)
    T = forward(robot, q)
    assert np.abs(T[:, :3, 3] - place).max() < 1e-12 and np.abs(T[:, :3, :3] - axes).max() < 1e-12
    assert np.nanmin(np.abs(wrap(inverse(robot, T[:20]) - q[:20, None])).max(axis=2), axis=1).max() < 1e-6


@pytest.mark.parametrize("name", TABLE)
def test_an_arm_reaches_what_its_data_sheet_says_and_is_known_by_its_names(name: str) -> None:
    stated, robot = TABLE[name], describe_robot(name)
    _, a1, a2, a3, d4, _ = stated.lengths
    reaches = (a1 + a2 + np.hypot(d4, a3), horizontal_reach(stated.lengths, robot))
    assert robot.reach == pytest.approx(1e-3 * stated.reach)
    assert (min(abs(x - stated.reach) for x in reaches) <= 8.0) != ("~" in stated.marks)
    assert {library_name(type_) for type_ in stated.names} == {name}


@pytest.mark.parametrize("name", sorted({*TABLE} - {"irb4600_60_205"}))
def test_an_arm_says_what_it_weighs_and_how_stiff_it_may_be(name: str) -> None:
    robot = describe_robot(name)
    stated = float(robot.sources["bodies.body"].partition("shares of the ")[2].split(" kg")[0])
    assert robot.mass.sum() == pytest.approx(stated, rel=2e-3) and robot.sources["bodies.body"].startswith("estimate")
    assert robot.mass_factor is not None and (robot.mass_factor > 1.2).all()
    assert robot.joint_compliance is not None and robot.stiffness_factor is not None and robot.reach is not None
    assert (robot.stiffness_factor >= 2).all() and robot.mounting and doubts(robot) == []
    rule = np.array([70, 105, 70, 13, 14.5, 13]) * stated * 9.81 * robot.reach
    if robot.stiffness_source == "estimated":
        assert 1 / robot.joint_compliance == pytest.approx(rule, rel=0.05)
    else:  # measured on another arm of the type: within the factors of the rule
        assert name in ("irb1200_5_09", "irb6660_205_19")
        assert (np.abs(np.log(robot.joint_compliance * rule)) < np.log([4, 3, 2.5, 2.5, 3.5, 2.5])).all()
    for key in ("chain.origin_mm", "joints.limits_deg", "joints.speed_deg_per_s", "joints.stiffness_Nm_per_rad"):
        assert robot.sources[key]


@pytest.mark.parametrize("name", sorted({*TABLE} - {*COMPUTED}))
def test_a_parallelogram_is_described_and_refused_by_name(name: str) -> None:
    (finding,) = refused(lambda: load_robot(name))
    assert finding.code == "KIN012" and f"`{name}`" in finding.message


def test_the_arm_of_the_study_has_its_published_numbers() -> None:
    robot = load_robot("irb4600_60_205")
    assert robot.mass.sum() == 425 and robot.stiffness_source == "measured"
    assert 1 / robot.joint_compliance == pytest.approx([0.237e6, 3.32e6, 2.79e6, 0.486e6, 0.521e6, 0.38e6])  # type: ignore[operator]
    assert np.degrees(robot.lower).tolist() == pytest.approx([-180, -90, -180, -400, -125, -400])
    assert load_robot("ur10").joint_compliance is None


@pytest.mark.parametrize("name", sorted(set(list_robots()) & set(A.ARMS)))
def test_an_arm_agrees_with_an_independent_one(name: str) -> None:
    robot, other = load_robot(name), A.ARMS[name]()
    q = np.random.default_rng(1).uniform(-6, 6, (200, 6))
    f, T = other.forward(q, np.eye(4)), body_poses(robot, q)
    assert np.abs(forward(robot, q) - f.flange).max() < 1e-12
    assert robot.mass[1:] == pytest.approx(other.mass[1:], rel=2e-3)
    for b in range(1, 7) if "205" in name or name.startswith("ur") else ():
        center = T[:, b, :3, 3] + T[:, b, :3, :3] @ robot.center[b]
        assert np.abs(center - f.body[b][:, :3, 3] - f.body[b][:, :3, :3] @ other.center[b]).max() < 1e-12
    for key in ("joints.limits_deg", "joints.speed_deg_per_s", "joints.acceleration_rad_per_s2", "bodies.body"):
        assert robot.sources[key]
    assert robot.sources["joints.jerk_rad_per_s3"].startswith("estimate")
    assert pickle.loads(pickle.dumps(robot)).name == name


@pytest.mark.parametrize("name", ["irb4600_60_205", "ur10"])
def test_jacobian_is_the_derivative_of_the_pose(name: str) -> None:
    robot, tool, h = load_robot(name), np.eye(4), 1e-6
    tool[:3, 3] = [0.1, -0.2, 0.3]
    q = np.random.default_rng(11).uniform(-2, 2, (50, 6))
    J = jacobian(robot, q, tool)
    for j in range(6):
        up, down = (forward(robot, q + s * h * np.eye(6)[j]) @ tool for s in (1, -1))
        spin = (up - down)[:, :3, :3] @ np.swapaxes(up[:, :3, :3], 1, 2) / (2 * h)
        angular = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        assert np.abs(J[:, :3, j] - (up - down)[:, :3, 3] / (2 * h)).max() < 1e-8
        assert np.abs(J[:, 3:, j] - angular).max() < 2e-6


LOGGED = {"irb6640_180_255", "irb1200_5_09"}
RULED = [name for name in list_robots() if name.startswith("irb") and name not in LOGGED]


def test_accelerations_that_nobody_logged_follow_the_rule() -> None:
    """57, 29, 60 rad/s^2 m^2 over the reach squared, 103, 111, 133 rad/s^2 m over the reach, printed with two digits."""
    assert len(RULED) == 37
    for robot in map(describe_robot, RULED):
        reach = robot.reach or 2.05  # the study's arm states none
        rule = np.array([57, 29, 60, 103, 111, 133]) / np.repeat([reach**2, reach], 3)
        assert robot.acceleration == pytest.approx(rule, rel=0.05), robot.name
        assert "estimate" in robot.sources["joints.acceleration_rad_per_s2"]


@pytest.mark.parametrize("name", ["irb6640_180_255", "irb4600_60_205", "irb2400_16_155"])
def test_drives_accelerate_links_and_rotors_at_the_zero_pose_as_stated(name: str) -> None:
    """Against the recursive Newton-Euler algorithm."""
    robot = describe_robot(name)
    assert robot.drives is not None
    none, each = np.zeros((3, 6)), np.eye(6)[:3]
    links = np.diag(inertial_torque(robot, (none, none, each), (np.zeros(3), np.zeros((3, 3)))))
    assert (robot.drives.torque / (links + robot.drives.rotor)) == pytest.approx(robot.acceleration[:3])
    assert (robot.drives.rotor > 0).all()
