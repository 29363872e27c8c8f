"""Model files: what they say, what is said about mistakes, and how they are written back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.cli.output import write_model
from postproc.diagnostics import Source
from postproc.effects.library.joints.backlash import Backlash
from postproc.model.doubts import doubts
from postproc.model.file import default_model, parse_model, read_model
from postproc.model.rewrite import render_model
from postproc.robot.catalogue import ARMS
from tests.build import refused
from tests.independent import arm as A

MODEL = """# our cell
robot = "irb4600_60_205"            # the big one
[mounting]
rpy_deg = [0, 180, 0]               # hangs from the gantry
[tool]
xyz_mm = [0, 0, 350.125]
[effects.joint_compliance]
compliance_rad_per_Nm = [4.2e-6, 3.0e-7, 3.6e-7, 2.1e-6, 1.9e-6, 2.6e-6]  # from spring
[effects.backlash]
half_gap_rad = [0, 1e-4, 9e-5, 0, 0, 0]
[fit]
noise_mm = 0.03
"""


def parsed(text: str = MODEL):
    return parse_model(Source("cell.toml", text.encode()))


def test_a_model_file_is_read():
    model = parsed()
    assert model.gravity == pytest.approx([0, 0, 9.81])
    assert model.T_flange_tcp[:3, 3] == pytest.approx([0, 0, 0.350125])
    assert [e.key for e in model.effects] == ["joint_compliance", "backlash"]
    assert model.effects[1].half_gap_rad[1] == 1e-4
    assert model.fit["noise_mm"] == 0.03


ROBOT, GAP, NOISE = 'robot = "irb4600_60_205"', "[0, 1e-4, 9e-5, 0, 0, 0]", "noise_mm = 0.03"
# What is replaced in the file by what, the code and the place of the first finding, and a part of what it says.
MISTAKES = [
    ("[mounting]", "[mountin]", "MOD002 3:2", "unknown key `mountin`"),
    ("rpy_deg = [0", "rpy = [0", "MOD002 4:1", "unknown key `rpy` did you mean `rpy_deg`? allowed here: `rpy_deg`"),
    ("xyz_mm", "xzy_mm", "MOD002 6:1", "did you mean `xyz_mm`? allowed here: `rpy_deg`, `xyz_mm`"),
    ("[0, 180, 0]", "[0, 180]", "MOD002 4:11", "`mounting.rpy_deg` has too few values"),
    ("[0, 0, 350.125]", '"long"', "MOD002 6:10", "`tool.xyz_mm`: input should be a valid"),
    (ROBOT, 'robot = "irb1"', "KIN006 2:9", "`irb1`"),
    (ROBOT, "robot = 3", "MOD002 2:9", "`robot`: input should be a valid string"),
    ("[effects.backlash]", "[effects.backlsh]", "MOD003 9:2", "did you mean `backlash`?"),
    ("half_gap_rad", "half_gap", "EFF021 10:1", "`half_gap`"),
    (GAP, "[0, 1e-4]", "EFF022 10:1", "`half_gap_rad`"),
    (GAP, "[0, 1e-4", "MOD001 11:1", "not TOML"),
    (GAP, "[0 1e-4]", "MOD001 10:19", "commas stand between the values"),
    (NOISE, "[fit]\n", "MOD001 12:5", "a table stands twice"),
    (NOISE, "rows = 1\nrows = 2\n", "MOD001 13:9", "a key stands twice"),
    (MODEL, '{"robot": "ur5"}', "MOD001 1:1", "a line is `[table]`"),
    (
        MODEL,
        "x;y\n1,5;2\n",
        "MOD001 1:1",
        "a table of measurements, not a TOML file `postproc fit cell.toml -o MODEL.toml`",
    ),
    (MODEL, "# my cell, arm 1\nrobot irb4600, hangs\n", "MOD001 2:7", "a line is `[table]`"),
    (NOISE, "noise_mm = .03", "MOD001 12:12", "numbers begin with a digit, 0.49"),
    (NOISE, "noise_mm = 0,03", "MOD001 12:13", "numbers have a decimal point"),
    (NOISE, 'covariance = "abc"', "MOD002 12:14", "`fit.covariance`: input should be a valid list"),
    (NOISE, 'covariance = ["1", "2 q"]', "MOD002 12:14", "`fit.covariance.1.1`: input should be a valid number"),
    (NOISE, 'covariance = ["1"]', "MOD002 12:14", "`fit.covariance`: 1 rows for 0 parameters"),
    (NOISE, "range = {q1 = [1]}", "MOD002 12:9", "`fit.range.q1` has too few values"),
    (NOISE, "range = {q1 = [2, 1]}", "MOD002 12:9", "`fit.range.q1`: the lowest value is above the highest"),
    (NOISE, "range = {q7 = [1, 2]}", "MOD002 12:9", "`fit.range.q7.[key]`: input should be 'q1', 'q2'"),
    (NOISE, "rang = {q1 = [1, 2]}", "MOD002 12:1", "unknown key `rang`"),
    (NOISE, 'parameters = ["a"]\ncorrelation = "AAAA"', "MOD002 13:15", "there is no `sigma` to it"),
    (NOISE, "sigma = [1]", "MOD002 12:9", "`fit.sigma`: 1 numbers for 0 parameters"),
    (NOISE, 'parameters = ["a"]\nsigma = []', "MOD002 13:9", "`fit.sigma`: 0 numbers for 1 parameters"),
    (NOISE, "correlation = 'ab!'", "MOD002 12:15", "the text is not base64 of compressed numbers"),
    (NOISE, "correlation = 'eNpjYIAAAAAIAAE='", "MOD002 12:15", "the text is not that of 0 parameters"),
    (NOISE, "unseen = [[1, 2]]", "MOD002 12:10", "`fit.unseen`: row 1 has 2 numbers, not 0"),
]


@pytest.mark.parametrize(("old", "new", "place", "says"), MISTAKES)
def test_mistakes_are_found_at_their_place(old, new, place, says):
    assert MODEL.count(old) == 1
    first = refused(lambda: parsed(MODEL.replace(old, new)))[0]
    assert f"{first.code} {first.place.removeprefix('cell.toml:')}" == place
    assert says in f"{first.message} {first.help}"


def test_a_fitted_value_is_doubted_where_it_is_surely_below_the_least():
    """Two standard deviations may lie below zero; where no fit notes how sure it is, nothing may."""
    least = "no arm has `compliance_rad_per_Nm[2] = -3e-07` of `joint_compliance`"
    text = MODEL.partition("[fit]")[0].replace("3.0e-7", "-3.0e-7")
    assert [d.message for d in refused(lambda: parsed(text))] == [least]
    for sigma, messages in ((2e-7, []), (1e-7, [least])):
        fit = f'[fit]\nparameters = ["joint_compliance.compliance_rad_per_Nm[2]"]\ncovariance = [[{sigma**2}]]\n'
        assert [d.message for *_, d in doubts(parsed(text + fit))] == messages


def test_writing_keeps_comments_and_changes_only_what_changed(tmp_path: Path):
    path = tmp_path / "cell.toml"
    path.write_text(MODEL, encoding="utf-8")
    model = read_model(path)
    assert render_model(model, MODEL) == MODEL
    effects = model.effects[0].with_vector(np.full(6, 1e-6)), Backlash(half_gap_rad=[0, 2e-4, 0, 0, 0, 0])
    write_model(path, replace(model, effects=effects, fit={"noise_mm": 0.02}))
    text, again = path.read_text(encoding="utf-8"), read_model(path)
    assert all(c in text for c in ("# our cell", "# the big one", "# hangs from the gantry", "# from spring"))
    assert again.effects[0].vector().tolist() == [1e-6] * 6
    assert again.effects[1].half_gap_rad[1] == 2e-4
    assert again.fit == {"noise_mm": 0.02}
    write_model(path, model.with_effects(model.effects[0]))
    assert [e.key for e in read_model(path).effects] == ["joint_compliance"]
    assert [p.name for p in tmp_path.iterdir()] == ["cell.toml"]


@pytest.mark.parametrize("rpy_deg", [(10, 90, 20), (0, -90, 0), (180, 0, 0), (5, 90 - 1e-7, -170), (12, -34, 156)])
def test_any_mounting_is_written_as_it_is(rpy_deg: tuple[float, ...]):
    """On a wall roll and yaw turn about one axis: roll is 0 then."""
    roll, pitch, yaw = (A.rotation(axis, np.radians(x)) for axis, x in zip(np.eye(3), rpy_deg, strict=True))
    R = yaw @ pitch @ roll
    again = parsed(render_model(replace(default_model("irb4600_60_205"), R_world_base=R)))
    np.testing.assert_allclose(again.R_world_base, R, atol=1e-9)
    written = render_model(again).partition("rpy_deg = ")[2]
    assert abs(rpy_deg[1]) != 90 or written.startswith("[0.0, ")


def test_a_new_file_reads_back_as_the_same_model(tmp_path: Path):
    names = [f"joint_offset.offset_rad[{j}]" for j in range(1, 7)]
    fit = {"parameters": names, "covariance": np.eye(6).tolist(), "version": "1"}
    path, model = tmp_path / "new.toml", replace(default_model("irb4600_60_205_seed"), fit=fit)
    write_model(path, model)
    write_model(path, replace(model, effects=(*model.effects, Backlash())))
    text = path.read_text("utf-8")
    assert "]\n\n[fit]\n" in text and '\n    "joint_offset.offset_rad[2]",\n' in text  # long lists line by line
    write_model(path, model)
    again = read_model(path)
    assert again.robot.name == "irb4600_60_205_seed"
    assert again.effects[0].vector() == pytest.approx(model.effects[0].vector(), abs=0)
    assert again.fit == fit


def test_a_robot_file_beside_the_model_is_found(tmp_path: Path):
    (tmp_path / "mine.toml").write_bytes((ARMS / "ur5.toml").read_bytes())
    (tmp_path / "cell.toml").write_text('robot = "mine.toml"\n', encoding="utf-8")
    assert read_model(tmp_path / "cell.toml").robot.name == "ur5"


def test_an_arm_of_unknown_stiffness_asks_for_a_fit():
    (finding,) = refused(lambda: default_model("ur10"))
    assert finding.code == "MOD004" and "postproc fit" in finding.help
    assert refused(lambda: read_model("nowhere.toml"))[0].code == "MOD001"


def test_a_file_without_effects_is_the_arm_of_the_library_as_it_stands():
    """And an empty table of effects is a rigid arm, also once it was written."""
    hangs = "[mounting]\nrpy_deg = [180, 0, 0]\n"
    for name, source in (("irb4600_60_205", "measured"), ("irb1200_5_09", "estimated")):
        model = parsed(f'robot = "{name}"\n{hangs}')
        assert model.stiffness_source == source and model.gravity[2] > 9.8
        assert [e.to_file() for e in model.effects] == [e.to_file() for e in default_model(name).effects] != []
        assert not parsed(render_model(model.with_effects())).effects
    assert not parsed(f'robot = "irb4600_60_205"\n{hangs}[effects]\n').effects
    assert not parsed(f'robot = "irb4600_60_205"\n{hangs}[fit]\nrows = 3\n').effects
    assert not parsed('robot = "ur10"\n').effects


def test_a_model_file_keeps_where_its_stiffness_comes_from():
    text = 'robot = "irb4600_40_255"\nstiffness_source = "estimated"\n[effects.joint_compliance]\n'
    model = parsed(text)
    assert model.stiffness_source == "estimated"
    assert 'stiffness_source = "estimated"' in render_model(model, text)
    fitted = replace(model, fit={"parameters": ["joint_compliance.compliance_rad_per_Nm[2]"], "covariance": ["1e-14"]})
    assert 'stiffness_source = "measured"' in render_model(fitted, text)
    assert "measured_springs = [2]" in render_model(fitted, text)
    assert default_model("irb4600_60_205").stiffness_source == "measured"
    assert default_model("irb1200_5_09").stiffness_source == "estimated"
