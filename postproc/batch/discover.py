"""What stands in a folder: which files run together, and which are only copied.

A controller's backup keeps a task's modules in RAPID/TASKn/PROGMOD and SYSMOD; its HOME holds copies, not what runs. A
program folder has a ``.pgf`` that lists the modules of one task. Every other module is a task of its own.
"""

from __future__ import annotations

import errno
import re
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from postproc.batch.backinfo import LISTED, listed_modules, not_loaded, say_not_loaded
from postproc.batch.lines import STATE
from postproc.batch.values import Task
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.files import real
from postproc.rapid.data.records import Ax6
from postproc.rapid.program.program import ENDINGS, read_program
from postproc.robot.controller import Backup, Drive, read_backup, read_drive, read_quietly
from postproc.settings import NAME, Settings, corrected_twice

if TYPE_CHECKING:
    from postproc.robot.cells.cell import Cell
    from postproc.robot.cells.station import Station

SYSTEM = frozenset({".sys", ".sysx"})
OUTSIDE = frozenset({STATE, ".git", ".hg", ".svn"})
PARTS = frozenset({"progmod", "sysmod"})
CONFIGURED = frozenset({"syspar", "backinfo"})
CONTROLLER = "the controller's configuration"
SHARED = "task0"  # installed in every task


def discover(folder: Path, output: Path | None = None) -> tuple[list[Task], list[str]]:
    """Return the tasks of a folder, and the files that are only copied, by relative path; both sorted.

    Args:
        output: folder of the outputs, which is left out where it is inside the folder.

    Raises:
        PostprocError: BAT002, a folder cannot be read.
    """
    files = sorted(files_below(folder, output))
    backups = _backups(files)
    groups: dict[str, list[str]] = {}
    copies, rest = [], []
    for name in files:
        home = _task_folder(name)
        if _in_home(name, backups) or (home is not None and _suffix(name) not in ENDINGS):
            copies.append(name)
        elif home is None:
            rest.append(name)
        else:
            groups.setdefault(home, []).append(name)
    stated = {backup: _stated(folder / backup) for backup in backups}
    left_out = _leave_out(folder, groups, backups)
    copies += [name for names in left_out.values() for name in names]
    drives = {home: _drive(home, stated) for home in groups}
    tasks = []
    for home, members in groups.items():
        drive = drives[home]
        moveless = drive is not None and (not drive[0].moves or (drive[0].unknown and _moveless(folder, members)))
        if PurePosixPath(home).name.lower() == SHARED or moveless:
            copies += members
            continue
        others = {h: names for h, names in groups.items() if h != home and _parent(h) == _parent(home)}
        shared = [f for h, names in others.items() if PurePosixPath(h).name.lower() == SHARED for f in names]
        beside = [tuple(names) for h, names in others.items() if PurePosixPath(h).name.lower() != SHARED]
        task = _task(home, members, drive)
        findings = (*task.findings, *say_not_loaded(left_out.get(home, ())))
        task = replace(task, shared=tuple(shared), beside=tuple(beside), findings=findings)
        tasks.append(_beside_others(folder, task, members, {h: (drives[h], groups[h]) for h in others}))
    loose, more = _loose(folder, rest)
    return sorted([*tasks, *loose], key=lambda t: t.name), sorted([*copies, *more])


def task_around(module: Path) -> Task:
    """Return the task of the backup that a module belongs to, without its files; elsewhere a task of the module alone.

    Args:
        module: path of its file.
    """
    here = module.absolute()
    for folder in here.parents:
        home = _task_folder(here.relative_to(folder).as_posix())
        if home is not None and home.lower().startswith("rapid/") and _configured(folder):
            stated = {".": _stated(folder)}
            task, groups = _task(home, [], _drive(home, stated)), dict[str, list[str]]()
            for name in files_below(folder) if task.station is not None else ():
                if _suffix(name) in ENDINGS and (place := _task_folder(name)) is not None:
                    groups.setdefault(place, []).append(name)
            _leave_out(folder, groups, (".",))
            others = {h: (_drive(h, stated), names) for h, names in groups.items() if h != home}
            return _beside_others(folder, task, groups.get(home, ()), others)
    return Task(module.name, ())


def _leave_out(folder: Path, groups: dict[str, list[str]], backups: Iterable[str]) -> dict[str, list[str]]:
    """Take modules out of groups that the controller of their backup does not load; return them by the task's folder.

    Args:
        groups: names of files by the folder of their task; changed in place. Names are relative to ``folder``.
    """
    found = {}
    for backup in backups:
        listed = listed_modules(folder / backup)
        for home, members in groups.items() if listed else ():
            modules = [folder / name for name in members if _suffix(name) in ENDINGS]
            if _below(f"{home}/x", backup, "rapid") and (left := not_loaded(folder / home, modules, listed)):
                found[home] = [path.relative_to(folder).as_posix() for path in left]
                groups[home] = [name for name in members if name not in found[home]]
    return found


