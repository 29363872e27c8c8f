"""From tasks to jobs: models are read once, files when their turn comes, and a key says what the result depends on."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from itertools import chain
from pathlib import Path

from postproc.batch.values import BatchPlan, Job, Shard, module_place, page_of
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.files import check_tree, read_source, real, resource
from postproc.model.arm import Model
from postproc.rapid.program.read_along import ReadAlong, data_of_other_tasks, lent_values
from postproc.render.templates import environment
from postproc.robot.arm import Robot
from postproc.robot.controller import read_quietly
from postproc.settings import Settings, made_with, read_arm
from postproc.tasks.contradictions import contradictions
from postproc.tasks.discover import STATE
from postproc.tasks.nearby import arm_nearby, read_nearby
from postproc.tasks.task import CONTROLLER, Task

LIBRARIES = ("numpy", "scipy", "toppra", "ruckig", "py-opw-kinematics", "jinja2")


@dataclass(frozen=True)
class Converter:
    """Settings with all files read, ready to be sent to workers.

    Args:
        model: pickled. robot: its arm. settings: where all of it comes from.
        fingerprint: hash of model, options, templates, effect code and software. side_files: read-only modules.
    """

    model: bytes
    robot: Robot
    settings: Settings
    fingerprint: str
    side_files: tuple[Source, ...]


@dataclass(frozen=True)
class ReadyTask:
    """A task with what it is converted with, or the error for which it cannot be; findings on its settings."""

    task: Task
    converter: Converter | PostprocError
    findings: Sequence[Diagnostic] = ()


@dataclass(frozen=True)
class Ready:
    """A checked plan of a batch, with the tasks of one shard.

    Args:
        out: the folder of the tree; nothing that will be written there is an input. pages: each task gets a page there.
    """

    plan: BatchPlan
    shard: Shard
    out: Path
    tasks: tuple[ReadyTask, ...]
    pages: bool = False


def get_ready(plan: BatchPlan, shard: Shard, out: Path, report: Path | None = None) -> Ready:
    """Read models, effects and side files of a plan, and check what will be written.

    Args:
        out: the folder of the tree; a run that was stopped is continued there.
        report: page that is written besides the tree, which then holds a page for each task.

    Raises:
        PostprocError: one of the files cannot be used, no arm is named for any task, or an output is an input or leads
            out of its folder. What is wrong with an arm that a controller's configuration names fails its tasks only.
    """
    _check_outputs(plan, shard.part, out, report)
    read: dict[Settings, Converter] = {}
    tasks: list[ReadyTask] = []
    owned = [(task, settings) for task, settings in plan.tasks if shard.owns(task.name)]
    for task, settings in owned:
        try:
            if settings not in read:
                model = read_arm(settings, task.name, task.unknown or arm_nearby(task.name, task.root / task.name))
                read[settings] = _read_converter(settings, model)
            tasks.append(ReadyTask(task, read[settings], contradictions(settings, task, read[settings].robot)))
        except PostprocError as error:
            if settings.names_arm and settings.robot_from != CONTROLLER:
                raise
            tasks.append(ReadyTask(task, error))
    errors = [one.converter for one in tasks if isinstance(one.converter, PostprocError)]
    if errors and len(errors) == len(tasks) and not any(settings.names_arm for _, settings in owned):
        raise PostprocError([d for error in errors for d in error.diagnostics])
    if wrong := [d for one in tasks for d in one.findings if d.severity == "error"]:
        raise PostprocError(list(dict.fromkeys(wrong)))
    return Ready(plan, shard, out, tuple(tasks), report is not None)


def _check_outputs(plan: BatchPlan, part: str, out: Path, report: Path | None) -> None:
    """Raise PostprocError where a batch would write over one of its inputs, or outside its folder.

    Args:
        part: of the batch. out: the folder of the tree. report: page beside it; then the tree has a page for each task.
    """
    mirrored = [*chain.from_iterable(task.files for task, _ in plan.tasks), *plan.copies]
    taken = {name.casefold() for name in mirrored}
    for task, settings in plan.tasks:
        if settings.options.run_time != "off" and task.files:
            name = module_place(task.name, task.files, settings.options.run_time_module)
            if name.casefold() in taken:
                text = f"the module for run time `{out / name}` is the copy of an input, or that of another task"
                raise PostprocError.of("BAT015", text, help="give it another name with --run-time-module")
            taken.add(name.casefold())
            mirrored.append(name)
    pages = [page_of(task.name) for task, _ in plan.tasks] if report is not None else []
    lent = [name for task, _ in plan.tasks for name in chain(task.shared, *(other.files for other in task.others))]
    stated = [Path(name) for settings in {s for _, s in plan.tasks} for name in settings.inputs if name is not None]
    state = [f"{STATE}/{name}" for name in (f"{part}.lock", f"{part}.unfinished/x", "edited/x")]
    reads = dict.fromkeys([*(plan.root / name for name in (*mirrored, *lent)), *stated])
    check_tree(out, [*mirrored, *pages], state, reads, report)


def _read_converter(settings: Settings, model: Model) -> Converter:
    """Read effects, templates and side files of settings, and hash all that a result depends on beside its program.

    Raises:
        PostprocError: one of the files cannot be used.
    """
    folder = settings.options.template_dir
    environment(folder)  # says whether the folder is there
    templates = sorted(folder.glob("*.j2")) if folder is not None else []
    # Code of the package may change while its version does not.
    code = [path.read_bytes() for path in sorted(Path(__file__).parents[1].rglob("*.py"))]
    shipped = [path.read_bytes() for path in sorted(resource("templates").rglob("*.*"))]
    stated = [_read(path) for path in (*settings.effects, *templates)]
    versions, options = [_version(name) for name in LIBRARIES], replace(settings.options, template_dir=None)
    words = repr((options, [path.name for path in templates], versions))
    pickled = pickle.dumps(model)
    sides = tuple(Source(str(path), _read(path), read_only=True) for path in settings.side_files)
    key = _digest([pickled, words.encode(), *stated, *shipped, *code])
    return Converter(pickled, model.robot, settings, key, sides)


def _version(name: str) -> str:
    """Return the installed version of a package; empty where its name is not known."""
    try:
        return version(name)
    except PackageNotFoundError:  # conda names some of them differently
        return ""


def read_job(ready: ReadyTask, page: bool = False) -> Job:
    """Read the files of a task into a job.

    Args:
        page: the task gets an HTML page.

    Raises:
        PostprocError: the error for which it cannot be converted, or BAT002, one of its files cannot be read.
    """
    task, converter = ready.task, ready.converter
    if isinstance(converter, PostprocError):
        raise converter
    settings, root = converter.settings, task.root
    program = [Source(name, _read(root / name)) for name in task.files]
    lent = [Source(name, _read(root / name), read_only=True) for name in task.shared]
    paths = {real(path) for path in task.paths}
    lent += [source for source in converter.side_files if real(Path(source.path)) not in paths]
    # What other tasks of the controller, and files nearby, have of its data.
    others = [tuple(Source(name, read_quietly(root / name)) for name in other.files) for other in task.others]
    lent += lent_values([*program, *lent], lambda: chain.from_iterable(others))
    along = ReadAlong() if settings.alone else read_nearby([*program, *lent], root)
    lent += along.sources
    other_tasks = replace(data_of_other_tasks([*program, *lent], others), read_along=along.written)
    files = [(source.path, source.read_only) for source in (*program, *lent)]
    words = repr(
        (converter.fingerprint, files, *map(sorted, astuple(other_tasks)), [d.message for d in along.findings])
    )
    key = _digest([words.encode(), *(source.data for source in (*program, *lent))])
    options = replace(settings.options, other_tasks=other_tasks)
    job = Job(task.name, key, (*program, *lent), converter.model, options, findings=along.findings)
    return replace(job, page=page_of(task.name), made=made_with(settings, root)) if page else job


def _read(path: Path) -> bytes:
    """Return the bytes of a file.

    Raises:
        PostprocError: BAT002, it cannot be read.
    """
    return read_source(path, "BAT002").data


def _digest(parts: Iterable[bytes]) -> str:
    """Return the SHA-256 of parts, each with its length, as hexadecimal text."""
    hash_ = sha256()
    for part in parts:
        hash_.update(len(part).to_bytes(8, "big") + part)
    return hash_.hexdigest()
