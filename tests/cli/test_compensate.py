"""``compensate`` as a user runs it: files, streams, exit codes, and bad input of every kind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from postproc.cli.app import build
from postproc.cli.run import run

from .conftest import Call

FORCE = ("--force", "200,-200,-200", "--inertia", "off")


def test_a_wider_tolerance_needs_fewer_targets(call: Call, samples: Path) -> None:
    documents = [
        json.loads(
            call(
                "compensate", samples / "corner_arc.mod", "--tolerance", mm, "--air-tolerance", mm, "--check", "--json"
            ).out
        )
        for mm in ("0.01", "0.2")
    ]
    assert [d["tolerance_mm"] for d in documents] == [0.01, 0.2]
    assert documents[0]["added_targets"] > documents[1]["added_targets"]
    assert documents[1]["max_error_after_mm"] <= 0.2


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


def test_a_result_is_not_compensated_twice(call: Call, samples: Path, tmp_path: Path) -> None:
    once, twice = tmp_path / "once.mod", tmp_path / "twice.mod"
    assert call("compensate", samples / "corner_arc.mod", "-o", once).code == 0
    outcome = call("compensate", once, "-o", twice)
    assert outcome.code == 1
    assert "error[CMP001]" in outcome.err
    assert not twice.exists()


SEAM = "ArcL pSeam50,v100,smShell,wdShell\\Weave:=wvShell,z1,tTorch\\WObj:=wobjShell;"


@pytest.mark.parametrize(
    ("name", "before", "after", "words"),
    [
        ("unknown tool", SEAM, SEAM.replace("tTorch", "tOther"), "tOther"),
        ("unknown work object", SEAM, SEAM.replace("wobjShell", "wobjHull"), "wobjHull"),
        ("unreachable target", "[[698.15,5.53,0.48]", "[[698.15,-1405.53,0.48]", "reach"),
        ("impossible configuration", "[-1,0,-1,0]", "[-1,0,-1,7]", "configuration"),
        ("joint limit", "[-1,0,-1,0]", "[-1,0,5,0]", ""),
        ("stationary tool", "tTorch:=[TRUE,", "tTorch:=[FALSE,", ""),
    ],
)
def test_programs_that_are_not_safe(
    call: Call, samples: Path, tmp_path: Path, name: str, before: str, after: str, words: str
) -> None:
    text = (samples / "hull_seam.mod").read_bytes().decode()
    assert before in text
    program, target = tmp_path / "bad.mod", tmp_path / "out.mod"
    program.write_bytes(text.replace(before, after, 1).encode())
    outcome = call("compensate", program, "-o", target)
    assert outcome.code in (1, 2), name
    assert outcome.out == ""
    assert outcome.err.splitlines()[1].startswith(("error[", "warning["))
    assert outcome.err.endswith("; no program was written.\n")
    assert "error[" in outcome.err
    assert f"--> {program}:" in outcome.err
    assert "= help: " in outcome.err
    assert words in outcome.err
    assert list(tmp_path.iterdir()) == [program]


def test_of_a_file_that_is_no_program_nothing_is_written(call: Call, tmp_path: Path) -> None:
    program, target = tmp_path / "odd.mod", tmp_path / "out.mod"
    program.write_bytes(b"hello")
    outcome = call("compensate", program, "-o", target)
    assert outcome.code == 2 and "error[RAP011]" in outcome.err and str(program) in outcome.err
    assert not target.exists()


@pytest.mark.parametrize(
    "content", [b"MODULE m\r\nENDMODULE", b"MODULE m\n PROC main()\n  rSeam;\n ENDPROC\nENDMODULE\n"]
)
def test_a_module_in_which_nothing_moves_is_written_as_it_is(call: Call, tmp_path: Path, content: bytes) -> None:
    program, target = tmp_path / "data.sys", tmp_path / "out.sys"
    program.write_bytes(content)
    outcome = call("compensate", program, "-o", target, "--report", tmp_path / "out.html")
    assert outcome.code == 0
    assert "warning[CMP002]" in outcome.err and "Nothing moves: the program is written as it is." in outcome.err
    assert target.read_bytes() == content
    assert "Nothing moves: the program is written as it is." in (tmp_path / "out.html").read_text()
    assert call("compensate", program, "--check").code == 0


@pytest.mark.parametrize(
    "options",
    [
        ("--force", "1,2"),
        ("--force", "a,b,c"),
        ("--moment", "nan,0,0"),
        ("--force-on", "weld"),
        ("--inertia", "yes"),
        ("--tolerance", "0"),
        ("--tolerance", "-1"),
        ("--robot", "irb9"),
        ("--robot", "ur10"),
        ("--robot", "irb6660_205_19"),
        ("-m", "no.toml"),
        ("--template", "no_folder"),
        ("--effects", "no.py"),
    ],
)
def test_options_that_do_not_fit(call: Call, samples: Path, options: tuple[str, str]) -> None:
    outcome = call("compensate", samples / "corner_arc.mod", *options)
    assert (outcome.code, outcome.out) == (2, "")
    assert "error[" in outcome.err