def _configured(folder: Path) -> bool:
    """Tell whether a folder holds SYSPAR or BACKINFO."""
    try:
        return any(path.name.lower() in CONFIGURED and path.is_dir() for path in folder.iterdir())
    except OSError:
        return False


def with_arm(settings: Settings, task: Task, bare: bool = False) -> Settings:
    """Return the settings with the arm of the task's controller where they name none, and with its station.

    The programs of other tasks are executed for the places of their units, unless the task is refused because its
    controller already corrects the arm.

    Args:
        bare: the program is only inspected, so it is not refused.
    """
    if not settings.names_arm and task.robot is not None:
        settings = replace(settings, robot=task.robot, robot_from=CONTROLLER)
    if task.station is None:
        return settings
    refused = not bare and corrected_twice(settings, task.station)
    return replace(settings, station=task.station if refused else _with_units_of_others(task.station, task))


def files_below(folder: Path, output: Path | None = None) -> Iterator[str]:
    """Yield the files below a folder by relative path, following links; without outputs, version control and settings.

    Raises:
        PostprocError: BAT002, a folder cannot be read: what is in it must not count as gone.
    """
    waiting = [(folder, frozenset({real(folder)}))]
    while waiting:
        here, around = waiting.pop()
        for path in _entries(here):
            kind = _file_type(path)
            if kind == stat.S_IFDIR:
                at = real(path)
                # A link to a folder that it stands in would never end.
                if path.name not in OUTSIDE and at not in around and not in_output(path, output):
                    waiting.append((path, around | {at}))
            elif path.name != NAME and kind in (stat.S_IFREG, None):  # a pipe is no file
                yield path.relative_to(folder).as_posix()


def in_output(path: Path, output: Path | None) -> bool:
    """Tell whether a path leads into the folder of the outputs."""
    return output is not None and real(path).is_relative_to(real(output))


def _entries(folder: Path) -> list[Path]:
    """Return the sorted paths in a folder.

    Raises:
        PostprocError: BAT002, it cannot be read.
    """
    try:
        return sorted(folder.iterdir())
    except OSError as error:
        raise _unreadable(folder, error) from error


def _file_type(path: Path) -> int | None:
    """Return the type of the file a path leads to (``stat.S_IFMT``); None for a broken link.

    A broken link is reported where it is read.

    Raises:
        PostprocError: BAT002, the type cannot be read.
    """
    try:
        return stat.S_IFMT(path.stat().st_mode)
    except OSError as error:
        if error.errno in (errno.ENOENT, errno.ELOOP):
            return None
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: OSError) -> PostprocError:
    """Return the error BAT002 about a path."""
    text = f"cannot read `{path}`: {error.strerror}"
    return PostprocError.of("BAT002", text, help="check its rights; nothing was done, and no output taken out")


def _suffix(name: str) -> str:
    """Return the ending of a path in lower case."""
    return PurePosixPath(name).suffix.lower()


def _backups(files: Iterable[str]) -> set[str]:
    """Return the backups among relative paths of files: folders with RAPID beside SYSPAR, BACKINFO or HOME.

    The root itself is ``.``.
    """
    beside: dict[str, set[str]] = {}
    for name in files:
        parts = PurePosixPath(name).parts
        for depth, part in enumerate(parts[:-1]):
            beside.setdefault(str(PurePosixPath(*parts[:depth])), set()).add(part.lower())
    return {place for place, found in beside.items() if "rapid" in found and found & {"syspar", "backinfo", "home"}}


def _in_home(name: str, backups: Iterable[str]) -> bool:
    """Tell whether a file is in the HOME folder of a backup.

    Args:
        name: relative path of the file. backups: folders, relative too.
    """
    return any(_below(name, backup, "home") for backup in backups)


def _below(name: str, backup: str, part: str) -> bool:
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
    for depth, part in enumerate(parts[:-1]):
        if part.lower() in PARTS:
            return str(PurePosixPath(*parts[:depth]))
        if (
            part.lower() == "rapid"
            and len(parts) > depth + 2
            and not {p.lower() for p in parts[depth + 1 : -1]} & PARTS
        ):
            return str(PurePosixPath(*parts[: depth + 2]))
    return None


def _drive(home: str, stated: dict[str, tuple[Backup, Cell]]) -> tuple[Drive, Cell] | None:
    """Return what the task of a folder moves, and its cell; None outside a backup.

    Args:
        home: the task's folder. stated: configuration and cell of each backup, by its folder.
    """
    for backup, (configuration, cell) in stated.items():
        if _below(f"{home}/x", backup, "rapid"):
            return read_drive(configuration, PurePosixPath(home).name), cell
    return None


def _parent(place: str) -> str:
    """Return the folder above a path in lower case."""
    return str(PurePosixPath(place).parent).lower()


