"""Robot files: what ships, what a user writes, and what is said about mistakes."""

from __future__ import annotations

import pickle
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.robot.catalogue import ARMS, describe_robot, doubts, list_robots, load_robot, read_robot
from postproc.robot.configuration import confdata
from postproc.robot.inverse import joint_solution
from postproc.robot.kinematics import body_poses, forward
from tests.build import refused
from tests.independent import arm as A


def test_shipped_numbers() -> None:
    robot = load_robot("irb4600_60_205")
    assert robot.mass.sum() == 425
    assert 1 / robot.joint_compliance == pytest.approx([0.237e6, 3.32e6, 2.79e6, 0.486e6, 0.521e6, 0.38e6])  # type: ignore[operator]
    assert np.degrees(robot.lower).tolist() == pytest.approx([-180, -90, -180, -400, -125, -400])
    T = body_poses(robot, np.zeros((1, 6)))[0]
    at_zero = T[:, :3, 3] + np.einsum("bij,bj->bi", T[:, :3, :3], robot.center)
    assert at_zero[4] == pytest.approx([0.78, 0, 1.57])
    assert load_robot("irb4600_60_205_seed").link[2, 2, 3] == pytest.approx(1.075)
    assert load_robot("irb4600_60_205").stiffness_source == "measured" and load_robot("ur10").joint_compliance is None


@pytest.mark.parametrize("name", sorted(set(list_robots()) & set(A.ARMS)))
def test_masses_agree_with_an_independent_table_and_every_number_has_a_source(name: str) -> None:
    robot, other = load_robot(name), A.ARMS[name]()
    q = np.random.default_rng(1).uniform(-2, 2, (5, 6))
    f = other.forward(q, np.eye(4))
    T = body_poses(robot, q)
    assert robot.mass[1:] == pytest.approx(other.mass[1:], rel=2e-3)
    if "205" in name or name.startswith("ur"):
        for b in range(1, 7):
            center = T[:, b, :3, 3] + T[:, b, :3, :3] @ robot.center[b]
            expected = f.body[b][:, :3, 3] + f.body[b][:, :3, :3] @ other.center[b]
            assert np.abs(center - expected).max() < 1e-12
    for key in ("joints.limits_deg", "joints.speed_deg_per_s", "joints.acceleration_rad_per_s2", "bodies.body"):
        assert robot.sources[key]
    assert robot.sources["joints.jerk_rad_per_s3"].startswith("estimate")
    assert pickle.loads(pickle.dumps(robot)).name == name


def test_a_geometry_alone_is_an_arm_without_weight() -> None:
    whole = (ARMS / "ur5.toml").read_text(encoding="utf-8")
    bare = read_robot(Source("cell/arm.toml", whole[whole.index("[dh]") : whole.index("[joints]")].encode()))
    assert bare.name == "arm"
    q = np.random.default_rng(2).uniform(-3, 3, (5, 6))
    assert np.abs(forward(bare, q) - forward(load_robot("ur5"), q)).max() < 1e-12
    assert np.degrees(bare.upper).tolist() == pytest.approx([360.0] * 6) and (bare.jerk == 10 * bare.acceleration).all()
    assert bare.sources["joints"].startswith("not stated") and not bare.mass.any()
    assert [d.code for d in doubts(bare)] == ["KIN010"]


def codes(text: str) -> list[tuple[str, str]]:
    return [(d.code, d.place) for d in refused(lambda: read_robot(Source("arm.toml", text.encode())))]


def test_mistakes_are_found_at_their_place() -> None:
    good = (ARMS / "ur5.toml").read_text(encoding="utf-8")
    assert codes(good.replace("a_mm =", "a_m =")) == [("KIN007", "arm.toml:5:2"), ("KIN007", "arm.toml:6:1")]
    assert codes(good.replace("[0, -425, ", "[0, ")) == [("KIN007", "arm.toml:6:8")]
    assert codes(good.replace("mass_kg = 3.7,", "mass_kg = -3.7,"))[0][0] == "KIN007"
    assert codes("name = 'x'\nname = 'y'\n")[0][0] == "KIN007"
    assert codes(good.replace("[dh]", "[chian]"))[0][0] == "KIN007"


def test_an_unknown_robot_is_told_with_the_nearest_names() -> None:
    (found,) = refused(lambda: load_robot("irb4600_60_250"))
    assert found.code == "KIN006" and found.help.startswith("did you mean `irb4600_60_205` or ")


URDF = """<robot name="arm"><link name="base"/>{links}{joints}<link name="tool0"/>
<joint name="f" type="fixed"><parent link="l6"/><child link="tool0"/><origin rpy="0 1.5707963267948966 0" xyz="0 0 0"/></joint></robot>"""


def urdf() -> str:
    origins = ["0 0 0.495", "0.175 0 0", "0 0 0.9", "0 0 0.175", "0.96 0 0", "0.135 0 0"]
    axes = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]
    links, joints = "", ""
    for i, (origin, axis) in enumerate(zip(origins, axes, strict=True), 1):
        inertial = '<inertial><origin xyz="0.1 0 0"/><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        links += f'<link name="l{i}">{inertial}</link>'
        parent = "base" if i == 1 else f"l{i - 1}"
        joints += (
            f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/><origin xyz="{origin}"/>'
            f'<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="2" effort="100"/></joint>'
        )
    return URDF.format(links=links, joints=joints)


