"""The tree of outputs: what is converted, what is copied, what is left out."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from postproc.batch.document import batch_document
from postproc.batch.jobs import get_ready
from postproc.batch.values import Shard
from postproc.cli.convert.batch_lines import result_line
from postproc.diagnostics import PostprocError, Source
from postproc.report.terminal import render_text
from postproc.settings import Settings
from postproc.tasks.discover import discover
from postproc.tasks.nearby import read_nearby

from .folders import ARM, ROUGH, TOOL, UNNAMED, codes, convert, planned, program, statuses, target, tree, write

ENCRYPTED = b"\xfe\x01\x02\x03secret\x00\x05"
BACKINFO = ">>SYSTEM_ID:\nCell\n\n>>TASK1: (T_MAIN,,)\nPROGMOD/Seam.mod @ \nPROGMOD/Main.mod @ \n\n>>TASK2: (T_BACK,,)\n\n>>EOF:\n"
SYS = """SYS:CFG_1.0:6:0::
#
CAB_TASKS:

      -Name "T_BACK" -Type "SEMISTATIC"

      -Name "T_MAIN" -Type "NORMAL" -UseMechanicalUnitGroup "rob2" -MotionTask
#
MECHANICAL_UNIT_GROUP:

      -Name "rob1" -Robot "ROB_1"

      -Name "rob2" -Robot "ROB_2"\\
      -UseMotionPlanner "motion_planner_2"
#
"""
MOC = """MOC:CFG_1.0:6:0::
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1"\\
      -use_robot_type "ROB1_6700_LeanID_2.65_220" -use_robot_calib "r1_uncalib"

      -name "ROB_2" -use_robot_serial_number "rob_2"\\
      -use_robot_type "ROB2_4600_2.05_60" -base_frame_orient_u0 1 {base}
#
"""


def backup(root: Path, base: str = "", **more: str) -> Path:
    """A controller's backup: two modules and a system module share data, a background task, a copy in HOME."""
    main = "MODULE Main\n  PROC main()\n    rSeam;\n    MoveJ pShared,v500,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    data = f"MODULE user(SYSMODULE)\n  {TOOL}\n  CONST robtarget pShared:={target(1180)};\nENDMODULE\n"
    return write(
        root,
        {
            "BACKINFO/backinfo.txt": BACKINFO,
            "SYSPAR/SYS.cfg": SYS,
            "SYSPAR/MOC.cfg": MOC.replace("{base}", base),
            "HOME/Main.mod": main,
            "RAPID/TASK1/PROGMOD/Main.mod": main,
            "RAPID/TASK1/PROGMOD/Seam.mod": program("Seam", tool=""),
            "RAPID/TASK1/PROGMOD/Prog.pgf": "<Program><Module>Main.mod</Module></Program>",
            "RAPID/TASK1/SYSMOD/user.sys": data,
            "RAPID/TASK1/SYSMOD/Hidden.sys": ENCRYPTED,
            "RAPID/TASK2/PROGMOD/Back.mod": "MODULE Back\n  PROC main()\n    WaitTime 1;\n  ENDPROC\nENDMODULE\n",
            **more,
        },
    )


def test_the_tree_mirrors_the_folder_and_a_bad_file_stops_nobody(tmp_path: Path) -> None:
    source = write(
        tmp_path / "in",
        {
            "a.mod": program("A"),
            "deep/er/B.PRG": program("B", 1100),
            "bad.mod": "this is no RAPID",
            "far.mod": program("Far", 9000),
            "secret.sys": ENCRYPTED,
            "data.sys": f"MODULE data\n  {TOOL}\nENDMODULE\n",
            "deep/notes.txt": "left alone\r\n",
            ".git/config": "not ours",
        },
    )
    batch, told = convert(source, tmp_path / "out")
    assert batch.failed and batch.copied == 1
    assert statuses(batch) == {
        "a.mod": "compensated",
        "bad.mod": "failed",
        "data.sys": "unchanged",
        "deep/er/B.PRG": "compensated",
        "far.mod": "failed",
        "secret.sys": "unchanged",
    }
    assert codes(batch, "bad.mod") == ["RAP011"]
    assert len(told) == len(batch.outcomes)
    before, after = tree(source), tree(tmp_path / "out", without=[".postproc"])
    assert set(after) == {"a.mod", "deep/er/B.PRG", "secret.sys", "data.sys", "deep/notes.txt"}
    assert {n for n in after if after[n] == before[n]} == {"secret.sys", "data.sys", "deep/notes.txt"}
    assert re.search(rb"! postproc [\d.]+: compensated", (tmp_path / "out/a.mod").read_bytes())


