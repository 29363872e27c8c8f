"""Running a batch: what is done already is taken over, the rest goes to workers, results are written as they come."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

from postproc.batch.executors import Pool
from postproc.batch.jobs import Converter, read_job, read_settings
from postproc.batch.journal import Journal, open_journal
from postproc.batch.nearby import LACKING, help_nearby
from postproc.batch.values import Batch, Job, Outcome, Plan, Result, Settings, Shard, Task, failed
from postproc.batch.work import convert
from postproc.diagnostics import Diagnostic, PostprocError, has_errors

AHEAD = 3  # jobs per worker that are read and waiting: workers never starve, memory stays bounded


def run_batch(plan: Plan, out: Path, pool: Pool, shard: Shard, tell: Callable[[Outcome], None]) -> Batch:
    """Convert every task of a plan into a mirrored tree.

    Args:
        out: the folder of the tree; a run that was stopped goes on where it was.
        tell: called with every outcome as it is known.

    Raises:
        PostprocError: settings that cannot be read, an output folder that cannot be written (BAT003, BAT004).
    """
    mine = [(task, settings) for task, settings in plan.tasks if shard.owns(task.name)]
    copies = [path for path in plan.copies if shard.owns(path)]
    foreign = {f for t, _ in plan.tasks if not shard.owns(t.name) for f in t.files}
    foreign |= {path for path in plan.copies if not shard.owns(path)}
    converters = {settings: read_settings(settings) for settings in {s for _, s in mine}}
    with open_journal(out, shard.part) as journal:
        findings = [f for path in copies for f in _copy(plan.root, path, journal)]
        outcomes: list[Outcome] = []
        stated = {task.name: (task, _stated(task, converters[settings])) for task, settings in mine}

        def note(line: Mapping[str, Any], cached: bool) -> None:
            task, first = stated[line["name"]]
            told = (*first, *(_named(plan.root, finding) for finding in line["findings"]))
            outcomes.append(Outcome(task, line["status"], cached, line["figures"], told))
            tell(outcomes[-1])

        def todo() -> Iterator[Job]:
            for task, settings in mine:
                job = _prepare(plan.root, task, settings, converters[settings])
                line = journal.find(job.name, job.key) if isinstance(job, Job) else None
                if isinstance(job, Result):
                    note(journal.add(job), cached=False)
                elif line is not None:
                    note(journal.keep(line), cached=True)
                else:
                    yield job

        for result in work_through(todo(), pool):
            note(journal.add(result), cached=False)
        journal.close(shard.owns, foreign)
    outcomes.sort(key=lambda o: o.task.name)
    return Batch(tuple(outcomes), len(copies) - len(findings), tuple(findings))


def _prepare(root: Path, task: Task, settings: Settings, converter: Converter) -> Job | Result:
    """The job of a task, or why there is none."""
    if has_errors(task.findings):
        return failed(task.name, "", final=False)
    if task.unknown is not None and not converter.chosen:
        return failed(task.name, "", task.unknown, final=False)
    try:
        if task.robot is not None and task.robot != converter.robot and not converter.chosen:
            converter = read_settings(settings, task.robot)
        return read_job(root, task, converter)
    except PostprocError as error:
        return failed(task.name, "", *error.diagnostics, final=False)


def _stated(task: Task, converter: Converter) -> tuple[Mapping[str, Any], ...]:
    """What is to be said about a task before it is converted."""
    found = list(task.findings)
    if converter.chosen and task.robot is not None and task.robot != converter.robot:
        text = f"the controller drives `{task.robot}` with this task, the model is of `{converter.robot}`"
        help_ = "give each arm's model to its tasks in a jobs file"
        found.append(Diagnostic("BAT012", "warning", text, help=help_))
    if converter.chosen and task.unknown is not None:
        found.append(replace(task.unknown, severity="info", help="the arm or model that was named is used"))
    return tuple(d.as_json() for d in found)


def _named(root: Path, finding: Mapping[str, Any]) -> Mapping[str, Any]:
    """A finding; one about data that a file nearby declares names that file."""
    told = None
    if finding["code"] in LACKING and finding["path"] is not None:
        told = help_nearby(finding["message"], root / finding["path"])
    return finding if told is None else {**finding, "help": told}


def _copy(root: Path, path: str, journal: Journal) -> Iterator[Mapping[str, Any]]:
    try:
        data = (root / path).read_bytes()
    except OSError as error:
        text = f"cannot copy `{path}`: {error.strerror}"
        yield Diagnostic("BAT002", "error", text, help="check its rights").as_json()
        return
    journal.copy(path, data)


def work_through(jobs: Iterable[Job], pool: Pool) -> Iterator[Result]:
    """Results in the order in which they are ready; every job gives one, whatever happens to its worker.

    Jobs whose worker was lost are tried again, a second time one by one: what is lost once more is the reason itself.
    """
    waiting, before = iter(jobs), set[str]()
    while lost := (yield from _until_broken(waiting, pool)):
        if not pool.repeats:
            yield from map(_killer, lost)
            continue
        for job in lost:
            if job.name in before:
                yield from map(_killer, (yield from _until_broken(iter([job]), Pool(pool.make, 1))))
        again = [job for job in lost if job.name not in before]
        before |= {job.name for job in again}
        waiting = chain(again, waiting)


def _until_broken(waiting: Iterator[Job], pool: Pool) -> Generator[Result, None, list[Job]]:
    """Work with one executor until nothing waits or a worker is lost; the jobs that were lost with it."""
    executor = pool.make(pool.workers)
    running: dict[Future[Result], Job] = {}
    lost: list[Job] = []
    try:
        for job in waiting:
            if not _submit(executor, job, running):
                lost.append(job)
            elif len(running) >= AHEAD * pool.workers:
                yield from _collect(running, lost)
            if lost:
                break
        while running:
            yield from _collect(running, lost)
    finally:
        for future in running:
            future.cancel()
        executor.shutdown(wait=False)
    return lost


def _submit(executor: Executor, job: Job, running: dict[Future[Result], Job]) -> bool:
    try:
        running[executor.submit(convert, job)] = job
    except RuntimeError:  # a worker died between two jobs
        return False
    return True


def _collect(running: dict[Future[Result], Job], lost: list[Job]) -> Iterator[Result]:
    done, _ = wait(running, return_when=FIRST_COMPLETED)
    for future in done:
        job = running.pop(future)
        try:
            yield future.result()
        except (Exception, CancelledError):  # convert raises nothing: its worker is gone
            lost.append(job)


def _killer(job: Job) -> Result:
    help_ = "it may need more memory than a worker has: use fewer workers, or convert it alone"
    found = Diagnostic("BAT008", "error", "workers died on this task again and again", help=help_)
    return failed(job.name, job.key, found, final=False)
