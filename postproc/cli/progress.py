"""How a batch and other long work are shown while they run and when they are done: for people, on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from postproc.batch.summary import finding_line, result_line
from postproc.batch.values import TaskOutcome
from postproc.cli.printing import MOST_SHOWN, print_aside, say, width_of
from postproc.diagnostics import Matter, PostprocError, visible
from postproc.grouping import grouped

if TYPE_CHECKING:
    from postproc.batch.run import Ready
    from postproc.watch import Watch

CLEAR = "\r\x1b[K"  # the line of a terminal on which the cursor is


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
        told = [f for f in outcome.findings if f.matter is Matter.EDITED or (failed and f.severity == "error")]
        for code, found in grouped((f.code, f) for f in told).items():
            for finding in found[: MOST_SHOWN["error"]]:
                self._say(f"  {finding_line(finding)}")
            if len(found) > MOST_SHOWN["error"]:
                self._say(f"  {code}: {len(found) - MOST_SHOWN['error']} more like this")

    def _say(self, text: str) -> None:
        """Print a line, over the line that shows the progress."""
        if self.watch is not None:
            print_aside(CLEAR, end="")
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
    if not sys.stderr.isatty():
        yield Reporter(total)
        return
    with watching("programs") as watch:
        yield Reporter(total, watch)


class _Work:
    """The progress of long work: its present step, the share that is done, and since when it runs."""

    def __init__(self, what: str, lines: int) -> None:
        """Start the clock of a work with this name and number of lines."""
        self.what, self.lines = what, lines
        self.begun = self.told = time.monotonic()
        self.step, self.share = "", 0.0

    def watch(self, step: str, share: float) -> None:
        """Note the present step and the share of the work that is done."""
        self.step, self.share, self.told = step, max(self.share, min(share, 1.0)), time.monotonic()

    def line(self, now: float) -> str:
        """Return a line on step, share, time, rate and remaining time, as far as the share tells them.

        Args:
            now: by the monotonic clock [s].
        """
        parts = [": ".join(filter(None, (self.what, self.step))), f"{now - self.begun:.0f} s"]
        if self.share > 0:
            parts.insert(1, f"{100 * self.share:.0f} %")
            done = self.told - self.begun
            if done < 0.5:  # too early to tell
                return visible(", ".join(parts))
            if self.lines:
                parts.append(f"{self.share * self.lines / done:,.0f} lines/s")
            left = done * (1 - self.share) / self.share - (now - self.told)
            if left >= 1:  # a step that takes longer than its share foretold has no end that is known
                parts.append(f"about {left:.0f} s remain")
        return visible(", ".join(parts))


@contextmanager
def watching(what: str = "", lines: int = 0) -> Iterator[Watch]:
    """Show the progress of work that takes over a second: each second on a terminal, elsewhere at growing intervals.

    Args:
        what: name of the work. lines: length of the program that is worked on, for a rate; 0 for no rate.
    """
    terminal, done, work = sys.stderr.isatty(), threading.Event(), _Work(what, lines)

    def tell() -> None:
        """Print the progress until the work is done."""
        pause = 1.0 if terminal else 10.0
        while not done.wait(pause):
            line = work.line(time.monotonic())
            if terminal:  # what wraps could not be taken back
                line = line[: (width_of(sys.stderr) or len(line) + 1) - 1]
                print_aside(f"\r{line}\x1b[K", end="")
            else:
                print_aside(line)
            pause *= 1 if terminal else 2
        if terminal and time.monotonic() - work.begun > 1:
            print_aside(CLEAR, end="")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield work.watch
    finally:
        done.set()
        teller.join()


def arm_lines(ready: Ready) -> Iterator[str]:
    """Yield lines on which arm tasks are converted for, and by what settings; equal lines are counted."""
    lines: Counter[str] = Counter()
    for found in ready.converters.values():
        lines["no arm" if isinstance(found, PostprocError) else found.settings.headline(found.robot)] += 1
    for line, count in lines.items():
        yield line if len(lines) == 1 else f"{count} task{'s' * (count > 1)}: {line}"
    converters = (found for found in ready.converters.values() if not isinstance(found, PostprocError))
    yield from dict.fromkeys(line for found in converters for line in found.settings.inherited_line(ready.plan.root))