def test_linked_folders_are_followed_but_not_in_circles(tmp_path: Path) -> None:
    write(tmp_path, {"in/a/one.mod": program("One"), "elsewhere/two.mod": program("Two")})
    (tmp_path / "in" / "linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "in" / "a" / "up").symlink_to(tmp_path / "in")
    (tmp_path / "elsewhere" / "back").symlink_to(tmp_path / "in" / "a")
    found = [task.name for task in discover(tmp_path / "in")[0]]
    assert found == ["a/one.mod", "linked/back/one.mod", "linked/two.mod"]


def test_the_modules_of_a_backup_run_together(tmp_path: Path) -> None:
    source = backup(tmp_path / "in")
    batch, _ = convert(source, tmp_path / "out", UNNAMED)
    assert statuses(batch) == {"RAPID/TASK1": "compensated"}, batch.outcomes
    assert batch.outcomes[0].arm == {"robot": ARM, "robot_from": "the controller's configuration", "scope": "all"}
    before, after = tree(source), tree(tmp_path / "out", without=[".postproc"])
    assert set(before) == set(after)
    changed = {name for name in before if before[name] != after[name]}
    assert changed <= {f"RAPID/TASK1/{n}" for n in ("PROGMOD/Main.mod", "PROGMOD/Seam.mod", "SYSMOD/user.sys")}
    assert "RAPID/TASK1/PROGMOD/Seam.mod" in changed


def test_a_task_whose_arm_nobody_knows_needs_a_model(tmp_path: Path) -> None:
    source = backup(tmp_path / "in")
    (source / "SYSPAR/SYS.cfg").write_text(SYS.replace('"rob2" -MotionTask', '"rob1" -MotionTask'))
    with pytest.raises(PostprocError) as refused:
        convert(source, tmp_path / "out", UNNAMED)
    assert [d.code for d in refused.value.diagnostics] == ["KIN011"]
    batch, _ = convert(source, tmp_path / "out", ROUGH)
    assert statuses(batch) == {"RAPID/TASK1": "compensated"}
    first = next(f for o in batch.outcomes for f in o.findings)
    assert (first.code, first.severity) == ("KIN011", "info")


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({"SYSPAR/MOC.cfg": MOC.replace("ROB2_4600_2.05_60", "ROB1_660_180")}, "`ROB1_660_180`, which is not in"),
        ({"SYSPAR/MOC.cfg": MOC.replace("ROB2_4600_2.05_60", "ROB_L_14000_05_05_TYPEA")}, "ROB_L_14000_05_05_TYPEA"),
        ({"SYSPAR/MOC.cfg": ""}, "the backup has no SYSPAR/MOC.cfg"),
        ({"SYSPAR/SYS.cfg": ""}, "`ROB_1` (`ROB1_6700_LeanID_2.65_220`) and `ROB_2` (`ROB2_4600_2.05_60`)"),
        ({"SYSPAR/SYS.cfg": SYS.replace('-UseMechanicalUnitGroup "rob2" ', "")}, "no mechanical unit group says which"),
        ({"SYSPAR/SYS.cfg": SYS.replace("T_MAIN", "T_OTHER")}, "its SYS.cfg does not list the task `T_MAIN`"),
    ],
)
def test_a_backup_whose_arm_is_not_understood_is_refused(tmp_path: Path, files: dict[str, str], told: str) -> None:
    source = backup(tmp_path / "in", **files)
    with pytest.raises(PostprocError) as refused:
        convert(source, tmp_path / "out", UNNAMED)
    found = refused.value.diagnostics
    assert any(d.code == "KIN011" and told in d.message for d in found), found
    assert all("`--robot NAME`" in (d.help or "") and "`-m MODEL`" in (d.help or "") for d in found)
    assert not (tmp_path / "out/RAPID/TASK1/PROGMOD/Seam.mod").exists()


