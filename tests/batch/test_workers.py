"""Workers: processes and a Dask cluster give the same tree; the death of a worker, a scheduler, a disk or the batch itself
loses nothing and is told.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from postproc.batch.executors import Pool, local_pool, open_pool
from postproc.batch.run import run_batch
from postproc.batch.work import prepare_worker
from postproc.diagnostics import PostprocError
from postproc.process import THREADS
from tests.build import refused

from .build import ARM, EFFECT, ROUGH, Work, programs, start, tree, write

LONGEST_S = 90.0


def wait_for(ripe: Callable[[], bool], seconds: float = LONGEST_S) -> None:
    end = time.monotonic() + seconds
    while not ripe():
        assert time.monotonic() < end, "it makes no progress"
        time.sleep(0.002)


class Deadly(ProcessPoolExecutor):
    """Its worker dies on one task."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        dies = bool(args) and args[0].name == "line1/Seam1.mod"
        return super().submit(os._exit, 9) if dies else super().submit(fn, *args, **kwargs)


class Silent(Executor):
    """Takes jobs and answers none: what a Dask client does with those that it gets while its connection breaks."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        return Future()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        raise Exception("Client is closed. Can't send cancel-keys message.")


class Unstartable(Executor):
    """Its workers end before they have read what they are to do."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        raise BrokenPipeError(32, "Broken pipe")


def environment_of_worker() -> dict[str, str]:
    return {name: os.environ[name] for name in THREADS}


def test_workers_have_one_thread_each() -> None:
    with local_pool(1).start(1) as executor:
        assert set(executor.submit(environment_of_worker).result().values()) == {"1"}


def test_a_task_that_kills_its_workers_is_named_and_the_others_are_done(work: Work) -> None:
    programs(work.source, 3)
    spawn = get_context("spawn")
    pool = Pool(lambda count: Deadly(count, mp_context=spawn, initializer=prepare_worker), 1)
    made = work.convert(pool=pool)
    assert made.codes("line1/Seam1.mod") == ["BAT008"]
    assert [name for name, status in made.statuses.items() if status == "failed"] == ["line1/Seam1.mod"]
    again = work.convert()
    assert not again.batch.failed and len(again.cached) == 2
    work.into("here").convert()
    assert tree(work.out) == tree(work.root / "here")


def test_workers_that_cannot_start_are_told(work: Work) -> None:
    programs(work.source, 2)
    finding = work.refusal(pool=Pool(lambda count: Unstartable(), 1))
    assert finding.code == "BAT021" and "Broken pipe" in finding.message


def test_effects_of_the_user_reach_the_workers(work: Work) -> None:
    programs(work.source, 1)
    write(work.root, {"sag.py": EFFECT, "model.toml": f'robot = "{ARM}"\n[effects.sag]\noffset_rad = 2e-4\n'})
    settings = replace(ROUGH, model=work.root / "model.toml", effects=(work.root / "sag.py",), robot=None)
    made = work.convert(settings, local_pool(1))
    assert not made.batch.failed, made.told
    assert "! model: sag" in (work.out / "line0/Seam0.mod").read_text()


def test_many_tasks_wait_without_being_read(work: Work) -> None:
    """Files are read when a worker is nearly free: memory does not grow with the number of tasks."""
    futures: list[Future[Any]] = []
    waiting: list[int] = []

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            futures.append(super().submit(fn, *args, **kwargs))
            waiting.append(sum(not future.done() for future in futures))
            return futures[-1]

    programs(work.source, 14)
    work.convert(pool=Pool(lambda count: Counting(1), 1))
    assert len(futures) == 14 and max(waiting) <= 4


