"""What a worker does: one task at a time, in a process of its own, with one thread for linear algebra.

Nothing heavy is imported before a job comes: numpy counts threads when it is first loaded.
"""

from __future__ import annotations

import os
import threading
import traceback
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from typing import TYPE_CHECKING

from postproc.batch.values import MEASURED, ON_ARM, Job, TaskRecord, failed, module_place
from postproc.diagnostics import Diagnostic, Matter, PostprocError
from postproc.process import THREADS, spare_scipy

if TYPE_CHECKING:
    from postproc.model.arm import Model

FIGURES = (
    *("added_targets", "unproved_statements", "cycle_time_s", "weld_statements", "corrected_weld_statements"),
    *(
        "figures",
        "tolerance_mm",
        "expected_accuracy",
        "verdict",
        "verdict_sentence",
        "welds",
        "rigid_shift",
        "expected_remaining_fraction",
        "expected_remaining_fraction_after_gauge",
        "gauge_load_kg",
        "mounting_deg",
    ),
)


def prepare_worker() -> None:
    """Set up a local worker process: one thread for linear algebra, interrupts ignored, ended when its parent ends."""
    import signal

    os.environ.update(dict.fromkeys(THREADS, "1"))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    """Exit when the parent process has ended: a killed one closes no queue, and workers would wait for ever."""
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def convert(job: Job) -> tuple[TaskRecord, Mapping[str, bytes]]:
    """Convert one task; errors of any kind become findings of its record.

    Returns:
        What became of it, and its files by path in the tree.
    """
    spare_scipy()
    from postproc.runtime.passes import correct_program

    try:
        model = _model(job.model)
        done = correct_program(job.sources, model, job.options, findings=job.findings)
        files = dict(done.outputs)
        if done.module is not None:
            files[module_place(job.name, tuple(done.outputs), job.options.run_time_module)] = done.module
        if job.page is not None and done.plan is not None:
            from postproc.report.page import render_page
            from postproc.results.convert.conversion import conversion_document

            page = render_page(conversion_document(job.name, done, job.made))
            files[job.page] = page.encode("utf-8", "replace")
    except PostprocError as error:
        return failed(job.name, job.key, error.diagnostics), {}
    except Exception as error:
        return failed(job.name, "", [_internal(error)]), {}
    hashes = {path: sha256(data).hexdigest() for path, data in sorted(files.items())}
    # Data or a background task: nothing in it moves the arm, and in a folder that is nothing to be told.
    findings = tuple(d.finding for d in done.diagnostics if d.matter is not Matter.STILL)
    record = TaskRecord(job.name, job.key, "unchanged" if done.outputs else "failed", hashes, findings=findings)
    if done.plan is None and done.module is None:
        return record, files
    names = (*MEASURED, ON_ARM, *FIGURES) if done.report["measured_statements"] else FIGURES
    figures = {name: done.report[name] for name in names if done.report[name] is not None}
    statuses = [row["status"] for row in done.report["statements"]]
    counted = ("compensated", "run_time", "unchanged", "skipped")
    figures["statements"] = {status: statuses.count(status) for status in counted}
    return replace(record, status="compensated", figures=figures), files


@lru_cache(maxsize=16)
def _model(data: bytes) -> Model:
    """Unpickle a model, once for all tasks that it corrects."""
    import pickle

    return pickle.loads(data)


def _internal(error: Exception) -> Diagnostic:
    """Return BAT006 for an unexpected exception, with the place where it was raised."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    text = f"internal error, {type(error).__name__}: {' '.join(str(error).split())[:200]}"
    place = f"{os.path.basename(where.filename)}:{where.lineno}"
    help_ = f"convert this task alone with `postproc compensate` for the details; it happened at {place}"
    return Diagnostic("BAT006", "error", text, help=help_)
