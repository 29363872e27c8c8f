"""Approved outputs kept in version control, as docs/approved.md shows."""

from __future__ import annotations

import subprocess
import sys
import tomllib

import pytest

from .build import ROOT, program, write

pytest_plugins = ("pytester",)
SUITE = """
import pytest
from postproc.testing import programs

@pytest.mark.parametrize("name", sorted({*programs("approved"), *programs("out")}))
def test_output(name, approved_program):
    approved_program(f"out/{name}", f"approved/{name}", tolerance_mm=0.2)
"""
TEXT = program("Seam")
NEAR, FAR = (TEXT.replace("1210,180,", f"1210,{y},") for y in ("180.1", "180.25"))


@pytest.fixture
def suite(pytester: pytest.Pytester) -> pytest.Pytester:
    """An integrator's repository: an approved program, and one that was produced today."""
    write(pytester.path, {"approved/a.mod": TEXT, "out/a.mod": TEXT})
    pytester.makepyfile(SUITE)
    return pytester


def run(suite: pytest.Pytester, *options: str) -> pytest.RunResult:
    return suite.runpytest("-p", "postproc.testing", "-p", "no:cacheprovider", *options)


def test_the_fixture_says_what_moved_by_how_much_and_where(suite: pytest.Pytester) -> None:
    run(suite).assert_outcomes(passed=1)
    write(suite.path, {"out/a.mod": FAR})
    result = run(suite)
    result.assert_outcomes(failed=1)
    moved = "*changed *Seam.rSeam *7 *7 *MoveL *0.2500 *"
    result.stdout.fnmatch_lines(["out/a.mod is not as approved in approved/a.mod", moved, "*pytest --approve-programs"])
    for pattern in ("*Traceback*", "*testing.py*"):
        result.stdout.no_fnmatch_line(pattern)


def test_programs_are_approved_on_request(suite: pytest.Pytester) -> None:
    write(suite.path, {"out/a.mod": NEAR, "out/cell/new.mod": FAR})
    run(suite).assert_outcomes(passed=1, failed=1)
    run(suite, "--approve-programs").assert_outcomes(passed=2)
    assert (suite.path / "approved/cell/new.mod").read_text() == FAR
    assert (suite.path / "approved/a.mod").read_text() == TEXT, "within the tolerance: as it was"
    run(suite).assert_outcomes(passed=2)


@pytest.mark.parametrize("produced", [None, "text"])
def test_what_is_no_program_or_no_longer_produced_is_never_approved(
    suite: pytest.Pytester, produced: str | None
) -> None:
    (suite.path / "out/a.mod").unlink() if produced is None else write(suite.path, {"out/a.mod": produced})
    for options in ((), ("--approve-programs",)):
        result = run(suite, *options)
        result.assert_outcomes(failed=1)
        if produced is None:
            result.stdout.fnmatch_lines(["out/a.mod is not there", "*delete approved/a.mod"])
    assert (suite.path / "approved/a.mod").read_text() == TEXT


def test_pytest_finds_the_plug_in_and_starts_as_fast_as_before() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    ((name, module),) = project["entry-points"]["pytest11"].items()
    assert name == module == "postproc.testing"
    code = f"import sys; import pytest; import {module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert {m for m in loaded.split() if m.split(".")[0] == "postproc"} == {"postproc", "postproc.testing"}
    assert not {"numpy", "scipy", "pinocchio", "rich", "cyclopts"} & {m.split(".")[0] for m in loaded.split()}
