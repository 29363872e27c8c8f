"""How a batch is shown while it runs and when it is done: for people, on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from postproc.batch.summary import finding_line, result_line, sum_line, table_lines
from postproc.batch.values import Batch, Outcome
from postproc.cli.report import SHOWN, say
from postproc.diagnostics import PostprocError, visible

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from postproc.batch.run import Ready

EDITED = "BAT016"
"""Somebody's own work was put aside: that is told whatever became of the program."""


@dataclass
class Reporter:
    """One line for each task, or a bar on a terminal; failures and edits that were put aside are told either way."""

    total: int
    bar: tuple[Progress, TaskID] | None = None
    started: float = field(default_factory=time.monotonic)
    done: int = 0

    def outcome(self, outcome: Outcome) -> None:
        self.done += 1
        failed = outcome.status == "failed"
        if self.bar is None:
            self._say(f"[{self.done:{len(str(self.total))}}/{self.total}] {result_line(outcome)}")
        elif failed:
            self._say(result_line(outcome))
        told = [f for f in outcome.findings if f["code"] == EDITED or (failed and f["severity"] == "error")]
        count: Counter[str] = Counter()
        for found in told:
            count[found["code"]] += 1
            if count[found["code"]] <= SHOWN:
                self._say(f"  {finding_line(found)}")
        for code, places in count.items():
            if places > SHOWN:
                self._say(f"  {code}: {places - SHOWN} more places")
        if self.bar is not None:
            self.bar[0].advance(self.bar[1])

    def _say(self, text: str) -> None:
        if self.bar is None:
            say(text)
        else:
            self.bar[0].console.print(visible(text), markup=False, highlight=False, soft_wrap=True)

    def summary(self, batch: Batch) -> None:
        for line in table_lines(batch):
            say(line)
        for found in batch.findings:
            say(finding_line(found))
        say(sum_line(batch, time.monotonic() - self.started))


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say every now and then that work goes on: each second in one line of a terminal, elsewhere ever more rarely."""
    terminal, done, started = sys.stderr.isatty(), threading.Event(), time.monotonic()

    def tell() -> None:
        pause = 1.0 if terminal else 10.0
        while not done.wait(pause):
            line = visible(f"{what}: {time.monotonic() - started:.0f} s")
            print(f"\r{line}" if terminal else line, end="" if terminal else "\n", file=sys.stderr, flush=True)
            pause *= 1 if terminal else 2
        if terminal and time.monotonic() - started > 1:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()


def arm_lines(ready: Ready) -> Iterator[str]:
    """Which arm each task is converted for, what says so, how near: a line for all tasks that are alike."""
    lines: Counter[str] = Counter()
    for found in ready.converters.values():
        lines["no arm" if isinstance(found, PostprocError) else found.settings.headline(found.robot)] += 1
    for line, count in lines.items():
        yield line if len(lines) == 1 else f"{count} task{'s' * (count > 1)}: {line}"


@contextmanager
def reporting(total: int) -> Iterator[Reporter]:
    """A reporter; on a terminal with a bar, the rate and the remaining time."""
    if not sys.stderr.isatty():
        yield Reporter(total)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TimeRemainingColumn
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Any) -> Text:
            return Text(f"{60 * (task.finished_speed or task.speed or 0):.0f}/min")

    columns = (BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as progress:
        yield Reporter(total, (progress, progress.add_task("", total=total)))


@contextmanager
def watching() -> Iterator[Callable[[str, float], None]]:
    """What is told of a long fit or search: on a terminal a line with what is done, and the time that may remain."""
    if not sys.stderr.isatty():
        yield lambda what, share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (BarColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=1.0)
        yield lambda what, share: progress.update(task, description=what, completed=share)
