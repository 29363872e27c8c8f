"""How far long work is, shown on a terminal while it runs."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from postproc.cli.printing import print_stderr, width_of
from postproc.diagnostics import visible

if TYPE_CHECKING:
    from postproc.watch import Watch

EVERY_S = 1.0  # [s] after which the line is shown, and shown anew
CLEAR = "\r\x1b[K"  # the line of a terminal on which the cursor is


class _Work:
    """The progress of long work: its present step, the share that is done, and since when it runs."""

    def __init__(self, what: str, lines: int) -> None:
        """Start the clock of a work with this name and number of lines."""
        self.what, self.lines = what, lines
        self.begun = self.reported = time.monotonic()
        self.step, self.share = "", 0.0

    def watch(self, step: str, share: float) -> None:
        """Note the present step and the share that is done, which falls where there is more to do than was known."""
        self.step, self.share, self.reported = step, min(share, 1.0), time.monotonic()

    def line(self, now: float, width: int | None = None) -> str:
        """Return a line on step, share, time, rate and remaining time, as far as the share tells them.

        Args:
            now: by the monotonic clock [s].
            width: columns that there are, None for as many as it takes; the rate goes first, then the end of the name.
        """
        name, parts = ": ".join(filter(None, (self.what, self.step))), [f"{now - self.begun:.0f} s"]
        if self.share > 0:
            parts.insert(0, f"{100 * self.share:.0f} %")
            done = self.reported - self.begun
            remaining = done * (1 - self.share) / self.share - (now - self.reported)
            # Too early it is not known, nor where a step takes longer than its share foretold.
            parts += [f"about {remaining:.0f} s remain"] if done >= 0.5 and remaining >= 1 else []
            rate = f"{self.share * self.lines / max(done, 0.5):,.0f} lines/s"
            if self.lines and done >= 0.5 and (width is None or len(", ".join((name, rate, *parts))) < width):
                parts.insert(2, rate)
        behind = "".join(f", {part}" for part in parts)
        return visible((name if width is None else name[: max(0, width - 1 - len(behind))]) + behind)


@contextmanager
def watching(what: str = "", lines: int = 0) -> Iterator[Watch]:
    """Show the progress of work that takes over a second, each second on a terminal; a pipe or a log gets none.

    Args:
        what: name of the work. lines: length of the program that is worked on, for a rate; 0 for no rate.
    """
    done, work = threading.Event(), _Work(what, lines)
    if not sys.stderr.isatty():
        yield work.watch
        return

    def tell() -> None:
        """Print the progress until the work is done."""
        while not done.wait(EVERY_S):
            # What wraps could not be taken back.
            print_stderr(f"\r{work.line(time.monotonic(), width_of(sys.stderr))}\x1b[K", end="")
        if time.monotonic() - work.begun > EVERY_S:
            print_stderr(CLEAR, end="")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield work.watch
    finally:
        done.set()
        teller.join()
