"""Which arm a program is for, and what else ``postproc.toml`` says: nothing is assumed in silence."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from postproc.cli.app import build
from postproc.cli.program_options import TaskOptions
from postproc.settings import USER_OPTIONS, Settings, read_arm
from postproc.settings_files import settings_at
from tests.batch.build import write
from tests.compensation.build import small

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
    files = {"postproc.toml": 'robot = "ur3"\nscope = "all"\n', "a/postproc.toml": f"{line}\n", "a/b/x": ""}
    below = write(tmp_path, {**files}) / "a" / "b"

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


def test_settings_are_searched_up_to_the_repository_or_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"postproc.toml": 'robot = "ur5"\n', "home/a/x": "", "repo/.git/x": "", "repo/b/x": "", "open/c/x": ""}
    write(tmp_path, {**files})
    monkeypatch.setenv("HOME", str(tmp_path / "home"))

    def robots() -> list[str | None]:
        return [settings_at(tmp_path / place).robot for place in ("open/c", "home/a", "repo/b")]

    assert robots() == ["ur5", None, None]
    write(tmp_path, {"repo/postproc.toml": 'robot = "ur10"\n', "home/postproc.toml": 'robot = "ur3"\n'})
    write(tmp_path, {"open/postproc.toml": 'robot = "ur16"\n'})
    os.chmod(tmp_path / "open", 0o777)
    assert robots() == ["ur5", "ur3", "ur10"], "anybody may have put a file into an open folder"


def test_what_a_fit_knows_holds_for_the_arm_that_was_measured(samples: Path, tmp_path: Path) -> None:
    text = (samples / "models" / "hull_cell.toml").read_text("utf-8")
    fitted = write(tmp_path, {"fitted.toml": f"{text}\n[fit]\nnoise_mm = 0.05\n".encode()}) / "fitted.toml"
    settings = Settings(model=fitted, robot="irb4600_60_205", another_arm=True)
    same, other = (read_arm(s, "p.mod") for s in (settings, replace(settings, robot="irb2600id_15_185")))
    assert same.fit and not other.fit
    assert [e.key for e in same.effects] == [e.key for e in other.effects]


@pytest.mark.parametrize(
    ("option", "help_"),
    [
        (("--wobj-taught", "wpat"), "did you mean `wPart`?"),
        (("--wobj-taught", "wPart,xyz"), "the work objects are `wPart` and `wT`"),
        (
            ("--wobj-taught", "wobj0"),
            "name the work object that was taught; targets that were jogged need no correction",
        ),
        (("--taught", "pHom"), "did you mean `pHome`?"),
        (("--taught", "all"), "name the file that declares it, `--with FILE`"),
    ],
)
def test_an_option_that_names_no_data_of_the_program_is_bad_usage(
    call: Call, tmp_path: Path, option: tuple[str, str], help_: str
) -> None:
    program, out = tmp_path / "in" / "one.mod", tmp_path / "out"
    program.parent.mkdir()
    data = 'PERS wobjdata wPart:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    text = small("MoveJ pHome,v200,fine,tT; MoveL p2,v200,fine,tT;", "pHome 1300 -500, p2 1300 -400", data)
    program.write_text(text, "latin-1")
    for words in (("compensate", program, "-o", out / "one.mod"), ("batch", program.parent, "-o", out)):
        made = call(*words, *option)
        assert (made.code, out.exists()) == (2, False)
        what = "`wobj0` is the base" if "wobj0" in option else "no file declares "
        assert f"error[CLI019]: `{option[0]} {option[1].split(',')[-1]}`: {what}" in made.err
        assert f"= help: {help_}\n" in made.err
    for names in (("--wobj-taught", "all"), ("--wobj-taught", "WPART"), ("--taught", "phome")):
        assert call("compensate", program, "--check", *names).code == 1