def test_urdf_gives_the_same_arm(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(), encoding="utf-8")
    robot, shipped = load_robot(path), load_robot("irb4600_60_205")
    q = np.random.default_rng(0).uniform(-3, 3, (20, 6))
    assert np.abs(forward(robot, q) - forward(shipped, q)).max() < 1e-12
    assert robot.opw is not None
    assert robot.mass.tolist() == [0, 5, 5, 5, 5, 5, 5]
    assert robot.center[3] == pytest.approx([0.1, 0, 0])
    # A straight wrist, the joint frames of the file turned against the base.
    turned = urdf().replace(
        'xyz="0 0 0.9"/><axis xyz="0 1 0"/>', 'xyz="0 0 0.9" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 -1"/>'
    )
    turned = turned.replace('xyz="0 0 0.175"/><axis', 'xyz="0 0.175 0" rpy="-1.5707963267948966 0 0"/><axis')
    path.write_text(turned, encoding="utf-8")
    other = load_robot(path)
    assert np.abs(forward(other, q) - forward(shipped, q)).max() < 1e-12
    q[:, 4] = 1e-6
    T = forward(other, q)
    solution = joint_solution(other, T, confdata(other, q))
    assert np.abs(forward(other, solution.q) - T).max() < 1e-9
    path.write_text(urdf().replace('type="revolute"', 'type="fixed"', 1), encoding="utf-8")
    assert refused(lambda: load_robot(path))[0].code == "KIN007"


@pytest.mark.parametrize("quarter", ["1.5708", "1.571", "1.570796", "1.57079633", "1.5707963267948966"])
def test_rounded_quarter_turns_of_a_urdf_are_quarter_turns(tmp_path: Path, quarter: str) -> None:
    """tool0 with rpy="0 1.5708 0", as in the common URDFs of ABB arms: four digits are enough for the closed form."""
    path = tmp_path / "arm.urdf"
    path.write_text(urdf().replace('rpy="0 1.5707963267948966 0"', f'rpy="0 {quarter} 0"'), encoding="utf-8")
    robot, shipped = load_robot(path), load_robot("irb4600_60_205")
    q = np.random.default_rng(0).uniform(-3, 3, (20, 6))
    assert robot.opw is not None and np.abs(forward(robot, q) - forward(shipped, q)).max() < 1e-12
    told = [d for d in doubts(robot) if d.code == "KIN013"]
    assert [d.severity for d in told] == ([] if len(quarter) > 12 else ["info"])
    assert all(quarter in d.message for d in told)


def test_an_angle_that_is_meant_stays(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf().replace('rpy="0 1.5707963267948966 0"', 'rpy="0 1.5650 0"'), encoding="utf-8")
    robot = load_robot(path)
    assert robot.opw is None and doubts(robot) == []
    assert robot.link[6, 0, 2] == pytest.approx(np.sin(1.565), abs=1e-12)


def test_a_xacro_file_is_told_how_to_become_a_urdf(tmp_path: Path) -> None:
    text = '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="m"/></robot>'
    for name in ("arm.xacro", "arm.urdf.xacro", "arm.urdf"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        (found,) = refused(partial(load_robot, tmp_path / name))
        assert found.code == "KIN007" and "xacro" in found.message
        assert f"`xacro {tmp_path / name} > arm_made.urdf`" in found.help
    left = urdf().replace('<robot name="arm">', '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">')
    (tmp_path / "made.urdf").write_text(left, encoding="utf-8")
    assert load_robot(tmp_path / "made.urdf").opw is not None


def test_a_urdf_that_is_hardly_meant_is_doubted(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"

    def said(text: str) -> list[str]:
        path.write_text(text, encoding="utf-8")
        return [f"{d.code} {d.message} {d.help}" for d in doubts(load_robot(path))]

    assert said(urdf()) == []
    [massless] = said(re.sub("<inertial>.*?</inertial>", "", urdf()))
    assert "no masses" in massless
    [long] = said(urdf().replace("0 0 0.9", "0 0 900").replace("0.96 0 0", "960 0 0"))
    assert "lengths are in m in a URDF" in long
    assert [doubts(describe_robot(name)) for name in list_robots()] == [[]] * len(list_robots())


def test_limits_of_a_urdf_are_an_interval(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf().replace('lower="-3" upper="3"', 'lower="3" upper="-3"'), encoding="utf-8")
    with pytest.raises(PostprocError, match="lower limit"):
        load_robot(path)
    path.write_text(urdf().replace('type="revolute"', 'type="continuous"'), encoding="utf-8")
    robot = load_robot(path)
    assert robot.lower.tolist() == [-2 * np.pi] * 6
    assert robot.upper.tolist() == [2 * np.pi] * 6


def test_a_file_that_is_not_there_is_no_name(tmp_path: Path) -> None:
    with pytest.raises(PostprocError, match="there is no robot file"):
        load_robot(tmp_path / "mine.toml")


def test_a_joint_without_a_speed_limit_is_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.urdf").write_text(re.sub(r' velocity="[^"]*"', "", urdf(), count=1), encoding="utf-8")
    (found,) = refused(lambda: load_robot(tmp_path / "arm.urdf"))
    assert found.code == "KIN007" and "limit has no velocity" in found.message
    assert capfd.readouterr().err == ""
