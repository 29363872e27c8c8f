"""Robot files: what a user writes, and what is said about mistakes and about names that controllers use."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.robot.arm import Robot
from postproc.robot.catalogue import ARMS, describe_robot, doubts, list_robots, load_robot, read_robot
from postproc.robot.configuration import confdata
from postproc.robot.controller import Backup, arm_entries, read_drive, read_entries
from postproc.robot.inverse import joint_solution
from postproc.robot.kinematics import forward
from postproc.robot.type_names import library_name, nearest_names
from tests.build import refused

UR5 = (ARMS / "ur5.toml").read_text(encoding="utf-8")
Q = np.random.default_rng(0).uniform(-3, 3, (20, 6))


def test_a_geometry_alone_is_an_arm_without_weight() -> None:
    bare = read_robot(Source("cell/arm.toml", UR5[UR5.index("[dh]") : UR5.index("[joints]")].encode()))
    assert bare.name == "arm" and np.abs(forward(bare, Q) - forward(load_robot("ur5"), Q)).max() < 1e-12
    assert np.degrees(bare.upper).tolist() == pytest.approx([360.0] * 6) and (bare.jerk == 60 * bare.acceleration).all()
    assert bare.sources["joints"].startswith("not stated") and not bare.mass.any()
    assert [d.code for d in doubts(bare)] == ["KIN010"]


@pytest.mark.parametrize(
    ("text", "places"),
    [
        (UR5.replace("a_mm =", "a_m ="), ["5:2", "6:1"]),
        (UR5.replace("[0, -425, ", "[0, "), ["6:8"]),
        (UR5.replace("mass_kg = 3.7,", "mass_kg = -3.7,"), ["20:8"]),
        ("name = 'x'\nname = 'y'\n", ["2:11"]),
        (UR5.replace("[dh]", "[chian]"), ["5:2"]),
    ],
)
def test_mistakes_are_found_at_their_place(text: str, places: list[str]) -> None:
    findings = refused(lambda: read_robot(Source("arm.toml", text.encode())))
    assert [(d.code, d.place) for d in findings] == [("KIN007", f"arm.toml:{place}") for place in places]


FLANGE = 'rpy="0 1.5707963267948966 0"'
INERTIAL = '<inertial><origin xyz="0.1 0 0"/><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
ORIGINS = ["0 0 0.495", "0.175 0 0", "0 0 0.9", "0 0 0.175", "0.96 0 0", "0.135 0 0"]
AXES = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]
JOINT = """<joint name="j{i}" type="revolute"><parent link="l{before}"/><child link="l{i}"/><origin xyz="{origin}"/>
<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="2" effort="100"/></joint>"""
URDF = '<robot name="arm"><link name="l0"/>'
for i, (origin, axis) in enumerate(zip(ORIGINS, AXES, strict=True), 1):
    URDF += f'<link name="l{i}">{INERTIAL}</link>' + JOINT.format(i=i, before=i - 1, origin=origin, axis=axis)
URDF += '<link name="tool0"/><joint name="f" type="fixed"><parent link="l6"/><child link="tool0"/>'
URDF += f'<origin {FLANGE} xyz="0 0 0"/></joint></robot>'
# A straight wrist, the joint frames of the file turned against the base.
TURNED = URDF.replace(
    'xyz="0 0 0.9"/>\n<axis xyz="0 1 0"/>', 'xyz="0 0 0.9" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 -1"/>'
).replace('xyz="0 0 0.175"/>\n<axis', 'xyz="0 0.175 0" rpy="-1.5707963267948966 0 0"/><axis')

Loader = Callable[[str], Robot]


@pytest.fixture
def loaded(tmp_path: Path) -> Loader:
    """Reads the text of a URDF from a file."""

    def load(text: str) -> Robot:
        (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
        return load_robot(tmp_path / "arm.urdf")

    return load


@pytest.mark.parametrize("text", [URDF, TURNED], ids=["plain", "turned frames"])
def test_urdf_gives_the_same_arm(loaded: Loader, text: str) -> None:
    robot, q = loaded(text), Q.copy()
    assert np.abs(forward(robot, q) - forward(load_robot("irb4600_60_205"), q)).max() < 1e-12
    assert robot.mass.tolist() == [0, 5, 5, 5, 5, 5, 5] and robot.center[6] == pytest.approx([0.1, 0, 0])
    q[:, 4] = 1e-6
    T = forward(robot, q)
    assert np.abs(forward(robot, joint_solution(robot, T, confdata(robot, q)).q) - T).max() < 1e-9


@pytest.mark.parametrize("quarter", ["1.5708", "1.571", "1.570796", "1.57079633", "1.5707963267948966"])
def test_rounded_quarter_turns_of_a_urdf_are_quarter_turns(loaded: Loader, quarter: str) -> None:
    """tool0 with rpy="0 1.5708 0", as in the common URDFs of ABB arms: four digits are enough for the closed form."""
    robot = loaded(URDF.replace(FLANGE, f'rpy="0 {quarter} 0"'))
    assert robot.opw is not None and np.abs(forward(robot, Q) - forward(load_robot("irb4600_60_205"), Q)).max() < 1e-12
    findings = doubts(robot)
    assert [(d.code, d.severity) for d in findings] == ([] if len(quarter) > 12 else [("KIN013", "info")])
    assert all(quarter in d.message for d in findings)


def test_an_angle_that_is_meant_stays(loaded: Loader) -> None:
    robot = loaded(URDF.replace(FLANGE, 'rpy="0 1.5650 0"'))
    assert robot.opw is None and doubts(robot) == []
    assert robot.link[6, 0, 2] == pytest.approx(np.sin(1.565), abs=1e-12)


def test_limits_of_a_continuous_joint_are_a_turn(loaded: Loader) -> None:
    robot = loaded(URDF.replace('type="revolute"', 'type="continuous"'))
    assert robot.lower.tolist() == [-2 * np.pi] * 6 and robot.upper.tolist() == [2 * np.pi] * 6


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (URDF, []),
        (re.sub("<inertial>.*?</inertial>", "", URDF), ["no masses"]),
        (URDF.replace("0 0 0.9", "0 0 900").replace("0.96 0 0", "960 0 0"), ["lengths are in m in a URDF"]),
    ],
)
def test_a_urdf_that_is_hardly_meant_is_doubted(loaded: Loader, text: str, said: list[str]) -> None:
    findings = [f"{d.message} {d.help}" for d in doubts(loaded(text))]
    assert len(findings) == len(said) and all(words in finding for words, finding in zip(said, findings, strict=True))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (URDF.replace('type="revolute"', 'type="fixed"', 1), "six in a chain are needed"),
        (URDF.replace('lower="-3" upper="3"', 'lower="3" upper="-3"'), "lower limit"),
        (re.sub(r' velocity="[^"]*"', "", URDF, count=1), "limit has no velocity"),
    ],
)
def test_a_urdf_that_is_no_arm_is_refused(
    loaded: Loader, text: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (finding,) = refused(lambda: loaded(text))
    assert finding.code == "KIN007" and said in finding.message
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("name", ["arm.xacro", "arm.urdf.xacro", "arm.urdf"])
def test_a_xacro_file_is_told_how_to_become_a_urdf(tmp_path: Path, name: str) -> None:
    text = '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="m"/></robot>'
    (tmp_path / name).write_text(text, encoding="utf-8")
    (finding,) = refused(partial(load_robot, tmp_path / name))
    assert finding.code == "KIN007" and "xacro" in finding.message
    assert f"`xacro {tmp_path / name} > arm_made.urdf`" in finding.help


def test_what_xacro_has_made_is_a_urdf(loaded: Loader) -> None:
    made = URDF.replace('<robot name="arm">', '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">')
    assert loaded(made).opw is not None


@pytest.mark.parametrize(
    ("name", "message", "help_"),
    [
        ("irb4600_60_250", "there is no robot `irb4600_60_250`", "did you mean `irb4600_60_205` or "),
        ("IRB 4600-40/2.55", "there is no robot `IRB 4600-40/2.55`", "the library calls it `irb4600_40_255`; "),
        ("mine.toml", "there is no robot file `mine.toml`", ""),
    ],
)
def test_an_unknown_robot_is_told_with_the_nearest_names(name: str, message: str, help_: str) -> None:
    (finding,) = refused(lambda: load_robot(name))
    assert (finding.code, finding.message) == ("KIN006", message) and finding.help.startswith(help_)


def test_no_arm_of_the_library_is_doubted() -> None:
    assert [doubts(describe_robot(name)) for name in list_robots()] == [[]] * len(list_robots())


@pytest.mark.parametrize(
    ("type_", "name", "near"),
    [
        ("ROB1_4600_2.05_60", "irb4600_60_205", "irb4600"),
        ("rob1_4600_2.550_40.0_TypeC", "irb4600_40_255", "irb4600"),
        ("IRB 4600-20/2.50", "irb4600_20_250", "irb4600"),
        # Options are other arms, and the nearest are of the same model.
        ("ROB1_6700_LeanID_2.65_235", None, "irb6700"), ("ROB1_6700_LeanID_2.65_220", None, "irb6700"),
        ("ROB1_4600_3.0_25", None, "irb4600"), ("IRB 1600-99/1.2", None, "irb1600"),
        *((other, None, "") for other in ("ROB1_660_180", "ROB1_660_250", "ROB1_360_1.6_6", "ROB1_910SC_0.55_3")),
        *((f"ROB_{side}_14000_05_05_TYPEA", None, "") for side in "RL"), ("ROB1_8700_LeanID_3.50_630", None, ""),
        *((other, None, "any") for other in ("GantryXYZ", "ZhongXunGantry1", "GantryRob", "STN1", "")),
    ],
)  # fmt: skip
def test_arms_by_the_names_that_controllers_give_them(type_: str, name: str | None, near: str) -> None:
    assert library_name(type_) == name
    nearest = nearest_names(type_)
    assert set(nearest) <= set(list_robots())
    assert near == "any" or {n.split("_")[0].removesuffix("id") for n in nearest} == ({near} if near else set())


def test_the_only_arm_is_that_of_a_task_that_the_configuration_does_not_list() -> None:
    """System tasks stand in a backup's RAPID folder and not in its SYS.cfg."""
    motion = read_entries('ROBOT:\n\n      -name "ROB_1" -use_robot_type "ROB1_1200_0.9_5_TypeB"\n#\n')
    system = read_entries('CAB_TASKS:\n\n      -Name "T_ROB1" -MotionTask\n#\n')
    drive = read_drive(Backup({"TASK2": "PSC_CBC"}, system, motion), "TASK2")
    assert (drive.task, drive.arm, drive.unknown) == ("PSC_CBC", "irb1200_5_09", None)


