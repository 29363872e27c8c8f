"""What settings say against a controller, a model or a data sheet is an error unless the command line says it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from postproc.settings_files import settings_at
from tests.batch.folders import program, write
from tests.batch.test_tree import MOC, backup

from .conftest import Call


@pytest.mark.parametrize(
    ("text", "code", "options"),
    [
        ('robot = "irb4600_60_205_seed"\n', "BAT012", ("--robot", "irb4600_60_205_seed")),
        ("force = [500, 0, 0]\n", "BAT019", ("--force", "500,0,0")),
        ('already = ["gravity"]\n', "BAT019", ("--already", "gravity")),
    ],
)
def test_a_file_above_a_backup_says_nothing_against_it(
    call_as_written: Call, tmp_path: Path, text: str, code: str, options: tuple[str, ...]
) -> None:
    root = backup(tmp_path / "common" / "in")
    (tmp_path / "common/postproc.toml").write_text(text)
    batch = ("batch", root, "-o", tmp_path / "out", "--workers", "1", "--tolerance", "0.5")
    refused = call_as_written(*batch)
    assert refused.code == 2 and f"error[{code}]" in refused.err and not (tmp_path / "out").exists()
    one = call_as_written(
        "compensate", root / "RAPID/TASK1/PROGMOD/Seam.mod", "--with", root / "RAPID/TASK1/SYSMOD/user.sys"
    )
    assert one.code == 2 and f"error[{code}]" in one.err
    said = call_as_written(*batch, *options)
    assert said.code == 0, said.err


def test_a_file_in_the_backup_states_its_force(call_as_written: Call, tmp_path: Path) -> None:
    root = backup(tmp_path / "in")
    (root / "postproc.toml").write_text("force = [100, 0, 0]\ntolerance_mm = 0.5\n")
    found = call_as_written("batch", root, "-o", tmp_path / "out", "--workers", "1", "--tolerance", "0.4")
    assert found.code == 0, found.err


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


def test_a_configuration_beside_programs_is_named(call_as_written: Call, tmp_path: Path) -> None:
    source = write(tmp_path / "in", {"progs/a.mod": program("A"), "MOC.cfg": MOC.replace("{base}", "")})
    for words in (("compensate", source / "progs/a.mod"), ("batch", source, "-o", tmp_path / "out", "--workers", "1")):
        found = call_as_written(*words)
        assert found.code == 2 and "error[CLI013]" in found.err
        assert f"`{source / 'MOC.cfg'}` near it is of `" in found.err and "and `irb4600_60_205`" in found.err


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
