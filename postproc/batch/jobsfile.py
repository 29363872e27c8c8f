"""Jobs files: which folders and files a batch converts, each with its own model and options."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Annotated

from pydantic import Field

from postproc.batch.discover import OUTSIDE, discover, in_output, with_arm
from postproc.batch.values import BatchPlan, Task
from postproc.diagnostics import PostprocError, Source
from postproc.files import read_source, real, stays_inside
from postproc.rapid.program.program import ENDINGS
from postproc.settings import Settings
from postproc.settings_files import StatedJob, with_choices
from postproc.tomlfile import check, parse_toml, span_of

SettingsAt = Callable[[Path], Settings]
"""What holds for the programs of a folder: ``postproc.toml`` found from there, and the command line."""


class _Job(StatedJob):
    """One job: a folder, or the files of one task.

    Args:
        folder: beside or below the jobs file.
        only: names of its tasks, with wildcards.
        files: names of the files of one task, with wildcards.
        name: of that task.
    """

    folder: str | None = None
    only: tuple[str, ...] = ("*",)
    files: tuple[str, ...] = ()
    name: str | None = None


class JobsFile(StatedJob):
    """A jobs file of ``batch``.

    Args:
        job: each job; what the file states beside them holds for all.
    """

    job: Annotated[list[_Job], Field(min_length=1)]


def read_plan(folder_or_jobs: Path, settings_at: SettingsAt, output: Path) -> BatchPlan:
    """Return what a batch converts and copies, for a folder, a list of modules (.pgf) or a jobs file.

    Args:
        settings_at: returns the settings for programs in a folder; a jobs file overrides them.
        output: folder of the outputs, in which nothing is looked for.

    Raises:
        PostprocError: BAT001 there is nothing to convert, BAT009 something is wrong in the jobs file.
    """
    settings_at = cache(settings_at)
    if folder_or_jobs.is_dir():
        found, copies = discover(folder_or_jobs, output)
        tasks = tuple((task, _settled(task, folder_or_jobs, settings_at)) for task in found)
        plan = BatchPlan(folder_or_jobs, tasks, tuple(copies))
    elif folder_or_jobs.suffix.lower() == ".pgf" and folder_or_jobs.is_file():
        root = folder_or_jobs.parent
        listed = [task for task in discover(root, output)[0] if task.name == folder_or_jobs.name]
        plan = BatchPlan(
            root, tuple((task, _settled(task, root, settings_at)) for task in listed), (folder_or_jobs.name,)
        )
    elif folder_or_jobs.suffix.lower() in ENDINGS:
        text, help_ = f"`{folder_or_jobs}` is one program", "use `postproc compensate`, or name its folder"
        raise PostprocError.of("BAT001", text, help=help_)
    else:
        plan = _planned(read_source(folder_or_jobs, "BAT001"), settings_at, output)
    if not plan.tasks:
        text = f"there is no RAPID module in `{folder_or_jobs}`"
        help_ = "name a folder with .mod, .prg, .sys, .modx or .sysx files, or a jobs file"
        still = [name for name in plan.copies if PurePosixPath(name).suffix.lower() in ENDINGS]
        if still:
            modules = "its module" if len(still) == 1 else f"none of its {len(still)} modules, such as"
            text = f"nothing in `{folder_or_jobs}` is to be converted: {modules} `{still[0]}`"
            text += " moves no arm" if len(still) == 1 else ", moves an arm"
            help_ = "modules in HOME are copies; convert motions that are loaded at run time in a folder of their own"
        raise PostprocError.of("BAT001", text, help=help_)
    return plan


def _planned(source: Source, settings_at: SettingsAt, output: Path) -> BatchPlan:
    """Return the plan of a jobs file.

    Args:
        source: the file. settings_at: returns the settings for programs in a folder. output: folder of the outputs.

    Raises:
        PostprocError: BAT009, a key does not fit, or two jobs have the same task or file.
    """
    content = parse_toml(source, "BAT009")
    if "job" not in content and isinstance(content.get("effects"), dict):
        text, help_ = "this is a model, not a jobs file", f"name the folder of the programs, and `-m {source.path}`"
        raise PostprocError.of("BAT009", text, source, None, help_)
    file = check(JobsFile, content, source, "BAT009")
    root = Path(source.path).parent
    tasks: dict[str, tuple[Task, Settings]] = {}
    owner: dict[str, str] = {}
    copies: set[str] = set()
    for index, job in enumerate(file.job):
        found, more = _found(source, root, index, job, output)
        _check_only(source, index, job, found)
        for task in found:
            if job.files and task.name in tasks:
                raise _wrong(source, index, f"there is a task `{task.name}` already", "give another `name`")
            if task.name in tasks or not any(fnmatchcase(task.name, pattern) for pattern in _patterns(job)):
                continue
            twice = next((f for f in task.files if f in owner), None)
            if twice is not None:
                raise _wrong(source, index, f"`{twice}` belongs to `{owner[twice]}` too", "name each file in one job")
            tasks[task.name] = (task, _settled(task, root, settings_at, source.path, file, job))
            owner.update(dict.fromkeys(task.files, task.name))
        copies.update(more)
    return BatchPlan(root, tuple(tasks[name] for name in sorted(tasks)), tuple(sorted(copies - owner.keys())))


def _check_only(source: Source, index: int, job: _Job, found: Sequence[Task]) -> None:
    """Raise BAT009 where an entry of the job's ``only`` matches no task that was found.

    Args:
        source: the jobs file. index: of the job in it. found: all tasks of the job's folder.
    """
    for name, pattern in zip(job.only, _patterns(job), strict=True):
        if name != "*" and not any(fnmatchcase(task.name, pattern) for task in found):
            skipped = len(pattern) - len(name)
            names = ", ".join(f"`{task.name[skipped:]}`" for task in found[:10]) or "none"
            raise _wrong(source, index, f"no task matches `{name}`", f"the tasks there: {names}", "only")


def _patterns(job: _Job) -> list[str]:
    """Return the job's patterns of task names with its folder before them."""
    prefix = "" if job.folder is None or Path(job.folder) == Path() else f"{Path(job.folder).as_posix()}/"
    return [prefix + pattern for pattern in job.only]


