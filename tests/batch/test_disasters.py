"""A scheduler that dies and a disk that fills in a batch: told in a finding, nothing lost, the same tree in the end."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from postproc.batch.executors import Pool
from postproc.diagnostics import PostprocError

from .folders import ARM, cached, convert, programs, tree

BATCH = (sys.executable, "-m", "postproc", "batch")
WORDS = ("--robot", ARM, "--tolerance", "0.1")
LONGEST_S = 90.0


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that is ended at the end."""
    process = subprocess.Popen(
        [sys.executable, "-m", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ}
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def scheduled(place: Path) -> str:
    """The address of a scheduler, once it has written its file."""
    import json

    until = time.monotonic() + 30
    while time.monotonic() < until:
        try:
            return str(json.loads(place.read_text())["address"])
        except (OSError, ValueError):
            time.sleep(0.1)
    raise AssertionError("the scheduler did not start")


def test_a_scheduler_that_dies_is_told_and_nothing_is_lost(tmp_path: Path) -> None:
    source, place = programs(tmp_path / "in", 8), tmp_path / "scheduler.json"
    local = ("--host", "127.0.0.1", "--no-dashboard")
    with running("dask", "scheduler", *local, "--port", "0", "--scheduler-file", str(place)) as scheduler:
        address = scheduled(place)
        with running("dask", "worker", address, *local, "--nthreads", "1", "--no-nanny"):
            command = [*BATCH, str(source), "-o", str(tmp_path / "out"), *WORDS, "--scheduler", address]
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as work:
                until = time.monotonic() + 60
                while not list((tmp_path / "out").rglob("*.mod")) and time.monotonic() < until:
                    time.sleep(0.05)
                scheduler.kill()
                try:
                    _, told = work.communicate(timeout=LONGEST_S)
                finally:
                    work.kill()
    assert work.returncode == 2 and told.count("error[BAT007]") == 1, told
    assert "Traceback" not in told and "asyncio" not in told, told
    assert "BAT008" not in told, "no task is to blame"
    assert 0 < len(list((tmp_path / "out").rglob("*.mod"))) < 8, "it died in the middle"
    again, _ = convert(source, tmp_path / "out")
    assert not again.failed and cached(again)
    convert(source, tmp_path / "whole")
    assert tree(tmp_path / "out") == tree(tmp_path / "whole")


@contextmanager
def small_disk(place: Path, size: str) -> Iterator[None]:
    """A file system of its own; a machine that cannot mount one fails the test: it would show nothing."""
    place.mkdir()
    sudo = () if os.geteuid() == 0 else ("sudo", "-n")
    made = subprocess.run(
        [*sudo, "mount", "-t", "tmpfs", "-o", f"size={size},mode=777", "tmpfs", place], capture_output=True, text=True
    )
    assert made.returncode == 0, f"this test needs the right to mount a small disk: {made.stderr}"
    try:
        yield
    finally:
        subprocess.run([*sudo, "umount", place], check=True)


@pytest.mark.skipif(sys.platform != "linux", reason="tmpfs is a file system of Linux")
def test_a_disk_that_fills_is_told_and_nothing_is_lost(tmp_path: Path) -> None:
    source, disk = programs(tmp_path / "in", 8), tmp_path / "disk"
    convert(source, tmp_path / "whole")
    whole = tree(tmp_path / "whole")
    with small_disk(disk, "24k"):
        command = [*BATCH, source, "-o", disk / "out", *WORDS, "--workers", "1"]
        full = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
        assert full.returncode == 2 and "error[BAT004]" in full.stderr, full.stderr
        assert "No space left on device" in full.stderr and "Traceback" not in full.stderr
        made = tree(disk / "out", without=[".postproc"])
        assert made.items() <= whole.items() and len(made) < 8, "what stands there is whole"
        sudo = () if os.geteuid() == 0 else ("sudo", "-n")
        subprocess.run([*sudo, "mount", "-o", "remount,size=8m", disk], check=True)
        assert not convert(source, disk / "out")[0].failed
        assert tree(disk / "out") == whole


class Unstartable(Executor):
    """Its workers end before they have read what they are to do."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        raise BrokenPipeError(32, "Broken pipe")


def test_workers_that_cannot_start_are_told(tmp_path: Path) -> None:
    with pytest.raises(PostprocError, match=r"BAT021.*Broken pipe") as told:
        convert(programs(tmp_path / "in", 2), tmp_path / "out", pool=Pool(lambda count: Unstartable(), 1))
    assert told.value.exit_code == 2
