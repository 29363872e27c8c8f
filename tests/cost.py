"""What a run costs, the same on every machine: operations, time against a loop, and the largest memory so far."""

from __future__ import annotations

import gc
import resource
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any


def operations(run: Callable[[], object]) -> int:
    """Lines of Python that a run executes, passes of loops within a line included: the same number every time."""
    count = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        count += 1
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        run()
    finally:
        sys.settrace(before)
    return count


def loops(run: Callable[[], object], times: int = 1) -> float:
    """Processor time of a run in passes of an empty loop on this machine, the least of several runs.

    For what happens inside one call of C, as a regular expression, where no operation can be counted. Without garbage
    collection, which costs what other tests left.
    """
    runs = []
    collecting = gc.isenabled()
    for _ in range(times):
        gc.disable()
        try:
            begin = time.process_time()
            run()
            runs.append(time.process_time() - begin)
        finally:
            if collecting:
                gc.enable()
    return min(runs) / _pass()


def within(run: Callable[[], object], most: float) -> bool:
    """Whether one of three runs takes at most so many passes of an empty loop (`loops`): a busy machine slows them."""
    return any(loops(run) <= most for _ in range(3))


@cache
def _pass() -> float:
    """Processor time of a pass of an empty loop [s]: of so many that the clock's own step does not matter."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        for _ in range(5_000_000):
            pass
        times.append(time.process_time() - begin)
    return min(times) / 5e6


def peak_mb() -> float:
    """In MB. On Linux from /proc: ``ru_maxrss`` also keeps what the process that started this one held."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(x for x in status.read_text("ascii").splitlines() if x.startswith("VmHWM"))
        return float(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
