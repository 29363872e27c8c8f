"""The page of a batch: how many programs, the worst that remains, what failed and why, every program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.report.page import Section, made_section, render_page, table

MOST_ROWS = 2000
UNPROVED = "corrected statements that also run where they cannot be followed; what remains there is in no figure"
COLUMNS = ("program", "result", "before [mm]", "after [mm]", "added", "left", "unproved", "cycle [s]", "warnings")


def batch_page(name: str, document: Mapping[str, Any], made: Mapping[str, str] | None = None) -> str:
    """HTML of a batch.

    Args:
        name: of the folder or the jobs file. document: ``postproc/batch/1``, plain values. made: with which model,
            loads and choices, where no jobs file says otherwise.
    """
    tasks, count = document["tasks"], document["counts"]
    done = [t for t in tasks if "max_error_after_mm" in t]
    worst = max(done, key=lambda t: float(t["max_error_after_mm"]), default=None)
    key = {
        "corrected": str(count["compensated"]),
        "nothing to correct": str(count["unchanged"]) if count["unchanged"] else None,
        "failed": str(count["failed"]),
        "worst before": max((t["max_error_before_mm"] for t in done), default=None),
        "worst after": worst and worst["max_error_after_mm"],
        "targets added": str(sum(t["added_targets"] for t in done)),
    }
    sections = []
    said = [_finding(t["name"], d) for t in tasks for d in t["diagnostics"] if d["severity"] != "info"]
    said.sort(key=lambda row: row[2] != "error")
    said += [_finding("", d) for d in document["diagnostics"]]
    if said:
        columns = ("program", "line", "", "code", "what", "what to do")
        sections.append(Section("Errors and warnings", table(columns, said[:MOST_ROWS]), _cut(len(said))))
    rows = [_row(t) for t in sorted(tasks, key=_rank)]
    note = "Failures first, then the largest deviations that remain. "
    if any(t.get("unproved_statements") for t in tasks):
        note += f"Unproved: {UNPROVED}. "
    note += _cut(len(rows))
    sections.append(Section("Every program", table(COLUMNS, rows[:MOST_ROWS]), note))
    sections.append(made_section(made or {}))
    return render_page(f"postproc batch {name}", _sentence(count, worst), sections, document, key)


def _sentence(count: Mapping[str, int], worst: Mapping[str, Any] | None) -> str:
    total = count["compensated"] + count["unchanged"] + count["failed"]
    lead = f"{count['compensated']} of {total} programs are corrected"
    failed = f"; {count['failed']} failed and have no output" if count["failed"] else ""
    left = worst and f"; at most {worst['max_error_after_mm']:.3f} mm remain, in `{worst['name']}`"
    return f"{lead}{failed}{left or ''}."


def _rank(task: Mapping[str, Any]) -> tuple[bool, float]:
    return task["status"] != "failed", -task.get("max_error_after_mm", 0.0)


def _row(task: Mapping[str, Any]) -> tuple[object, ...]:
    warnings = sum(d["severity"] == "warning" for d in task["diagnostics"])
    result = task["status"] + (", as before" if task["cached"] else "")
    names = ("max_error_before_mm", "max_error_after_mm", "added_targets")
    left, unproved = task.get("statements", {}).get("skipped"), task.get("unproved_statements") or None
    figures = (*(task.get(n) for n in names), left, unproved, task.get("cycle_time_s"))
    return (task["name"], result, *figures, warnings or None)


def _finding(name: str, found: Mapping[str, Any]) -> tuple[object, ...]:
    return found["path"] or name, found["line"], found["severity"], found["code"], found["message"], found["help"]


def _cut(count: int) -> str:
    return f"The first {MOST_ROWS} of {count}." if count > MOST_ROWS else ""
