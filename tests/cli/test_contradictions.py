"""What settings say against a controller, a model or a data sheet is an error unless the command line says it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from postproc.settings_files import settings_at
from tests.batch.folders import program, write

from .conftest import Call


def test_settings_are_searched_up_to_the_repository_or_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(
        tmp_path,
        {"postproc.toml": 'robot = "ur5"\n', "home/a/x": "", "repo/.git/x": "", "repo/b/x": "", "open/c/x": ""},
    )
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert settings_at(tmp_path / "open/c").robot == "ur5"
    assert settings_at(tmp_path / "home/a").robot is None
    assert settings_at(tmp_path / "repo/b").robot is None
    write(tmp_path, {"repo/postproc.toml": 'robot = "ur10"\n', "home/postproc.toml": 'robot = "ur3"\n'})
    assert (settings_at(tmp_path / "repo/b").robot, settings_at(tmp_path / "home/a").robot) == ("ur10", "ur3")
    write(tmp_path, {"open/postproc.toml": 'robot = "ur3"\n'})
    os.chmod(tmp_path / "open", 0o777)
    assert settings_at(tmp_path / "open/c").robot == "ur5", "anybody may have put it there"


def test_an_arm_that_the_library_lacks_is_not_offered_as_a_name(call_as_written: Call, tmp_path: Path) -> None:
    """The help offers names of the library alone; for other arms it says how one is described."""

    def help_of(*types: str) -> str:
        entries = "\n".join(f'  -name "R{i}" -use_robot_type "{kind}"' for i, kind in enumerate(types))
        write(tmp_path, {"a.mod": program("A"), "MOC.cfg": f"MOC:CFG_1.0:6:0::\n#\nROBOT:\n{entries}\n"})
        found = call_as_written("compensate", tmp_path / "a.mod")
        assert found.code == 2 and f"near it is of `{types[0]}`" in found.err
        return found.err

    assert "`--robot irb4600_60_205`" in help_of("ROB1_360_1.6_6", "ROB1_4600_2.05_60")
    alone, variant = help_of("ROB1_360_1.6_6"), help_of("ROB1_6640_LeanID_2.55_180")
    assert "no arm of that model" in alone and "irb6640_180_255" in variant
    for text in (alone, variant):
        assert "--robot ROB1" not in text and "a file that describes it, `--robot NAME`" in text
