"""The largest memory that a process has held since it began."""

from __future__ import annotations

import resource
from pathlib import Path


def peak_mb() -> float:
    """In MB. On Linux from /proc: ``ru_maxrss`` also keeps what the process that started this one held."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(x for x in status.read_text("ascii").splitlines() if x.startswith("VmHWM"))
        return float(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
