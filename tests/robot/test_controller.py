"""Arms by the names that controllers give them."""

from __future__ import annotations

import pytest

from postproc.robot.catalogue import list_robots, load_robot
from postproc.robot.controller import Backup, arm_entries, read_drive, read_entries
from postproc.robot.type_names import library_name, nearest_names, parse_type_name
from tests.build import refused

OUT_OF_SCOPE = [
    "ROB1_660_180",
    "ROB1_660_250",
    "ROB1_360_1.6_6",
    "ROB1_910SC_0.55_3",
    "ROB_R_14000_05_05_TYPEA",
    "ROB_L_14000_05_05_TYPEA",
    "GantryXYZ",
    "ZhongXunGantry1",
    "GantryRob",
    "STN1",
    "ROB1_6700_LeanID_2.65_220",
    "ROB1_8700_LeanID_3.50_630",
    "",
]


@pytest.mark.parametrize("type_", OUT_OF_SCOPE)
def test_what_is_no_arm_of_the_library_is_not_taken_for_one(type_: str) -> None:
    assert library_name(type_) is None
    assert set(nearest_names(type_)) <= set(list_robots())


@pytest.mark.parametrize(
    ("type_", "model"),
    [
        ("ROB_R_14000_05_05_TYPEA", None),
        ("ROB1_8700_LeanID_3.50_630", None),
        ("ROB1_6700_LeanID_2.65_220", "irb6700"),
        ("ROB1_4600_3.0_25", "irb4600"),
        ("IRB 1600-99/1.2", "irb1600"),
    ],
)
def test_arms_of_another_model_are_not_the_nearest(type_: str, model: str | None) -> None:
    assert {name.split("_")[0].removesuffix("id") for name in nearest_names(type_)} == ({model} if model else set())


@pytest.mark.parametrize(
    ("type_", "name"),
    [
        ("ROB1_4600_2.05_60", "irb4600_60_205"),
        ("ROB2_4600_2.55_40", "irb4600_40_255"),
        ("rob1_4600_2.550_40.0_TypeC", "irb4600_40_255"),
        ("IRB 4600-40/2.55 Type C", "irb4600_40_255"),
        ("IRB 4600-20/2.50", "irb4600_20_250"),
    ],
)
def test_a_type_is_known_by_its_numbers(type_: str, name: str) -> None:
    assert library_name(type_) == name


def test_an_option_is_another_arm() -> None:
    plain, lean = parse_type_name("ROB1_6700_2.65_235"), parse_type_name("ROB1_6700_LeanID_2.65_235")
    assert plain is not None and lean is not None and not plain.is_same_arm(lean)


def test_a_controllers_name_for_an_arm_is_told_with_ours() -> None:
    assert refused(lambda: load_robot("IRB 4600-40/2.55"))[0].help.startswith("the library calls it `irb4600_40_255`; ")


def test_the_only_arm_is_that_of_a_task_that_the_configuration_does_not_list() -> None:
    """System tasks stand in a backup's RAPID folder and not in its SYS.cfg."""
    motion = read_entries('ROBOT:\n\n      -name "ROB_1" -use_robot_type "ROB1_1200_0.9_5_TypeB"\n#\n')
    system = read_entries('CAB_TASKS:\n\n      -Name "T_ROB1" -MotionTask\n#\n')
    found = read_drive(Backup({"TASK2": "PSC_CBC"}, system, motion), "TASK2")
    assert (found.task, found.arm, found.unknown) == ("PSC_CBC", "irb1200_5_09", None)


def test_gantries_and_positioners_are_no_arms() -> None:
    text = """MOC:CFG_1.0:6:0::
#
ROBOT_TYPE:

      -name "ROB_AS_GANTRY" -type "GEN_KIN" -no_of_joints 3
#
ROBOT:

      -name "ROB_1" -use_robot_type "ROB1_140_0.81_6"\\
      -base_frame_coordinated "GAN"
      -name "GANTRY_1" -use_robot_type "ROB_AS_GANTRY" -use_joint_0 "x"
      -name "STN1" -use_robot_type "STN1"
#
"""
    assert [e["name"] for e in arm_entries(read_entries(text))] == ["ROB_1"]
