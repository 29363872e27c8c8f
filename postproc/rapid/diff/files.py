"""Two versions of one file compared: RAPID modules by meaning, all others by bytes."""

from __future__ import annotations

from pathlib import Path

from postproc.diagnostics import PostprocError, Source, has_errors
from postproc.rapid.diff.compare import compare_programs
from postproc.rapid.diff.difference import FileDiff
from postproc.rapid.program.program import ENDINGS, read_program


def compare_files(path: str, one: Source, two: Source, near: tuple[float, float]) -> FileDiff:
    """Compare two files: RAPID modules by meaning, all others by bytes.

    Args:
        path: of both, for the result; its ending says whether they are modules. near: tolerances [mm], [deg].
    """
    if one.data == two.data:
        return FileDiff(path, "equal", "the same bytes")
    if Path(path).suffix.lower() not in ENDINGS:
        return FileDiff(path, "changed", "other bytes")
    try:
        programs = [read_program(source) for source in (one, two)]
        for program in programs:
            if has_errors(program.diagnostics) or not program.modules:  # an encrypted file has no modules
                raise PostprocError(d for d in program.diagnostics if d.severity == "error" or not program.modules)
        difference = compare_programs(programs[0], programs[1], *near)
    except PostprocError as error:
        first = error.diagnostics[0]
        return FileDiff(path, "unreadable", f"other bytes, and not to be read: {first.code}, {first.message}")
    return FileDiff(path, "equal" if difference.equal else "changed", None, difference)
