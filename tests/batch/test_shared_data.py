"""PERS data that tasks of one controller share: one object, which no task changes for another."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.diagnostics import Source
from postproc.tasks.nearby import MOST_FILES, read_nearby

from .folders import TOOL, UNNAMED, convert, statuses, target, write

TASKS = ">>TASK1: (T_ROB1,,)\n>>TASK2: (T_ROB2,,)\n>>TASK3: (T_BACK,,)\n"
SYS = """SYS:CFG_1.0:6:0::
#
CAB_TASKS:

      -Name "T_BACK" -Type "SEMISTATIC"

      -Name "T_ROB1" -Type "NORMAL" -UseMechanicalUnitGroup "rob1" -MotionTask

      -Name "T_ROB2" -Type "NORMAL" -UseMechanicalUnitGroup "rob2" -MotionTask
#
MECHANICAL_UNIT_GROUP:

      -Name "rob1" -Robot "ROB_1"

      -Name "rob2" -Robot "ROB_2"
#
"""
MOC = """MOC:CFG_1.0:6:0::
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1" -use_robot_type "ROB1_4600_2.05_60"

      -name "ROB_2" -use_robot_serial_number "rob_2" -use_robot_type "ROB2_4600_2.55_40"
#
"""
SHARED = f"PERS robtarget pA:={target(1200, 40)};"


def seam(declared: str, body: str = "") -> str:
    return (
        f"MODULE Seam\n  {TOOL.replace('PERS', 'TASK PERS')}\n  {declared}\n  PROC main()\n"
        f"    MoveJ {target(1190)},v500,fine,tTorch;\n    {body}MoveL pA,v100,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    )


def cell(root: Path, first: str, second: str, back: str = "") -> Path:
    """A controller with two arms and a background task."""
    return write(
        root,
        {
            "BACKINFO/backinfo.txt": TASKS,
            "SYSPAR/SYS.cfg": SYS,
            "SYSPAR/MOC.cfg": MOC,
            "RAPID/TASK1/PROGMOD/Seam.mod": first,
            "RAPID/TASK2/PROGMOD/Seam.mod": second,
            "RAPID/TASK3/PROGMOD/Back.mod": f"MODULE Back\n  {back}\nENDMODULE\n",
        },
    )


def declared_in(path: Path) -> list[str]:
    """What a module declares `pA` as."""
    return re.findall(r"^\s*((?:TASK )?PERS robtarget pA:=.*;)", path.read_text(), re.MULTILINE)


def moves_to(path: Path) -> str:
    """The target of the last motion statement."""
    return re.findall(r"MoveL (.*),v100,fine,tTorch", path.read_text().replace("\n", ""))[-1]


def test_one_value_serves_two_arms_and_each_corrects_its_own_statement(tmp_path: Path) -> None:
    source = cell(tmp_path / "in", seam(SHARED), seam(SHARED))
    batch, _ = convert(source, tmp_path / "out", UNNAMED)
    assert statuses(batch) == {"RAPID/TASK1": "compensated", "RAPID/TASK2": "compensated"}, batch.outcomes
    outputs = [tmp_path / f"out/RAPID/TASK{n}/PROGMOD/Seam.mod" for n in (1, 2)]
    assert [declared_in(path) for path in outputs] == [[SHARED], [SHARED]]
    assert len({moves_to(path) for path in outputs}) == 2, "each arm strays by itself"
    assert all(o.figures["max_error_after_mm"] < o.figures["max_error_before_mm"] for o in batch.outcomes)


def test_data_of_each_task_is_corrected_where_it_is_declared(tmp_path: Path) -> None:
    own = f"TASK {SHARED}"
    convert(cell(tmp_path / "in", seam(own), seam(own)), tmp_path / "out", UNNAMED)
    for number in (1, 2):
        path = tmp_path / f"out/RAPID/TASK{number}/PROGMOD/Seam.mod"
        assert declared_in(path) != [own] and moves_to(path) == "pA"


def test_a_background_task_that_declares_data_keeps_its_value(tmp_path: Path) -> None:
    source = cell(tmp_path / "in", seam(SHARED), seam(f"TASK {SHARED}"), SHARED)
    convert(source, tmp_path / "out", UNNAMED)
    assert declared_in(tmp_path / "out/RAPID/TASK1/PROGMOD/Seam.mod") == [SHARED]


WRITES = "PROC main()\n    pA.trans.z:=900;\n  ENDPROC"
BY_NAME = 'PROC main()\n    VAR robtarget p;\n    SetDataVal "pA",p;\n  ENDPROC'


@pytest.mark.parametrize("back", [f"{SHARED}\n  {WRITES}", f"{SHARED}\n  {BY_NAME}", SHARED.replace("900", "950")])
def test_what_another_task_may_change_is_assumed_and_told(tmp_path: Path, back: str) -> None:
    source = cell(tmp_path / "in", seam(SHARED), seam(f"TASK {SHARED}"), back)
    batch, _ = convert(source, tmp_path / "out", UNNAMED)
    texts = {o.task.name: " ".join(f.message for f in o.findings) for o in batch.outcomes}
    assert "another task of the controller writes `pA`" in texts["RAPID/TASK1"]
    assert "another task" not in texts["RAPID/TASK2"]


def test_a_job_is_done_again_where_another_task_begins_to_write(tmp_path: Path) -> None:
    source = cell(tmp_path / "in", seam(SHARED), seam(f"TASK {SHARED}"), SHARED)
    convert(source, tmp_path / "out", UNNAMED)
    cell(tmp_path / "in", seam(SHARED), seam(f"TASK {SHARED}"), f"{SHARED}\n  {WRITES}")
    batch, _ = convert(source, tmp_path / "out", UNNAMED)
    assert {o.task.name: o.cached for o in batch.outcomes} == {"RAPID/TASK1": False, "RAPID/TASK2": True}


def test_of_too_many_files_near_a_program_none_is_read_and_that_is_said(tmp_path: Path) -> None:
    lacking = b"MODULE New\n  PROC r()\n    MoveL pNear,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    own = [Source("New.mod", lacking)]
    near = f"MODULE Near\n  PERS robtarget pNear:={target(1100)};\nENDMODULE\n"
    write(tmp_path, {"New.mod": lacking, "Near.mod": near, **{f"m{i}.mod": "" for i in range(MOST_FILES - 1)}})
    assert [d.code for d in read_nearby(own, tmp_path).findings] == ["RAP038"], "as many as may be read"
    write(tmp_path, {"one_more.mod": ""})
    found = read_nearby(own, tmp_path)
    assert not found.sources and [d.code for d in found.findings] == ["RAP040"]
