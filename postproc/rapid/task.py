"""Which files belong together: controller backups, program folders and single files.

A backup holds ``RAPID/TASKn/{PROGMOD,SYSMOD}``; ``HOME`` holds copies that do not run. TASKn is not robot n: the
names stand in ``BACKINFO/backinfo.txt``, the mechanical units in ``SYSPAR/SYS.cfg`` and the types of the arms in
``SYSPAR/MOC.cfg``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from postproc.diagnostics import Source

MODULE_SUFFIXES = frozenset({".mod", ".prg", ".sys", ".modx", ".sysx"})
_MODULE_ENTRY = re.compile(r"<Module>\s*([^<]*?)\s*</Module>", re.IGNORECASE)
_TASK_ENTRY = re.compile(r"^>>(TASK\w+):\s*\(\s*([^,)\s]*)", re.MULTILINE)
_SECTION = re.compile(r"^(\w+):\s*$(.*?)(?=^\w+:\s*$|\Z)", re.MULTILINE | re.DOTALL)
_SETTING = re.compile(r'-(\w+)(?:\s+"([^"]*)")?')


@dataclass(frozen=True, slots=True)
class Task:
    """The files of one RAPID task.

    Args:
        name: name of the task as far as it is known, else of the folder or file.
        root: the folder they were found in, or the file's folder.
        modules: files that are read together.
        moves: whether the controller lets the task move an arm (True where nothing says otherwise).
        robot: mechanical unit, such as ``ROB_1``; robot_type: the controller's name of the arm; empty if not known.
    """

    name: str
    root: Path
    modules: tuple[Path, ...]
    moves: bool = True
    robot: str = ""
    robot_type: str = ""

    def read(self) -> tuple[Source, ...]:
        """The files as sources, named by their paths.

        Raises:
            OSError: a file cannot be read.
        """
        return tuple(Source(str(path), path.read_bytes()) for path in self.modules)


def find_tasks(root: Path) -> tuple[Task, ...]:
    """All tasks below a folder, or the one of a single file; a file outside any task is a task of its own.

    Files of a backup's ``HOME`` are left out. Modules that a ``.pgf`` lists belong together.
    """
    if root.is_file():
        return (Task(root.stem, root.parent, _listed(root) if root.suffix.lower() == ".pgf" else (root,)),)
    tasks: list[Task] = []
    taken: set[Path] = set()
    for folder in _task_folders(root):
        places = (folder, folder / "PROGMOD", folder / "SYSMOD")
        modules = tuple(
            path for place in places if place.is_dir() for path in sorted(place.iterdir()) if _is_module(path)
        )
        if modules:
            tasks.append(_described(folder, modules))
            taken |= set(modules)
    homes = {path.parent / "HOME" for path in root.rglob("RAPID") if path.is_dir()}
    loose = [p for p in sorted(root.rglob("*")) if p.is_file() and p not in taken and not homes & set(p.parents)]
    for path in loose:
        if path.suffix.lower() == ".pgf":
            modules = tuple(m for m in _listed(path) if m not in taken)
            if modules:
                tasks.append(Task(path.stem, path.parent, modules))
                taken |= set(modules)
    tasks += [Task(path.stem, path.parent, (path,)) for path in loose if _is_module(path) and path not in taken]
    return tuple(tasks)


def _is_module(path: Path) -> bool:
    return path.suffix.lower() in MODULE_SUFFIXES and path.is_file()


def _task_folders(root: Path) -> Iterator[Path]:
    """Folders below a folder ``RAPID``, or the root itself if it is one of them."""
    if any((root / name).is_dir() for name in ("PROGMOD", "SYSMOD")):
        yield root
        return
    for rapid in sorted([root, *root.rglob("*")]):
        if rapid.name.upper() == "RAPID" and rapid.is_dir() and "HOME" not in rapid.relative_to(root).parts:
            inner = sorted(path for path in rapid.iterdir() if path.is_dir())
            # A folder RAPID may also be somebody's name for a collection of backups.
            yield from (path for path in inner if not any(p.is_dir() for p in path.rglob("RAPID")))


def _listed(program: Path) -> tuple[Path, ...]:
    """Modules that a .pgf lists, found without regard to case."""
    names = _MODULE_ENTRY.findall(program.read_text("latin-1"))
    present = {path.name.lower(): path for path in program.parent.iterdir()}
    found = (present.get(name.replace("\\", "/").rsplit("/", 1)[-1].lower()) for name in names)
    return tuple(path for path in found if path is not None)


def _described(folder: Path, modules: tuple[Path, ...]) -> Task:
    """A task with what the backup around it says."""
    backup = folder.parent.parent
    names = dict(_TASK_ENTRY.findall(_text(backup / "BACKINFO" / "backinfo.txt")))
    name = {key.lower(): value for key, value in names.items()}.get(folder.name.lower(), folder.name) or folder.name
    system = _settings(_text(backup / "SYSPAR" / "SYS.cfg"))
    task = next((entry for entry in system.get("cab_tasks", []) if entry.get("name") == name), None)
    if task is None:
        return Task(name, folder, modules)
    group = task.get("usemechanicalunitgroup", "")
    units = system.get("mechanical_unit_group", [])
    robot = next((entry.get("robot", "") for entry in units if entry.get("name") == group), "")
    arms = _settings(_text(backup / "SYSPAR" / "MOC.cfg")).get("robot", [])
    kind = next((entry.get("use_robot_type", "") for entry in arms if entry.get("name") == robot), "")
    return Task(name, folder, modules, "motiontask" in task, robot, kind)


def _text(path: Path) -> str:
    """Text of a file whose name may be written in any case; nothing if there is none."""
    if path.parent.is_dir():
        for entry in path.parent.iterdir():
            if entry.name.lower() == path.name.lower():
                return entry.read_text("latin-1")
    return ""


def _settings(text: str) -> Mapping[str, list[dict[str, str]]]:
    """Instances of a system parameter file by type: every instance starts with ``-Name``, lines go on after ``\\``."""
    found: dict[str, list[dict[str, str]]] = {}
    for kind, body in _SECTION.findall(text.replace("\r", "").replace("#", "")):
        entries = found.setdefault(kind.lower(), [])
        for key, value in _SETTING.findall(body):
            if key.lower() == "name":
                entries.append({})
            if entries:
                entries[-1][key.lower()] = value
    return found
