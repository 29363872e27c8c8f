"""Regression tests of outputs: two programs are the same if the arm does the same with them."""

from __future__ import annotations

from pathlib import Path

from postproc.diagnostics import PostprocError, Source, has_errors
from postproc.rapid.diff import compare_programs
from postproc.rapid.program import Program, read_program

MODULES = (".mod", ".prg", ".sys", ".modx", ".sysx")


def programs(folder: str | Path) -> list[str]:
    """Names of the modules below a folder, relative to it, sorted."""
    root = Path(folder)
    return sorted(p.relative_to(root).as_posix() for p in root.rglob("*") if p.suffix.lower() in MODULES)


def assert_same_program(approved: str | Path, produced: str | Path, tolerance_mm: float = 0.001) -> None:
    """Compare two programs statement by statement, as ``postproc diff`` does.

    Raises:
        AssertionError: with every statement that differs, or because one of the files is not there.
        PostprocError: a file that is not a program.
    """
    for path in (approved, produced):
        if not Path(path).is_file():
            raise AssertionError(f"{path} is not there")
    found = compare_programs(_read(approved), _read(produced), tolerance_mm)
    if not found.equal:
        raise AssertionError(f"{produced} is not as approved in {approved}\n{found.render()}")


def _read(path: str | Path) -> Program:
    program = read_program(Source(str(path), Path(path).read_bytes()))
    if has_errors(program.diagnostics):
        raise PostprocError(program.diagnostics)
    return program
