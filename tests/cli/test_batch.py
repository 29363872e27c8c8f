"""``batch``: documents, exit codes, usage."""

from __future__ import annotations

import io
import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.cli.convert.batch_lines import reporting
from postproc.diagnostics import Finding, Matter
from postproc.report.terminal import render_text
from postproc.tasks.task import Task
from tests.batch.folders import program, write

from .conftest import Call

EMPTY = "MODULE Data\n  PERS num n:=1;\nENDMODULE\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "in").mkdir()
    (tmp_path / "in/data.mod").write_text(EMPTY)
    (tmp_path / "in/bad.mod").write_text("no module")
    return tmp_path / "in"


def test_the_document_and_the_exit_code(call: Call, folder: Path, tmp_path: Path) -> None:
    outcome = call("batch", folder, "-o", tmp_path / "out", "--workers", "1", "--json")
    document = json.loads(outcome.out)
    assert outcome.code == 1
    assert document["schema"] == "postproc/batch/1" and document["shard"] == "1/1"
    assert document["counts"] == {
        "compensated": 0,
        "unchanged": 1,
        "failed": 1,
        "cached": 0,
        "beyond_tolerance": 0,
        "copied": 0,
    }
    assert [(t["name"], t["status"], t["cached"]) for t in document["tasks"]] == [
        ("bad.mod", "failed", False),
        ("data.mod", "unchanged", False),
    ]
    assert [bool(t["diagnostics"]) for t in document["tasks"]] == [True, False]  # data that moves nothing is no fault
    assert "bad.mod: error[RAP011]" in outcome.err
    (folder / "bad.mod").unlink()
    (folder / "data.mod").rename(folder / "a[b].mod")
    outcome = call("batch", folder, "-o", tmp_path / "out", "--workers", "1", "--tolerance", "0.1")
    first, second, *rest = outcome.err.splitlines()
    assert outcome.code == 0 and any(line.startswith("1 task in ") for line in rest)
    assert first == "arm `irb4600_60_205` (from --robot); tolerance 0.1 mm, 0.2 mm in the air; scope all"
    assert second.startswith("[1/1] a[b].mod: "), "where there is no terminal, a line for each program"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_how_far_it_is_and_what_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr("sys.stderr", screen)
    found = Finding("RAP001", "error", "the file [bold] is empty", "a[0].mod", 3, 7)
    with reporting(2) as shown:
        shown.outcome(TaskOutcome(Task("a[0].mod", ()), "failed", False, {}, (found,)))
        shown.outcome(TaskOutcome(Task("b.mod", ()), "unchanged", False, {}, ()))
        edited = Finding("BAT016", "warning", "put aside", "c.mod", 3, 7, matter=Matter.EDITED)
        off = replace(edited, code="CMP006", matter=Matter.OFF)
        shown.outcome(TaskOutcome(Task("c.mod", ()), "compensated", False, {}, (edited, off)))
        time.sleep(1.2)
    text = screen.getvalue()
    assert "programs: 3 of 2, 100 %" in text
    assert "a[0].mod:3:7: error[RAP001]: the file [bold] is empty" in text
    assert "b.mod" not in text
    assert "c.mod:3:7: warning[BAT016]: put aside" in text and "CMP006" not in text


def test_the_table_of_many_tasks_shows_those_that_matter() -> None:
    figures = {"added_targets": 1, "statements": {"skipped": 2}, "max_error_before_mm": 1.0}
    good = [
        TaskOutcome(Task(f"{i:03}.mod", ()), "compensated", i % 2 == 0, {**figures, "max_error_after_mm": i / 1e4}, ())
        for i in range(100)
    ]
    why = (Finding("CMP009", "warning", "m"), Finding("KIN001", "error", "m"))
    bad = TaskOutcome(Task("zzz.mod", ()), "failed", False, {}, why)
    astray = {**good[99].figures, "unproved_statements": 71}
    good[99] = TaskOutcome(good[99].task, "compensated", False, astray, ())
    batch = Batch((*good, bad), 3, ())
    text = render_text(batch_document("in", batch)).split("\nEvery program:\n")
    assert "done before 50" in text[0] and "failed 1" in text[0] and "files copied 3" in text[0]
    lines = text[1].partition("\n\n")[0].splitlines()
    assert len(lines) == 42 and lines[-1] == "  61 more; `--verbose` shows them"
    assert lines[1].split() == ["zzz.mod", "failed", "1"]
    assert "unproved" in lines[0]
    assert lines[2].split() == ["099.mod", "compensated", "1.000", "0.0099", "1", "2", "71"]
    assert lines[3].split() == ["098.mod", "compensated,", "as", "before", "1.000", "0.0098", "1", "2"]
    assert lines[-2].split()[0] == "061.mod"
    off = Batch(
        (TaskOutcome(Task("a", ()), "compensated", False, {}, (replace(why[0], matter=Matter.OFF),) * 2),), 0, ()
    )
    assert "beyond the tolerance somewhere 1" in render_text(batch_document("in", off))


def test_warnings_of_converted_tasks_reach_the_terminal(call: Call, tmp_path: Path) -> None:
    text = program("A").replace("MoveJ pStart", "CConv;\n    MoveL pNone,v100,fine,tTorch;\n    MoveJ pStart")
    source = write(tmp_path / "in", {"a.mod": text, "b.mod": text.replace("MODULE A", "MODULE B")})
    found = call("batch", source, "-o", tmp_path / "out", "--workers", "1", "--tolerance", "0.5")
    assert found.code == 0, found.err
    lines = [line.split() for line in found.err.partition("\nWarnings:\n")[2].splitlines() if "RAP020" in line]
    assert len(lines) == 1 and "`pNone`" in lines[0] and lines[0][:3] == ["2", "2", "a.mod"]


def test_paths_of_sarif_start_at_the_working_folder(
    call: Call, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = call("batch", "in", "-o", "out", "--workers", "1", "--format", "sarif")
    results = json.loads(found.out)["runs"][0]["results"]
    places = [place["physicalLocation"]["artifactLocation"]["uri"] for r in results for place in r["locations"]]
    assert places and all((tmp_path / place).is_file() for place in places)
