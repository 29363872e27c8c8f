"""What became of a task of a batch, on one line as it is done, and its findings."""

from __future__ import annotations

from postproc.batch.values import TaskOutcome
from postproc.batch.work import MEASURED
from postproc.diagnostics import Finding, one_line


def result_line(outcome: TaskOutcome) -> str:
    """Return one line on a task of a batch: its deviation before and after, or its status."""
    text: str = outcome.status
    if f := outcome.figures:
        fell = " -> ".join(f"{f[name]:.3f} mm" for name in MEASURED if name in f) or "no line or arc could be measured"
        through = f["statements"].get("run_time")
        text = f"{fell}, {f['added_targets']} target{'s' * (f['added_targets'] != 1)} added"
        text += f", {through} statement{'s' * (through != 1)} corrected on the controller" if through else ""
    return f"{one_line(outcome.task.name)}: {text}{' (done before)' if outcome.cached else ''}"


def finding_line(found: Finding) -> str:
    """Return a finding on one line: ``path:line:column: severity[code]: message (help)``."""
    place = ":".join(str(part) for part in (found.path, found.line, found.column) if part is not None)
    help_ = f" ({found.help})" if found.help else ""
    return one_line(f"{place + ': ' if place else ''}{found.severity}[{found.code}]: {found.message}{help_}")