@contextmanager
def cluster(workers: int) -> Iterator[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the libraries of the cluster warn of
        from distributed import LocalCluster

        options = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
        with LocalCluster(n_workers=workers, **options) as running:
            yield running


def test_a_cluster_loses_a_worker_in_mid_run(work: Work) -> None:
    programs(work.source, 8)
    work.into("here").convert()
    with cluster(2) as running, open_pool(None, running.scheduler_address) as workers:
        assert workers.workers == 2
        victim = next(iter(running.workers.values())).process.process.pid
        done = threading.Event()
        shooter = threading.Thread(target=lambda: (done.wait(), os.kill(victim, signal.SIGKILL)))
        shooter.start()
        batch = run_batch(work.ready(), workers, lambda outcome: done.set())
        shooter.join()
    assert not batch.failed and len(batch.outcomes) == 8
    assert tree(work.out) == tree(work.root / "here")


def test_a_scheduler_that_is_not_there_is_an_error() -> None:
    def connect() -> None:
        with open_pool(None, "tcp://127.0.0.1:9", timeout=0.5):
            pass

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert [d.code for d in refused(connect)] == ["BAT007"]


def test_jobs_that_a_lost_scheduler_never_answers_are_not_waited_for(work: Work) -> None:
    programs(work.source, 2)
    seen: list[str] = []

    def check() -> None:
        raise PostprocError.of("BAT007", "the connection is lost")

    def convert() -> None:
        seen.append(work.refusal(pool=Pool(lambda count: Silent(), 1, check)).code)

    waiting = threading.Thread(target=convert, daemon=True)  # a batch that waits for ever fails, and ends with us
    waiting.start()
    waiting.join(30.0)
    assert seen == ["BAT007"]


@contextmanager
def dask(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of Dask that is ended at the end."""
    local = ("--host", "127.0.0.1", "--no-dashboard")
    command = [sys.executable, "-m", "dask", *words, *local]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_scheduler_that_dies_is_told_and_nothing_is_lost(work: Work) -> None:
    programs(work.source, 8)
    place, out = work.root / "scheduler.json", work.out
    with dask("scheduler", "--port", "0", "--scheduler-file", str(place)) as scheduler:
        wait_for(lambda: place.exists() and place.read_text().rstrip().endswith("}"))
        address = json.loads(place.read_text())["address"]
        with dask("worker", address, "--nthreads", "1", "--no-nanny"):
            run = start(work.source, out, "--scheduler", address)
            wait_for(lambda: bool(list(out.rglob("*.mod"))) or run.poll() is not None)
            scheduler.kill()
            try:
                _, stderr = run.communicate(timeout=LONGEST_S)
            finally:
                run.kill()
    assert run.returncode == 2 and stderr.count(b"error[BAT007]") == 1, stderr
    assert not any(words in stderr for words in (b"Traceback", b"asyncio", b"BAT008")), "no task is to blame"
    assert 0 < len(list(out.rglob("*.mod"))) < 8, "it died in the middle"
    goes_on(work)


def goes_on(work: Work) -> None:
    """The next run does what is missing, and no more."""
    again = work.convert()
    assert not again.batch.failed and again.cached
    work.into("full").convert()
    assert tree(work.out) == tree(work.root / "full")


def root(*words: object) -> None:
    """Run a command as root; a machine on which that is not possible fails the test, which would show nothing."""
    sudo = () if os.geteuid() == 0 else ("sudo", "-n")
    done = subprocess.run([*sudo, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, f"this test needs the right to mount a small disk: {done.stderr}"


@pytest.mark.skipif(sys.platform != "linux", reason="tmpfs is a file system of Linux")
def test_a_disk_that_fills_is_told_and_nothing_is_lost(work: Work) -> None:
    programs(work.source, 8)
    work.into("full").convert()
    full, disk, small = tree(work.root / "full"), work.root / "disk", work.into("disk/out")
    disk.mkdir()
    root("mount", "-t", "tmpfs", "-o", "size=24k,mode=777", "tmpfs", disk)
    try:
        run = start(work.source, small.out, "--workers", "1")
        _, stderr = run.communicate(timeout=LONGEST_S)
        assert run.returncode == 2 and b"error[BAT004]" in stderr, stderr
        assert b"No space left on device" in stderr and b"Traceback" not in stderr
        made = small.outputs()
        assert made.items() <= full.items() and len(made) < 8, "each file that is there is complete"
        root("mount", "-o", "remount,size=8m", disk)
        assert not small.convert().batch.failed
        assert tree(small.out) == full
    finally:
        root("umount", disk)


def children(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(child) for child in path.read_text().split()] if path.exists() else []


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_killed_run_goes_on(work: Work) -> None:
    """Signal 9 or Ctrl-C at any moment: nothing is lost, nothing is half written, no worker stays behind."""
    write(programs(work.source, 6), {"note.txt": "text"})
    work.into("full").convert()
    for count, by, code in ((1, signal.SIGKILL, -signal.SIGKILL), (3, signal.SIGINT, 1)):
        run = start(work.source, work.out, "--workers", "2")
        while len(list(work.out.rglob("*.mod"))) < count:
            assert run.poll() is None, "it ended by itself"
            time.sleep(0.002)
        workers = children(run.pid)
        run.send_signal(by)
        _, stderr = run.communicate(timeout=LONGEST_S)
        assert b"resource_tracker" not in stderr, "nobody wants to read about semaphores"
        wait_for(lambda workers=workers: not any(map(is_alive, workers)))  # type: ignore[misc]
        assert run.returncode == code
        assert len(work.outputs()) < 6, "killed too late to show anything"
        assert work.outputs().items() <= tree(work.root / "full").items()
    goes_on(work)
