"""Where jobs run: processes of this machine or a Dask cluster, both as a ``concurrent.futures.Executor``."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context
from typing import Any

from postproc.batch.values import Job, TaskRecord, failed
from postproc.batch.work import convert, prepare_worker
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.files import why

AHEAD = 3  # jobs per worker that are read and waiting: workers never starve, memory stays bounded
LOOK_S = 1.0  # [s] after which a batch that waits for its workers looks whether there still are any
Converted = tuple[TaskRecord, Mapping[str, bytes]]
"""What became of a job, and its files by path in the tree."""


@dataclass(frozen=True)
class Pool:
    """A way to start executors.

    Args:
        start: returns an executor of so many workers (a cluster has its own number); it is shut down after use.
        workers: how many jobs run at once.
        check: raises BAT007 where the connection to the workers is lost for good.
    """

    start: Callable[[int], Executor]
    workers: int
    check: Callable[[], None] = lambda: None


@contextmanager
def open_pool(workers: int | None, scheduler: str | None, timeout: float = 10.0) -> Iterator[Pool]:
    """Provide the workers of a running Dask scheduler where one is named, else processes of this machine.

    Args:
        workers: number of local processes; None takes one for each free core.
        scheduler: address. timeout: [s] to wait for its answer.

    Raises:
        PostprocError: BAT007, the library is missing or the scheduler does not answer.
    """
    if scheduler is None:
        free = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        yield local_pool(workers or free)
        return
    try:
        from distributed import Client
    except ImportError:
        text = "the library `distributed` is not installed"
        raise PostprocError.of("BAT007", text, help="install the extra: `pip install postproc[cluster]`") from None
    logging.disable()  # Dask and asyncio print tracebacks of lost connections; a diagnostic reports those
    try:
        make_client: Any = Client  # untyped
        client = make_client(scheduler, timeout=timeout, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise _lost(scheduler, error) from error

    def check() -> None:
        """Raise BAT007 where the client has no connection: it has cancelled all that it was to do."""
        if client.status != "running":
            raise _lost(scheduler, "the connection is lost")

    with client:
        threads = sum(client.nthreads().values())
        yield Pool(lambda count: client.get_executor(), max(1, threads), check)


def local_pool(workers: int) -> Pool:
    """Return a pool of local processes, started afresh since threads of linear algebra do not survive a fork."""
    spawn = get_context("spawn")
    return Pool(lambda count: ProcessPoolExecutor(count, mp_context=spawn, initializer=prepare_worker), workers)


def run_jobs(jobs: Iterable[Job], pool: Pool) -> Iterator[Converted]:
    """Yield what became of every job, in the order in which they are done, whatever happens to its worker.

    A job whose worker died is tried again, alone; if that worker dies too, the job fails with BAT008.

    Raises:
        PostprocError: BAT007 or BAT021, there are no workers any more; the jobs that are not done are not to blame.
    """
    waiting = iter(jobs)
    while lost := (yield from _run_until_lost(waiting, pool, pool.workers)):
        for job in lost:
            if (yield from _run_until_lost(iter([job]), pool, 1)):
                help_ = "it may need more memory than a worker has: use fewer workers, or convert it alone"
                text = "workers died on this task again and again"
                yield failed(job.name, "", [Diagnostic("BAT008", "error", text, help=help_)]), {}


def _run_until_lost(waiting: Iterator[Job], pool: Pool, workers: int) -> Generator[Converted, None, list[Job]]:
    """Yield results from one executor until all jobs are done or a worker dies; returns the jobs lost with it."""
    executor = pool.start(workers)
    running: dict[Future[Converted], Job] = {}
    lost: list[Job] = []
    try:
        while True:
            for job in islice(waiting, 0 if lost else AHEAD * workers - len(running)):
                try:
                    running[executor.submit(convert, job)] = job
                except BrokenExecutor:  # a worker died between two jobs
                    lost.append(job)
                    break
                except Exception as error:
                    pool.check()
                    reason = why(error)[0] if isinstance(error, OSError) else error
                    text, help_ = f"the workers cannot be started: {reason}", "use fewer, `--workers 1`, or free memory"
                    raise PostprocError.of("BAT021", text, help=help_) from error
            if not running:
                return lost
            done, _ = wait(running, LOOK_S, FIRST_COMPLETED)
            if not done:  # jobs that were handed over while a connection broke are never answered
                pool.check()
            for future in done:
                job = running.pop(future)
                try:
                    yield future.result()
                except Exception:  # convert raises nothing: its worker is gone
                    pool.check()
                    lost.append(job)
    finally:
        with suppress(Exception):  # a client whose scheduler is gone cannot tell it to cancel anything
            for future in running:
                future.cancel()
            executor.shutdown(wait=False)


def _lost(address: str, reason: object) -> PostprocError:
    """Return the error BAT007: the scheduler at this address does not answer, for this reason."""
    help_ = "write the address as the scheduler prints it, tcp://HOST:8786; run the same command again to go on"
    return PostprocError.of("BAT007", f"the scheduler `{address}` does not answer: {reason}", help=help_)
