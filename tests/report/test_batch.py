"""The page of a batch puts failures first and leads to the page of every program."""

from __future__ import annotations

import re
from dataclasses import replace

from postproc.batch.document import batch_document
from postproc.batch.values import Batch, TaskOutcome
from postproc.diagnostics import Finding, Severity
from postproc.report.page import render_page
from postproc.tasks.task import Task
from tests.report.conftest import tables


def test_batch_page_puts_failures_and_the_farthest_first() -> None:
    finding = Finding("RAP007", "error", "PROC `main`", "b<1>.mod", 3, help="x")
    kinds: list[tuple[Severity, str, str, float]] = [("info", "MOT012", "x", 0.0), ("warning", "CMP005", "left", 0.0)]
    kinds += [("warning", "CMP006", f"{x} mm off", x) for x in (0.1, 0.92)]
    told = tuple(
        replace(finding, severity=severity, code=code, message=message, length_mm=length)
        for severity, code, message, length in kinds
    )
    figures = {
        "max_error_before_mm": 2.0,
        "added_targets": 1,
        "cycle_time_s": 9.0,
        "statements": {"compensated": 3, "skipped": 2},
    }
    doubt = {"unproved_statements": 71}
    outcomes = (
        TaskOutcome(Task("a.mod", ()), "compensated", True, {**doubt, **figures, "max_error_after_mm": 0.01}, told),
        TaskOutcome(Task("b<1>.mod", ()), "failed", False, {}, (finding,)),
        TaskOutcome(Task("c.mod", ()), "compensated", False, {**figures, "max_error_after_mm": 0.2}, told[-2:-1]),
    )
    page = render_page(batch_document("cell", Batch(outcomes, 0, ()), pages={"a.mod": "out/report/a #1.html"}))
    assert (
        "2 of 3 programs are corrected, 6 of 10 motion statements in them; 1 failed and has no output; at most 0.200 mm"
        " remain, in <code>c.mod</code>." in page
    )
    shown = dict(re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", page))
    assert shown == {
        "programs corrected": "2",
        "failed": "1",
        "worst before": "2.000 mm",
        "worst after": "0.200 mm",
        "targets added": "2",
        "done before": "1",
    }
    found = tables(page)
    assert [row[3:5] for row in found["errors"]["rows"]] == [["RAP007", "PROC main"]]
    every = found["programs"]["rows"]
    assert [row[0] for row in every] == ["b<1>.mod", "c.mod", "a.mod"]
    assert [row[-1] for row in every] == [None, None, "out/report/a%20%231.html"]
    unproved = [column["title"] for column in found["programs"]["columns"]].index("unproved")
    assert [row[unproved] for row in every] == [None, None, 71] and "also run where they cannot be followed" in page
    assert every[2][1] == "compensated, as before"
    assert [row[5] for row in found["warnings"]["rows"]] == ["CMP006", "CMP005"]
    assert found["warnings"]["rows"][0][:2] == [3, 2] and "0.92 mm off" in found["warnings"]["rows"][0]
    assert "programs" in page and 'class="was"' in page and 'class="is"' in page
