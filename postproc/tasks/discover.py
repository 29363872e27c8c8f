"""What stands in a folder: which files run together, and which are only copied.

A controller's backup keeps a task's modules in RAPID/TASKn/PROGMOD and SYSMOD; its HOME holds copies, not what runs. A
program folder has a ``.pgf`` that lists the modules of one task. Every other module is a task of its own.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath

from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.files import real
from postproc.rapid.program.program import ENDINGS, read_program
from postproc.robot.controller import read_backup, read_drive, read_quietly
from postproc.settings import NAME
from postproc.tasks.lists import file_name, listed_modules, modules_of_program, not_loaded
from postproc.tasks.task import OtherTask, Task

STATE = ".postproc"
"""Folder in a tree of outputs in which a batch keeps what it knows of them."""
IGNORED_FOLDERS = frozenset({STATE, ".git", ".hg", ".svn"})
"""Folders in which no programs are looked for."""
MODULE_FOLDERS = frozenset({"progmod", "sysmod"})
SHARED_TASK = "task0"
"""Folder of the modules that are installed in every task."""


def discover(root: Path, output: Path | None = None, below: Path = Path()) -> tuple[list[Task], list[str]]:
    """Return the tasks of a folder, and the files that are only copied, by path relative to ``root``; both sorted.

    Args:
        output: folder of the outputs, which is left out where it is inside the folder.
        below: the folder, relative to ``root``.

    Raises:
        PostprocError: BAT002, a folder cannot be read.
    """
    names = sorted((below / name).as_posix() for name in files_below(root / below, output))
    backups = _backups(names)
    groups: dict[str, list[str]] = {}
    copies, unlisted = [], []
    for name in names:
        home = _task_folder(name)
        if any(_is_in(name, backup, "home") for backup in backups) or (
            home is not None and _suffix(name) not in ENDINGS
        ):
            copies.append(name)
        elif home is None:
            unlisted.append(name)
        else:
            groups.setdefault(home, []).append(name)
    tasks, unloaded = _read_tasks(root, groups, backups)
    copies += [name for home in unloaded for name in unloaded[home]]
    moving: list[Task] = []
    for home, task in tasks.items():
        if _is_shared(home) or not _moves(task):
            copies += task.files
        else:
            if missing := unloaded.get(home):
                text = "only copied, since `BACKINFO/backinfo.txt` does not list it and no controller loads it: "
                text += f"`{missing[0]}`" + (f" and {len(missing) - 1} more" if len(missing) > 1 else "")
                finding = Diagnostic("BAT022", "warning", text, help="add to that list what belongs to the program")
                task = replace(task, findings=(*task.findings, finding))
            moving.append(task)
    single, others = _read_programs(root, unlisted)
    return sorted([*moving, *single], key=lambda task: task.name), sorted([*copies, *others])


def task_around(module: Path) -> Task:
    """Return the task of the backup that a module belongs to; elsewhere a task of the module alone, without files.

    Args:
        module: path of its file.
    """
    place = module.absolute()
    for folder in place.parents:
        home = _task_folder(place.relative_to(folder).as_posix())
        if home is not None and home.lower().startswith("rapid/") and _is_configured(folder):
            groups: dict[str, list[str]] = {home: []}
            rapid = PurePosixPath(home).parts[0]
            for name in (f"{rapid}/{file}" for file in files_below(folder / rapid)):
                if _suffix(name) in ENDINGS and (other := _task_folder(name)) is not None:
                    groups.setdefault(other, []).append(name)
            return _read_tasks(folder, groups, ["."])[0][home]
    return Task(module.name, ())


def files_below(folder: Path, output: Path | None = None) -> Iterator[str]:
    """Yield the files below a folder by relative path, following links; without outputs, version control and settings.

    Raises:
        PostprocError: BAT002, a folder cannot be read: what is in it must not count as gone.
    """

    def refuse(error: OSError) -> None:
        """Raise BAT002: a path cannot be read."""
        help_ = "check its rights; nothing was done, and no output taken out"
        raise PostprocError.of("BAT002", f"cannot read `{error.filename}`: {error.strerror}", help=help_) from error

    for place, folders, files in os.walk(folder, onerror=refuse, followlinks=True):
        inside = Path(place)
        paths = [inside / name for name in folders if name not in IGNORED_FOLDERS]
        folders[:] = [path.name for path in paths if not _leads_back(path, folder) and not in_output(path, output)]
        for name in files:
            try:
                kind = stat.S_IFMT((inside / name).stat().st_mode)
            except OSError as error:
                if error.errno not in (errno.ENOENT, errno.ELOOP):
                    refuse(error)
                kind = stat.S_IFREG  # a broken link is reported where it is read
            if name != NAME and kind == stat.S_IFREG:  # a pipe is no file
                yield (inside / name).relative_to(folder).as_posix()


def _leads_back(path: Path, folder: Path) -> bool:
    """Tell whether a path is a link to a folder that it stands in, which would never end."""
    return path.is_symlink() and real(path) in {real(above) for above in path.parents if above.is_relative_to(folder)}


def in_output(path: Path, output: Path | None) -> bool:
    """Tell whether a path leads into the folder of the outputs."""
    return output is not None and real(path).is_relative_to(real(output))


def _read_tasks(
    root: Path, groups: Mapping[str, list[str]], backups: Iterable[str]
) -> tuple[dict[str, Task], dict[str, list[str]]]:
    """Return the task of each folder, and the modules there that the controller of its backup does not load.

    Args:
        groups: files by the folder of their task. backups: folders. All names are relative to ``root``.
    """
    from postproc.robot.cells.mechanical_units import read_cell
    from postproc.robot.cells.station import station_of

    configured = {name: read_backup(root / name) for name in backups}
    cells = {name: read_cell(configuration) for name, configuration in configured.items()}
    listed = {name: listed_modules(root / name) for name in configured}
    tasks: dict[str, Task] = {}
    units: dict[str, frozenset[str]] = {}
    unloaded: dict[str, list[str]] = {}
    for home, names in groups.items():
        tasks[home] = Task(home, tuple(names), root)
        backup = next((name for name in configured if _is_in(f"{home}/x", name, "rapid")), None)
        if backup is None:
            continue
        paths = {root / name: name for name in names}
        if missing := [paths[path] for path in not_loaded(root / home, paths, listed[backup])]:
            unloaded[home] = missing
        # What the task moves, and in which cell.
        drive = read_drive(configured[backup], PurePosixPath(home).name)
        station = station_of(cells[backup], drive.task)
        moved = cells[backup].tasks.get(drive.task.lower())
        units[home] = frozenset(name.lower() for name in moved.units) if moved is not None else frozenset()
        findings = [] if station is None else list(station.findings)
        if station is not None and not station.placed:
            text = f"where the base of the arm that `{drive.task}` drives stands in the world is not known"
            help_ = "describe what carries it, or where it stands, in a file for `--cell FILE`"
            findings.append(Diagnostic("BAT013", "error", text, help=help_))
        files = tuple(name for name in names if name not in missing)
        tasks[home] = Task(home, files, root, (), (), root / backup, drive, station, tuple(findings))
    for home, task in tasks.items():
        parent = str(PurePosixPath(home).parent).lower()
        siblings = [h for h in tasks if h != home and str(PurePosixPath(h).parent).lower() == parent]
        shared = [name for h in siblings if _is_shared(h) for name in tasks[h].files]
        others = [OtherTask(tasks[h].files, units.get(h, frozenset())) for h in siblings if not _is_shared(h)]
        tasks[home] = replace(task, shared=tuple(shared), others=tuple(others))
    return tasks, unloaded


def _read_programs(root: Path, names: Iterable[str]) -> tuple[list[Task], list[str]]:
    """Return the tasks of program folders (``.pgf``) and of single modules, and the files that are neither.

    Args:
        names: relative paths of all files outside of backups.
    """
    tasks: list[Task] = []
    program: dict[str, str] = {}  # of each module
    for listing in (name for name in names if _suffix(name) == ".pgf"):
        folder = PurePosixPath(listing).parent
        near = {PurePosixPath(name).name.lower(): name for name in names if PurePosixPath(name).parent == folder}
        source = Source(listing, read_quietly(root / listing))
        members, findings = [], []
        for listed, span in modules_of_program(source):
            module = near.get(file_name(listed))
            if module is None:
                text = f"`{listed}` is listed here but does not stand beside"
                help_ = "check that the folder is complete"
                findings.append(Diagnostic("BAT010", "warning", text, source, span, help_))
            elif module in program:
                text = f"`{module}` belongs to the program `{program[module]}` too"
                findings.append(Diagnostic("BAT011", "error", text, source, span, "convert the programs one by one"))
            else:
                program[module] = listing
                members.append(module)
        # System modules beside a program are loaded with it: they hold its tools and frames.
        members += [name for name in near.values() if _suffix(name) in (".sys", ".sysx") and name not in program]
        program.update(dict.fromkeys(members, listing))
        if members or findings:
            tasks.append(Task(listing, tuple(members), root, findings=tuple(findings)))
    tasks += [Task(name, (name,), root) for name in names if _suffix(name) in ENDINGS and name not in program]
    return tasks, [name for name in names if _suffix(name) not in ENDINGS]


def _moves(task: Task) -> bool:
    """Tell whether a task may move an arm; where its arm is not known, its modules tell."""
    if task.drive is None or not task.drive.moves or task.drive.unknown is None:
        return task.drive is None or task.drive.moves
    program = read_program([Source(name, read_quietly(task.root / name)) for name in task.files])
    return any(statement.interpolation != "none" for statement in program.statements)


def _backups(names: Iterable[str]) -> list[str]:
    """Return the backups among relative paths of files: folders with RAPID beside SYSPAR, BACKINFO or HOME.

    The root itself is ``.``.
    """
    inside: dict[str, set[str]] = {}
    for name in names:
        parts = PurePosixPath(name).parts
        for depth, part in enumerate(parts[:-1]):
            inside.setdefault(str(PurePosixPath(*parts[:depth])), set()).add(part.lower())
    return [folder for folder, parts in inside.items() if "rapid" in parts and parts & {"syspar", "backinfo", "home"}]


def _is_configured(folder: Path) -> bool:
    """Tell whether a folder holds SYSPAR or BACKINFO."""
    try:
        return any(path.name.lower() in ("syspar", "backinfo") and path.is_dir() for path in folder.iterdir())
    except OSError:
        return False


def _is_in(name: str, backup: str, part: str) -> bool:
    """Tell whether a file is below a certain folder of a backup.

    Args:
        name, backup: relative paths of the file and the backup. part: name of the folder, in lower case.
    """
    parts, base = PurePosixPath(name).parts, PurePosixPath(backup).parts
    return parts[: len(base)] == base and len(parts) > len(base) + 1 and parts[len(base)].lower() == part


def _task_folder(name: str) -> str | None:
    """Return the folder of the task that a file belongs to: above PROGMOD or SYSMOD, or inside RAPID; else None.

    Args:
        name: relative path of the file.
    """
    parts = PurePosixPath(name).parts
    folders = [part.lower() for part in parts[:-1]]
    for depth, folder in enumerate(folders):
        if folder in MODULE_FOLDERS:
            return str(PurePosixPath(*parts[:depth]))
        if folder == "rapid" and len(parts) > depth + 2 and not MODULE_FOLDERS & {*folders[depth + 1 :]}:
            return str(PurePosixPath(*parts[: depth + 2]))
    return None


def _is_shared(home: str) -> bool:
    """Tell whether a task's folder holds the modules that every task shares."""
    return PurePosixPath(home).name.lower() == SHARED_TASK


def _suffix(name: str) -> str:
    """Return the ending of a path in lower case."""
    return PurePosixPath(name).suffix.lower()
