"""Files near a module that say what it lacks: data that they declare, the arm of a controller."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from postproc.batch.discover import PARTS, SHARED
from postproc.diagnostics import Diagnostic
from postproc.files import read_file
from postproc.rapid.program.program import ENDINGS

LEVELS = 3  # folders above a program whose configuration may be that of its controller


def help_nearby(name: str, module: Path) -> str | None:
    """Return a help text that names the file near a module that gives the data a value; None if none does.

    Args:
        name: of the data that is used without a value. module: path of the file that uses it.
    """
    # Where it is used it may be part of something else; LOCAL data serves its own module alone.
    data = rb"(?im)^[ \t]*(?:TASK\s+)?(?:PERS|CONST|VAR)\s+\w+\s+" + re.escape(name.encode("latin-1", "replace"))
    declares = re.compile(data + rb"\s*(?:\{[^};]*+\}\s*)?:=")
    for path in _nearby(module):
        try:
            found = declares.search(read_file(path))
        except OSError:
            continue
        if found:
            return f"`{path}` declares it: add `--with {path}`"
    return None


def _nearby(module: Path) -> Iterator[Path]:
    """Yield modules beside a file, in the other folders of its task, and in other tasks of its backup."""
    if not module.is_file():
        return
    backup = module.parent.name.lower() in PARTS
    task = module.parent.parent if backup else module.parent
    places = [module.parent, *(p for p in _folders(task) if p.name.lower() in {*PARTS, SHARED})]
    if backup:
        places += [inner for other in _folders(task.parent) for inner in _folders(other)]
    for place in dict.fromkeys(places):
        yield from (p for p in sorted(place.iterdir()) if p.suffix.lower() in ENDINGS and p != module)


def _folders(place: Path) -> list[Path]:
    """Return the folders inside a folder, sorted."""
    return sorted(p for p in place.iterdir() if p.is_dir())


def arm_nearby(program: str, place: Path) -> Diagnostic | None:
    """Return CLI013 that names the arms of a MOC.cfg up to three folders above; None where there is none.

    Args:
        program: its name, for people. place: its file, or folder.
    """
    from postproc.robot.controller import arm_entries, read_entries, read_quietly
    from postproc.robot.type_names import library_name

    at = place.absolute()
    for folder in (at, *list(at.parents)[:LEVELS]):
        for path in (folder / "MOC.cfg", folder / "SYSPAR" / "MOC.cfg"):
            types = [
                r.get("use_robot_type", "") for r in arm_entries(read_entries(read_quietly(path).decode("latin-1")))
            ]
            names = dict.fromkeys(library_name(kind) or kind for kind in types)
            if names:
                text = f"nothing says which arm runs `{program}`: `{path}` near it is of " + " and ".join(
                    f"`{name}`" for name in names
                )
                return Diagnostic("CLI013", "error", text, help=f"say `--robot {next(iter(names))}` if it runs there")
    return None
