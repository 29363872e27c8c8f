"""BACKINFO/backinfo.txt lists the modules of each task: a controller that is restored loads those alone."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath

from postproc.batch.lines import Line
from postproc.batch.values import Task, page_of
from postproc.diagnostics import Diagnostic
from postproc.grouping import grouped
from postproc.robot.controller import read_quietly, text_in_backup

LISTED = re.compile(r"<Module>([^<]*+)</Module>", re.IGNORECASE)
_TASK = rb"(?im)^>>%s:[^\n]*\n(?:(?!>>)[^\n]*\S[^\n]*(?:\n|\Z))*"  # its head and the lines below, up to a blank one


def listed_modules(backup: Path) -> Mapping[str, frozenset[str]]:
    """Return the paths inside its folder, in lower case, that each task of a backup loads, by name (``TASK1``).

    A task stands there under the name of its folder and under its own, both in upper case.
    """
    data = text_in_backup(backup, "BACKINFO", "backinfo.txt").encode("latin-1")
    listed = {}
    for section in re.finditer(_TASK % rb"(TASK\w*)", data):
        head, *lines = section[0].decode("latin-1").splitlines()
        paths = (re.sub(r"\s@.*", "", line).strip().replace("\\", "/").lower() for line in lines)
        name = re.search(r"\(([^,)]*)", head)
        listed.update(dict.fromkeys((section[1].decode("latin-1").upper(), (name[1] if name else "").strip().upper()),
                                    frozenset(filter(None, paths))))  # fmt: skip
    return listed


def not_loaded(home: Path, paths: Iterable[Path], listed: Mapping[str, frozenset[str]]) -> list[Path]:
    """Return the modules of a task that its controller does not load.

    Its list, or a ``.pgf`` beside a module, names what is loaded. A folder of which the list names no module counts
    whole: not every backup lists the modules of a program.

    Args:
        home: the task's folder. paths: of modules in it. listed: from ``listed_modules``.
    """
    names = listed.get(home.name.upper(), frozenset())
    if not names:
        return []
    found: list[Path] = []
    for place, modules in grouped((path.parent, path) for path in paths).items():
        listings = (path for path in place.iterdir() if path.suffix.lower() == ".pgf")
        program = {name for listing in listings for name in modules_of_program(read_quietly(listing))}
        stated = {path for path in modules if path.relative_to(home).as_posix().lower() in names}
        if stated:
            found += [path for path in modules if path not in stated and path.name.lower() not in program]
    return found


def say_not_loaded(names: Sequence[str]) -> list[Diagnostic]:
    """Return BAT022 about the modules of a task that its controller does not load, by the names of their files."""
    if not names:
        return []
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    text = f"only copied, since `BACKINFO/backinfo.txt` does not list it and no controller loads it: `{names[0]}`{more}"
    return [Diagnostic("BAT022", "warning", text, help="add to that list what belongs to the program")]


def modules_of_program(listing: bytes) -> list[str]:
    """Return the lower-case file names of the modules that a ``.pgf`` lists."""
    return [re.split(r"[\\/]", found[1].strip())[-1].lower() for found in LISTED.finditer(listing.decode("latin-1"))]


def is_backinfo(path: str) -> bool:
    """Tell whether a path is that of BACKINFO/backinfo.txt, in any case."""
    return [part.lower() for part in PurePosixPath(path).parts[-2:]] == ["backinfo", "backinfo.txt"]


def added_modules(path: str, tasks: Iterable[Task], lines: Iterable[Line]) -> list[tuple[str, str]]:
    """Return the modules that a batch added to the tasks of a backup: name of the task's folder, and path inside it.

    Args:
        path: of backinfo.txt. tasks: all of the batch. lines: of its journal, the newest last.
    """
    home = PurePosixPath(path).parent.parent
    own = {task.name: {*task.files, page_of(task.name)} for task in tasks}
    outputs = {line.name: line.outputs for line in lines if line.name in own}  # the newest last
    found = []
    for name in sorted(outputs):
        task = PurePosixPath(name)
        if task.parent.parent == home and task.parent.name.lower() == "rapid":
            added = (PurePosixPath(p) for p in sorted(outputs[name].keys() - own[name]))
            found += [(task.name, str(p.relative_to(task))) for p in added if p.is_relative_to(task)]
    return found


def with_modules(data: bytes, modules: Iterable[tuple[str, str]]) -> bytes:
    """Return the content of backinfo.txt with modules added to the list of their task, if it lacks them.

    Args:
        data: the content as it is. modules: (name of the task's folder, path inside it).
    """
    for task, module in modules:
        section = re.search(_TASK % re.escape(task.encode()), data)
        name = module.encode()
        if section is None or re.search(rb"(?im)^" + re.escape(name) + rb"\s", section[0]):
            continue
        end = b"\r\n" if b"\r\n" in section[0] else b"\n"
        before = section[0] if section[0].endswith(b"\n") else section[0] + end
        data = data[: section.start()] + before + name + b" @ " + end + data[section.end() :]
    return data
