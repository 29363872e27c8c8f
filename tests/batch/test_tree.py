"""The tree of outputs: what is converted, what is copied, what is left out; jobs files."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from postproc.batch.document import batch_document
from postproc.cli.convert.batch_lines import result_line
from postproc.report.terminal import render_text
from postproc.settings import Settings
from postproc.tasks.discover import discover
from tests.build import refused

from . import build
from .build import ARM, ROUGH, TOOL, Work, module, program, programs, target, tree, work_in, write

MOVING = module("A", "", "MoveL *,v100,fine,tool0;")
LISTING = "<Program><Module>{}</Module></Program>".format


def test_the_tree_mirrors_the_folder_and_a_bad_file_stops_nobody(work: Work) -> None:
    work.write({"a.mod": program("A"), "deep/er/B.PRG": program("B", 1100), "bad.mod": "this is no RAPID"})
    work.write({"far.mod": program("Far", 9000), "data.sys": module("data", TOOL), "deep/notes.txt": "as it is\r\n"})
    work.write({"secret.sys": build.ENCRYPTED, ".git/config": "hidden"})
    made = work.convert()
    assert made.statuses == {
        "a.mod": "compensated", "bad.mod": "failed", "data.sys": "unchanged", "deep/er/B.PRG": "compensated",
        "far.mod": "failed", "secret.sys": "unchanged",
    }  # fmt: skip
    assert made.batch.failed and made.batch.copied == 1 and len(made.told) == 6
    assert made.codes("bad.mod") == ["RAP011"]
    before, after = tree(work.source), work.outputs()
    assert set(after) == {"a.mod", "deep/er/B.PRG", "secret.sys", "data.sys", "deep/notes.txt"}
    assert {n for n in after if after[n] == before[n]} == {"secret.sys", "data.sys", "deep/notes.txt"}
    assert re.search(rb"! postproc [\d.]+: compensated", (work.out / "a.mod").read_bytes())


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
    tasks, copies = discover(write(tmp_path, dict.fromkeys(files, MOVING)))
    assert [task.name for task in tasks] == names
    assert sorted([f for t in tasks for f in t.files] + copies) == sorted(files)


def test_links_are_followed_but_not_in_circles_and_those_to_nothing_are_reported(work: Work) -> None:
    write(work.root, {"in/a/one.mod": program("One"), "elsewhere/two.mod": program("Two")})
    links = {"in/linked": "elsewhere", "in/a/up": "in", "elsewhere/back": "in/a"}
    for link, place in {**links, "in/gone.txt": "nowhere", "in/gone.mod": "nowhere"}.items():
        (work.root / link).symlink_to(work.root / place)
    os.mkfifo(work.source / "pipe.mod")
    made = work.convert()
    done = ["a/one.mod", "linked/back/one.mod", "linked/two.mod"]
    assert made.statuses == {"gone.mod": "failed", **dict.fromkeys(done, "compensated")}
    assert [f.code for f in made.batch.findings] == ["BAT002"]


def test_a_program_folder_is_one_task(work: Work) -> None:
    work.write({"P/P.pgf": LISTING("One.mod</Module><Module>TWO.mod</Module><Module>Gone.mod")})
    work.write({"P/one.mod": module("One", "", "rTwo;"), "P/two.mod": program("Two", tool="")})
    work.write({"P/tools.sys": module("tools", TOOL), "P/other.mod": program("Other"), "Q/x.mod": program("X")})
    work.write({"Q/Q.pgf": LISTING("x.mod"), "Q/R.pgf": LISTING("x.mod")})
    tasks = {task.name: task for task, _ in work.plan().tasks}
    assert set(tasks) == {"P/P.pgf", "P/other.mod", "Q/Q.pgf", "Q/R.pgf"}
    assert set(tasks["P/P.pgf"].files) == {"P/one.mod", "P/two.mod", "P/tools.sys"}
    assert [[d.code for d in tasks[name].findings] for name in ("P/P.pgf", "Q/R.pgf")] == [["BAT010"], ["BAT011"]]
    assert work.ready(build.RUN_TIME).tasks
    plan = work_in(work.source, "Q/Q.pgf").plan()
    assert [(task.name, task.files) for task, _ in plan.tasks] == [("Q.pgf", ("x.mod",))] and plan.copies == ("Q.pgf",)


@pytest.mark.parametrize(
    "files",
    [
        {"PROGMOD/a.mod": program("A", tool=""), "SYSMOD/user.sys": module("user", TOOL)},  # the folder of a task
        {"P/P.pgf": LISTING("one.mod"), "P/one.mod": program("One")},
    ],
)
def test_what_is_one_task_keeps_all_its_files(tmp_path: Path, files: dict[str, str | bytes]) -> None:
    work = work_in(tmp_path, "TASK1")
    work.write(files)
    for _ in range(2):
        assert [*work.convert().statuses.values()] == ["compensated"]
        assert set(work.outputs()) == set(files)


def test_the_output_folder_is_not_input(work: Work) -> None:
    programs(work.source, 2)
    inside = work.into("in/out")
    inside.convert()
    assert len(inside.plan().tasks) == 2 and not inside.plan().copies
    write(work.root, {"jobs.toml": '[[job]]\nname = "t"\nfiles = ["**/Seam0.mod"]\n'})
    jobs = replace(inside, source=work.root / "jobs.toml")
    assert [task.files for task, _ in jobs.plan().tasks] == [("in/line0/Seam0.mod",)]


def test_modules_of_a_folder_lend_each_other_what_they_declare(work: Work) -> None:
    lent = module("D", f"{TOOL}\n  PROC rOther()\n    MoveJ {target(1300)},v500,fine,tTorch;\n  ENDPROC")
    work.write({"a.mod": program("A", tool=""), "Data.mod": lent})
    for cached in (set(), {"Data.mod", "a.mod"}):
        made = work.convert()
        assert made.statuses == {"a.mod": "compensated", "Data.mod": "compensated"} and made.cached == cached
        (message,) = (f.message for f in made.findings("a.mod") if f.code == "RAP038")
        assert message == "`Data.mod` near it is read along: it declares `tTorch`"
        shown = render_text(batch_document("in", made.batch))
        assert "Read along:" in shown and message in shown
    figures = made.batch.outcomes[1].figures
    write(work.root, {"alone/a.mod": program("A")})
    assert replace(work, source=work.root / "alone").into("out2").convert().batch.outcomes[0].figures == figures
    work.write({"Data.mod": lent.replace("350", "390")})  # the result depends on it
    made = work.convert()
    assert "a.mod" not in made.cached and made.batch.outcomes[1].figures != figures


def test_a_module_that_lacks_data_is_told_which_file_beside_it_declares_them(work: Work) -> None:
    data = work.write({"a.mod": program("A", tool=""), "Data.mod": module("D", TOOL)}) / "Data.mod"
    for _ in range(2):  # the second is taken over from the first
        findings = work.convert(replace(ROUGH, alone=True)).findings("a.mod")
        assert next(f.help for f in findings if f.code == "RAP020") == f"`{data}` declares it: add `--with {data}`"


def test_a_task_of_which_nothing_could_be_measured_has_no_figures(work: Work) -> None:
    work.write({"One.mod": re.sub(r"(?m)^\s*Move[LC].*\n", "", program("One"))})
    batch = work.convert().batch
    (only,) = batch.outcomes
    assert only.status == "compensated" and "max_error_after_mm" not in only.figures
    assert result_line(only) == "One.mod: no line or arc could be measured, 0 targets added"
    assert "One.mod  compensated" in render_text(batch_document("in", batch))


JOBS = """
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
SOFT = f'robot = "{ARM}"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [1e-5, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5]\n'