def test_the_only_arm_beside_a_gantry_of_ones_own_is_the_arm(tmp_path: Path) -> None:
    gantry = '      -name "GANTRY_1" -use_robot_type "MyGantry"\\\n      -base_frame_pos_z 2\n#\nROBOT_TYPE:\n\n      -name "MyGantry" -type "GEN_KIN" -no_of_joints 3\n#\n'
    moc = MOC.replace('"ROB1_6700_LeanID_2.65_220" -use_robot_calib "r1_uncalib"', '"MyGantry"')
    moc = moc.replace('-use_robot_serial_number "rob_1"\\\n', "\\\n").replace("{base}\n#\n", "{base}\n\n" + gantry)
    source = backup(tmp_path / "in", **{"SYSPAR/MOC.cfg": moc.replace("{base}", ""), "SYSPAR/SYS.cfg": ""})
    found = {t.name: t.robot for t in discover(source)[0]}
    assert found["RAPID/TASK1"] == "irb4600_60_205"


def test_targets_are_taken_in_the_world_where_the_controller_places_the_base(tmp_path: Path) -> None:
    batch, _ = convert(backup(tmp_path / "in", base="-base_frame_pos_x 3.7"), tmp_path / "out")
    assert set(codes(batch, "RAPID/TASK1")) >= {"KIN001"} and batch.failed
    near, _ = convert(backup(tmp_path / "near", base="-base_frame_pos_x 0.004"), tmp_path / "out2")
    assert statuses(near) == {"RAPID/TASK1": "compensated"}
    plain, _ = convert(backup(tmp_path / "plain"), tmp_path / "out3")
    assert statuses(plain) == {"RAPID/TASK1": "compensated"}
    seams = [(tmp_path / out / "RAPID/TASK1/PROGMOD/Seam.mod").read_bytes() for out in ("out2", "out3")]
    assert seams[0] != seams[1]


@pytest.mark.parametrize(
    ("base", "code"),
    [
        ('-base_frame_coordinated "TRACK1"', "BAT013"),
        ("-base_frame_pos_x nowhere", "BAT013"),
    ],
)
def test_a_base_that_nobody_can_place_is_refused(tmp_path: Path, base: str, code: str) -> None:
    batch, _ = convert(backup(tmp_path / "in", base=base), tmp_path / "out")
    assert code in codes(batch, "RAPID/TASK1") and batch.failed
    assert not (tmp_path / "out/RAPID/TASK1/PROGMOD/Seam.mod").exists()


def test_what_every_task_shares_is_read_and_not_written(tmp_path: Path) -> None:
    shared = f"MODULE shared(SYSMODULE)\n  {TOOL}\nENDMODULE\n"
    lonely = "MODULE user(SYSMODULE)\nENDMODULE\n"
    more = {"RAPID/TASK0/SYSMOD/shared.sys": shared, "RAPID/TASK1/SYSMOD/user.sys": lonely}
    more["RAPID/TASK1/PROGMOD/Main.mod"] = "MODULE Main\n  PROC main()\n    rSeam;\n  ENDPROC\nENDMODULE\n"
    batch, _ = convert(backup(tmp_path / "in", **more), tmp_path / "out")
    assert statuses(batch) == {"RAPID/TASK1": "compensated"}, batch.outcomes
    assert (tmp_path / "out/RAPID/TASK0/SYSMOD/shared.sys").read_text() == shared


def test_data_without_a_value_has_that_of_another_task(tmp_path: Path) -> None:
    # One object in all tasks, as MultiMove cells declare it; LOCAL and TASK data is another in each.
    bare = "PERS tooldata tTorch;"
    seam = program("Seam", tool=bare)
    head = f"MODULE Head\n  VAR num nOther:=1;\n  {TOOL}\n  PROC main()\n    MoveL *,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    more = {"RAPID/TASK1/PROGMOD/Main.mod": "MODULE Main\n  PROC main()\n    rSeam;\n  ENDPROC\nENDMODULE\n"}
    more |= {"RAPID/TASK1/PROGMOD/Seam.mod": seam, "RAPID/TASK1/SYSMOD/user.sys": "MODULE user\nENDMODULE\n"}
    batch, _ = convert(backup(tmp_path / "in", **more, **{"RAPID/TASK8/PROGMOD/Head.mod": head}), tmp_path / "out")
    assert statuses(batch)["RAPID/TASK1"] == "compensated", batch.outcomes
    assert (tmp_path / "out/RAPID/TASK1/PROGMOD/Seam.mod").read_text().count(bare) == 1
    own = {"RAPID/TASK8/PROGMOD/Head.mod": head.replace("PERS", "TASK PERS")}
    batch, _ = convert(backup(tmp_path / "own", **more, **own), tmp_path / "out2")
    assert "RAP020" in codes(batch, "RAPID/TASK1")


