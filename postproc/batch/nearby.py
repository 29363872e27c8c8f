"""Files near a module that declare what it lacks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from postproc.batch.discover import PARTS, SHARED
from postproc.rapid.program.program import ENDINGS

LACKING = frozenset({"RAP020", "RAP021"})
"""Findings about data without a value, whose name stands first in their message."""


def help_nearby(message: str, module: Path) -> str | None:
    """What to do about a finding of ``LACKING``: the file near the module that declares the data; None if none does."""
    # Where it is used it may be part of something else; LOCAL data serves its own module alone.
    name = re.escape(message.split("`")[1].encode("latin-1", "replace"))
    declares = re.compile(rb"(?im)^[ \t]*(?:TASK\s+)?(?:PERS|CONST|VAR)\s+\w+\s+" + name + rb"\s*(?:\{[^}]*\}\s*)?:=")
    for path in _nearby(module):
        try:
            found = declares.search(path.read_bytes())
        except OSError:
            continue
        if found:
            return f"`{path}` declares it: add `--with {path}`"
    return None


def _nearby(module: Path) -> Iterator[Path]:
    """Modules beside a file, in the other folders of its task, and in the other tasks of a backup (they share data)."""
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
    return sorted(p for p in place.iterdir() if p.is_dir())
