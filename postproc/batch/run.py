"""Running a batch: what is done already is taken over, the rest goes to workers, results are written as they come."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.batch.backinfo import added_modules, is_backinfo, with_modules
from postproc.batch.contradictions import contradictions
from postproc.batch.discover import CONTROLLER
from postproc.batch.executors import Pool
from postproc.batch.jobs import Converter, read_converter, read_job
from postproc.batch.journal import EDITED, Journal, open_journal
from postproc.batch.lines import COPY, STATE, Line
from postproc.batch.nearby import arm_nearby, help_nearby
from postproc.batch.values import (
    Batch,
    BatchPlan,
    Job,
    Result,
    Shard,
    Task,
    TaskOutcome,
    failed,
    module_place,
    page_of,
)
from postproc.batch.work import convert
from postproc.diagnostics import Diagnostic, Finding, Matter, PostprocError, has_errors
from postproc.files import check_tree, why
from postproc.settings import Settings, read_arm

if TYPE_CHECKING:
    from postproc.robot.arm import Robot

AHEAD = 3  # jobs per worker that are read and waiting: workers never starve, memory stays bounded
LOOK_S = 1.0  # [s] after which a batch that waits for its workers looks whether there still are any


@dataclass(frozen=True)
class Ready:
    """A checked plan of a batch, with the tasks of one shard and what each is converted with.

    Args:
        out: the folder of the tree; nothing that will be written there is an input. pages: each task gets a page there.
        tasks: those of the shard.
        converters: by name of the task, or the error for which it cannot be converted.
        said: diagnostics on the settings of each task, by name.
    """

    plan: BatchPlan
    shard: Shard
    out: Path
    tasks: tuple[Task, ...]
    converters: Mapping[str, Converter | PostprocError]
    pages: bool = False
    said: Mapping[str, Sequence[Diagnostic]] = field(default_factory=dict)


def get_ready(plan: BatchPlan, shard: Shard, out: Path, report: Path | None = None) -> Ready:
    """Read models, effects and side files of a plan, and check what will be written.

    Args:
        out: the folder of the tree; a run that was stopped is continued there.
        report: page that is written besides the tree, which then holds a page for each task.

    Raises:
        PostprocError: one of the files cannot be used, no arm is named for any task, or an output is an input or leads
            out of its folder. What is wrong with an arm that a controller's configuration names fails its tasks only.
    """
    _check_paths(plan, shard, out, report)
    tasks = [(task, settings) for task, settings in plan.tasks if shard.owns(task.name)]
    read: dict[Settings, Converter] = {}
    arms: dict[Settings, Robot] = {}
    converters: dict[str, Converter | PostprocError] = {}
    for task, settings in tasks:
        try:
            if settings not in read:
                model = read_arm(settings, task.name, task.unknown or arm_nearby(task.name, plan.root / task.name))
                read[settings] = read_converter(settings, model)
                arms[settings] = model.robot
            converters[task.name] = read[settings]
        except PostprocError as error:
            if settings.names_arm and settings.robot_from != CONTROLLER:
                raise
            converters[task.name] = error
    errors = [found for found in converters.values() if isinstance(found, PostprocError)]
    if errors and len(errors) == len(converters) and not any(settings.names_arm for _, settings in tasks):
        raise PostprocError([d for error in errors for d in error.diagnostics])
    known = [(task, settings) for task, settings in tasks if settings in arms]
    said = {task.name: contradictions(s, task, plan.root / task.name, arms[s]) for task, s in known}
    if wrong := [d for found in said.values() for d in found if d.severity == "error"]:
        raise PostprocError(list(dict.fromkeys(wrong)))
    return Ready(plan, shard, out, tuple(task for task, _ in tasks), converters, report is not None, said)


def _check_paths(plan: BatchPlan, shard: Shard, out: Path, report: Path | None) -> None:
    """Raise PostprocError where the batch would write over one of its inputs, or outside its folder.

    Args:
        out: the folder of the tree. report: page beside it; then the tree has a page for each task.
    """
    part = shard.part
    mirrored = [*(f for task, _ in plan.tasks for f in task.files), *plan.copies]
    modules = [
        module_place(task.name, task.files, settings.options.run_time_module)
        for task, settings in plan.tasks
        if settings.options.run_time != "off"
    ]
    taken = {name.casefold() for name in mirrored}
    for name in modules:
        if name.casefold() in taken:
            text = f"the module for run time `{out / name}` is the copy of an input, or that of another task"
            raise PostprocError.of("BAT015", text, help="give it another name with --run-time-module")
        taken.add(name.casefold())
    mirrored += modules
    pages = [page_of(task.name) for task, _ in plan.tasks] if report is not None else []
    read_only = [f for task, _ in plan.tasks for f in (*task.shared, *chain.from_iterable(task.beside))]
    stated = [Path(name) for settings in {s for _, s in plan.tasks} for name in settings.inputs if name is not None]
    state = [f"{STATE}/{name}" for name in (f"{part}.lock", f"{part}.jsonl", f"{part}.unfinished/x", f"{EDITED}/x")]
    reads = dict.fromkeys([*(plan.root / name for name in (*mirrored, *read_only)), *stated])
    check_tree(out, [*mirrored, *pages], state, reads, report)


def run_batch(ready: Ready, pool: Pool, tell: Callable[[TaskOutcome], None]) -> Batch:
    """Convert the tasks of a plan into a tree that mirrors the folder, and copy the other files.

    Args:
        pool: runs the conversions. tell: called with each outcome as soon as it is known.

    Raises:
        PostprocError: an output folder that cannot be written (BAT003, BAT004).
    """
    plan, shard, converters = ready.plan, ready.shard, ready.converters
    copies = [path for path in plan.copies if shard.owns(path)]
    foreign = {f for t, _ in plan.tasks if not shard.owns(t.name) for f in t.files}
    foreign |= {path for path in plan.copies if not shard.owns(path)}
    with open_journal(ready.out, shard.part) as journal:
        lists = {path for path in copies if is_backinfo(path)}
        findings = [d for path in copies if path not in lists for d in _copy(plan.root, path, journal)]
        findings += journal.findings
        outcomes: list[TaskOutcome] = []
        tasks = {task.name: task for task in ready.tasks}

        def note(line: Line, cached: bool) -> None:
            """Tell what became of a task."""
            assert line.status != COPY
            task = tasks[line.name]
            found = converters[task.name]
            first = [*task.findings, *ready.said.get(task.name, ())]
            told = (
                *(d.finding for d in first),
                *(_with_file_nearby(plan.root, task, finding) for finding in line.findings),
            )
            arm = found.settings.document(found.robot) if isinstance(found, Converter) else {}
            page = page_of(task.name) if page_of(task.name) in line.outputs else None
            outcomes.append(TaskOutcome(task, line.status, cached, line.figures, told, arm, page))
            tell(outcomes[-1])

        def todo() -> Iterator[Job]:
            """Yield a job for each task that is not done; note those that are, and those that cannot be read."""
            for task in ready.tasks:
                job = _prepare(plan.root, task, converters[task.name], ready.pages)
                if isinstance(job, Result):
                    if any(finding.matter is Matter.UNREADABLE for finding in job.findings):
                        journal.hold(job.name)
                    note(journal.add(job), cached=False)
                    continue
                line = journal.find(job.name, job.key)
                if line is None or (job.page and line.status == "compensated" and job.page not in line.outputs):
                    yield job
                else:
                    note(journal.keep(line), cached=True)

        for result in work_through(todo(), pool):
            note(journal.add(result), cached=False)
        lines = [*chain.from_iterable(journal.before.values()), *journal.now.values()]
        for path in sorted(lists):
            made = (line for line in lines if line.key != COPY)
            modules = added_modules(path, (task for task, _ in plan.tasks), made)
            findings += _copy(plan.root, path, journal, modules)
        journal.close(shard.owns, foreign)
    outcomes.sort(key=lambda o: o.task.name)
    missing = sum(finding.severity == "error" for finding in findings)
    return Batch(tuple(outcomes), len(copies) - missing, tuple(d.finding for d in findings))


def _prepare(root: Path, task: Task, converter: Converter | PostprocError, page: bool) -> Job | Result:
    """Return the job of a task, or a failed result where the task has errors or cannot be read.

    Args:
        root: folder of the batch. converter: or the error for which there is none. page: the task gets an HTML page.
    """
    if has_errors(task.findings):
        return failed(task.name, "", final=False)
    try:
        if isinstance(converter, PostprocError):
            raise converter
        return read_job(root, task, converter, page)
    except PostprocError as error:
        return failed(task.name, "", *error.diagnostics, final=False)


def _with_file_nearby(root: Path, task: Task, finding: Finding) -> Finding:
    """Return a finding; if it is about data that a file nearby declares, its help names that file.

    Args:
        root: folder of the batch. task: which the finding is about.
    """
    told = None
    if finding.matter is Matter.UNDECLARED:
        told = help_nearby(finding.name, [root / name for name in (*task.files, *task.shared)])
    return finding if told is None else replace(finding, help=told)


def _copy(root: Path, path: str, journal: Journal, modules: Sequence[tuple[str, str]] = ()) -> list[Diagnostic]:
    """Copy a file into the tree; return BAT002 if that fails, and BAT016 for an edited copy, which was kept beside it.

    Args:
        root: folder of the batch. path: of the file, relative to it.
        modules: (task, path) to add to the lists, where the file is a backinfo.txt.
    """
    try:
        data = (root / path).read_bytes()
    except OSError as error:
        journal.hold(path, copied=True)
        return [Diagnostic("BAT002", "error", f"cannot copy `{path}`: {error.strerror}", help="check its rights")]
    return journal.copy(path, with_modules(data, modules))


def work_through(jobs: Iterable[Job], pool: Pool) -> Iterator[Result]:
    """Yield a result for every job, in the order in which they are done, whatever happens to its worker.

    In local processes a job whose worker died is tried again with the others, then once alone; if that worker dies too,
    it fails.
    """
    waiting, before = iter(jobs), set[str]()
    while lost := (yield from _until_broken(waiting, pool)):
        if not pool.repeats:
            pool.make(pool.workers)  # the whole cluster may be gone: no task is to blame
            yield from map(_worker_died, lost)
            continue
        for job in lost:
            if job.name in before:
                yield from map(_worker_died, (yield from _until_broken(iter([job]), Pool(pool.make, 1))))
        again = [job for job in lost if job.name not in before]
        before |= {job.name for job in again}
        waiting = chain(again, waiting)


def _until_broken(waiting: Iterator[Job], pool: Pool) -> Generator[Result, None, list[Job]]:
    """Yield results from one executor until all jobs are done or a worker dies; returns the jobs lost with it."""
    executor = pool.make(pool.workers)
    running: dict[Future[Result], Job] = {}
    lost: list[Job] = []
    try:
        for job in waiting:
            if not _submit(executor, job, running, pool):
                lost.append(job)
            elif len(running) >= AHEAD * pool.workers:
                yield from _collect(running, lost, pool)
            if lost:
                break
        while running:
            yield from _collect(running, lost, pool)
    finally:
        try:
            for future in running:
                future.cancel()
            executor.shutdown(wait=False)
        except Exception:
            if not pool.lost():  # a client whose scheduler is gone cannot tell it to cancel anything
                raise
    return lost


def _submit(executor: Executor, job: Job, running: dict[Future[Result], Job], pool: Pool) -> bool:
    """Hand a job to the executor; return False if the executor no longer works.

    Args:
        running: gets the job by its future.

    Raises:
        PostprocError: BAT021, local workers cannot be started.
    """
    try:
        running[executor.submit(convert, job)] = job
    except RuntimeError:  # a worker died between two jobs
        return False
    except OSError as error:
        if not pool.repeats:  # the connection to the cluster
            return False
        text, help_ = f"the workers cannot be started: {why(error)[0]}", "use fewer, `--workers 1`, or free memory"
        raise PostprocError.of("BAT021", text, help=help_) from error
    return True


def _collect(running: dict[Future[Result], Job], lost: list[Job], pool: Pool) -> Iterator[Result]:
    """Wait for at least one running job; yield results, and append jobs whose worker died to ``lost``.

    Args:
        running: jobs by their future; those that are done are taken out.
    """
    done, _ = wait(running, LOOK_S, FIRST_COMPLETED)
    while not done and not pool.lost():
        done, _ = wait(running, LOOK_S, FIRST_COMPLETED)
    if not done:  # jobs that were handed over while the connection broke are never answered
        lost += running.values()
        running.clear()
    for future in done:
        job = running.pop(future)
        try:
            yield future.result()
        except (Exception, CancelledError):  # convert raises nothing: its worker is gone
            lost.append(job)


def _worker_died(job: Job) -> Result:
    """Return the failed result BAT008 of a job on which workers died again and again."""
    help_ = "it may need more memory than a worker has: use fewer workers, or convert it alone"
    found = Diagnostic("BAT008", "error", "workers died on this task again and again", help=help_)
    return failed(job.name, job.key, found, final=False)
