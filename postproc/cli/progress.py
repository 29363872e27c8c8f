"""How a batch and other long work are shown while they run and when they are done: for people, on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from postproc.batch.summary import finding_line, result_line
from postproc.batch.values import TaskOutcome
from postproc.cli.report import MOST, say, width_of
from postproc.diagnostics import PostprocError, visible

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from postproc.batch.run import Ready
    from postproc.watch import Watch

EDITED = "BAT016"
"""Somebody's own work was put aside: that is told whatever became of the program."""


@dataclass
class Reporter:
    """One line for each task, or a bar on a terminal; failures and edits that were put aside are told either way."""

    total: int
    bar: tuple[Progress, TaskID] | None = None
    started: float = field(default_factory=time.monotonic)
    done: int = 0

    def outcome(self, outcome: TaskOutcome) -> None:
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
            if count[found["code"]] <= MOST["error"]:
                self._say(f"  {finding_line(found)}")
        for code, places in count.items():
            if places > MOST["error"]:
                self._say(f"  {code}: {places - MOST['error']} more like this")
        if self.bar is not None:
            self.bar[0].advance(self.bar[1])

    def _say(self, text: str) -> None:
        if self.bar is None:
            say(text)
        else:
            self.bar[0].console.print(visible(text), markup=False, highlight=False, soft_wrap=True)

    def time_line(self) -> str:
        """How many tasks were done, in which time."""
        return f"{self.done} task{'s' * (self.done != 1)} in {time.monotonic() - self.started:.1f} s"


class _Work:
    """How far a long work is: what is done, its share, and since when."""

    def __init__(self, what: str, lines: int) -> None:
        self.what, self.lines = what, lines
        self.begun = self.told = time.monotonic()
        self.step, self.share = "", 0.0

    def watch(self, step: str, share: float) -> None:
        self.step, self.share, self.told = step, max(self.share, min(share, 1.0)), time.monotonic()

    def line(self, now: float) -> str:
        """Step, share, time, rate and the time that may remain, as far as the share tells them."""
        parts = [": ".join(filter(None, (self.what, self.step))), f"{now - self.begun:.0f} s"]
        if self.share > 0:
            parts.insert(1, f"{100 * self.share:.0f} %")
            done = self.told - self.begun
            if done < 0.5:  # too early to tell
                return visible(", ".join(parts))
            if self.lines:
                parts.append(f"{self.share * self.lines / done:,.0f} lines/s")
            left = done * (1 - self.share) / self.share - (now - self.told)
            parts.append(f"about {max(left, 1):.0f} s remain")
        return visible(", ".join(parts))


@contextmanager
def watching(what: str = "", lines: int = 0) -> Iterator[Watch]:
    """Show how far a work of more than a second is: each second on a terminal, elsewhere ever more rarely.

    Args:
        lines: length of what is worked on, for a rate; 0 where that says nothing.
    """
    terminal, done, work = sys.stderr.isatty(), threading.Event(), _Work(what, lines)

    def tell() -> None:
        pause = 1.0 if terminal else 10.0
        while not done.wait(pause):
            line = work.line(time.monotonic())
            if terminal:  # what wraps could not be taken back
                line = line[: (width_of(sys.stderr) or len(line) + 1) - 1]
                print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)
            else:
                print(line, file=sys.stderr, flush=True)
            pause *= 1 if terminal else 2
        if terminal and time.monotonic() - work.begun > 1:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield work.watch
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
    converters = (found for found in ready.converters.values() if not isinstance(found, PostprocError))
    yield from dict.fromkeys(line for found in converters for line in found.settings.heritage(ready.plan.root))


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
