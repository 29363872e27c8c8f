"""Files that belong together."""

from __future__ import annotations

from pathlib import Path

from postproc.rapid.program import read_program
from postproc.rapid.task import find_tasks
from postproc.rapid.walk import walk
from tests.rapid.build import module, places, target

SYS = """SYS:CFG_1.0:6:0::
#
CAB_TASKS:

      -Name "T_ROB2" -Type "NORMAL" -UseMechanicalUnitGroup "rob2" -MotionTask

      -Name "T_CTRL" -Type "NORMAL" -UseMechanicalUnitGroup "rob1"
#
MECHANICAL_UNIT_GROUP:

      -Name "rob2" -Robot "ROB_2" -MechanicalUnit_1 "TRACK_2"\\
      -UseMotionPlanner "motion_planner_2"
#
"""
MOC = 'MOC:CFG_1.0:6:0::\n#\nROBOT:\n\n      -name "ROB_2" -use_robot_type "ROB1_4600_60_2.05" -base_frame_pos_x 1\n#\n'
INFO = ">>SYSTEM_ID:\n4600-1\n\n>>TASK1: (T_CTRL,,)\nPROGMOD/Main.mod @ \n\n>>TASK2: (T_ROB2,,)\nSYSMOD/user.sys @ \n"


def write(path: Path, data: bytes | str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode("latin-1"))


def test_backup(tmp_path: Path) -> None:
    backup = tmp_path / "cell"
    write(backup / "BACKINFO" / "backinfo.txt", INFO)
    write(backup / "SYSPAR" / "SYS.cfg", SYS)
    write(backup / "SYSPAR" / "MOC.cfg", MOC)
    write(backup / "HOME" / "Weld.mod", module("Old;"))
    write(backup / "HOME" / "old.pgf", "<Program><Module>Weld.mod</Module></Program>")
    write(backup / "RAPID" / "TASK1" / "PROGMOD" / "Main.mod", module(""))
    write(backup / "RAPID" / "TASK2" / "PROGMOD" / "Weld.mod", module("MoveL P1,v5,z0,tool0;"))
    write(backup / "RAPID" / "TASK2" / "PROGMOD" / "Weld.pgf", "<Program><Module>Weld.mod</Module></Program>")
    write(
        backup / "RAPID" / "TASK2" / "SYSMOD" / "user.sys",
        f"MODULE user(SYSMODULE)\nPERS robtarget p1:={target(1, 2, 3)};\nENDMODULE",
    )
    tasks = find_tasks(tmp_path)
    assert [(t.name, t.moves, t.robot, t.robot_type) for t in tasks] == [
        ("T_CTRL", False, "", ""),
        ("T_ROB2", True, "ROB_2", "ROB1_4600_60_2.05"),
    ]
    assert [p.name for p in tasks[1].modules] == ["Weld.mod", "user.sys"]
    assert places(walk(read_program(tasks[1].read()))) == [(1, 2, 3)]
    assert [t.name for t in find_tasks(backup / "RAPID" / "TASK2")] == ["T_ROB2"]


def test_folder_with_a_program_list_and_a_loose_file(tmp_path: Path) -> None:
    write(
        tmp_path / "Hull.pgf",
        '<?xml version="1.0"?><Program><Module>main.MOD</Module>\n<Module> data.mod </Module></Program>',
    )
    write(tmp_path / "Main.mod", module("MoveL q,v5,z0,tool0;"))
    write(tmp_path / "data.mod", f"MODULE data\nCONST robtarget q:={target(4, 5, 6)};\nENDMODULE")
    write(tmp_path / "sub" / "other.modx", module(""))
    write(tmp_path / "notes.txt", "MODULE no")
    tasks = find_tasks(tmp_path)
    assert [(t.name, [p.name for p in t.modules]) for t in tasks] == [
        ("Hull", ["Main.mod", "data.mod"]),
        ("other", ["other.modx"]),
    ]
    assert find_tasks(tmp_path / "Hull.pgf")[0].modules == tasks[0].modules
    assert places(walk(read_program(tasks[0].read()))) == [(4, 5, 6)]


def test_task_folders_named_by_the_robot(tmp_path: Path) -> None:
    write(tmp_path / "RAPID" / "T_ROB1" / "a.mod", module(""))
    write(tmp_path / "RAPID" / "T_ROB2" / "a.mod", module(""))
    assert [(t.name, t.robot) for t in find_tasks(tmp_path)] == [("T_ROB1", ""), ("T_ROB2", "")]
    assert [t.name for t in find_tasks(tmp_path / "RAPID" / "T_ROB1" / "a.mod")] == ["a"]