def test_gantries_and_positioners_are_no_arms() -> None:
    arm = '-name "ROB_1" -use_robot_type "ROB1_140_0.81_6"\\\n      -base_frame_coordinated "GAN"'
    gantry = '-name "GANTRY_1" -use_robot_type "ROB_AS_GANTRY" -use_joint_0 "x"'
    text = f'ROBOT_TYPE:\n\n      -name "ROB_AS_GANTRY" -type "GEN_KIN" -no_of_joints 3\n#\nROBOT:\n\n      {arm}\n'
    text += f'      {gantry}\n      -name "STN1" -use_robot_type "STN1"\n#\n'
    assert [e["name"] for e in arm_entries(read_entries(text))] == ["ROB_1"]


def test_a_urdf_without_pinocchio_names_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (finding,) = refused(partial(load_robot, tmp_path / "arm.urdf"))
    assert finding.code == "KIN007" and "conda-forge" in finding.help


def test_limits_of_acceleration_say_where_they_come_from() -> None:
    """Two arms of the library were logged; a file states them, says otherwise, or leaves them to an estimate."""
    logged = {name for name in list_robots() if describe_robot(name).acceleration_source == "logged"}
    assert {name for name in logged if "seed" not in name} == {"irb1200_5_09", "irb6640_180_255"}
    limits = "acceleration_rad_per_s2 = [8, 8, 8, 20, 20, 25]\n"
    for added, source in (
        ("", "estimated"),
        (limits, "stated"),
        (f'{limits}acceleration_source = "logged"\n', "logged"),
    ):
        text = re.sub(r"(?m)^acceleration.*\n", "", UR5).replace("[joints]\n", f"[joints]\n{added}")
        assert read_robot(Source("arm.toml", text.encode())).acceleration_source == source
