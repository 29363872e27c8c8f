"""A batch in words: one line for each task, a table at the end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from postproc.batch.values import Batch, TaskOutcome
from postproc.batch.work import MEASURED
from postproc.diagnostics import one_line

HEAD = ("task", "result", "before mm", "after mm", "added", "controller", "left", "unproved", "warnings")
MOST_ROWS = 40


def result_line(outcome: TaskOutcome) -> str:
    """What became of a task."""
    text: str = outcome.status
    if f := outcome.figures:
        fell = " -> ".join(f"{length} mm" for length in _lengths(f) if length) or "no line or arc could be measured"
        through = f["statements"].get("run_time")
        text = f"{fell}, {f['added_targets']} target{'s' * (f['added_targets'] != 1)} added"
        text += f", {_counted(through, 'statement')} corrected on the controller" if through else ""
    return f"{one_line(outcome.task.name)}: {text}{' (done before)' if outcome.cached else ''}"


def finding_line(found: Mapping[str, Any]) -> str:
    """A finding on one line, as compilers write them."""
    place = ":".join(str(found[key]) for key in ("path", "line", "column") if found[key] is not None)
    help_ = f" ({found['help']})" if found["help"] else ""
    return one_line(f"{place + ': ' if place else ''}{found['severity']}[{found['code']}]: {found['message']}{help_}")


def table_lines(batch: Batch) -> Iterator[str]:
    """A row for each task: deviation before and after, targets added, statements corrected on the controller, those
    left as they are, and corrected ones that also run where they cannot be followed.

    Those that matter most, failures first with their reason, then the largest remaining deviations.
    """
    shown = sorted(batch.outcomes, key=_rank)[:MOST_ROWS]
    rows = [HEAD, *map(_row, shown)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEAD))]
    for row in rows:
        cells = [cell.rjust(w) if i > 1 else cell.ljust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))]
        yield "  ".join(cells).rstrip()
    if len(shown) < len(batch.outcomes):
        yield f"and {len(batch.outcomes) - len(shown)} more; --json lists all"


def _rank(outcome: TaskOutcome) -> tuple[bool, float]:
    return outcome.status != "failed", -outcome.figures.get("max_error_after_mm", 0.0)


def _lengths(figures: Mapping[str, Any]) -> tuple[str, ...]:
    """Deviation before and after [mm]; empty where nothing could be measured."""
    return tuple(f"{figures[name]:.3f}" if name in figures else "" for name in MEASURED)


def _row(outcome: TaskOutcome) -> tuple[str, ...]:
    figures: tuple[str, ...] = ("",) * 6
    if f := outcome.figures:
        status = f["statements"]
        counts = (
            f["added_targets"],
            status.get("run_time") or "",
            status["skipped"],
            f.get("unproved_statements") or "",
        )
        figures = (*_lengths(f), *map(str, counts))
    warnings = sum(found["severity"] == "warning" for found in outcome.findings)
    reason = next((f": {found['code']}" for found in outcome.findings if found["severity"] == "error"), "")
    result = outcome.status + (reason if outcome.status == "failed" else "") + (", as before" if outcome.cached else "")
    return (one_line(outcome.task.name), result, *figures, str(warnings or ""))


def warning_lines(batch: Batch) -> Iterator[str]:
    """Warnings of tasks that did not fail: a line for each code, with how often, and one of it."""
    found: dict[str, list[tuple[str, Mapping[str, Any]]]] = {}
    for outcome in batch.outcomes:
        for finding in outcome.findings if outcome.status != "failed" else ():
            if finding["severity"] == "warning":
                found.setdefault(finding["code"], []).append((outcome.task.name, finding))
    for code, here in sorted(found.items()):
        tasks = _counted(len({task for task, _ in here}), "task")
        task, first = here[0]
        where = "" if first["path"] is not None else f"{task}: "
        yield f"{code}: {_counted(len(here), 'warning')} in {tasks}, such as {where}{finding_line(first)}"


def sum_line(batch: Batch, seconds: float) -> str:
    """The batch in one line."""
    count = batch.counts
    parts = [f"{count[status]} {status}" for status in ("compensated", "unchanged", "failed") if count[status]]
    beyond = count["beyond_tolerance"]
    parts += [f"{beyond} of them beyond the tolerance somewhere (CMP006)"] if beyond else []
    parts += [f"{count['cached']} of them done before"] if count["cached"] else []
    parts += [_counted(batch.copied, "file") + " copied"] if batch.copied else []
    return f"{_counted(len(batch.outcomes), 'task')} in {seconds:.1f} s: {', '.join(parts)}"


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"
