"""Kill a batch with signal 9 while it works, again and again, then let it finish."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def start(source: Path, out: Path, *options: str) -> subprocess.Popen[bytes]:
    command = [
        sys.executable,
        "-m",
        "postproc",
        "batch",
        str(source),
        "-o",
        str(out),
        "--tolerance",
        "0.1",
        "--robot",
        "irb4600_60_205",
        *options,
    ]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command,
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        # A shell starts what runs in its background deaf to SIGINT, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def children(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(child) for child in path.read_text().split()] if path.exists() else []


def kill_when(
    run: subprocess.Popen[bytes], ripe: Callable[[], bool], limit: float = 120.0, by: signal.Signals = signal.SIGKILL
) -> list[int]:
    """Kill a run when it is ripe; the processes that it leaves behind."""
    end = time.monotonic() + limit
    while not ripe() and run.poll() is None:
        assert time.monotonic() < end, "the run makes no progress"
        time.sleep(0.002)
    left = children(run.pid)
    run.send_signal(by)
    _, said = run.communicate(timeout=limit)
    assert b"resource_tracker" not in said, "nobody wants to read about semaphores"
    return left


def gone(pids: list[int], limit: float = 30.0) -> bool:
    """Whether processes end by themselves."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        if not any(_alive(pid) for pid in pids):
            return True
        time.sleep(0.05)
    return False


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def outputs(out: Path) -> int:
    return sum(1 for path in out.rglob("*.mod") if ".postproc" not in path.parts)