def _found(source: Source, root: Path, index: int, job: _Job, output: Path) -> tuple[list[Task], list[str]]:
    """Return the tasks of a job's folder or files, and the files that are only copied.

    Args:
        source: the jobs file. root: its folder. index: of the job in it. output: folder of the outputs.

    Raises:
        PostprocError: BAT009, there are no such files, or they are outside of the jobs file's folder.
    """
    if (job.folder is None) == (not job.files):
        raise _wrong(source, index, "a job needs `folder` or `files`", "give one of them")
    if job.folder is not None:
        folder = root / job.folder
        inside = stays_inside(job.folder) and real(folder).is_relative_to(real(root))
        if not (folder.is_dir() and (inside or Path(job.folder) == Path())):
            text = f"`{job.folder}` is not a folder beside or below the jobs file"
            raise _wrong(source, index, text, "the tree of outputs mirrors what stands below the jobs file", "folder")
        return _below(*discover(folder, output), Path(job.folder))
    names: list[str] = []
    for pattern in job.files:
        if not stays_inside(pattern):
            help_ = "name files beside or below the jobs file; lend others with `with`"
            raise _wrong(source, index, f"`{pattern}` leads out of the folder of the jobs file", help_, "files")
        try:
            there = [p for p in root.glob(pattern) if p.is_file() and not in_output(p, output)]
        except (ValueError, OSError, NotImplementedError) as error:
            raise _wrong(
                source, index, f"`{pattern}` is no pattern of files: {error}", "write *.mod", "files"
            ) from error
        below = (p.relative_to(root) for p in there)
        matched = sorted(name.as_posix() for name in below if not OUTSIDE & {*name.parts})
        if not matched:
            raise _wrong(source, index, f"no file matches `{pattern}`", "paths start at the jobs file", "files")
        names += [name for name in matched if name not in names]
    return [Task(job.name or names[0], tuple(names))], []


def _below(tasks: Iterable[Task], copies: Iterable[str], folder: Path) -> tuple[list[Task], list[str]]:
    """Return tasks and copies with the folder put before the names of their files."""

    def moved(names: Iterable[str]) -> tuple[str, ...]:
        """Return names with the folder before them."""
        return tuple((folder / name).as_posix() for name in names)

    renamed = [
        replace(
            t,
            name=(folder / t.name).as_posix(),
            files=moved(t.files),
            shared=moved(t.shared),
            beside=tuple(map(moved, t.beside)),
        )
        for t in tasks
    ]
    return renamed, [*moved(copies)]


def _settled(task: Task, root: Path, settings_at: SettingsAt, origin: str = "", *layers: StatedJob) -> Settings:
    """Return the settings of a task: of its folder, overridden by each layer, then completed by the arm it drives.

    Args:
        root: folder of the batch. settings_at: returns the settings for programs in a folder.
        origin: the jobs file. layers: what it states for all jobs, and for this one; paths start at ``root``.
    """
    settings = settings_at((root / task.files[0]).parent if task.files else root)
    for layer in layers:
        settings = with_choices(settings, layer.stated(), root, origin)
    return with_arm(settings, task)


def _wrong(source: Source, index: int, text: str, help_: str, key: str | None = None) -> PostprocError:
    """Return the error BAT009 at a job, or at a key of it.

    Args:
        source: the jobs file. index: of the job in it. text, help_: of the finding.
    """
    keys = ("job", index) if key is None else ("job", index, key)
    return PostprocError.of("BAT009", text, source, span_of(source, keys), help_)
