"""Workers: processes and a Dask cluster give the same tree, and the death of one loses nothing."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Iterator
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

from .folders import EFFECT, ROUGH, codes, convert, programs, ready, statuses, tree, write


class Deadly(ProcessPoolExecutor):
    """Its worker dies on one task."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if args and args[0].name == "line1/Seam1.mod":
            return super().submit(os._exit, 9)
        return super().submit(fn, *args, **kwargs)


class Silent(Executor):
    """Takes jobs and answers none: what a Dask client does with those that it gets while its connection breaks."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        return Future()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        raise Exception("Client is closed. Can't send cancel-keys message.")


class Shot(ProcessPoolExecutor):
    """One of its workers is killed as soon as it works."""

    shots = 1

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future = super().submit(fn, *args, **kwargs)
        if Shot.shots:
            Shot.shots -= 1
            victim = next(iter(self._processes))
            threading.Timer(0.5, os.kill, (victim, signal.SIGKILL)).start()
        return future


def pool(kind: type[ProcessPoolExecutor], workers: int) -> Pool:
    return Pool(lambda count: kind(count, mp_context=get_context("spawn"), initializer=prepare_worker), workers)


def test_workers_have_one_thread_each() -> None:
    executor = local_pool(1).start(1)
    with executor:
        assert set(executor.submit(environment_of_worker).result().values()) == {"1"}


def environment_of_worker() -> dict[str, str]:
    return {name: os.environ[name] for name in THREADS}


def test_processes_make_the_same_tree_and_survive_a_kill(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 6)
    convert(source, tmp_path / "here")
    Shot.shots = 1
    batch, _ = convert(source, tmp_path / "out", pool=pool(Shot, 2))
    assert Shot.shots == 0
    assert not batch.failed
    assert tree(tmp_path / "out") == tree(tmp_path / "here")


def test_a_task_that_kills_its_workers_is_named_and_the_others_are_done(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 3)
    batch, _ = convert(source, tmp_path / "out", pool=pool(Deadly, 1))
    assert codes(batch, "line1/Seam1.mod") == ["BAT008"]
    assert [name for name, status in statuses(batch).items() if status == "failed"] == ["line1/Seam1.mod"]
    again, _ = convert(source, tmp_path / "out")
    assert not again.failed and sum(o.cached for o in again.outcomes) == 2


def test_effects_of_the_user_reach_the_workers(tmp_path: Path) -> None:
    model = 'robot = "irb4600_60_205"\n[effects.sag]\noffset_rad = 2e-4\n'
    files = write(tmp_path, {"sag.py": EFFECT, "model.toml": model})
    settings = replace(ROUGH, model=files / "model.toml", effects=(files / "sag.py",), robot=None)
    source = programs(tmp_path / "in", 1)
    batch, _ = convert(source, tmp_path / "out", settings, local_pool(1))
    assert not batch.failed, batch.outcomes
    assert "! model: sag" in (tmp_path / "out/line0/Seam0.mod").read_text()


def test_many_tasks_wait_without_being_read(tmp_path: Path) -> None:
    """Files are read when a worker is nearly free: memory does not grow with the number of tasks."""
    source, waiting, most = programs(tmp_path / "in", 14), set(), 0

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            nonlocal most
            future = super().submit(fn, *args, **kwargs)
            waiting.add(future)
            most = max(most, sum(not f.done() for f in waiting))
            return future

    convert(source, tmp_path / "out", pool=Pool(lambda count: Counting(1), 1))
    assert len(waiting) == 14 and most <= 4


@contextmanager
def cluster(workers: int) -> Iterator[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the libraries of the cluster warn of is not ours
        from distributed import LocalCluster

        with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50) as found:
            yield found


def test_a_cluster_loses_a_worker_in_mid_run(tmp_path: Path) -> None:
    source = programs(tmp_path / "in", 8)
    convert(source, tmp_path / "here")
    with cluster(2) as running, open_pool(None, running.scheduler_address) as workers:
        assert workers.workers == 2
        victim = next(iter(running.workers.values())).process.process.pid
        done: list[float] = []

        def shoot() -> None:
            while not done:
                time.sleep(0.05)
            os.kill(victim, signal.SIGKILL)

        shooter = threading.Thread(target=shoot)
        shooter.start()
        work = ready(source, tmp_path / "out")
        batch = run_batch(work, workers, lambda outcome: done.append(0.0))
        shooter.join()
    assert not batch.failed and len(batch.outcomes) == 8
    assert tree(tmp_path / "out") == tree(tmp_path / "here")


def test_a_scheduler_that_is_not_there_is_an_error() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(PostprocError) as caught, open_pool(None, "tcp://127.0.0.1:9", timeout=0.5):
            pass
    assert caught.value.diagnostics[0].code == "BAT007"


def test_jobs_that_a_lost_scheduler_never_answers_are_not_waited_for(tmp_path: Path) -> None:
    def check() -> None:
        raise PostprocError.of("BAT007", "the connection is lost")

    work = ready(programs(tmp_path / "in", 2), tmp_path / "out")
    codes_of: list[str] = []

    def convert_all() -> None:
        try:
            run_batch(work, Pool(lambda count: Silent(), 1, check), lambda _: None)
        except PostprocError as error:
            codes_of.extend(d.code for d in error.diagnostics)

    waiting = threading.Thread(target=convert_all, daemon=True)  # a batch that waits for ever fails, and ends with us
    waiting.start()
    waiting.join(30.0)
    assert codes_of == ["BAT007"]
