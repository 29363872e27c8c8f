"""What ``batch`` prints on stderr: which arm it is for, what became of each task, how far it is."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from postproc.batch.values import ON_ARM, TaskOutcome
from postproc.cli.printing import MOST_SHOWN, print_stderr, say
from postproc.cli.progress import CLEAR, watching
from postproc.diagnostics import Finding, Matter, PostprocError, one_line
from postproc.grouping import grouped
from postproc.numbers import fixed, on_arm_text
from postproc.results.convert.figures import decimals, is_guess, main_figure

if TYPE_CHECKING:
    from postproc.batch.jobs import Ready
    from postproc.watch import Watch


def arm_lines(ready: Ready) -> Iterator[str]:
    """Yield lines on which arm tasks are converted for, and by what settings; equal lines are counted."""
    converters = [one.converter for one in ready.tasks]
    lines = Counter("no arm" if isinstance(c, PostprocError) else c.settings.headline(c.robot.name) for c in converters)
    for line, count in lines.items():
        yield line if len(lines) == 1 else f"{count} task{'s' * (count > 1)}: {line}"
    known = (converter for converter in converters if not isinstance(converter, PostprocError))
    yield from dict.fromkeys(line for c in known for line in c.settings.inherited_line(ready.plan.root))


@dataclass
class Reporter:
    """Prints a line for each task that is done; on a terminal only for failures, beside a line of progress.

    Args:
        total: number of tasks. started: by the monotonic clock [s].
        watch: shows on a terminal how far the batch is; None elsewhere.
    """

    total: int
    watch: Watch | None = None
    started: float = field(default_factory=time.monotonic)
    done: int = 0

    def outcome(self, outcome: TaskOutcome) -> None:
        """Print what became of a task; on a terminal only failures, and files edited by hand that were kept aside."""
        self.done += 1
        failed = outcome.status == "failed"
        if self.watch is None:
            say(f"[{self.done:{len(str(self.total))}}/{self.total}] {result_line(outcome)}")
        else:
            self.watch(f"{self.done} of {self.total}", self.done / self.total)
            if failed:
                self._say(result_line(outcome))
        # Somebody's own work was put aside: that is told whatever became of the program.
        shown = [f for f in outcome.findings if f.matter is Matter.EDITED or (failed and f.severity == "error")]
        for code, findings in grouped((f.code, f) for f in shown).items():
            for finding in findings[: MOST_SHOWN["error"]]:
                self._say(f"  {_finding_line(finding)}")
            if len(findings) > MOST_SHOWN["error"]:
                self._say(f"  {code}: {len(findings) - MOST_SHOWN['error']} more like this")

    def _say(self, text: str) -> None:
        """Print a line, over the line that shows the progress."""
        if self.watch is not None:
            print_stderr(CLEAR, end="")
        say(text)

    def time_line(self) -> str:
        """Return a line on how many tasks were done, in which time."""
        return f"{self.done} task{'s' * (self.done != 1)} in {time.monotonic() - self.started:.1f} s"


@contextmanager
def reporting(total: int) -> Iterator[Reporter]:
    """Provide a reporter for a batch; on a terminal it also shows progress and remaining time.

    Args:
        total: number of tasks.
    """
    with watching("programs") if sys.stderr.isatty() else nullcontext() as watch:
        yield Reporter(total, watch)


def result_line(outcome: TaskOutcome) -> str:
    """Return one line on a task of a batch: its deviation on the arm and in the model, or its status."""
    text: str = outcome.status
    if f := outcome.figures:
        fell = "no line or arc could be measured"
        if figure := main_figure(f):
            before, after = (fixed(figure[key], decimals(f)) for key in ("before_mm", "after_mm"))
            on_arm = on_arm_text(f.get(ON_ARM), decimals(f), is_guess(f))
            fell = f"on the arm {on_arm}, in the model {before} -> {after} mm"
        through = f["statements"].get("run_time")
        text = f"{fell}, {f['added_targets']} target{'s' * (f['added_targets'] != 1)} added"
        text += f", {through} statement{'s' * (through != 1)} corrected on the controller" if through else ""
        if f.get("verdict") == "not_kept":
            sentence = f["verdict_sentence"].removesuffix(".")
            text = f"{sentence[0].lower()}{sentence[1:]}; {text}"
    return f"{one_line(outcome.task.name)}: {text}{' (done before)' if outcome.cached else ''}"


def _finding_line(finding: Finding) -> str:
    """Return a finding on one line: ``path:line:column: severity[code]: message (help)``."""
    place = ":".join(str(part) for part in (finding.path, finding.line, finding.column) if part is not None)
    help_ = f" ({finding.help})" if finding.help else ""
    return one_line(f"{place + ': ' if place else ''}{finding.severity}[{finding.code}]: {finding.message}{help_}")
