"""Regression tests of outputs: two programs are the same if the arm does the same with them.

pytest loads this module as a plug-in at every start: what it needs is imported when a test asks for it.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from postproc.rapid.program.program import Program

UPDATE = "--approve-programs"


class ApprovedProgram(Protocol):
    """What the fixture ``approved_program`` gives a test: a function of the paths of both programs."""

    def __call__(self, produced: str | Path, approved: str | Path, tolerance_mm: float = 0.001) -> None: ...


def programs(folder: str | Path) -> list[str]:
    """Return the names of the modules below a folder, relative to it, sorted."""
    from postproc.rapid.program.program import ENDINGS

    root = Path(folder)
    return sorted(p.relative_to(root).as_posix() for p in root.rglob("*") if p.suffix.lower() in ENDINGS)


def assert_same_program(approved: str | Path, produced: str | Path, tolerance_mm: float = 0.001) -> None:
    """Compare two programs statement by statement, as ``postproc diff`` does.

    Args:
        approved, produced: their files. tolerance_mm: distance between targets that still counts as equal.

    Raises:
        AssertionError: with every statement that differs, or because one of the files is not there.
        PostprocError: a file that is not a program.
    """
    from postproc.rapid.diff.compare import compare_programs
    from postproc.report.terminal import render_text
    from postproc.results.convert.difference import difference_document

    for path in (approved, produced):
        if not Path(path).is_file():
            raise AssertionError(f"{path} is not there")
    difference = compare_programs(_read(approved), _read(produced), tolerance_mm)
    if not difference.equal:
        text = render_text(difference_document(str(approved), str(produced), difference))
        raise AssertionError(f"{produced} is not as approved in {approved}\n{text}")


@pytest.fixture
def approved_program(pytestconfig: pytest.Config) -> ApprovedProgram:
    """Provide a function that fails a test where a produced program does not do what the approved one does.

    With ``--approve-programs`` the produced program takes the place of an approved one that differs or is not there.
    """

    def check(produced: str | Path, approved: str | Path, tolerance_mm: float = 0.001) -> None:
        """Fail with what differs, or with ``--approve-programs`` copy what is produced."""
        failure = _difference(produced, approved, tolerance_mm)
        if failure and not Path(produced).is_file():
            pytest.fail(f"{produced} is not there\nif this is as it should be: delete {approved}", pytrace=False)
        elif failure and pytestconfig.getoption(UPDATE):
            _read(produced)  # what is no program is not approved
            Path(approved).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(produced, approved)
        elif failure:
            pytest.fail(f"{failure}\nif this is as it should be: pytest {UPDATE}", pytrace=False)

    return check


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option ``--approve-programs`` to pytest."""
    group = parser.getgroup("postproc", "robot programs")
    group.addoption(UPDATE, action="store_true", help="produced programs take the place of approved ones that differ")


def _difference(produced: str | Path, approved: str | Path, tolerance_mm: float) -> str:
    """Return how two programs differ, or why one cannot be read; empty where they are equal.

    Args:
        tolerance_mm: distance between targets that still counts as equal.
    """
    from postproc.diagnostics import PostprocError

    try:
        assert_same_program(approved, produced, tolerance_mm)
    except (AssertionError, PostprocError) as error:
        return str(error)
    return ""


def _read(path: str | Path) -> Program:
    """Read a program; PostprocError where it has errors."""
    from postproc.diagnostics import PostprocError, has_errors
    from postproc.files import read_source
    from postproc.rapid.program.program import read_program

    program = read_program(read_source(path))
    if has_errors(program.diagnostics):
        raise PostprocError(program.diagnostics)
    return program
