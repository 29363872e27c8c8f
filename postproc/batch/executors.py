"""Where jobs run: processes of this machine or a Dask cluster, both as a ``concurrent.futures.Executor``."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

from postproc.batch.work import prepare_worker
from postproc.diagnostics import PostprocError


@dataclass(frozen=True)
class Pool:
    """A way to make executors, and how many jobs they run at once.

    Args:
        make: returns an executor of so many workers (a cluster has its own number); it is shut down after use. Raises
            BAT007 where the cluster is lost.
        workers: how many jobs run at once.
        repeats: a job whose worker is lost is to be tried again; False for a scheduler that does so by itself.
        lost: tells whether the connection to the workers is lost for good.
    """

    make: Callable[[int], Executor]
    workers: int
    repeats: bool = True
    lost: Callable[[], bool] = lambda: False


@contextmanager
def open_pool(workers: int | None, scheduler: str | None) -> Iterator[Pool]:
    """Provide the pool in which jobs run: a Dask cluster where a scheduler is named, else local processes.

    Args:
        workers: number of local processes; None takes one for each free core.
    """
    if scheduler is not None:
        with cluster_pool(scheduler) as pool:
            yield pool
    else:
        yield local_pool(workers or _cores())


def _cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def local_pool(workers: int) -> Pool:
    """Return a pool of local processes, started afresh since threads of linear algebra do not survive a fork."""

    def make(count: int) -> Executor:
        """Start this many worker processes."""
        return ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=prepare_worker)

    return Pool(make, workers)


@contextmanager
def cluster_pool(address: str, timeout: float = 10.0) -> Iterator[Pool]:
    """Provide the workers of a running Dask scheduler.

    Args:
        address: of the scheduler. timeout: [s] to wait for its answer.

    Raises:
        PostprocError: BAT007, the library is missing or the scheduler does not answer.
    """
    try:
        from distributed import Client
    except ImportError:
        text = "the library `distributed` is not installed"
        raise PostprocError.of("BAT007", text, help="install the extra: `pip install postproc[cluster]`") from None
    _quiet()
    try:
        make_client: Any = Client  # untyped
        client = make_client(address, timeout=timeout, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise _lost(address, error) from error
    with client:
        threads = sum(client.nthreads().values())

        def make(count: int) -> Executor:
            """Return the cluster's executor, whatever the count; BAT007 where the connection is lost."""
            if client.status != "running":
                raise _lost(address, "the connection is lost")
            return client.get_executor()

        yield Pool(make, max(1, threads), repeats=False, lost=lambda: client.status in ("closing", "closed"))


def _quiet() -> None:
    """Silence the loggers of Dask and asyncio, which print tracebacks of lost connections; a diagnostic reports those.

    Loggers below ``distributed`` have handlers of their own, and asyncio reports what nobody waits for any more.
    """
    for name in ("distributed", "tornado", "asyncio", *logging.root.manager.loggerDict):
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logger = logging.getLogger(name)
            logger.handlers = [logging.NullHandler()]
            logger.propagate = False


def _lost(address: str, reason: object) -> PostprocError:
    """Return the error BAT007: the scheduler at this address does not answer, for this reason."""
    help_ = "write the address as the scheduler prints it, tcp://HOST:8786; run the same command again to go on"
    return PostprocError.of("BAT007", f"the scheduler `{address}` does not answer: {reason}", help=help_)
