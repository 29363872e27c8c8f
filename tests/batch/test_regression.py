"""Approved outputs kept in version control, as docs/approved.md shows."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from .folders import program, write

pytest_plugins = ("pytester",)
ROOT = Path(__file__).resolve().parents[2]
SUITE = """
import pytest
from postproc.testing import programs

@pytest.mark.parametrize("name", sorted({*programs("approved"), *programs("out")}))
def test_output(name, approved_program):
    approved_program(f"out/{name}", f"approved/{name}", tolerance_mm=0.2)
"""


@pytest.fixture
def suite(pytester: pytest.Pytester) -> pytest.Pytester:
    """An integrator's repository: an approved program, and one that was produced today."""
    text = program("Seam")
    write(pytester.path, {"approved/a.mod": text, "out/a.mod": text})
    pytester.makepyfile(SUITE)
    return pytester


def run(suite: pytest.Pytester, *options: str) -> pytest.RunResult:
    return suite.runpytest("-p", "postproc.testing", "-p", "no:cacheprovider", *options)


def test_the_fixture_says_what_moved_by_how_much_and_where(suite: pytest.Pytester) -> None:
    run(suite).assert_outcomes(passed=1)
    moved = program("Seam").replace("1210,180,", "1210,180.25,")
    (suite.path / "out/a.mod").write_text(moved)
    result = run(suite)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "out/a.mod is not as approved in approved/a.mod",
            "*changed *Seam.rSeam *7 *7 *MoveL *0.2500 *",
            "*pytest --approve-programs",
        ]
    )
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*testing.py*")


def test_programs_are_approved_on_request(suite: pytest.Pytester) -> None:
    near, far = (program("Seam").replace("1210,180,", f"1210,{y},") for y in ("180.1", "180.25"))
    write(suite.path, {"out/a.mod": near, "out/cell/new.mod": far})
    run(suite).assert_outcomes(passed=1, failed=1)
    run(suite, "--approve-programs").assert_outcomes(passed=2)
    assert (suite.path / "approved/cell/new.mod").read_text() == far
    assert (suite.path / "approved/a.mod").read_text() == program("Seam")  # within the tolerance: left as it is
    run(suite).assert_outcomes(passed=2)


def test_a_program_that_is_no_longer_produced_is_missed(suite: pytest.Pytester) -> None:
    (suite.path / "out/a.mod").unlink()
    for options in ((), ("--approve-programs",)):
        result = run(suite, *options)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(["out/a.mod is not there", "*delete approved/a.mod"])


def test_what_is_no_program_is_never_approved(suite: pytest.Pytester) -> None:
    (suite.path / "out/a.mod").write_text("text")
    result = run(suite, "--approve-programs")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert (suite.path / "approved/a.mod").read_text() == program("Seam")


def test_pytest_finds_the_plug_in_and_starts_as_fast_as_before() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    ((name, module),) = project["entry-points"]["pytest11"].items()
    assert name == module == "postproc.testing"
    code = f"import sys; import pytest; import {module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    ours = {m for m in loaded.split() if m.split(".")[0] == "postproc"}
    assert ours == {"postproc", "postproc.testing"}
    assert not {"numpy", "scipy", "pinocchio", "rich", "cyclopts"} & {m.split(".")[0] for m in loaded.split()}
