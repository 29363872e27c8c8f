"""RAPID programs that the user names, and the files near them that declare what they lack."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from postproc.batch.discover import MODULES, PARTS, SHARED
from postproc.cli.inputs import read_source
from postproc.diagnostics import Diagnostic, PostprocError, Source


def read_program_file(name: str) -> Source:
    """The bytes of one module; ``-`` is stdin.

    Raises:
        PostprocError: as ``read_source``, or a folder or a list of modules (CLI003).
    """
    path = Path(name)
    if path.is_dir() or (path.suffix.lower() == ".pgf" and path.is_file()):
        what = "a folder" if path.is_dir() else "a list of modules"
        help_ = f"`postproc batch {name} -o FOLDER` converts what belongs together; or name one module"
        raise PostprocError.of("CLI003", f"`{name}` is {what}", help=help_)
    return read_source(name)


def read_lent(files: Iterable[Path], program: str = "-") -> list[Source]:
    """Modules that are read along with a program and never changed; the program itself is none of them."""
    return [read_source(str(path), lent=True) for path in files if path.resolve() != Path(program).resolve()]


def named_files(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The findings; those about data that a file nearby declares (RAP020, RAP021) name that file."""
    return [_named(d) if d.code in ("RAP020", "RAP021") else d for d in diagnostics]


def _named(finding: Diagnostic) -> Diagnostic:
    if finding.source is None or finding.span is None:
        return finding
    name = re.escape(
        finding.message.split("`")[1].encode("latin-1")
    )  # where it is used it may be part of something else
    # LOCAL data serves its own module alone.
    declares = re.compile(rb"(?im)^[ \t]*(?:TASK\s+)?(?:PERS|CONST|VAR)\s+\w+\s+" + name + rb"\s*(?:\{[^}]*\}\s*)?:=")
    for path in _nearby(Path(finding.source.path)):
        try:
            found = declares.search(path.read_bytes())
        except OSError:
            continue
        if found:
            return replace(finding, help=f"`{path}` declares it: add `--with {path}`")
    return finding


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
        yield from (p for p in sorted(place.iterdir()) if p.suffix.lower() in MODULES and p != module)


def _folders(place: Path) -> list[Path]:
    return sorted(p for p in place.iterdir() if p.is_dir())
