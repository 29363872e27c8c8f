"""A batch: how many programs, the worst that remains, what failed and why, every program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from postproc import __version__
from postproc.batch.values import ON_ARM, Batch, Shard, TaskOutcome
from postproc.compensation.judgement.accuracy import remaining_deflection
from postproc.compensation.verdict import CORRECTED
from postproc.diagnostics import Finding, Matter
from postproc.grouping import grouped
from postproc.numbers import fixed, on_arm_text, range_text
from postproc.report.blocks import DataTable, Document, Figure, Scene, Section, Values, View, attributes
from postproc.results.convert.conversion import made_section, unknown_accuracy
from postproc.results.convert.figures import decimals, is_guess, main_figure, severity

MOST_SHOWN = 40
"""Programs that a terminal prints where not all are asked for."""
UNPROVED = "corrected statements that also run where they cannot be followed; what remains there is in no figure"
FINDING = ("program", "line", "severity", "code", "what", "what to do")
COLUMNS = (
    *("program", "result", "on the arm [mm]", "before", "in the model", "tolerance", "added", "on the controller"),
    *("left", "unproved", "cycle [s]", "warnings"),
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
    # Failed tasks first, then the worst.
    tasks = sorted(batch.outcomes, key=lambda task: (task.status == "failed", severity(task.figures)), reverse=True)
    count = batch.counts
    digits = max((decimals(task.figures) for task in tasks if main_figure(task.figures)), default=3)
    findings = [(task.task.name, finding) for task in tasks for finding in task.findings]
    errors = [_finding_row(name, finding) for name, finding in findings if finding.severity == "error"]
    errors += [_finding_row("", finding) for finding in batch.findings]
    # A terminal has shown those of tasks as each was done.
    error_table = DataTable("errors", FINDING, errors, range(len(errors) - len(batch.findings), len(errors)))
    # Before and after, where a line or an arc could be measured.
    shown = [(task, figure) for task in tasks if (figure := main_figure(task.figures))]
    measured = [task for task, _ in shown]
    known = [task for task in measured if ON_ARM in task.figures]
    worst = max(known or measured, key=_farthest, default=None)
    before, after = ([float(figure[key]) for _, figure in shown] for key in ("before_mm", "after_mm"))
    lent = [(name, finding.message) for name, finding in findings if finding.matter is Matter.READ_ALONG]
    along = DataTable("read along", ("program", "what"), lent, range(min(MOST_SHOWN, len(lent))))
    return Document(
        title=f"postproc batch {name}",
        values=_values(batch, shard),
        sentence=_sentence(count, worst, tasks),
        tone="error" if count["failed"] or any(task.figures.get("verdict") == "not_kept" for task in tasks) else "",
        figures=[
            Figure("programs corrected", count["compensated"]),
            Figure("failed", count["failed"] or None, "beyond"),
            Figure("nothing to correct", count["unchanged"] or None),
            Figure("worst on the arm", worst and _on_arm(worst)),
            Figure("worst before", max(before, default=None), "before", decimals=digits),
            Figure("worst after", max(after, default=None), "after", decimals=digits),
            Figure("targets added", sum(task.figures["added_targets"] for task in measured)),
            Figure("beyond the tolerance somewhere", count["beyond_tolerance"] or None, "beyond"),
            Figure("done before", count["cached"] or None),
            Figure("files copied", batch.copied or None),
        ],
        basis=_caveat(measured),
        sections=[
            Section("Errors", [error_table]),
            _every_program(tasks, pages or {}, digits),
            Section("Read along", [along]),
            _warnings([(name, finding) for name, finding in findings if finding.severity == "warning"]),
            made_section(made or {}),
        ],
        scene=Scene("programs", lambda: {"drawn": [_drawn(task.figures) for task in tasks]}),
    )


def _caveat(measured: Sequence[TaskOutcome]) -> str:
    """Say that no arm was measured for some of the programs, as their own pages do; empty where all models are fitted.

    Args:
        measured: tasks of which a line or an arc could be measured.
    """
    unfitted = [task.figures for task in measured if not _fitted(task.figures)]
    if not unfitted:
        return ""
    against = [d for task in measured for d in task.findings if d.matter is Matter.CONTRADICTED]
    text = unknown_accuracy(against, of_type=any(ON_ARM in figures for figures in unfitted))
    which = "" if len(unfitted) == len(measured) else f"In {len(unfitted)} of the programs "
    return f"{which or text[0].upper()}{text if which else text[1:]}."


def _fitted(figures: Values) -> bool:
    """Tell whether what is expected on the arm comes from a fit to its measurements."""
    return ON_ARM in figures and figures.get("expected_remaining_fraction") is None


def _drawn(figures: Values) -> Values | None:
    """Return the lengths [mm] that the page draws of a program; None where no line or arc of it could be measured."""
    main = main_figure(figures)
    keys = {"before": "before_mm", "after": "after_mm", "tolerance": "tolerance_mm", "on_arm": "expected_on_arm_mm"}
    return None if main is None else {**{k: main[key] for k, key in keys.items()}, "fitted": _fitted(figures)}


def _values(batch: Batch, shard: Shard) -> Values:
    """Return the ``postproc/batch/1`` document."""
    return {
        "schema": "postproc/batch/1",
        "tool": __version__,
        "shard": f"{shard.index}/{shard.count}",
        "tasks": [_task_values(outcome) for outcome in batch.outcomes],
        "counts": {**batch.counts, "copied": batch.copied},
        "diagnostics": [finding.as_json() for finding in batch.findings],
    }


def _task_values(outcome: TaskOutcome) -> Values:
    """Return an entry of ``tasks`` of the document."""
    return {
        "name": outcome.task.name,
        **attributes(outcome, "status", "cached"),
        "files": list(outcome.task.files),
        **({"page": outcome.page} if outcome.page else {}),
        **outcome.arm,
        **outcome.figures,
        "diagnostics": [finding.as_json() for finding in outcome.findings],
    }


def _sentence(count: Mapping[str, int], worst: TaskOutcome | None, tasks: Sequence[TaskOutcome]) -> str:
    """Say how many programs and statements are corrected, how many failed, and the largest deviation expected.

    Args:
        count: ``Batch.counts``. worst: the task with that deviation; None where none was measured.
        tasks: all of them, failures first, then those that do not keep their tolerance.
    """
    figures = [task.figures for task in tasks]
    statuses = [f["statements"] for f in figures if "statements" in f]
    corrected = sum(s.get(status, 0) for s in statuses for status in CORRECTED)
    every = sum(sum(s.values()) for s in statuses)
    text = f"{count['compensated']} of {len(figures)} programs are corrected"
    text += f", {corrected} of {every} motion statements in them" if every else ""
    bare = sum(f.get("weld_statements", 0) > f.get("corrected_weld_statements", 0) == 0 for f in figures)
    text += f"; in {bare} of them no weld was corrected" if bare else ""
    lost = sum(f.get("verdict") == "not_kept" for f in figures)
    text += f"; in {lost} of them the tolerance is not kept" if lost else ""
    failed = count["failed"]
    text += f"; {failed} failed and {'has' if failed == 1 else 'have'} no output" if failed else ""
    if worst is None:
        return f"{text}."
    after = fixed(_after(worst), decimals(worst.figures))
    worst_text = f"Farthest off is `{worst.task.name}`: on the arm {_on_arm(worst)}, in the model {after} mm."
    unknown = sum(ON_ARM not in f and main_figure(f) is not None for f in figures)
    if unknown and ON_ARM in worst.figures:
        worst_text += f" What the arm does is not known of {unknown} program{'s' * (unknown != 1)}."
    if guesses := sum(map(is_guess, figures)):
        worst_text += f" In {guesses} program{'s' * (guesses != 1)} it is a guess, outside the measured range."
    first = next((task for task in tasks if task.figures.get("verdict") == "not_kept"), None)
    not_kept = [] if first is None else [f"`{first.task.name}`: {first.figures['verdict_sentence']}"]
    stiffness, advice = remaining_deflection(_remaining(worst, tasks))
    further = [f"{stiffness[0].upper()}{stiffness[1:]}.", f"{advice[0].upper()}{advice[1:]}"] if stiffness else []
    return "\n".join([f"{text}.", *not_kept, worst_text, *further])


def _remaining(worst: TaskOutcome, tasks: Sequence[TaskOutcome]) -> Values:
    """Return the entries of `remaining_deflection` for the arm of a task, in ranges of all programs of that arm."""
    robot, mounting = worst.arm.get("robot"), worst.figures.get("mounting_deg", (0.0, 0.0, 0.0))
    of_robot = [task for task in tasks if task.arm.get("robot") == robot]
    of_arm = [task.figures for task in of_robot if task.figures.get("mounting_deg", mounting) == mounting]
    values: dict[str, Any] = {"robot": robot, "mounting_deg": mounting}
    for key in ("expected_remaining_fraction", "expected_remaining_fraction_after_gauge"):
        shares = [figures[key] for figures in of_arm if figures.get(key)]
        values[key] = [min(low for low, _ in shares), max(high for _, high in shares)] if shares else None
    loads = [figures["gauge_load_kg"] for figures in of_arm if figures.get("gauge_load_kg") is not None]
    return {**values, "gauge_load_kg": max(loads, default=None)}


def _farthest(task: TaskOutcome) -> tuple[float, float]:
    """Return the upper end of what is expected on the arm [mm], 0 where it is not known, and what the model leaves."""
    return task.figures.get(ON_ARM, (0.0, 0.0))[1], _after(task)


def _after(task: TaskOutcome) -> float:
    """Return the deviation [mm] that remains in the model in the place that counts most; 0 where none was measured."""
    figure = main_figure(task.figures)
    return float(figure["after_mm"]) if figure else 0.0


def _on_arm(task: TaskOutcome) -> str:
    """Return what is expected on the arm as text."""
    return on_arm_text(task.figures.get(ON_ARM), decimals(task.figures), is_guess(task.figures))


def _every_program(tasks: Sequence[TaskOutcome], pages: Mapping[str, str], digits: int) -> Section:
    """Return the section with a row for each task.

    Args:
        pages: path of the page of each task by name. digits: decimals of lengths.
    """
    note = "Failures first, then programs that do not keep the tolerance; of each kind the largest deviation over it."
    note += " A click on a program opens its page." if pages else ""
    if any(task.figures.get("unproved_statements") for task in tasks):
        note += f" Unproved: {UNPROVED}."
    paths = [pages.get(task.task.name, "").encode("utf-8", "surrogateescape") for task in tasks]
    # In an address `a b#1.html` must be a file and not a place in one.
    links = (0, [quote(path, safe="/") if path else None for path in paths]) if pages else None
    rows, brief = [_row(task) for task in tasks], range(min(MOST_SHOWN, len(tasks)))
    number = (*[None] * 3, *[digits] * 3, *[None] * 4, 1, None)
    table = DataTable("programs", COLUMNS, rows, brief, links, view="table", decimals=number)
    drawn = [View("legend")] if any(_drawn(task.figures) for task in tasks) else []
    return Section("Every program", [*drawn, table], note)


def _row(outcome: TaskOutcome) -> tuple[object, ...]:
    """Return the row of a task in the table of programs."""
    figures = outcome.figures
    warnings = sum(finding.severity == "warning" for finding in outcome.findings)
    result = outcome.status + (", not kept" if figures.get("verdict") == "not_kept" else "")
    result += ", as before" if outcome.cached else ""
    status, unproved = figures.get("statements", {}), figures.get("unproved_statements") or None
    counts = (status.get("run_time") or None, status.get("skipped"), unproved)
    figure = main_figure(figures) or {}
    lengths = (figure.get(f"{key}_mm") for key in ("before", "after", "tolerance"))
    known = (*lengths, figures.get("added_targets"), *counts, figures.get("cycle_time_s"))
    on_arm = range_text(figures.get(ON_ARM), decimals(figures), guess=is_guess(figures)) if figure else None
    return (outcome.task.name, result, on_arm, *known, warnings or None)


def _finding_row(name: str, finding: Finding) -> tuple[object, ...]:
    """Return the row of a finding in a table: place, severity, code, message and help.

    Args:
        name: of its task; empty for the batch.
    """
    return finding.path or name, finding.line, finding.severity, finding.code, finding.message, finding.help


def _warnings(warnings: Sequence[tuple[str, Finding]]) -> Section:
    """Return the section with a row for every code, the most frequent first: count, programs, worst finding.

    Args:
        warnings: with the name of the task of each.
    """
    by_code = grouped((finding.code, (name, finding)) for name, finding in warnings)
    rows: list[tuple[object, ...]] = []
    for same in sorted(by_code.values(), key=len, reverse=True):
        name, worst = max(same, key=lambda one: one[1].size)
        rows.append((len(same), len({program for program, _ in same}), *_finding_row(name, worst)))
    note = "One of each kind, with the largest figure that it tells; the JSON document of the batch has all of them."
    table = DataTable("warnings", ("how many", "programs", *FINDING), rows, beneath=6, tones=["warning"] * len(rows))
    return Section("Warnings", [table], note)
