"""Files near a program that say what it lacks: data that they declare, the arm of a controller."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path

from postproc.batch.backinfo import listed_modules, not_loaded
from postproc.batch.discover import PARTS, SHARED
from postproc.diagnostics import Diagnostic, Source
from postproc.files import real
from postproc.rapid.program.program import ENDINGS, read_program
from postproc.rapid.program.read_along import ReadAlong, declares, read_along
from postproc.rapid.syntax.tokens import identifiers
from postproc.robot.controller import arm_entries, not_in_library, read_entries, read_quietly
from postproc.robot.type_names import library_name

LEVELS = 3  # folders above a program whose configuration may be that of its controller
MOST_FILES = 500  # near a program; of more none is read along
_DECLARES = re.compile(
    rb"(?im)^[ \t]*(?:LOCAL[ \t]+|TASK[ \t]+)?(?:(?:PERS|CONST|VAR)[ \t]+\w+|RECORD|ALIAS[ \t]+\w+)[ \t]+(\w+)"
)


def read_nearby(own: Sequence[Source], root: Path = Path()) -> ReadAlong:
    """Return the declarations near a program of what it names and does not declare itself.

    Args:
        own: all that is read of the program, with paths relative to ``root``.
    """
    words = set[str]().union(*(identifiers(source.data) for source in own))
    near = _files_near([root / source.path for source in own], [root / s.path for s in own if not s.read_only])
    if sum(map(len, near)) > MOST_FILES:
        text = f"more than {MOST_FILES} files with modules are near `{own[0].path}`: none of them is read along"
        help_ = "where it lacks data, name the file that declares it, `--with FILE`"
        return ReadAlong(findings=(Diagnostic("RAP040", "info", text, help=help_),))
    if not any(words & _declared(path) for path in chain(*near)):
        return ReadAlong()

    def declaring(name: str) -> tuple[list[Source], list[Source]]:
        """Return the files near the program that declare a name: those of its own task, those of other tasks."""
        same, other = ([_source(path, root) for path in paths if name in _declared(path)] for paths in near)
        return same, other

    return read_along(read_program(own), declaring)


def help_nearby(name: str, own: Sequence[Path]) -> str | None:
    """Return a help text that names a file near a program that gives data a value; None if none does.

    Args:
        name: of the data that is used without a value. own: all files of the program.
    """
    near = _files_near(own, own)
    for path in chain(*near) if sum(map(len, near)) <= MOST_FILES else ():
        if name.lower() in _declared(path) and declares(_source(path, Path()), name):
            return f"`{path}` declares it: add `--with {path}`"
    return None


def _files_near(taken: Iterable[Path], paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return files with modules near those of a program: those that its task may hold, those of other tasks.

    That is what stands beside its files, in the other folders of its task, and in other tasks of its backup.

    Args:
        taken: files that are read already. paths: of the program's own files.
    """
    same, other = dict[Path, None](), dict[Path, None]()
    for folder in dict.fromkeys(path.parent for path in paths if path.is_file()):
        backup = folder.name.lower() in PARTS
        task = folder.parent if backup else folder
        same |= dict.fromkeys([folder, *(p for p in _folders(task) if p.name.lower() in {*PARTS, SHARED})])
        for home in _folders(task.parent) if backup else ():
            (same if home.name.lower() == SHARED else other).update(dict.fromkeys(_folders(home)))
    own = {real(path) for path in taken}
    near = [
        [p for place in places for p in _loaded_modules(place) if real(p) not in own]
        for places in (same, [place for place in other if place not in same])
    ]
    return near[0], near[1]


def _loaded_modules(place: Path) -> list[Path]:
    """Return the files with modules in a folder, sorted; in a backup those that its controller loads."""
    modules = sorted(p for p in place.iterdir() if p.suffix.lower() in ENDINGS)
    home = place.parent if place.name.lower() in PARTS else place
    left_out = not_loaded(home, modules, listed_modules(home.parent.parent))
    return [path for path in modules if path not in left_out]


def _folders(place: Path) -> list[Path]:
    """Return the folders inside a folder, sorted."""
    return sorted(p for p in place.iterdir() if p.is_dir())


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
    return frozenset(found[1].decode("latin-1").lower() for found in _DECLARES.finditer(read_quietly(path)))


def arm_nearby(program: str, place: Path) -> Diagnostic | None:
    """Return CLI013 that names the arms of a MOC.cfg up to three folders above; None where there is none.

    Args:
        program: its name, for people. place: its file, or folder.
    """
    at = place.absolute()
    for folder in (at, *list(at.parents)[:LEVELS]):
        for path in (folder / "MOC.cfg", folder / "SYSPAR" / "MOC.cfg"):
            types = [
                r.get("use_robot_type", "") for r in arm_entries(read_entries(read_quietly(path).decode("latin-1")))
            ]
            if types:
                return _arm_of(path, program, list(dict.fromkeys(types)))
    return None


def _arm_of(path: Path, program: str, types: Sequence[str]) -> Diagnostic:
    """Return CLI013 that names the arms of a MOC.cfg; the help offers only names that the library has.

    Args:
        path: of the MOC.cfg. program: its name, for people. types: of the arms, as the controller calls them.
    """
    names = dict.fromkeys(filter(None, map(library_name, types)))
    arms = " and ".join(f"`{name}`" for name in dict.fromkeys(library_name(kind) or kind for kind in types))
    text = f"nothing says which arm runs `{program}`: `{path}` near it is of {arms}"
    help_ = f"say `--robot {next(iter(names))}` if it runs there" if names else not_in_library(types[0])
    return Diagnostic("CLI013", "error", text, help=help_)
