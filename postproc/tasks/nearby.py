"""Files near a program that say what it lacks: data that they declare, the arm of a controller."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import TypeVar

from postproc.diagnostics import Diagnostic, Finding, Matter, Source
from postproc.files import real
from postproc.rapid.program.program import ENDINGS, read_program
from postproc.rapid.program.read_along import ReadAlong, declares, read_along
from postproc.rapid.syntax.tokens import identifiers
from postproc.robot.controller import arm_entries, not_in_library, read_entries, read_quietly
from postproc.robot.type_names import library_name
from postproc.tasks.discover import MODULE_FOLDERS, SHARED_TASK
from postproc.tasks.lists import listed_modules, not_loaded

LEVELS = 3  # folders above a program whose configuration may be that of its controller
MOST_FILES = 500  # near a program; of more none is read along
AFinding = TypeVar("AFinding", Finding, Diagnostic)
_DECLARES = re.compile(
    rb"(?im)^[ \t]*(?:LOCAL[ \t]+|TASK[ \t]+)?(?:(?:PERS|CONST|VAR)[ \t]+\w+|RECORD|ALIAS[ \t]+\w+)[ \t]+(\w+)"
)


def read_nearby(program: Sequence[Source], root: Path = Path()) -> ReadAlong:
    """Return the declarations near a program of what it names and does not declare itself.

    Args:
        program: all that is read of it, with paths relative to ``root``.
    """
    words = set[str]().union(*(identifiers(source.data) for source in program))
    near = _files_near([root / source.path for source in program], [root / s.path for s in program if not s.read_only])
    if sum(map(len, near)) > MOST_FILES:
        text = f"more than {MOST_FILES} files with modules are near `{program[0].path}`: none of them is read along"
        help_ = "where it lacks data, name the file that declares it, `--with FILE`"
        return ReadAlong(findings=(Diagnostic("RAP040", "info", text, help=help_),))
    if not any(words & _declared(path) for path in chain(*near)):
        return ReadAlong()

    def declaring(name: str) -> tuple[list[Source], list[Source]]:
        """Return the files near the program that declare a name: those of its own task, those of other tasks."""
        same, other = ([_source(path, root) for path in paths if name in _declared(path)] for paths in near)
        return same, other

    return read_along(read_program(program), declaring)


def with_file_nearby(finding: AFinding, paths: Sequence[Path]) -> AFinding:
    """Return a finding; if it is about data that a file nearby gives a value, its help names that file.

    Args:
        paths: all files of the program.
    """
    near = _files_near(paths, paths) if finding.matter is Matter.UNDECLARED else ([], [])
    for path in chain(*near) if sum(map(len, near)) <= MOST_FILES else ():
        if finding.name.lower() in _declared(path) and declares(_source(path, Path()), finding.name):
            return replace(finding, help=f"`{path}` declares it: add `--with {path}`")
    return finding


def _files_near(taken: Iterable[Path], paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return files with modules near those of a program: those that its task may hold, those of other tasks.

    That is what stands in the folder of a file, in the other folders of its task, and in other tasks of its backup.

    Args:
        taken: files that are read already. paths: of the program's files.
    """
    same, other = dict[Path, None](), dict[Path, None]()
    for folder in dict.fromkeys(path.parent for path in paths if path.is_file()):
        in_backup = folder.name.lower() in MODULE_FOLDERS
        home = folder.parent if in_backup else folder
        parts = {*MODULE_FOLDERS, SHARED_TASK}
        same |= dict.fromkeys([folder, *(path for path in _folders(home) if path.name.lower() in parts)])
        for task in _folders(home.parent) if in_backup else ():
            (same if task.name.lower() == SHARED_TASK else other).update(dict.fromkeys(_folders(task)))
    known = {real(path) for path in taken}
    near = [
        [path for folder in folders for path in _loaded_modules(folder) if real(path) not in known]
        for folders in (same, [folder for folder in other if folder not in same])
    ]
    return near[0], near[1]


def _loaded_modules(folder: Path) -> list[Path]:
    """Return the files with modules in a folder, sorted; in a backup those that its controller loads."""
    modules = sorted(path for path in folder.iterdir() if path.suffix.lower() in ENDINGS)
    home = folder.parent if folder.name.lower() in MODULE_FOLDERS else folder
    if home.parent.name.lower() != "rapid":
        return modules
    unloaded = not_loaded(home, modules, listed_modules(home.parent.parent))
    return [path for path in modules if path not in unloaded]


def _folders(place: Path) -> list[Path]:
    """Return the folders inside a folder, sorted."""
    return sorted(path for path in place.iterdir() if path.is_dir())


def _source(path: Path, root: Path) -> Source:
    """Read a file under its path relative to a folder, if it stands below it; empty if it cannot be read."""
    return Source(path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path), read_quietly(path))


def _declared(path: Path) -> frozenset[str]:
    """Return lower-case names of data and record types that lines of a file declare, those in routines among them."""
    try:
        status = path.stat()
    except OSError:
        return frozenset()
    return _declared_in(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=2 * MOST_FILES)
def _declared_in(path: Path, changed: int, size: int) -> frozenset[str]:
    """Return what a file declares, as `_declared` does; it is read again when its time or size has changed."""
    return frozenset(match[1].decode("latin-1").lower() for match in _DECLARES.finditer(read_quietly(path)))


def arm_nearby(program: str, place: Path) -> Diagnostic | None:
    """Return CLI013 that names the arms of a MOC.cfg up to three folders above; None where there is none.

    The help offers only names that the library has.

    Args:
        program: its name, for people. place: its file, or folder.
    """
    start = place.absolute()
    for folder in (start, *list(start.parents)[:LEVELS]):
        for path in (folder / "MOC.cfg", folder / "SYSPAR" / "MOC.cfg"):
            entries = arm_entries(read_entries(read_quietly(path).decode("latin-1")))
            if types := list(dict.fromkeys(entry.get("use_robot_type", "") for entry in entries)):
                names = dict.fromkeys(filter(None, map(library_name, types)))
                arms = " and ".join(f"`{name}`" for name in dict.fromkeys(library_name(kind) or kind for kind in types))
                text = f"nothing says which arm runs `{program}`: `{path}` near it is of {arms}"
                help_ = f"say `--robot {next(iter(names))}` if it runs there" if names else not_in_library(types[0])
                return Diagnostic("CLI013", "error", text, help=help_)
    return None