def test_a_module_that_lacks_data_is_told_which_file_beside_it_declares_them(tmp_path: Path) -> None:
    source = write(tmp_path / "in", {"a.mod": program("A", tool=""), "Data.mod": f"MODULE D\n  {TOOL}\nENDMODULE\n"})
    for _ in range(2):  # the second is taken over from the first
        batch, _ = convert(source, tmp_path / "out", replace(ROUGH, alone=True))
        lacking = next(f for o in batch.outcomes for f in o.findings if f.code == "RAP020")
        assert lacking.help == f"`{source / 'Data.mod'}` declares it: add `--with {source / 'Data.mod'}`"


def test_modules_of_a_folder_lend_each_other_what_they_declare(tmp_path: Path) -> None:
    lent = f"MODULE D\n  {TOOL}\n  PROC rOther()\n    MoveJ {target(1300)},v500,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    source = write(tmp_path / "in", {"a.mod": program("A", tool=""), "Data.mod": lent})
    for cached in (False, True):
        batch, _ = convert(source, tmp_path / "out")
        assert statuses(batch) == {"a.mod": "compensated", "Data.mod": "compensated"}
        assert batch.outcomes[1].cached is cached
        (told,) = (f.message for f in batch.outcomes[1].findings if f.code == "RAP038")
        assert told == "`Data.mod` near it is read along: it declares `tTorch`"
        assert "Read along:" in render_text(batch_document("in", batch)) and told in render_text(
            batch_document("in", batch)
        )
    alone, _ = convert(write(tmp_path / "in2", {"a.mod": program("A")}), tmp_path / "out2")
    assert alone.outcomes[0].figures == batch.outcomes[1].figures
    write(source, {"Data.mod": lent.replace("350", "390")})  # the result depends on it
    batch, _ = convert(source, tmp_path / "out")
    assert not batch.outcomes[1].cached and alone.outcomes[0].figures != batch.outcomes[1].figures


def test_targets_of_a_side_file_are_written_into_the_program(tmp_path: Path) -> None:
    own = f"MODULE A\n  {TOOL}\n  PROC main()\n    MoveJ {target(1200)},v500,fine,tTorch;\n    MoveL pThere,v100,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    side = write(tmp_path, {"points.mod": f"MODULE points\n  CONST robtarget pThere:={target(1250)};\nENDMODULE\n"})
    source = write(tmp_path / "in", {"a.mod": own})
    batch, _ = convert(source, tmp_path / "out", replace(ROUGH, side_files=(side / "points.mod",)))
    assert statuses(batch) == {"a.mod": "compensated"} and codes(batch, "a.mod") == []
    assert re.search(r"MoveL Offs\(pThere,", (tmp_path / "out/a.mod").read_text())


def test_a_program_folder_given_by_its_list(tmp_path: Path) -> None:
    listing = "<Program><Module>a.mod</Module><Module>b.mod</Module></Program>"
    write(tmp_path / "in", {"p.pgf": listing, "a.mod": program("A"), "b.mod": program("B"), "other.mod": "no program"})
    plan = planned(tmp_path / "in" / "p.pgf", tmp_path / "out")
    assert [(task.name, task.files) for task, _ in plan.tasks] == [("p.pgf", ("a.mod", "b.mod"))]
    assert plan.copies == ("p.pgf",)


def test_the_folder_of_one_task(tmp_path: Path) -> None:
    files = {"PROGMOD/a.mod": program("A", tool=""), "SYSMOD/user.sys": f"MODULE user\n  {TOOL}\nENDMODULE\n"}
    batch, _ = convert(write(tmp_path / "TASK1", files), tmp_path / "out")
    assert [outcome.status for outcome in batch.outcomes] == ["compensated"]
    assert set(tree(tmp_path / "out", without=[".postproc"])) == set(files)


