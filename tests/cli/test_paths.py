"""Paths in pages, certificates and documents: from the program or the working folder, never those of a home."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from postproc.files import short_path
from tests.compensation.build import TWO, effect

from .conftest import Call

SPRINGS = "compliance_rad_per_Nm = [4e-6, 4e-7, 3e-7, 2e-6, 2e-6, 3e-6]"


@pytest.mark.parametrize(
    ("path", "shown"),
    [
        ("cell.toml", "cell.toml"),
        ("../cell.toml", "../cell.toml"),
        ("{home}/cells/line/programs/cell.toml", "cell.toml"),
        ("{home}/cells/cell.toml", "../../cell.toml"),
        ("{home}/cell.toml", "../../../cell.toml"),
        ("{work}/models/cell.toml", "models/cell.toml"),
        ("{home}/../other/cell.toml", "cell.toml"),
        ("/elsewhere/cell.toml", "cell.toml"),
    ],
)
def test_a_path_is_stated_from_the_program_or_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, shown: str
) -> None:
    """The program stands below the user's home, and the command runs elsewhere."""
    home, work = tmp_path / "home" / "user", tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setattr(Path, "home", lambda: home)
    of = Path(path.format(home=home, work=work))
    assert short_path(of, home / "cells" / "line" / "programs") == shown


def test_nothing_that_is_written_holds_a_path_of_the_machine(
    call_as_written: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "somebody"
    program, page, certificate = home / "cell" / "programs" / "two.mod", tmp_path / "p.html", tmp_path / "c.html"
    program.parent.mkdir(parents=True)
    program.write_text(TWO, "latin-1")
    (home / "cell" / "arm.toml").write_text(f'robot = "irb4600_60_205"\n{effect("joint_compliance", SPRINGS)}')
    (home / "cell" / "postproc.toml").write_text('model = "arm.toml"\n')
    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.chdir(program.parent)
    made = call_as_written(
        "compensate", program.name, "-o", tmp_path / "o.mod", "--report", page, "--certificate", certificate
    )
    assert made.code == 0, made.err
    for written in (page, certificate):
        text = written.read_text("utf-8")
        assert "somebody" not in text and "../postproc.toml" in text and "../arm.toml" in text
    document = json.loads(call_as_written("compensate", program.name, "--json").out)
    assert document["robot_from"] == "../postproc.toml"
