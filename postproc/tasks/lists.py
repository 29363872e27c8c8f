"""Lists of the modules that a controller loads: ``BACKINFO/backinfo.txt`` for a backup, a ``.pgf`` for a program."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath

from postproc.diagnostics import Source, Span
from postproc.grouping import grouped
from postproc.robot.controller import read_quietly, text_in_backup

_MODULE = re.compile(r"<Module>([^<]*+)</Module>", re.IGNORECASE)
_TASK = rb"(?im)^>>%s:[^\n]*\n(?:(?!>>)[^\n]*\S[^\n]*(?:\n|\Z))*"  # its head and the lines below, up to a blank one


def modules_of_program(listing: Source) -> list[tuple[str, Span]]:
    """Return the paths of the modules that a ``.pgf`` lists, each with its place there."""
    return [(match[1].strip(), match.span(1)) for match in _MODULE.finditer(listing.data.decode("latin-1"))]


def file_name(listed: str) -> str:
    """Return the file name of a listed path, whichever way its slashes lean, in lower case."""
    return re.split(r"[\\/]", listed)[-1].lower()


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
        names = section[1].decode("latin-1").upper(), (name[1] if name else "").strip().upper()
        listed.update(dict.fromkeys(names, frozenset(filter(None, paths))))
    return listed


def not_loaded(home: Path, paths: Iterable[Path], listed: Mapping[str, frozenset[str]]) -> list[Path]:
    """Return the modules of a task that its controller does not load.

    Its list, or a ``.pgf`` beside a module, names what is loaded. A folder of which the list names no module counts
    in full: not every backup lists the modules of a program.

    Args:
        home: the task's folder. paths: of modules in it. listed: from ``listed_modules``.
    """
    names = listed.get(home.name.upper(), frozenset())
    unloaded: list[Path] = []
    for folder, modules in grouped((path.parent, path) for path in paths).items() if names else ():
        listings = [path for path in folder.iterdir() if path.suffix.lower() == ".pgf"]
        programs = (modules_of_program(Source(str(path), read_quietly(path))) for path in listings)
        loaded = {file_name(listed_path) for program in programs for listed_path, _ in program}
        missing = [path for path in modules if path.relative_to(home).as_posix().lower() not in names]
        if len(missing) < len(modules):
            unloaded += [path for path in missing if path.name.lower() not in loaded]
    return unloaded


def is_backinfo(path: str) -> bool:
    """Tell whether a path is that of BACKINFO/backinfo.txt, in any case."""
    return [part.lower() for part in PurePosixPath(path).parts[-2:]] == ["backinfo", "backinfo.txt"]


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
