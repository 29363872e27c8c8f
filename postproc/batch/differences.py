"""Two folders, or two backups of a controller, compared file by file: RAPID modules by meaning, all others by bytes."""

from __future__ import annotations

from pathlib import Path

from postproc.diagnostics import PostprocError
from postproc.files import read_source
from postproc.rapid.diff.difference import FileDiff
from postproc.rapid.diff.files import compare_files
from postproc.rapid.program.program import ENDINGS
from postproc.tasks.discover import files_below
from postproc.watch import Watch, unwatched


def compare_folders(
    a: Path, b: Path, tolerance_mm: float, tolerance_deg: float = 0.01, watch: Watch = unwatched
) -> list[FileDiff]:
    """Compare the files of two folders, paired by their relative path; returns a result for each path, sorted.

    A file in only one folder is "added" or "removed". A module is compared without the files it uses: names from there
    are compared as text. Hidden files and pages (``.html``) are left out.

    Args:
        tolerance_mm, tolerance_deg: distance between targets, and angle between them, that count as equal.
        watch: called with each path and the fraction done.

    Raises:
        PostprocError: a folder cannot be read (BAT002), or there is no RAPID module in either (BAT001).
    """
    ours, theirs = _files(a), _files(b)
    paths = sorted({*ours, *theirs})
    if not any(Path(path).suffix.lower() in ENDINGS for path in paths):
        help_ = "name two folders with programs, or two backups"
        raise PostprocError.of("BAT001", f"there is no RAPID module in `{a}` or `{b}`", help=help_)
    differences = []
    for done, path in enumerate(paths):
        watch(path, done / len(paths))
        if path not in theirs or path not in ours:
            differences.append(FileDiff(path, "added" if path in theirs else "removed"))
        else:
            one, two = (read_source(files[path], "BAT002") for files in (ours, theirs))
            differences.append(compare_files(path, one, two, (tolerance_mm, tolerance_deg)))
    return differences


def _files(folder: Path) -> dict[str, Path]:
    """Return the files below a folder by relative path, without hidden ones and pages."""
    names = (name for name in files_below(folder) if not any(p.startswith(".") for p in Path(name).parts))
    return {name: folder / name for name in names if Path(name).suffix.lower() != ".html"}