def test_a_program_folder_is_one_task(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "P/P.pgf": "<Program><Module>One.mod</Module><Module>TWO.mod</Module><Module>Gone.mod</Module></Program>",
            "P/one.mod": "MODULE One\n  PROC main()\n    rTwo;\n  ENDPROC\nENDMODULE\n",
            "P/two.mod": program("Two", tool=""),
            "P/tools.sys": f"MODULE tools\n  {TOOL}\nENDMODULE\n",
            "P/other.mod": program("Other"),
            "Q/Q.pgf": "<Program><Module>x.mod</Module></Program>",
            "Q/R.pgf": "<Program><Module>x.mod</Module></Program>",
            "Q/x.mod": program("X"),
        },
    )
    found = {task.name: task for task in discover(tmp_path)[0]}
    assert set(found) == {"P/P.pgf", "P/other.mod", "Q/Q.pgf", "Q/R.pgf"}
    assert set(found["P/P.pgf"].files) == {"P/one.mod", "P/two.mod", "P/tools.sys"}
    assert [d.code for d in found["P/P.pgf"].findings] == ["BAT010"]
    assert [d.code for d in found["Q/R.pgf"].findings] == ["BAT011"]
    run_time = replace(ROUGH, options=replace(ROUGH.options, run_time="all"))
    assert get_ready(planned(tmp_path, tmp_path / "out", run_time), Shard(), tmp_path / "out").tasks


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["RAPID/T_ROB1/a.mod", "RAPID/T_ROB1/sub/b.mod", "RAPID/T_ROB2/c.mod"], ["RAPID/T_ROB1", "RAPID/T_ROB2"]),
        (["x/RAPID/PROGMOD/a.mod", "x/RAPID/SYSMOD/b.sys"], ["x/RAPID"]),
        (["B/RAPID/TASK1/PROGMOD/a.mod", "B/SYSPAR/SYS.cfg", "B/HOME/RAPID/TASK1/PROGMOD/a.mod"], ["B/RAPID/TASK1"]),
        (["rapid/task1/progmod/A.MOD", "home/a.mod", "syspar/x.cfg"], ["rapid/task1"]),
        (["RAPID/loose.mod", "HOME/x.mod", "SYSPAR/y"], ["RAPID/loose.mod"]),
    ],
)
def test_layouts(tmp_path: Path, files: list[str], names: list[str]) -> None:
    moving = "MODULE A\n  PROC main()\n    MoveL *,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    write(tmp_path, dict.fromkeys(files, moving))
    tasks, copies = discover(tmp_path)
    assert [task.name for task in tasks] == names
    assert sorted([f for t in tasks for f in t.files] + copies) == sorted(files)


