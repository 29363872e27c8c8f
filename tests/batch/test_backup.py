"""A controller's backup: which modules run together, on which arm, and data that its tasks share."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from postproc.diagnostics import Source
from postproc.tasks.discover import discover
from postproc.tasks.nearby import MOST_FILES, read_nearby

from . import build
from .build import BACKINFO, MOC, SYS, TOOL, UNNAMED, Work, backup, module, program, target, tree, write

MAIN, SEAM, USER = ("RAPID/TASK1/" + name for name in ("PROGMOD/Main.mod", "PROGMOD/Seam.mod", "SYSMOD/user.sys"))
DONE = {"RAPID/TASK1": "compensated"}
CALLS_SEAM = {MAIN: module("Main", "", "rSeam;")}


def test_the_modules_of_a_backup_run_together(work: Work) -> None:
    backup(work.source)
    made = work.convert(UNNAMED)
    assert made.statuses == DONE
    assert made.told[0].arm == {"robot": build.ARM, "robot_from": "the controller's configuration", "scope": "all"}
    before, after = tree(work.source), work.outputs()
    assert set(before) == set(after)
    assert {SEAM} <= {name for name in before if before[name] != after[name]} <= {MAIN, SEAM, USER}


def test_a_task_whose_arm_nobody_knows_needs_a_model(work: Work) -> None:
    backup(work.source, **{"SYSPAR/SYS.cfg": SYS.replace('"rob2" -MotionTask', '"rob1" -MotionTask')})
    assert work.refusal(UNNAMED).code == "KIN011"
    made = work.convert()
    assert made.statuses == DONE
    assert next((f.code, f.severity) for f in made.findings("RAPID/TASK1")) == ("KIN011", "info")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("MOC", "ROB2_4600_2.05_60", "ROB1_660_180", "`ROB1_660_180`, which is not in"),
        ("MOC", "ROB2_4600_2.05_60", "ROB_L_14000_05_05_TYPEA", "ROB_L_14000_05_05_TYPEA"),
        ("MOC", MOC, "", "the backup has no SYSPAR/MOC.cfg"),
        ("SYS", SYS, "", "`ROB_1` (`ROB1_6700_LeanID_2.65_220`) and `ROB_2` (`ROB2_4600_2.05_60`)"),
        ("SYS", '-UseMechanicalUnitGroup "rob2" ', "", "no mechanical unit group says which"),
        ("SYS", "T_MAIN", "T_OTHER", "its SYS.cfg does not list the task `T_MAIN`"),
    ],
)
def test_a_backup_whose_arm_is_not_understood_is_refused(
    work: Work, file: str, old: str, new: str, message: str
) -> None:
    backup(work.source, **{f"SYSPAR/{file}.cfg": {"MOC": MOC, "SYS": SYS}[file].replace(old, new)})
    finding = work.refusal(UNNAMED)
    assert finding.code == "KIN011" and message in finding.message
    assert "`--robot NAME`" in (finding.help or "") and "`-m MODEL`" in (finding.help or "")
    assert not (work.out / SEAM).exists()


def test_the_only_arm_beside_a_gantry_of_ones_own_is_the_arm(work: Work) -> None:
    gantry = '      -name "GANTRY_1" -use_robot_type "MyGantry"\\\n      -base_frame_pos_z 2\n#\nROBOT_TYPE:\n\n      -name "MyGantry" -type "GEN_KIN" -no_of_joints 3\n#\n'
    moc = MOC.replace('"ROB1_6700_LeanID_2.65_220" -use_robot_calib "r1_uncalib"', '"MyGantry"')
    moc = moc.replace('-use_robot_serial_number "rob_1"\\\n', "\\\n").replace(" {base}\n#\n", f" \n\n{gantry}")
    backup(work.source, **{"SYSPAR/MOC.cfg": moc, "SYSPAR/SYS.cfg": ""})
    assert {task.name: task.robot for task, _ in work.plan(UNNAMED).tasks}["RAPID/TASK1"] == build.ARM


@pytest.mark.parametrize(
    ("base", "code"),
    [
        ("-base_frame_pos_x 3.7", "KIN001"),
        ("-base_frame_pos_x 0.004", None),
        ('-base_frame_coordinated "TRACK1"', "BAT013"),
        ("-base_frame_pos_x nowhere", "BAT013"),
    ],
)
def test_targets_are_taken_in_the_world_where_the_controller_places_the_base(
    work: Work, base: str, code: str | None
) -> None:
    backup(work.source)
    work.into("plain").convert()
    backup(work.source, base)
    made = work.convert()
    if code is None:
        assert made.statuses == DONE
        assert (work.out / SEAM).read_bytes() != (work.into("plain").out / SEAM).read_bytes()
    else:
        assert code in made.codes("RAPID/TASK1") and made.batch.failed and not (work.out / SEAM).exists()


def test_what_the_controller_corrects_is_not_corrected_once_more(work: Work) -> None:
    backup(work.source, '-use_robot_calib "r1_calib"')
    assert work.refusal().code == "KIN017"
    stated = replace(build.ROUGH, options=replace(build.ROUGH.options, already=("geometry", "gravity")))
    assert not work.convert(stated).batch.failed
    backup(work.source, '-use_robot_calib "r1_uncalib"')
    assert not work.convert().batch.failed


def test_what_every_task_shares_is_read_and_not_written(work: Work) -> None:
    shared = module("shared(SYSMODULE)", TOOL)
    backup(work.source, **CALLS_SEAM, **{USER: module("user(SYSMODULE)"), "RAPID/TASK0/SYSMOD/shared.sys": shared})
    assert work.convert().statuses == DONE
    assert (work.out / "RAPID/TASK0/SYSMOD/shared.sys").read_text() == shared


def test_data_without_a_value_has_that_of_another_task(work: Work) -> None:
    """One object in all tasks, as MultiMove cells declare it; LOCAL and TASK data is another in each."""
    head = module("Head", f"VAR num nOther:=1;\n  {TOOL}", "MoveL *,v100,fine,tool0;")
    files = {**CALLS_SEAM, SEAM: program("Seam", tool="PERS tooldata tTorch;"), USER: module("user")}
    backup(work.source, **files, **{"RAPID/TASK8/PROGMOD/Head.mod": head})
    assert work.convert().statuses["RAPID/TASK1"] == "compensated"
    assert (work.out / SEAM).read_text().count("PERS tooldata tTorch;") == 1
    work.write({"RAPID/TASK8/PROGMOD/Head.mod": head.replace("PERS", "TASK PERS")})
    assert "RAP020" in work.convert().codes("RAPID/TASK1")


def test_the_module_for_run_time_is_in_the_list_of_its_task(work: Work) -> None:
    backup(work.source)
    listed = work.out / "BACKINFO/backinfo.txt"
    for _ in range(2):
        batch = work.convert(build.RUN_TIME).batch
        assert not batch.failed and not batch.findings, batch.findings
        assert "PROGMOD/Main.mod @ \nSYSMOD/ppModel.sys @ \n\n>>TASK2" in listed.read_text()
        assert (work.out / "RAPID/TASK1/SYSMOD/ppModel.sys").is_file()
    work.convert()
    assert listed.read_text() == BACKINFO, "without the module as it was"


def test_a_controller_loads_the_modules_of_its_list_alone(work: Work) -> None:
    """A copy of a module that BACKINFO does not list is copied, said, and neither refused nor read along."""
    copy = program("Seam", tool="").replace("  PROC", f"  PERS robtarget pOld:={target(1100)};\n  PROC")
    unlisted, new = (f"RAPID/TASK1/PROGMOD/{name}.mod" for name in ("Seam_old", "New"))
    backup(work.source, **{unlisted: copy})
    made = work.convert(UNNAMED)
    assert made.statuses == DONE
    (message,) = [f.message for f in made.findings("RAPID/TASK1") if f.code == "BAT022"]
    assert message.endswith(f"`{unlisted}`") and (work.out / unlisted).read_text() == copy

    uses = module("New", "", "MoveL pOld,v100,fine,tTorch;")
    work.write({new: uses})
    for listed in (False, True):
        sources = read_nearby([Source(new, uses.encode())], work.source).sources
        assert any(b"pOld" in s.data for s in sources) == listed
        work.write({"BACKINFO/backinfo.txt": BACKINFO.replace("PROGMOD/Main.mod", "PROGMOD/Seam_old.mod")})


def test_a_list_without_the_modules_of_a_program_leaves_them_in(work: Work) -> None:
    backup(work.source, **{"BACKINFO/backinfo.txt": ">>TASK1: (T_MAIN,Prog,)\nSYSMOD/user.sys @\n"})
    (task,) = (task for task in discover(work.source)[0] if task.name == "RAPID/TASK1")
    assert {name.rpartition("/")[2] for name in task.files} >= {"Main.mod", "Seam.mod", "user.sys"}
    assert "Hidden.sys" in task.findings[0].message, "its list names the other module of SYSMOD"


def test_a_task_without_motion_needs_no_arm_and_a_backup_of_these_is_told_apart_from_an_empty_one(work: Work) -> None:
    arms = "\n\n".join(f'      -name "ROB_{n}" -use_robot_type "ROB{n}_4600_2.05_60"' for n in (1, 2))
    still = {f"HOME/{name}.mod": module(name, "", "WaitTime 1;") for name in "ab"}
    work.write({**still, "RAPID/TASK9/PROGMOD/talk.mod": module("Talk", "", 'TPWrite "hello";')})
    work.write({"SYSPAR/MOC.cfg": f"ROBOT:\n\n{arms}"})
    finding = work.refusal()
    assert "none of its 3 modules, such as `HOME/a.mod`, moves an arm" in finding.message
    assert "loaded at run time" in (finding.help or "")
    work.write({"RAPID/TASK1/PROGMOD/a.mod": module("A", "", "MoveL *,v100,fine,tool0;")})
    tasks, copies = discover(work.source)
    assert [task.name for task in tasks] == ["RAPID/TASK1"] and tasks[0].unknown is not None
    assert "RAPID/TASK9/PROGMOD/talk.mod" in copies


MAIN_TASK, ARM_TASK = '-Name "T_MAIN"', '-Name "T_ROB1" -Type "NORMAL" -UseMechanicalUnitGroup "rob1" -MotionTask'
TWO_ARMS = {
    "BACKINFO/backinfo.txt": ">>TASK1: (T_ROB1,,)\n>>TASK2: (T_ROB2,,)\n>>TASK3: (T_BACK,,)\n",
    "SYSPAR/SYS.cfg": SYS.replace(MAIN_TASK, f'{ARM_TASK}\n\n      -Name "T_ROB2"'),
    "SYSPAR/MOC.cfg": MOC.replace("4600_2.05_60", "4600_2.55_40").replace("6700_LeanID_2.65_220", "4600_2.05_60"),
}
SHARED = f"PERS robtarget pA:={target(1200, 40)};"
LOCAL = f"TASK {SHARED}"
WRITES = "\n  PROC main()\n    pA.trans.z:=900;\n  ENDPROC"
BY_NAME = '\n  PROC main()\n    VAR robtarget p;\n    SetDataVal "pA",p;\n  ENDPROC'


def two_arms(work: Work, first: str, second: str, background: str = "") -> list[Path]:
    """A controller with two arms and a background task, with these declarations of `pA`; the outputs of the arms."""
    names = [f"RAPID/TASK{n}/PROGMOD/Seam.mod" for n in (1, 2)]
    body = (f"MoveJ {target(1190)},v500,fine,tTorch;", "MoveL pA,v100,fine,tTorch;")
    tool = TOOL.replace("PERS", "TASK PERS")
    work.write(
        {name: module("Seam", f"{tool}\n  {data}", *body) for name, data in zip(names, (first, second), strict=True)}
    )
    work.write({**TWO_ARMS, "RAPID/TASK3/PROGMOD/Back.mod": module("Back", background)})
    return [work.out / name for name in names]


def declared_in(path: Path) -> list[str]:
    """What a module declares `pA` as."""
    return re.findall(r"^\s*((?:TASK )?PERS robtarget pA:=.*;)", path.read_text(), re.MULTILINE)


def moves_to(path: Path) -> str:
    """The target of the last motion statement."""
    return re.findall(r"MoveL (.*),v100,fine,tTorch", path.read_text().replace("\n", ""))[-1]


def test_one_value_serves_two_arms_and_each_corrects_its_own_statement(work: Work) -> None:
    both = two_arms(work, SHARED, SHARED)
    made = work.convert(UNNAMED)
    assert made.statuses == {"RAPID/TASK1": "compensated", "RAPID/TASK2": "compensated"}
    assert [declared_in(path) for path in both] == [[SHARED], [SHARED]]
    assert len({moves_to(path) for path in both}) == 2, "each arm strays by itself"
    assert all(o.figures["max_error_after_mm"] < o.figures["max_error_before_mm"] for o in made.told)


def test_data_of_each_task_is_corrected_where_it_is_declared(work: Work) -> None:
    both = two_arms(work, LOCAL, LOCAL)
    work.convert(UNNAMED)
    assert all(declared_in(path) != [LOCAL] and moves_to(path) == "pA" for path in both)


@pytest.mark.parametrize("background", [SHARED + WRITES, SHARED + BY_NAME, SHARED.replace("900", "950")])
def test_what_another_task_may_change_is_assumed_told_and_done_again(work: Work, background: str) -> None:
    first, _ = two_arms(work, SHARED, LOCAL, SHARED)
    work.convert(UNNAMED)
    assert declared_in(first) == [SHARED], "a background task that declares it, too, keeps its value"
    two_arms(work, SHARED, LOCAL, background)
    made = work.convert(UNNAMED)
    assert made.cached == {"RAPID/TASK2"}
    texts = [" ".join(f.message for f in made.findings(f"RAPID/TASK{n}")) for n in (1, 2)]
    assert "another task of the controller writes `pA`" in texts[0] and "another task" not in texts[1]


def test_of_too_many_files_near_a_program_none_is_read_and_that_is_said(tmp_path: Path) -> None:
    lacking = module("New", "", "MoveL pNear,v100,fine,tool0;")
    near = module("Near", f"PERS robtarget pNear:={target(1100)};")
    write(tmp_path, {"New.mod": lacking, "Near.mod": near, **{f"m{i}.mod": "" for i in range(MOST_FILES - 1)}})
    for code in ("RAP038", "RAP040"):  # as many as may be read, and one more
        along = read_nearby([Source("New.mod", lacking.encode())], tmp_path)
        assert [d.code for d in along.findings] == [code] and bool(along.sources) == (code == "RAP038")
        write(tmp_path, {"one_more.mod": ""})
