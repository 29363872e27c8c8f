"""What a run costs: processor time, and the largest memory that a process has had since it began."""

from __future__ import annotations

import gc
import resource
import time
from collections.abc import Callable
from pathlib import Path


def seconds(run: Callable[[], object], times: int = 1) -> float:
    """Processor time of a run, the least of several; without garbage collection, which costs what other tests left."""
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
    return min(runs)


def grows_by(short: Callable[[], object], longer: Callable[[], object], most: float, floor: float) -> bool:
    """Whether a longer run costs at most so many times the short one, or that many times the least that can be told.

    What is plainly so at once is not measured again; else the least of three counts.
    """
    return any(seconds(longer, n) < most * max(seconds(short, n), floor) for n in (1, 3))


def peak_mb() -> float:
    """In MB. On Linux from /proc: ``ru_maxrss`` also keeps what the process that started this one held."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(x for x in status.read_text("ascii").splitlines() if x.startswith("VmHWM"))
        return float(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
