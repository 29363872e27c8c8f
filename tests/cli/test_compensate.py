"""``compensate`` as a user runs it: files, streams, exit codes, and bad input of every kind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from postproc.cli.app import build
from postproc.cli.run import run

from .conftest import Call

FORCE = ("--force", "200,-200,-200", "--inertia", "off")


def test_a_seam_from_file_to_file(call: Call, samples: Path, tmp_path: Path) -> None:
    program, target, page = samples / "hull_seam.mod", tmp_path / "hull.mod", tmp_path / "hull.html"
    before = program.read_bytes()
    outcome = call("compensate", program, *FORCE, "-o", target, "--report", page, "--json")
    assert outcome.code == 0, outcome.err
    document = json.loads(outcome.out)
    assert document["schema"] == "postproc/compensate/1"
    assert 0.5 < document["max_error_before_mm"] < 3.0
    assert document["max_arc_error_after_mm"] <= 0.01 and document["max_error_after_mm"] <= 0.2
    assert document["added_targets"] <= 15 * 1.4
    assert len(document["statements"]) == 15
    assert [row["status"] for row in document["statements"]] == ["unchanged"] * 2 + ["compensated"] * 13
    assert all(row["reason"] for row in document["statements"] if row["status"] != "compensated")
    assert program.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["hull.html", "hull.mod"]
    assert "<!DOCTYPE html>" in page.read_text("utf-8")

    written = target.read_bytes()
    assert b"\n" not in written.replace(b"\r\n", b"")
    assert call("compensate", program, *FORCE, "-o", target, "--check").code == 0
    assert call("compensate", program, *FORCE, "--check").code == 1
    target.write_bytes(written + b" ")
    assert call("compensate", program, *FORCE, "-o", target, "--check").code == 1


def test_stdout_takes_the_program_and_stderr_the_summary(
    capfdbinary: pytest.CaptureFixture[bytes], samples: Path, tmp_path: Path
) -> None:
    target = tmp_path / "out.mod"
    program = str(samples / "corner_arc.mod")
    assert run(build(), ["compensate", program, "-o", str(target)]) == 0
    capfdbinary.readouterr()
    assert run(build(), ["compensate", program]) == 0
    captured = capfdbinary.readouterr()
    assert captured.out == target.read_bytes()
    assert b"of deviation remain" in captured.err


def test_the_difference_shows_targets_and_header_only(
    capfdbinary: pytest.CaptureFixture[bytes], samples: Path, tmp_path: Path
) -> None:
    assert run(build(), ["compensate", str(samples / "paper_case.mod"), *FORCE, "--diff"]) == 1
    lines = capfdbinary.readouterr().out.decode().splitlines()
    assert lines[0].startswith("--- ")
    removed = [line for line in lines[2:] if line.startswith("-")]
    added = [line for line in lines[2:] if line.startswith("+")]
    assert all("robtarget" in line or "Offs(" in line or "RelTool(" in line for line in removed)
    assert all("robtarget" in line or "ArcL " in line or "MoveL " in line or "! " in line for line in added)
