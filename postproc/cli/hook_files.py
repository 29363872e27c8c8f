"""Which programs the hooks look at: those that are named, or all of a folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from postproc.diagnostics import PostprocError
from postproc.settings import NAME
from postproc.tasks.discover import IGNORED_FOLDERS

MODULE_SUFFIXES = frozenset({".mod", ".prg", ".modx"})
"""Endings of programs, which are looked for in a folder."""
LENT = frozenset({".toml", ".sys", ".sysx"})
"""Endings of files that any program may be corrected with: settings and models, system modules."""


def chosen(words: Sequence[str], folders: Mapping[str, Path]) -> tuple[Sequence[str], list[Path], list[Path]]:
    """Return the options of the command with their values, the programs, and approved outputs without a program.

    Without names it is every program of the folder ``--programs``; also where a file is named that programs are
    corrected with. Without that folder such a file stands for all programs below its own. Of each approved output it is
    asked whether it has a program, whatever is named: a hook is not told what was deleted.

    Args:
        words: options of the command, then files. folders: the options of the hooks, by name.

    Raises:
        PostprocError: CLI016, there is no program.
    """
    first = len(words)
    while first and Path(words[first - 1]).suffix.lower() in MODULE_SUFFIXES | LENT:
        first -= 1
    if first < len(words) and first and words[first - 1].startswith("-"):  # the value of an option, if one takes it
        first += Path(words[first]).suffix.lower() in LENT and Path(words[first]).name != NAME
    named, folder = [Path(word) for word in words[first:]], folders.get("--programs")
    lent = [path for path in named if path.suffix.lower() in LENT]
    if lent and folder is not None:
        named = []
    elif lent:
        named = sorted({*named, *(program for path in lent for program in below(path.parent))} - {*lent})
    approved, programs = folders.get("--approved"), below(folder)
    if not (named or programs):
        where = "no program is named" if folder is None else f"there is no program in `{folder}`"
        raise PostprocError.of("CLI016", f"nothing is checked: {where}", help="name programs, or their folder")
    if folder is None or approved is None:
        return words[:first], named or programs, []
    names = {path.relative_to(folder) for path in programs}
    return words[:first], named or programs, [p for p in below(approved) if p.relative_to(approved) not in names]


def below(folder: Path | None) -> list[Path]:
    """Return the programs below a folder, sorted, without what a batch keeps for itself; none for None."""
    if folder is None:
        return []
    every = (path for path in folder.rglob("*") if IGNORED_FOLDERS.isdisjoint(path.relative_to(folder).parts))
    return sorted(path for path in every if path.suffix.lower() in MODULE_SUFFIXES and path.is_file())
