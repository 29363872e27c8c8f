"""Jobs files: which folders and files a batch converts, each with its own model and options."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Annotated

from pydantic import Field

from postproc.batch.values import BatchPlan
from postproc.diagnostics import PostprocError, Source
from postproc.files import read_source, real, stays_inside
from postproc.rapid.program.program import ENDINGS
from postproc.settings import Settings
from postproc.settings_files import StatedJob, with_choices
from postproc.tasks.discover import IGNORED_FOLDERS, discover, in_output
from postproc.tasks.task import Task, with_arm
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
    is_list = folder_or_jobs.suffix.lower() == ".pgf" and folder_or_jobs.is_file()
    if folder_or_jobs.is_dir() or is_list:
        root = folder_or_jobs.parent if is_list else folder_or_jobs
        tasks, copies = discover(root, output)
        if is_list:
            tasks, copies = [task for task in tasks if task.name == folder_or_jobs.name], [folder_or_jobs.name]
        plan = BatchPlan(root, tuple((task, _settled(task, settings_at)) for task in tasks), tuple(copies))
    elif folder_or_jobs.suffix.lower() in ENDINGS:
        text, help_ = f"`{folder_or_jobs}` is one program", "use `postproc compensate`, or name its folder"
        raise PostprocError.of("BAT001", text, help=help_)
    else:
        plan = _planned(read_source(folder_or_jobs, "BAT001"), settings_at, output)
    if plan.tasks:
        return plan
    text = f"there is no RAPID module in `{folder_or_jobs}`"
    help_ = "name a folder with .mod, .prg, .sys, .modx or .sysx files, or a jobs file"
    if still := [name for name in plan.copies if PurePosixPath(name).suffix.lower() in ENDINGS]:
        one = len(still) == 1
        modules = "its module" if one else f"none of its {len(still)} modules, such as"
        text = f"nothing in `{folder_or_jobs}` is to be converted: {modules} `{still[0]}`"
        text += " moves no arm" if one else ", moves an arm"
        help_ = "modules in HOME are copies; convert motions that are loaded at run time in a folder of their own"
    raise PostprocError.of("BAT001", text, help=help_)


def _planned(source: Source, settings_at: SettingsAt, output: Path) -> BatchPlan:
    """Return the plan of a jobs file.

    Args:
        source: the file. settings_at: returns the settings for programs in a folder. output: folder of the outputs.

    Raises:
        PostprocError: BAT009, a key does not fit, a pattern matches no task of its job, or two jobs have the same task
            or file.
    """
    content = parse_toml(source, "BAT009")
    if "job" not in content and isinstance(content.get("effects"), dict):
        text, help_ = "this is a model, not a jobs file", f"name the folder of the programs, and `-m {source.path}`"
        raise PostprocError.of("BAT009", text, source, None, help_)
    file = check(JobsFile, content, source, "BAT009")
    tasks: dict[str, tuple[Task, Settings]] = {}
    owner: dict[str, str] = {}
    copies: set[str] = set()
    for index, job in enumerate(file.job):
        of_job, of_folder = _tasks(source, index, job, output)
        copies.update(of_folder)
        prefix = "" if job.folder is None or Path(job.folder) == Path() else f"{Path(job.folder).as_posix()}/"
        patterns = [prefix + name for name in job.only]
        for name, pattern in zip(job.only, patterns, strict=True):
            if name != "*" and not any(fnmatchcase(task.name, pattern) for task in of_job):
                names = ", ".join(f"`{task.name[len(prefix) :]}`" for task in of_job[:10]) or "none"
                raise _wrong(source, index, f"no task matches `{name}`", f"the tasks there: {names}", "only")
        for task in of_job:
            if job.files and task.name in tasks:
                raise _wrong(source, index, f"there is a task `{task.name}` already", "give another `name`")
            if task.name in tasks or not any(fnmatchcase(task.name, pattern) for pattern in patterns):
                continue
            if (twice := next((name for name in task.files if name in owner), None)) is not None:
                raise _wrong(source, index, f"`{twice}` belongs to `{owner[twice]}` too", "name each file in one job")
            tasks[task.name] = task, _settled(task, settings_at, (source, file), (source, job))
            owner.update(dict.fromkeys(task.files, task.name))
    root = Path(source.path).parent
    return BatchPlan(root, tuple(tasks[name] for name in sorted(tasks)), tuple(sorted(copies - owner.keys())))


def _tasks(source: Source, index: int, job: _Job, output: Path) -> tuple[list[Task], list[str]]:
    """Return the tasks of a job's folder or files, and the files that are only copied, relative to the jobs file.

    Args:
        source: the jobs file. index: of the job in it. output: folder of the outputs.

    Raises:
        PostprocError: BAT009, there are no such files, or they are outside of the jobs file's folder.
    """
    root = Path(source.path).parent
    if (job.folder is None) == (not job.files):
        raise _wrong(source, index, "a job needs `folder` or `files`", "give one of them")
    if job.folder is not None:
        folder = root / job.folder
        inside = stays_inside(job.folder) and real(folder).is_relative_to(real(root))
        if not (folder.is_dir() and (inside or Path(job.folder) == Path())):
            text = f"`{job.folder}` is not a folder beside or below the jobs file"
            raise _wrong(source, index, text, "the tree of outputs mirrors what stands below the jobs file", "folder")
        return discover(root, output, Path(job.folder))
    names: list[str] = []
    for pattern in job.files:
        if not stays_inside(pattern):
            help_ = "name files beside or below the jobs file; lend others with `with`"
            raise _wrong(source, index, f"`{pattern}` leads out of the folder of the jobs file", help_, "files")
        try:
            files = [path for path in root.glob(pattern) if path.is_file() and not in_output(path, output)]
        except (ValueError, OSError, NotImplementedError) as error:
            text = f"`{pattern}` is no pattern of files: {error}"
            raise _wrong(source, index, text, "write *.mod", "files") from error
        relative = [path.relative_to(root) for path in files]
        matching = sorted(path.as_posix() for path in relative if not IGNORED_FOLDERS & {*path.parts})
        if not matching:
            raise _wrong(source, index, f"no file matches `{pattern}`", "paths start at the jobs file", "files")
        names += [name for name in matching if name not in names]
    return [Task(job.name or names[0], tuple(names), root)], []


def _settled(task: Task, settings_at: SettingsAt, *layers: tuple[Source, StatedJob]) -> Settings:
    """Return the settings of a task: of its folder, overridden by each layer, then completed by the arm it drives.

    Args:
        settings_at: returns the settings for programs in a folder.
        layers: what the jobs file states for all jobs, and for this one, with its source: paths start at its folder.
    """
    settings = settings_at((task.root / task.files[0]).parent if task.files else task.root)
    for source, layer in layers:
        settings = with_choices(settings, layer.stated(), Path(source.path).parent, source.path)
    return with_arm(settings, task)


def _wrong(source: Source, index: int, text: str, help_: str, key: str | None = None) -> PostprocError:
    """Return the error BAT009 at a job, or at a key of it.

    Args:
        source: the jobs file. index: of the job in it. text, help_: of the finding.
    """
    keys = ("job", index) if key is None else ("job", index, key)
    return PostprocError.of("BAT009", text, source, span_of(source, keys), help_)
