"""Model files: what they say, what is said about mistakes, and how they are written back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.cli.output import write_model
from postproc.diagnostics import PostprocError, Source
from postproc.effects.library.joints.backlash import Backlash
from postproc.model.file import default_model, parse_model, read_model
from postproc.model.rewrite import render_model
from tests.build import refused

MODEL = """# our cell
robot = "irb4600_60_205"            # the big one
[mounting]
rpy_deg = [0, 180, 0]               # hangs from the gantry
[tool]
xyz_mm = [0, 0, 350]
[effects.joint_compliance]
compliance_rad_per_Nm = [4.2e-6, 3.0e-7, 3.6e-7, 2.1e-6, 1.9e-6, 2.6e-6]  # from spring
[effects.backlash]
half_gap_rad = [0, 1e-4, 9e-5, 0, 0, 0]
[fit]
noise_mm = 0.03
"""


def test_a_model_file_is_read() -> None:
    model = parse_model(Source("cell.toml", MODEL.encode()))
    assert model.gravity == pytest.approx([0, 0, 9.81])
    assert model.T_flange_tcp[:3, 3] == pytest.approx([0, 0, 0.35])
    assert [e.key for e in model.effects] == ["joint_compliance", "backlash"]
    assert model.effect("backlash").half_gap_rad[1] == 1e-4  # type: ignore[union-attr]
    assert model.fit["noise_mm"] == 0.03


def problems(old: str, new: str) -> list[tuple[str, str]]:
    assert old in MODEL
    with pytest.raises(PostprocError) as error:
        parse_model(Source("cell.toml", MODEL.replace(old, new).encode()))
    assert error.value.exit_code == 2
    return [(d.code, d.place) for d in error.value.diagnostics]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[mounting]", "[mountin]", ("MOD002", "cell.toml:3:2")),
        ("rpy_deg = [0, 180, 0]", "rpy = [0, 180, 0]", ("MOD002", "cell.toml:4:1")),
        ("[0, 180, 0]", "[0, 180]", ("MOD002", "cell.toml:4:11")),
        ("[0, 0, 350]", '"long"', ("MOD002", "cell.toml:6:10")),
        ('robot = "irb4600_60_205"', 'robot = "irb1"', ("KIN006", "cell.toml:2:9")),
        ('robot = "irb4600_60_205"', "robot = 3", ("MOD002", "cell.toml:2:9")),
        ("[effects.backlash]", "[effects.backlsh]", ("MOD003", "cell.toml:9:2")),
        ("half_gap_rad", "half_gap", ("EFF021", "cell.toml:10:1")),
        ("[0, 1e-4, 9e-5, 0, 0, 0]", "[0, 1e-4]", ("EFF022", "cell.toml:10:1")),
        ("[0, 1e-4, 9e-5, 0, 0, 0]", "[0, 1e-4", ("MOD001", "cell.toml:11:1")),
        ("[0, 1e-4, 9e-5, 0, 0, 0]", "[0 1e-4]", ("MOD001", "cell.toml:10:19")),
    ],
)
def test_mistakes_are_found_at_their_place(old: str, new: str, expected: tuple[str, str]) -> None:
    assert problems(old, new)[0] == expected


def test_all_mistakes_are_listed_and_say_what_is_allowed() -> None:
    text = MODEL.replace("rpy_deg", "rpy").replace("xyz_mm", "xzy_mm")
    first, second = refused(lambda: parse_model(Source("cell.toml", text.encode())))
    assert first.message == "unknown key `rpy`"
    assert "allowed here: `rpy_deg`" in first.help
    assert second.help == "did you mean `xyz_mm`? allowed here: `rpy_deg`, `xyz_mm`"


def test_writing_keeps_comments_and_changes_only_what_changed(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(MODEL, encoding="utf-8")
    model = read_model(path)
    assert render_model(model, MODEL) == MODEL
    fitted = model.effects[0].with_vector(np.full(6, 1e-6))
    changed = replace(model, effects=(fitted, Backlash(half_gap_rad=[0, 2e-4, 0, 0, 0, 0])), fit={"noise_mm": 0.02})
    write_model(path, changed)
    text = path.read_text(encoding="utf-8")
    for comment in ("# our cell", "# the big one", "# hangs from the gantry", "# from spring"):
        assert comment in text
    again = read_model(path)
    assert again.effects[0].vector().tolist() == [1e-6] * 6
    assert again.effects[1].half_gap_rad[1] == 2e-4  # type: ignore[attr-defined]
    assert again.fit == {"noise_mm": 0.02}
    write_model(path, model.with_effects(model.effects[0]))
    assert [e.key for e in read_model(path).effects] == ["joint_compliance"]
    assert [p.name for p in tmp_path.iterdir()] == ["cell.toml"]


def test_a_new_file_reads_back_as_the_same_model(tmp_path: Path) -> None:
    model = replace(
        default_model("irb4600_60_205_seed"), fit={"parameters": ["a", "b"], "covariance": [[1.0, 0.5], [0.5, 2.0]]}
    )
    write_model(tmp_path / "new.toml", model)
    write_model(tmp_path / "new.toml", replace(model, effects=(*model.effects, Backlash())))
    assert "]\n\n[fit]\n" in (tmp_path / "new.toml").read_text("utf-8")
    write_model(tmp_path / "new.toml", model)
    again = read_model(tmp_path / "new.toml")
    assert again.robot.name == "irb4600_60_205_seed"
    assert again.effects[0].vector() == pytest.approx(model.effects[0].vector(), abs=0)
    assert again.fit["covariance"] == [[1.0, 0.5], [0.5, 2.0]]


def test_a_robot_file_beside_the_model_is_found(tmp_path: Path) -> None:
    from postproc.robot.catalogue import ARMS

    (tmp_path / "mine.toml").write_bytes((ARMS / "ur5.toml").read_bytes())
    (tmp_path / "cell.toml").write_text('robot = "mine.toml"\n', encoding="utf-8")
    assert read_model(tmp_path / "cell.toml").robot.name == "ur5"


def test_an_arm_of_unknown_stiffness_asks_for_a_fit() -> None:
    (found,) = refused(lambda: default_model("ur10"))
    assert found.code == "MOD004"
    assert "postproc fit" in found.help
    assert refused(lambda: read_model("nowhere.toml"))[0].code == "MOD001"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('covariance = "abc"', "`fit.covariance`: input should be a valid list"),
        ('covariance = ["1", "2 q"]', "`fit.covariance.1.1`: input should be a valid number"),
        ("range = {q1 = [1]}", "`fit.range.q1` has too few values"),
        ("range = {q7 = [1, 2]}", "`fit.range.q7.[key]`: input should be 'q1', 'q2'"),
        ("rang = {q1 = [1, 2]}", "unknown key `rang`"),
        ('parameters = ["a"]\ncorrelation = "AAAA"', "`fit.correlation`: there is no `sigma` to it"),
        ('covariance = ["1"]', "`fit.covariance`: 1 rows for 0 parameters"),
        ("sigma = [1]", "`fit.sigma`: 1 numbers for 0 parameters"),
        ("correlation = 'AAAAAAAA'", "`fit.correlation`: the text is not base64 of compressed numbers"),
        ("correlation = 'ab!'", "`fit.correlation`: the text is not base64 of compressed numbers"),
        ("correlation = 'eNpjYIAAAAAIAAE='", "`fit.correlation`: the text is not that of 0 parameters"),
        ('parameters = ["a"]\nsigma = []', "`fit.sigma`: 0 numbers for 1 parameters"),
    ],
)
def test_a_spoilt_fit_table_is_named_at_its_place(line: str, said: str) -> None:
    found = refused(lambda: parse_model(Source("m.toml", f'robot = "ur5"\n\n[fit]\n{line}\n'.encode())))[0]
    assert (found.code, found.place.split(":")[1]) == ("MOD002", str(4 + line.count("\n")))
    assert found.message.startswith(said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[tool]\n[tool]\n", "a table stands twice"),
        ("robot = 1\nrobot = 2\n", "a key stands twice"),
        ('{"robot": "ur5"}', "a line is `[table]`"),
        ("a = [.49e6]\n", "numbers begin with a digit, 0.49"),
        ("a = 1,5\n", "numbers have a decimal point"),
        ("a = [1 2]\n", "commas stand between the values"),
    ],
)
def test_text_that_is_not_toml_is_answered_by_what_it_means(text: str, said: str) -> None:
    (found,) = refused(lambda: parse_model(Source("m.toml", text.encode())))
    assert found.code == "MOD001" and said in found.help


def test_long_lists_of_texts_stand_line_by_line(tmp_path: Path) -> None:
    names = [f"joint_offset.offset_rad[{j}]" for j in range(1, 7)]
    write_model(tmp_path / "m.toml", replace(default_model(), fit={"parameters": names, "version": "1"}))
    text = (tmp_path / "m.toml").read_text("utf-8")
    assert '\n    "joint_offset.offset_rad[2]",\n' in text
    assert read_model(tmp_path / "m.toml").fit["parameters"] == names