def test_a_jobs_file_gives_each_task_its_model(tmp_path: Path) -> None:
    soft = 'robot = "irb4600_60_205"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [1e-5, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5]\n'
    jobs = """
largest_correction_mm = 20
[[job]]
folder = "cell"
only = ["a.mod"]
model = "soft.toml"
[[job]]
folder = "cell"
only = ["*.mod"]
[[job]]
files = ["loose/*.mod"]
name = "together"
"""
    write(
        tmp_path,
        {
            "soft.toml": soft,
            "jobs.toml": jobs,
            "cell/a.mod": program("A"),
            "cell/b.mod": program("A"),
            "cell/c.txt": "text",
            "loose/one.mod": f"MODULE one\n  {TOOL}\nENDMODULE\n",
            "loose/two.mod": program("Two", tool=""),
        },
    )
    stated = [chosen.options for _, chosen in planned(tmp_path / "jobs.toml", tmp_path / "out").tasks]
    assert [options.largest_correction_m for options in stated] == [0.02] * 3, "what the file states holds for all"
    batch, _ = convert(tmp_path / "jobs.toml", tmp_path / "out", Settings(robot=ARM))
    assert statuses(batch) == dict.fromkeys(("cell/a.mod", "cell/b.mod", "together"), "compensated")
    soft_mm, stiff_mm = (
        float(re.findall(r"pStart:=\[\[[\d.]+,[\d.]+,([\d.]+)\]", (tmp_path / "out/cell" / name).read_text())[0]) - 900
        for name in ("a.mod", "b.mod")
    )
    assert soft_mm > 1.5 * stiff_mm > 0
    assert set(tree(tmp_path / "out", without=[".postproc"])) == {
        "cell/a.mod", "cell/b.mod", "cell/c.txt", "loose/one.mod", "loose/two.mod",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('[[job]]\nfolder = "cell"\ntolerence_mm = 1\n', "3:1"),
        ('[[job]]\nfiles = ["nothing*.mod"]\n', "2:1"),
        ('[[job]]\nfolder = ".."\n', "2:1"),
        ('[[job]]\nfolder = "/tmp"\n', "2:1"),
        ('[[job]]\nfolder = "cell/.."\n', "2:1"),
        ('[[job]]\nname = "t"\nfiles = ["cell/a.mod"]\n[[job]]\nname = "t"\nfiles = ["cell/a.mod"]\n', "4:3"),
        ('[[job]]\nfolder = "cell"\nonly = ["a.mod", "cell/a.mod"]\n', "3:1"),
        ('[[job]]\nfiles = ["cell/a.mod"]\n[[job]]\nfiles = ["cell/a.mod"]\nname = "b"\n', "3:3"),
        ('[[job]]\nmodel = "x.toml"\n', "1:3"),
        ('[[job]]\nfolder = "cell"\nchannel = { temperature = "warm" }\n', "3:11"),
        ("[[job]\n", "1:6"),
    ],
)
def test_mistakes_in_a_jobs_file_are_named(tmp_path: Path, text: str, place: str) -> None:
    write(tmp_path, {"jobs.toml": text, "cell/a.mod": program("A")})
    with pytest.raises(PostprocError) as caught:
        planned(tmp_path / "jobs.toml", tmp_path / "out")
    found = caught.value.diagnostics[0]
    assert (found.code, found.place) == ("BAT009", f"{tmp_path}/jobs.toml:{place}")


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    text=st.text(st.sampled_from('[]job="\n./*folder files\x00é0:,-#{}'), max_size=80),
    name=st.sampled_from(["sys", "moc", "jobs", "pgf"]),
)
def test_any_text_around_programs_is_read_or_refused(tmp_path: Path, text: str, name: str) -> None:
    files: dict[str, str | bytes] = {
        "RAPID/TASK1/PROGMOD/a.mod": "MODULE a\nENDMODULE\n",
        "P/b.mod": "MODULE b\nENDMODULE\n",
    }
    files["BACKINFO/backinfo.txt"] = BACKINFO
    data = text.encode("utf-8", "replace")
    files |= {
        "SYSPAR/SYS.cfg": SYS[:60].encode() + data + SYS[60:].encode() if name == "sys" else SYS,
        "SYSPAR/MOC.cfg": MOC[:60].encode() + data if name == "moc" else MOC,
        "P/P.pgf": b"<Module>" + data + b"</Module>" if name == "pgf" else "",
        "jobs.toml": b'[[job]]\nfolder = "P"\n' + data if name == "jobs" else '[[job]]\nfolder = "P"\n',
    }
    write(tmp_path, files)
    assert discover(tmp_path)[0]
    try:
        assert planned(tmp_path / "jobs.toml", tmp_path / "out").tasks
    except PostprocError as error:
        assert {d.code for d in error.diagnostics} <= {"BAT001", "BAT009"}


def test_a_task_of_which_nothing_could_be_measured_has_no_figures(tmp_path: Path) -> None:
    lone = re.sub(r"(?m)^\s*Move[LC].*\n", "", program("One"))
    batch, _ = convert(write(tmp_path / "in", {"One.mod": lone}), tmp_path / "out")
    (only,) = batch.outcomes
    assert only.status == "compensated" and "max_error_after_mm" not in only.figures
    assert result_line(only) == "One.mod: no line or arc could be measured, 0 targets added"
    assert "One.mod  compensated" in render_text(batch_document("in", batch))


def test_a_task_without_motion_needs_no_arm(tmp_path: Path) -> None:
    two = 'ROBOT:\n\n      -name "ROB_1" -use_robot_type "ROB1_4600_2.05_60"\n\n      -name "ROB_2" -use_robot_type "ROB2_4600_2.05_60"\n'
    silent = 'MODULE Talk\n  PROC main()\n    TPWrite "hello";\n  ENDPROC\nENDMODULE\n'
    moving = "MODULE A\n  PROC main()\n    MoveL *,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    files = {"RAPID/TASK1/PROGMOD/a.mod": moving, "RAPID/TASK9/PROGMOD/talk.mod": silent, "SYSPAR/MOC.cfg": two}
    write(tmp_path, files)
    tasks, copies = discover(tmp_path)
    assert [task.name for task in tasks] == ["RAPID/TASK1"] and tasks[0].unknown is not None
    assert "RAPID/TASK9/PROGMOD/talk.mod" in copies