def test_a_jobs_file_gives_each_task_its_model(tmp_path: Path) -> None:
    files = {
        "jobs.toml": JOBS,
        "soft.toml": SOFT,
        "loose/one.mod": program("One"),
        "loose/two.mod": program("Two", tool=""),
    }
    write(tmp_path, {**files, "cell/a.mod": program("A"), "cell/b.mod": program("A"), "cell/c.txt": "text"})
    work = work_in(tmp_path, "jobs.toml")
    stated = [chosen.options.largest_correction_m for _, chosen in work.plan().tasks]
    assert stated == [0.02] * 3, "what the file states holds for all"
    made = work.convert(Settings(robot=ARM))
    assert made.statuses == dict.fromkeys(("cell/a.mod", "cell/b.mod", "together"), "compensated")
    height = re.compile(r"pStart:=\[\[[\d.]+,[\d.]+,([\d.]+)\]")
    soft_mm, stiff_mm = (float(height.findall((work.out / f"cell/{n}.mod").read_text())[0]) - 900 for n in "ab")
    assert soft_mm > 1.5 * stiff_mm > 0
    assert set(work.outputs()) == {"cell/a.mod", "cell/b.mod", "cell/c.txt", "loose/one.mod", "loose/two.mod"}


@pytest.mark.parametrize(
    ("job", "place"),
    [
        ('folder = "cell"\ntolerence_mm = 1\n', "3:1"),
        ('files = ["nothing*.mod"]\n', "2:1"),
        ('folder = ".."\n', "2:1"),
        ('folder = "/tmp"\n', "2:1"),
        ('folder = "cell/.."\n', "2:1"),
        ('name = "t"\nfiles = ["cell/a.mod"]\n[[job]]\nname = "t"\nfiles = ["cell/a.mod"]\n', "4:3"),
        ('folder = "cell"\nonly = ["a.mod", "cell/a.mod"]\n', "3:1"),
        ('files = ["cell/a.mod"]\n[[job]]\nfiles = ["cell/a.mod"]\nname = "b"\n', "3:3"),
        ('model = "x.toml"\n', "1:3"),
        ('folder = "cell"\nchannel = { temperature = "warm" }\n', "3:11"),
        ("[job\n", "2:5"),
        *(
            (f'files = ["{p}"]\n', "2:1")
            for p in ("../a.mod", "{root}/a.mod", "sub/../../a.mod", "", "/", "**/../*.mod")
        ),
        ('files = ["a\\u0000"]\n', "2:9"),
    ],
)
def test_mistakes_in_a_jobs_file_are_named(tmp_path: Path, job: str, place: str) -> None:
    text = f"[[job]]\n{job}".replace("{root}", str(tmp_path))
    write(tmp_path, {"a.mod": program("A"), "jobs/cell/a.mod": program("A"), "jobs/jobs.toml": text})
    work, before = work_in(tmp_path / "jobs", "jobs.toml"), tree(tmp_path)
    (finding,) = refused(work.plan)
    assert (finding.code, finding.place) == ("BAT009", f"{work.source}:{place}")
    assert tree(tmp_path) == before
