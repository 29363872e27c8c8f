"""A batch: how many programs, the worst that remains, what failed and why, every program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from urllib.parse import quote

import numpy as np

from postproc import __version__
from postproc.batch.values import Batch, Shard, TaskOutcome
from postproc.batch.work import MEASURED
from postproc.diagnostics import Finding, Matter
from postproc.grouping import grouped
from postproc.report.blocks import Chart, DataTable, Document, Figure, Section, Values
from postproc.report.drawing.charts import histogram
from postproc.results.conversion import CORRECTED, made_section

MOST = 40
"""Programs that a terminal prints where not all are asked for."""
BEFORE, AFTER = MEASURED
UNPROVED = "corrected statements that also run where they cannot be followed; what remains there is in no figure"
FINDING = ("program", "line", "severity", "code", "what", "what to do")
COLUMNS = (
    *("program", "result", "before [mm]", "after [mm]", "added", "on the controller", "left", "unproved"),
    *("cycle [s]", "warnings"),
)


def batch_document(
    name: str,
    batch: Batch,
    shard: Shard = Shard(),
    *,
    made: Mapping[str, str] | None = None,
    pages: Mapping[str, str] | None = None,
) -> Document:
    """Describe a batch, for terminal and page.

    Args:
        name: of the folder or the jobs file.
        made: what programs were converted with (model, loads, options) as label and text, where a jobs file states no
            others. pages: link to the page of each task by name.
    """
    tasks, count = sorted(batch.outcomes, key=_rank), batch.counts
    done = [t.figures for t in tasks if AFTER in t.figures]
    worst = max((t for t in tasks if AFTER in t.figures), key=lambda t: float(t.figures[AFTER]), default=None)
    told = [(t.task.name, found) for t in tasks for found in t.findings]
    errors = [_finding(name, found) for name, found in told if found.severity == "error"]
    said = [*errors, *(_finding("", found) for found in batch.findings)]
    # A terminal has shown those of tasks as each was done.
    found = DataTable("errors", FINDING, said, range(len(errors), len(said)))
    sections = [Section("Errors", [found])]
    note = "Failures first, then the largest deviations that remain."
    if pages:
        note += " A click on a program opens its page."
    if any(t.figures.get("unproved_statements") for t in tasks):
        note += f" Unproved: {UNPROVED}."
    links = (0, [_link((pages or {}).get(t.task.name)) for t in tasks]) if pages else None
    programs = DataTable("programs", COLUMNS, [_row(t) for t in tasks], range(min(MOST, len(tasks))), links)
    sections.append(Section("Every program", [programs], note))
    if len(done) > 1:
        sections.append(Section("Before and after", [Chart(lambda: [_histogram(done)], 520)]))
    note = "One of each kind, with the largest figure that it tells; the JSON document of the batch has all of them."
    warned = [(name, found) for name, found in told if found.severity == "warning"]
    kinds = DataTable("warnings", ("how many", "programs", *FINDING), _kinds(warned))
    along = [(name, found.message) for name, found in told if found.matter is Matter.READ_ALONG]
    lent = DataTable("read along", ("program", "what"), along, range(min(MOST, len(along))))
    sections.append(Section("Read along", [lent]))
    sections += [Section("Warnings", [kinds], note), made_section(made or {})]
    return Document(
        title=f"postproc batch {name}",
        values=batch_values(batch, shard),
        sentence=_sentence(count, worst, [t.figures for t in tasks]),
        figures=[
            Figure("programs corrected", count["compensated"]),
            Figure("failed", count["failed"] or None),
            Figure("nothing to correct", count["unchanged"] or None),
            Figure("worst before", max((f[BEFORE] for f in done), default=None), "before"),
            Figure("worst after", worst and worst.figures[AFTER], "after"),
            Figure("targets added", sum(f["added_targets"] for f in done)),
            Figure("beyond the tolerance somewhere", count["beyond_tolerance"] or None),
            Figure("done before", count["cached"] or None),
            Figure("files copied", batch.copied or None),
        ],
        sections=sections,
    )


def batch_values(batch: Batch, shard: Shard) -> Values:
    """Return the ``postproc/batch/1`` document."""
    return {
        "schema": "postproc/batch/1",
        "tool": __version__,
        "shard": f"{shard.index}/{shard.count}",
        "tasks": [_task_values(outcome) for outcome in batch.outcomes],
        "counts": {**batch.counts, "copied": batch.copied},
        "diagnostics": [found.as_json() for found in batch.findings],
    }


def _task_values(outcome: TaskOutcome) -> Values:
    """Return an entry of ``tasks`` of the document."""
    return {
        "name": outcome.task.name,
        "status": outcome.status,
        "cached": outcome.cached,
        "files": list(outcome.task.files),
        **({"page": outcome.page} if outcome.page else {}),
        **outcome.arm,
        **outcome.figures,
        "diagnostics": [found.as_json() for found in outcome.findings],
    }


def _histogram(done: Sequence[Values]) -> str:
    """Return an SVG histogram of the largest deviations of programs, before and after; empty where none is positive.

    Args:
        done: figures of each program.
    """
    lengths = {
        name: (kind, np.array([figures[key] for figures in done], dtype=float))
        for name, key, kind in (("before", BEFORE, "was"), ("after", AFTER, "is"))
    }
    return histogram(lengths, "mm", "Each program, before and after")


def _link(path: str | None) -> str | None:
    """Quote a path as the address of a link, in which `a b#1.html` is a file and not a place in one."""
    return None if path is None else quote(path.encode("utf-8", "surrogateescape"), safe="/")


def _sentence(count: Mapping[str, int], worst: TaskOutcome | None, figures: Sequence[Values]) -> str:
    """Say how many programs and statements are corrected, how many failed, and the largest deviation that remains.

    Args:
        count: ``Batch.counts``. worst: the task with that deviation; None where none was measured.
        figures: of all tasks.
    """
    total = count["compensated"] + count["unchanged"] + count["failed"]
    statuses = [f["statements"] for f in figures if "statements" in f]
    corrected = sum(s.get(status, 0) for s in statuses for status in CORRECTED)
    every = corrected + sum(s.get("skipped", 0) for s in statuses)
    lead = f"{count['compensated']} of {total} programs are corrected"
    lead += f", {corrected} of {every} motion statements in them" if every else ""
    bare = sum(f.get("weld_statements", 0) > f.get("corrected_weld_statements", 0) == 0 for f in figures)
    lead += f"; in {bare} of them no weld was corrected" if bare else ""
    failed = (
        f"; {count['failed']} failed and {'has' if count['failed'] == 1 else 'have'} no output"
        if count["failed"]
        else ""
    )
    left = worst and f"; at most {worst.figures[AFTER]:.3f} mm remain, in `{worst.task.name}`"
    return f"{lead}{failed}{left or ''}."


def _rank(outcome: TaskOutcome) -> tuple[bool, float]:
    """Return a sort key: failed tasks first, then by falling remaining deviation."""
    return outcome.status != "failed", -outcome.figures.get(AFTER, 0.0)


def _row(outcome: TaskOutcome) -> tuple[object, ...]:
    """Return the row of a task in the table of programs."""
    figures = outcome.figures
    warnings = sum(found.severity == "warning" for found in outcome.findings)
    result = outcome.status + (", as before" if outcome.cached else "")
    status, unproved = figures.get("statements", {}), figures.get("unproved_statements") or None
    counts = (status.get("run_time") or None, status.get("skipped"), unproved)
    known = (*(figures.get(key) for key in (BEFORE, AFTER, "added_targets")), *counts, figures.get("cycle_time_s"))
    return (outcome.task.name, result, *known, warnings or None)


def _finding(name: str, found: Finding) -> tuple[object, ...]:
    """Return the row of a finding in a table: place, severity, code, message and help.

    Args:
        name: of its task; empty for the batch.
    """
    return found.path or name, found.line, found.severity, found.code, found.message, found.help


def _kinds(told: Sequence[tuple[str, Finding]]) -> list[tuple[object, ...]]:
    """Return a row for every code, the most frequent first: count, programs, worst finding.

    Args:
        told: every finding with the name of its task.
    """
    rows = []
    for same in sorted(grouped((found.code, (name, found)) for name, found in told).values(), key=len, reverse=True):
        name, worst = max(same, key=lambda one: one[1].length_mm)
        rows.append((len(same), len({program for program, _ in same}), *_finding(name, worst)))
    return rows
