"""Which arm a program is for, and what else ``postproc.toml`` says: nothing is assumed in silence."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.diagnostics import PostprocError
from postproc.settings import Settings, read_arm
from postproc.settings_files import settings_at
from tests.batch.test_tree import SYS, backup

from .conftest import Call


def test_the_command_line_wins_and_the_nearest_file_counts(tmp_path: Path) -> None:
    from postproc.cli.program_options import ConvertOptions

    (tmp_path / "postproc.toml").write_text('robot = "ur5"\n')
    below = tmp_path / "a" / "b"
    below.mkdir(parents=True)
    (tmp_path / "a" / "postproc.toml").write_text(
        'robot = "irb4600_60_205"\nforce = [1, 2, 3]\ntolerance_mm = 0.05\nscope = "welds"\nallow_partial = true\n'
        'with = ["user.sys"]\ntaught = ["n"]\nchannel = { temperature = 30 }\nair_tolerance_mm = 0.3\n'
    )
    stated = settings_at(below)
    o = stated.options
    assert (stated.robot, stated.side_files) == ("irb4600_60_205", (tmp_path / "a" / "user.sys",))
    assert (o.force, o.tolerance_m, o.air_tolerance_m) == ((1, 2, 3), 5e-5, pytest.approx(3e-4))
    assert (o.scope, o.allow_partial, o.taught, o.channels) == ("welds", True, ("n",), (("temperature", 30.0),))
    given = ConvertOptions(tolerance=0.02, force="0,0,0", scope="all", taught=("k,l",)).settings_at(below)
    assert (given.robot, given.options.tolerance_m, given.options.force) == ("irb4600_60_205", 2e-5, (0, 0, 0))
    assert (given.options.scope, given.options.taught) == ("all", ("k", "l"))
    assert settings_at(tmp_path).robot == "ur5"


def test_a_robot_file_stands_beside_the_settings(tmp_path: Path, samples: Path) -> None:
    from postproc.robot.catalogue import ARMS

    (tmp_path / "own.toml").write_bytes((ARMS / "irb4600_60_205.toml").read_bytes())
    (tmp_path / "postproc.toml").write_text('robot = "own.toml"\n')
    assert read_arm(settings_at(tmp_path), "p").robot.name == "irb4600_60_205"


def test_a_program_in_a_backup_is_for_the_arm_of_its_task(call_as_written: Call, tmp_path: Path) -> None:
    root = backup(tmp_path / "in")
    module = root / "RAPID" / "TASK1" / "PROGMOD" / "Seam.mod"
    words = ("inspect", module, "--with", root / "RAPID/TASK1/SYSMOD/user.sys")
    found = call_as_written(*words)
    assert found.code == 0
    assert found.err.startswith("arm `irb4600_60_205` (from the controller's configuration);")
    other = call_as_written(*words, "--robot", "irb4600_60_205_seed")
    assert "warning[BAT012]: the controller drives `irb4600_60_205` with this task" in other.err
    (root / "SYSPAR/SYS.cfg").write_text(SYS.replace('"rob2" -MotionTask', '"rob3" -MotionTask'))
    lost = call_as_written(*words)
    assert lost.code == 2 and "error[KIN011]" in lost.err
    backup(tmp_path / "in", base="-base_frame_coordinated TRACK1")
    assert "error[BAT013]" in call_as_written(*words).err


def test_an_arm_that_is_not_understood_is_named(call_as_written: Call, tmp_path: Path) -> None:
    root = backup(tmp_path / "in")
    moc = root / "SYSPAR" / "MOC.cfg"
    moc.write_text(moc.read_text().replace("ROB2_4600_2.05_60", "ROB2_NEW_9"))
    found = call_as_written("batch", root, "-o", tmp_path / "out")
    assert found.code == 2 and "an arm of type `ROB2_NEW_9`, which is not in the library" in found.err
    assert not (tmp_path / "out").exists()


def test_the_former_name_of_taught_data_is_still_read(tmp_path: Path) -> None:
    (tmp_path / "postproc.toml").write_text('robot = "irb4600_60_205"\nconstant = ["n"]\nalready = ["gravity"]\n')
    options = settings_at(tmp_path).options
    assert (options.taught, options.already) == (("n",), ("gravity",))
    (tmp_path / "postproc.toml").write_text('already = ["gravety"]\n')
    with pytest.raises(PostprocError, match="CLI014"):
        settings_at(tmp_path)


def test_what_a_fit_knows_holds_for_the_arm_that_was_measured(samples: Path, tmp_path: Path) -> None:
    fitted = tmp_path / "fitted.toml"
    text = (samples / "models" / "hull_cell.toml").read_text(encoding="utf-8")
    fitted.write_text(f"{text}\n[fit]\nnoise_mm = 0.05\n", encoding="utf-8")
    own, other = (
        read_arm(Settings(model=fitted, robot=name, another_arm=True), "p.mod")
        for name in ("irb4600_60_205", "irb2600id_15_185")
    )
    assert own.fit and not other.fit
    assert [e.key for e in own.effects] == [e.key for e in other.effects]


@pytest.mark.parametrize(("line", "names"), [('["wJig", "wB"]', ("wJig", "wB")), ('"all"', ("all",))])
def test_taught_work_objects_stand_in_the_settings_too(tmp_path: Path, line: str, names: tuple[str, ...]) -> None:
    """The command line wins as for every key; names may be repeated or have commas between them."""
    from postproc.cli.program_options import ConvertOptions

    (tmp_path / "postproc.toml").write_text(f'robot = "ur5"\nwobj_taught = {line}\n')
    assert settings_at(tmp_path).options.wobj_taught == names
    given = ConvertOptions(wobj_taught=("wA,wB", "wC")).settings_at(tmp_path)
    assert given.options.wobj_taught == ("wA", "wB", "wC")
