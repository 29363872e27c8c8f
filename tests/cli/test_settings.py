"""Which arm a program is for, and what else ``postproc.toml`` says: nothing is assumed in silence."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.cli.app import build
from postproc.cli.program_options import TaskOptions
from postproc.settings import USER_OPTIONS, Settings, read_arm
from postproc.settings_files import settings_at
from tests.batch.test_tree import SYS, backup

from .conftest import Call

# Of each option: a line of a file and its value, words of the command line and their value.
STATED: dict[str, tuple[str, object, str, object]] = {
    "model": ('model = "m.toml"', "{at}/m.toml", "-m k.toml", Path("k.toml")),
    "robot": ('robot = "ur5"', "ur5", "--robot ur10", "ur10"),
    "another_arm": ("", False, "--model-of-another-arm", True),
    "effects": ("", (), "--effects a.py --effects b.py", (Path("a.py"), Path("b.py"))),
    "side_files": ('with = ["u.sys"]', ("{at}/u.sys",), "--with v.sys", (Path("v.sys"),)),
    "alone": ("alone = true", True, "--alone", True),
    "force": ("force = [1, 2, 3]", (1, 2, 3), "--force 0,0,-4", (0, 0, -4)),
    "moment": ("moment = [1, 2, 3]", (1, 2, 3), "--moment -4,0,0", (-4, 0, 0)),
    "force_on": ('force_on = "arc"', "arc", "--force-on all", "all"),
    "inertia": ("inertia = false", False, "--inertia on", True),
    "tolerance_m": ("tolerance_mm = 0.05", 5e-5, "--tolerance 0.02", 2e-5),
    "air_tolerance_m": ("air_tolerance_mm = 0.5", 5e-4, "--air-tolerance 2", 2e-3),
    "scope": ('scope = "welds"', "welds", "--scope all", "all"),
    "run_time": ('run_time = "all"', "all", "--run-time where-needed", "where-needed"),
    "run_time_module": ('run_time_module = "p.sys"', "{at}/p.sys", "--run-time-module q.sys", Path("q.sys")),
    "allow_partial": ("allow_partial = true", True, "--allow-partial", True),
    "largest_correction_m": ("largest_correction_mm = 20", 0.02, "--largest-correction 5", 0.005),
    "template_dir": ('template = "t"', "{at}/t", "--template v", Path("v")),
    "taught": ('constant = ["n"]', ("n",), "--taught k,l --constant m,k", ("k", "l", "m")),
    "wobj_taught": ('wobj_taught = "all"', ("all",), "--wobj-taught wA,wB --wobj-taught wC", ("wA", "wB", "wC")),
    "already": ('already = ["gravity"]', ("gravity",), "--already geometry,gravity", ("geometry", "gravity")),
    "channels": ("channel = { b = 30 }", (("b", 30),), "--channel b=c=1 --channel d=-2", (("b=c", 1), ("d", -2))),
    "entry": ("", None, "", None),
    "cell": ('cell = "c.toml"', "{at}/c.toml", "--cell d.toml", Path("d.toml")),
    "free_axes": ('free_axes = "b"', "b", "--free-axes CB", "cb"),
}


@pytest.mark.parametrize("name", [option.name for option in USER_OPTIONS])
def test_an_option_stands_in_the_nearest_file_and_the_command_line_wins(tmp_path: Path, name: str) -> None:
    """Paths start at the file that states them; an option that was not given leaves what the file states."""
    line, in_file, words, given = STATED[name]
    below = tmp_path / "a" / "b"
    below.mkdir(parents=True)
    (tmp_path / "postproc.toml").write_text('robot = "ur3"\nscope = "all"\n')
    (tmp_path / "a" / "postproc.toml").write_text(f"{line}\n")

    def value(*more: str) -> object:
        _, bound, *_ = build().parse_args(["compensate", "p.mod", *more], print_error=False, exit_on_error=False)
        settings = bound.arguments.get("convert", TaskOptions()).settings_at(below)
        assert settings.stated_in == (tmp_path / "a" / "postproc.toml",)
        return getattr(settings, name) if hasattr(settings, name) else getattr(settings.options, name)

    def placed(stated: object) -> object:
        if isinstance(stated, tuple):
            return tuple(map(placed, stated))
        return Path(stated.format(at=tmp_path / "a")) if isinstance(stated, str) and "{at}" in stated else stated

    assert value() == (pytest.approx(in_file) if isinstance(in_file, float) else placed(in_file))
    assert value(*words.split()) == (pytest.approx(given) if isinstance(given, float) else given)


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