def _moveless(folder: Path, members: Iterable[str]) -> bool:
    """Tell whether no statement of the modules among these files moves an arm.

    Args:
        members: paths relative to the folder.
    """
    sources = [Source(name, read_quietly(folder / name)) for name in members if _suffix(name) in ENDINGS]
    return not any(s.interpolation != "none" for s in read_program(sources).statements)


def _stated(backup: Path) -> tuple[Backup, Cell]:
    """Read a backup's configuration, and the cell that it describes."""
    from postproc.robot.cells.mechanical_units import read_cell

    configuration = read_backup(backup)
    return configuration, read_cell(configuration)


def _task(name: str, files: list[str], driven: tuple[Drive, Cell] | None) -> Task:
    """Return a task with the arm and station it drives, if any, and BAT013 if the arm's place is unknown.

    Args:
        name: of the task. files: its program files. driven: what it moves, and its cell; None outside a backup.
    """
    if driven is None:
        return Task(name, tuple(files))
    from postproc.robot.cells.station import station_of

    drive, cell = driven
    station = station_of(cell, drive.task)
    findings = [] if station is None else list(station.findings)
    if station is not None and not station.placed:
        text = f"where the base of the arm that `{drive.task}` drives stands in the world is not known"
        help_ = "describe what carries it, or where it stands, in a file for `--cell FILE`"
        findings.append(Diagnostic("BAT013", "error", text, help=help_))
    return Task(name, tuple(files), robot=drive.arm, unknown=drive.unknown, station=station, findings=tuple(findings))


def _beside_others(
    folder: Path,
    task: Task,
    members: Iterable[str],
    others: Mapping[str, tuple[tuple[Drive, Cell] | None, Sequence[str]]],
) -> Task:
    """Return the task with the units that other tasks of its controller move, and their files.

    Args:
        members: its files; others: what each other task of the controller drives, and its files, by the task's folder.
    """
    station = task.station
    if station is None or not station.connected:
        return task
    moved = []
    for driven, files in others.values():
        own = station.cell.tasks.get(driven[0].task.lower()) if driven is not None else None
        if own is not None and own.units:
            paths = tuple(folder / name for name in files if _suffix(name) in ENDINGS)
            moved.append((frozenset(name.lower() for name in own.units), paths))
    return replace(task, texts=tuple(folder / name for name in members), moved_by_others=tuple(moved))


def _with_units_of_others(station: Station, task: Task) -> Station:
    """Return the station with the positions of other tasks' units that the task's files name.

    A unit has a position if the programs that move it leave it at only one.
    """
    from postproc.motion.path.places import resting_place
    from postproc.rapid.execution.walk import walk

    foreign = station.cell.units.keys() - {name.lower() for name in station.units}
    text = b"".join(read_quietly(path).lower() for path in task.texts) if foreign else b""
    named = {unit for unit in foreign if f'"{unit}"'.encode("latin-1", "replace") in text}
    standing: dict[str, Ax6] = {}
    for own, paths in task.moved_by_others:
        if units := named & own:
            sources = [Source(str(path), read_quietly(path)) for path in paths]
            standing |= dict.fromkeys(units, resting_place(walk(read_program(sources))))
    return replace(station, standing=standing)


def _loose(folder: Path, names: list[str]) -> tuple[list[Task], list[str]]:
    """Return the tasks of program folders (``.pgf``) and of single modules, and the files that are neither.

    Args:
        names: relative paths of all files outside of backups.
    """
    tasks: list[Task] = []
    copies = [name for name in names if _suffix(name) not in ENDINGS]
    taken: dict[str, str] = {}
    for listing in (name for name in copies if _suffix(name) == ".pgf"):
        here = str(PurePosixPath(listing).parent)
        near = {PurePosixPath(n).name.lower(): n for n in names if str(PurePosixPath(n).parent) == here}
        source = Source(listing, read_quietly(folder / listing))
        members, findings = [], []
        for found in LISTED.finditer(source.data.decode("latin-1")):
            listed = found[1].strip()
            module = near.get(re.split(r"[\\/]", listed)[-1].lower())
            if module is None:
                text = f"`{listed}` is listed here but does not stand beside"
                findings.append(
                    Diagnostic("BAT010", "warning", text, source, found.span(1), "check that the folder is complete")
                )
            elif module in taken:
                text = f"`{module}` belongs to the program `{taken[module]}` too"
                findings.append(
                    Diagnostic("BAT011", "error", text, source, found.span(1), "convert the programs one by one")
                )
            else:
                taken[module] = listing
                members.append(module)
        # System modules beside a program are loaded with it: they hold its tools and frames.
        members += [n for n in near.values() if _suffix(n) in SYSTEM and n not in taken]
        if members or findings:
            tasks.append(Task(listing, tuple(members), findings=tuple(findings)))
        taken.update(dict.fromkeys(members, listing))
    tasks += [Task(name, (name,)) for name in names if _suffix(name) in ENDINGS and name not in taken]
    return tasks, copies
