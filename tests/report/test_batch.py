"""The pages of many programs: of a batch, with failures first and the page of every program, and of two folders."""

from __future__ import annotations

from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.diagnostics import Finding
from postproc.report.page import render_page
from postproc.tasks.task import Task
from tests.report.build import LONG_NAME, figures, folders_page, tables

FIGURES = {
    "max_error_before_mm": 2.0,
    "added_targets": 1,
    "cycle_time_s": 9.0,
    "statements": {"compensated": 3, "skipped": 2},
}
ERROR = Finding("RAP007", "error", "PROC `main`", "b<1>.mod", 3, help="x")
FAR = [Finding("CMP006", "warning", f"{x} mm off", "b<1>.mod", 3, help="x", length_mm=x) for x in (0.1, 0.92)]
OTHERS = [Finding("MOT012", "info", "x"), Finding("CMP005", "warning", "left")]


def test_the_page_of_a_batch_puts_failures_and_the_farthest_first() -> None:
    near, far = ({**FIGURES, "max_error_after_mm": after} for after in (0.01, 0.2))
    doubt = {**near, "unproved_statements": 71}
    outcomes = (
        TaskOutcome(Task("a.mod", ()), "compensated", True, doubt, (*OTHERS, *FAR)),
        TaskOutcome(Task("b<1>.mod", ()), "failed", False, {}, (ERROR,)),
        TaskOutcome(Task("c.mod", ()), "compensated", False, far, (FAR[0],)),
    )
    page = render_page(batch_document("cell", Batch(outcomes, 0, ()), pages={"a.mod": "out/report/a #1.html"}))
    text = "2 of 3 programs are corrected, 6 of 10 motion statements in them; 1 failed and has no output; "
    assert f"{text}at most 0.200 mm remain, in <code>c.mod</code>." in page
    assert figures(page) == {
        "programs corrected": "2",
        "failed": "1",
        "worst before": "2.000 mm",
        "worst after": "0.200 mm",
        "targets added": "2",
        "done before": "1",
    }
    errors, warnings, programs = (tables(page)[name] for name in ("errors", "warnings", "programs"))
    assert [row[3:5] for row in errors["rows"]] == [["RAP007", "PROC main"]]
    assert [row[5] for row in warnings["rows"]] == ["CMP006", "CMP005"]
    assert warnings["rows"][0][:2] == [3, 2] and "0.92 mm off" in warnings["rows"][0]
    unproved = [column["title"] for column in programs["columns"]].index("unproved")
    assert [(row[0], row[unproved], row[-1]) for row in programs["rows"]] == [
        ("b<1>.mod", None, None),
        ("c.mod", None, None),
        ("a.mod", 71, "out/report/a%20%231.html"),
    ]
    assert programs["rows"][2][1] == "compensated, as before" and "also run where they cannot be followed" in page
    assert 'class="was"' in page and 'class="is"' in page


def test_the_page_of_two_folders_puts_files_that_differ_first() -> None:
    files, differences = (tables(folders_page())[name]["rows"] for name in ("files", "differences"))
    assert [row[:3] for row in files] == [
        [f"RAPID/{LONG_NAME}.mod", "changed", 250],
        ["gone.mod", "removed", 0],
        ["a.mod", "equal", 0],
    ]
    assert len(differences) == 250 and figures(folders_page())["files that differ"] == "2"