def test_what_the_controller_corrects_is_not_corrected_once_more(tmp_path: Path) -> None:
    with pytest.raises(PostprocError, match="KIN017"):
        convert(backup(tmp_path / "in", base='-use_robot_calib "r1_calib"'), tmp_path / "out")
    plain, _ = convert(backup(tmp_path / "in2", base='-use_robot_calib "r1_uncalib"'), tmp_path / "out2")
    assert not plain.failed
    stated = replace(ROUGH, options=replace(ROUGH.options, already=("geometry", "gravity")))
    left, _ = convert(backup(tmp_path / "in3", base='-use_robot_calib "r1_calib"'), tmp_path / "out3", stated)
    assert not left.failed


def test_the_module_for_run_time_is_in_the_list_of_its_task(tmp_path: Path) -> None:
    options = replace(ROUGH.options, run_time="all")
    source = backup(tmp_path / "in")
    for _ in range(2):
        batch, _ = convert(source, tmp_path / "out", replace(ROUGH, options=options))
        assert not batch.failed and not batch.findings, batch.findings
        listed = (tmp_path / "out/BACKINFO/backinfo.txt").read_text()
        assert "PROGMOD/Main.mod @ \nSYSMOD/ppModel.sys @ \n\n>>TASK2" in listed
        assert (tmp_path / "out/RAPID/TASK1/SYSMOD/ppModel.sys").is_file()
    convert(source, tmp_path / "out")
    assert (tmp_path / "out/BACKINFO/backinfo.txt").read_text() == BACKINFO, "without the module as it was"


def test_a_controller_loads_the_modules_of_its_list_alone(tmp_path: Path) -> None:
    """A copy of a module that BACKINFO does not list is copied, said, and neither refused nor read along."""
    copy = program("Seam", tool="").replace("  PROC", f"  PERS robtarget pOld:={target(1100)};\n  PROC")
    source = backup(tmp_path / "in", **{"RAPID/TASK1/PROGMOD/Seam_old.mod": copy})
    batch, _ = convert(source, tmp_path / "out", UNNAMED)
    assert statuses(batch) == {"RAPID/TASK1": "compensated"}, batch.outcomes
    (said,) = [d for d in batch.outcomes[0].findings if d.code == "BAT022"]
    assert said.message.endswith("`RAPID/TASK1/PROGMOD/Seam_old.mod`")
    assert (tmp_path / "out/RAPID/TASK1/PROGMOD/Seam_old.mod").read_text() == copy

    uses = b"MODULE New\n  PROC r()\n    MoveL pOld,v100,fine,tTorch;\n  ENDPROC\nENDMODULE\n"
    write(source, {"RAPID/TASK1/PROGMOD/New.mod": uses})
    own = [Source("RAPID/TASK1/PROGMOD/New.mod", uses)]
    assert not any(b"pOld" in s.data for s in read_nearby(own, source).sources)
    listed = BACKINFO.replace("PROGMOD/Main.mod", "PROGMOD/Seam_old.mod")
    write(source, {"BACKINFO/backinfo.txt": listed})
    assert any(b"pOld" in s.data for s in read_nearby(own, source).sources)


def test_a_list_without_the_modules_of_a_program_leaves_them_in(tmp_path: Path) -> None:
    source = backup(tmp_path, **{"BACKINFO/backinfo.txt": ">>TASK1: (T_MAIN,Prog,)\nSYSMOD/user.sys @\n"})
    (task,) = (task for task in discover(source)[0] if task.name == "RAPID/TASK1")
    assert {name.rpartition("/")[2] for name in task.files} >= {"Main.mod", "Seam.mod", "user.sys"}
    assert "Hidden.sys" in task.findings[0].message, "its list names the other module of SYSMOD"


def test_a_backup_whose_motions_are_loaded_at_run_time_is_told_apart_from_an_empty_one(tmp_path: Path) -> None:
    rest = "MODULE {}\n  PROC main()\n    WaitTime 1;\n  ENDPROC\nENDMODULE\n"
    source = write(tmp_path / "in", {"SYSPAR/x": "", **{f"HOME/{n}.mod": rest.format(n) for n in "ab"}, "RAPID/x": ""})
    with pytest.raises(PostprocError, match=r"none of its 2 modules, such as `HOME/a.mod`, moves an arm") as told:
        convert(source, tmp_path / "out")
    assert "loaded at run time" in (told.value.diagnostics[0].help or "")
