"""A batch: how many programs, the worst that remains, what failed and why, every program."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from urllib.parse import quote

import numpy as np

from postproc.grouping import grouped
from postproc.report.blocks import Chart, DataTable, Document, Figure, Section, Values
from postproc.report.drawing.charts import histogram
from postproc.results.conversion import made_section

MOST = 40
"""Programs that a terminal prints where not all are asked for."""
UNPROVED = "corrected statements that also run where they cannot be followed; what remains there is in no figure"
FINDING = ("program", "line", "severity", "code", "what", "what to do")
COLUMNS = (
    *("program", "result", "before [mm]", "after [mm]", "added", "on the controller", "left", "unproved"),
    *("cycle [s]", "warnings"),
)


def batch_document(
    name: str,
    values: Values,
    made: Mapping[str, str] | None = None,
    pages: Mapping[str, str] | None = None,
) -> Document:
    """Describe a batch, for terminal and page.

    Args:
        name: of the folder or the jobs file. values: its ``postproc/batch/1`` document.
        made: model, loads and choices, where no jobs file states others. pages: link to the page of each task by name.
    """
    tasks, count = sorted(values["tasks"], key=_rank), values["counts"]
    done = [t for t in tasks if "max_error_after_mm" in t]
    worst = max(done, key=lambda t: float(t["max_error_after_mm"]), default=None)
    told = [(t["name"], d) for t in tasks for d in t["diagnostics"]]
    errors = [_finding(name, d) for name, d in told if d["severity"] == "error"]
    said = [*errors, *(_finding("", d) for d in values["diagnostics"])]
    # A terminal has shown those of tasks as each was done.
    found = DataTable("errors", FINDING, said, range(len(errors), len(said)))
    sections = [Section("Errors", [found])]
    note = "Failures first, then the largest deviations that remain."
    if pages:
        note += " A click on a program opens its page."
    if any(t.get("unproved_statements") for t in tasks):
        note += f" Unproved: {UNPROVED}."
    links = (0, [_link((pages or {}).get(t["name"])) for t in tasks]) if pages else None
    programs = DataTable("programs", COLUMNS, [_row(t) for t in tasks], range(min(MOST, len(tasks))), links)
    sections.append(Section("Every program", [programs], note))
    if len(done) > 1:
        sections.append(Section("Before and after", [Chart(lambda: [_histogram(done)], 520)]))
    note = "One of each kind, with the largest figure that it tells; the JSON document of the batch has all of them."
    warned = [(name, d) for name, d in told if d["severity"] == "warning"]
    kinds = DataTable("warnings", ("how many", "programs", *FINDING), _kinds(warned))
    sections += [Section("Warnings", [kinds], note), made_section(made or {})]
    return Document(
        title=f"postproc batch {name}",
        values=values,
        sentence=_sentence(count, worst),
        figures=[
            Figure("programs corrected", count["compensated"]),
            Figure("failed", count["failed"] or None),
            Figure("nothing to correct", count["unchanged"] or None),
            Figure("worst before", max((t["max_error_before_mm"] for t in done), default=None), "before"),
            Figure("worst after", worst and worst["max_error_after_mm"], "after"),
            Figure("targets added", sum(t["added_targets"] for t in done)),
            Figure("beyond the tolerance somewhere", count["beyond_tolerance"] or None),
            Figure("done before", count["cached"] or None),
            Figure("files copied", count["copied"] or None),
        ],
        sections=sections,
    )


def _histogram(done: Sequence[Values]) -> str:
    """Return an SVG histogram of the largest deviations of programs, before and after; empty where none is positive."""
    lengths = {
        key: (kind, np.array([t[f"max_error_{key}_mm"] for t in done], dtype=float))
        for key, kind in (("before", "was"), ("after", "is"))
    }
    return histogram(lengths, "mm", "Each program, before and after")


def _link(path: str | None) -> str | None:
    """Quote a path as the address of a link, in which `a b#1.html` is a file and not a place in one."""
    return None if path is None else quote(path.encode("utf-8", "surrogateescape"), safe="/")


def _sentence(count: Mapping[str, int], worst: Values | None) -> str:
    """Say how many programs are corrected, how many failed, and the largest deviation that remains."""
    total = count["compensated"] + count["unchanged"] + count["failed"]
    lead = f"{count['compensated']} of {total} programs are corrected"
    failed = (
        f"; {count['failed']} failed and {'has' if count['failed'] == 1 else 'have'} no output"
        if count["failed"]
        else ""
    )
    left = worst and f"; at most {worst['max_error_after_mm']:.3f} mm remain, in `{worst['name']}`"
    return f"{lead}{failed}{left or ''}."


def _rank(task: Values) -> tuple[bool, float]:
    """Return a sort key: failed tasks first, then by falling remaining deviation."""
    return task["status"] != "failed", -task.get("max_error_after_mm", 0.0)


def _row(task: Values) -> tuple[object, ...]:
    """Return the row of a task in the table of programs."""
    warnings = sum(d["severity"] == "warning" for d in task["diagnostics"])
    result = task["status"] + (", as before" if task["cached"] else "")
    names = ("max_error_before_mm", "max_error_after_mm", "added_targets")
    status, unproved = task.get("statements", {}), task.get("unproved_statements") or None
    counts = (status.get("run_time") or None, status.get("skipped"), unproved)
    figures = (*(task.get(n) for n in names), *counts, task.get("cycle_time_s"))
    return (task["name"], result, *figures, warnings or None)


def _finding(name: str, found: Values) -> tuple[object, ...]:
    """Return the row of a finding in a table: place, severity, code, message and help."""
    return found["path"] or name, found["line"], found["severity"], found["code"], found["message"], found["help"]


def _kinds(told: Sequence[tuple[str, Values]]) -> list[tuple[object, ...]]:
    """Return a row for every code among (task, finding), the most frequent first: count, programs, worst finding."""
    rows = []
    for same in sorted(grouped((one[1]["code"], one) for one in told).values(), key=len, reverse=True):
        name, worst = max(same, key=lambda one: _figure(one[1]["message"]))
        rows.append((len(same), len({program for program, _ in same}), *_finding(name, worst)))
    return rows


def _figure(message: str) -> float:
    """Return the first length [mm] in a message; 0 without one."""
    found = re.search(r"(?<![\d.])([\d.]++) mm\b", message)
    return float(found[1]) if found else 0.0
