"""Running a batch: what is done already is taken over, the rest goes to workers, results are written as they come."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import PurePosixPath

from postproc.batch.executors import Pool, run_jobs
from postproc.batch.jobs import Converter, Ready, read_job
from postproc.batch.records import OutputTree, open_tree
from postproc.batch.values import Batch, BatchPlan, Job, TaskOutcome, TaskRecord, failed, page_of
from postproc.diagnostics import Diagnostic, Finding, Matter, PostprocError, has_errors
from postproc.tasks.lists import is_backinfo, with_modules
from postproc.tasks.nearby import with_file_nearby


def run_batch(ready: Ready, pool: Pool, tell: Callable[[TaskOutcome], None]) -> Batch:
    """Convert the tasks of a plan into a tree that mirrors the folder, and copy the other files.

    Args:
        pool: runs the conversions. tell: called with each outcome as soon as it is known.

    Raises:
        PostprocError: an output folder that cannot be written (BAT003, BAT004), workers that cannot be started (BAT021)
            or are lost for good (BAT007).
    """
    tasks = {one.task.name: one for one in ready.tasks}
    outcomes: list[TaskOutcome] = []

    def note(record: TaskRecord, cached: bool = False, edited: Sequence[Finding] = ()) -> None:
        """Tell what became of a task, with findings on the task and its settings; edited outputs were replaced."""
        one, page = tasks[record.name], page_of(record.name)
        findings = [diagnostic.finding for diagnostic in (*one.task.findings, *one.findings)]
        findings += [with_file_nearby(finding, one.task.paths) for finding in record.findings]
        known = one.converter if isinstance(one.converter, Converter) else None
        arm = known.settings.document(known.robot.name) if known is not None else {}
        shown = page if page in record.outputs else None
        outcomes.append(TaskOutcome(one.task, record.status, cached, record.figures, (*findings, *edited), arm, shown))
        tell(outcomes[-1])

    with open_tree(ready.out, ready.shard.part) as tree:
        # What other shards of the plan put there stays.
        for task, _ in ready.plan.tasks:
            if not ready.shard.owns(task.name):
                tree.keep(task.name)
                tree.claimed.update(task.files)
        tree.claimed.update(path for path in ready.plan.copies if not ready.shard.owns(path))
        for record, files in run_jobs(_jobs(ready, tree, note), pool):
            note(record, edited=tree.add(record, files))
        findings = [*_copy_files(ready, tree), *tree.close(), *tree.foreign()]
    outcomes.sort(key=lambda outcome: outcome.task.name)
    copied = sum(map(ready.shard.owns, ready.plan.copies)) - sum(finding.severity == "error" for finding in findings)
    return Batch(tuple(outcomes), copied, tuple(findings))


def _jobs(ready: Ready, tree: OutputTree, note: Callable[..., None]) -> Iterator[Job]:
    """Yield a job for each task that is not done; note those that are, and those that cannot be read."""
    for one in ready.tasks:
        name = one.task.name
        try:
            if has_errors(one.task.findings):  # which are printed with the task
                raise PostprocError(())
            job = read_job(one, ready.pages)
        except PostprocError as error:
            failure = failed(name, "", error.diagnostics)
            if any(diagnostic.matter is Matter.UNREADABLE for diagnostic in error.diagnostics):
                tree.keep(name)
            else:
                tree.add(failure, {})
            note(failure)
            continue
        record = tree.record_of(name)
        lacks_page = record is not None and record.status == "compensated" and job.page not in (None, *record.outputs)
        if record is None or record.key != job.key or lacks_page or not tree.has(record):
            yield job
        else:
            tree.keep(name)
            note(record, cached=True)


def _copy_files(ready: Ready, tree: OutputTree) -> list[Finding]:
    """Copy files that are not converted; a list of a backup's modules gets those that the batch has added.

    Returns:
        BAT002 for a file that cannot be read, BAT016 for an edited copy.
    """
    findings: list[Finding] = []
    for path in ready.plan.copies:
        if not ready.shard.owns(path):
            continue
        try:
            data = (ready.plan.root / path).read_bytes()
        except OSError as error:
            tree.keep_copy(path)
            text = f"cannot copy `{path}`: {error.strerror}"
            findings.append(Diagnostic("BAT002", "error", text, help="check its rights").finding)
            continue
        if is_backinfo(path):
            data = with_modules(data, _added_modules(path, ready.plan, tree))
        findings += tree.copy(path, data)
    return findings


def _added_modules(backinfo: str, plan: BatchPlan, tree: OutputTree) -> Iterator[tuple[str, str]]:
    """Yield the modules that batches added to the tasks of a backup: name of the task's folder, and path inside it.

    Args:
        backinfo: path of the backup's list of modules.
    """
    for task, _ in plan.tasks:
        folder, record = PurePosixPath(task.name), tree.record_of(task.name)
        is_in_backup = folder.parent.parent == PurePosixPath(backinfo).parent.parent
        if record is not None and is_in_backup and folder.parent.name.lower() == "rapid":
            added = map(PurePosixPath, sorted(record.outputs.keys() - {*task.files, page_of(task.name)}))
            yield from ((folder.name, str(path.relative_to(folder))) for path in added if path.is_relative_to(folder))
