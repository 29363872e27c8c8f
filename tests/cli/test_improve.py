"""``fit``, ``compare``, ``diagnose``, ``add`` and ``predict`` on a cell simulated by independent code."""

from __future__ import annotations

import csv
import json
import re
import shlex
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions
from postproc.report.blocks import Document
from tests.independent import library_effects as hidden
from tests.independent.hidden_effects import Plan, make_set

from .conftest import Call

BASE = "instrument_frame,tool_frame,joint_offset,joint_compliance"
NOISE_MM = 0.03


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``fit.csv`` and ``validate_true.csv`` of an arm with backlash."""
    folder = tmp_path_factory.mktemp("cell")
    make_set(folder, seed=5, plan=Plan([hidden.backlash]), noise_mm=NOISE_MM, poses=120)
    return folder


def positions(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return [row["pose_id"] for row in rows], np.array([[float(row[f"{a}_mm"]) for a in "xyz"] for row in rows])


def test_too_few_poses_are_followed_by_more_poses(call: Call, cell: Path, tmp_path: Path) -> None:
    few, base = tmp_path / "few.csv", tmp_path / "base.toml"
    few.write_text("\n".join((cell / "fit.csv").read_text().splitlines()[:10]) + "\n")
    assert call("fit", few, "--robot", "irb4600_60_205", "--effects", BASE, "-o", base).code == 0
    diagnosed = call("diagnose", base, few)
    assert diagnosed.out.startswith("Too few poses to tell")
    assert f"next: `postproc plan {base} {few} -o POSES.csv` chooses them" in diagnosed.err
    assert "compensate" not in diagnosed.err


def test_the_error_falls_when_the_missing_effect_is_added(call: Call, cell: Path, tmp_path: Path) -> None:
    base, better = tmp_path / "base.toml", tmp_path / "better.toml"
    data = cell / "fit.csv"
    fitted = call("fit", data, "--robot", "irb4600_60_205", "--effects", BASE, "-o", base, "--json")
    assert fitted.code == 0, fitted.err
    assert json.loads(fitted.out)["schema"] == "postproc/fit/1"
    base.write_text("# our cell\n" + base.read_text())

    compared = call("compare", base, data, "--json", "--report", tmp_path / "compare.html")
    assert compared.code == 0, compared.err
    figures = json.loads(compared.out)
    assert figures["schema"] == "postproc/compare/1"
    assert figures["noise_mm"] == pytest.approx(NOISE_MM, rel=0.5)
    assert figures["rms_mm"] > 1.5 * NOISE_MM

    diagnosed = call("diagnose", base, data, "--json", "--report", tmp_path / "diagnose.html")
    assert diagnosed.code == 0, diagnosed.err
    document = json.loads(diagnosed.out)
    assert document["verdict"] == "missing"
    assert [m["effect"] for m in document["missing"]] == ["backlash"]
    for name, words in (("compare.html", "from where the model says"), ("diagnose.html", "backlash")):
        page = (tmp_path / name).read_text("utf-8")
        assert words in page.split('class="sentence">')[1].split("</p>")[0]

    added = call("add", base, "backlash", "--data", data, "-o", better, "--json")
    assert added.code == 0, added.err
    ladder = json.loads(added.out)
    assert ladder["held_out_rms_mm"] < 1.4 * NOISE_MM
    assert ladder["before"]["held_out_rms_mm"] > 1.5 * ladder["held_out_rms_mm"]
    assert better.read_text().startswith("# our cell\n")

    predicted = tmp_path / "predicted.csv"
    assert call("predict", better, cell / "validate_true.csv", "-o", predicted).code == 0
    names, places = positions(predicted)
    true_names, truth = positions(cell / "validate_true.csv")
    assert names == true_names
    assert np.sqrt(np.mean((places - truth) ** 2)) < 0.6 * NOISE_MM


OWN = '''
import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, State, param


class Play(Effect, reads=("approach",)):
    """Joints stop short on the side from which they came."""

    play_rad: Array = param(unit="rad", shape=(6,), typical=1e-4)

    def displacement(self, state: State) -> Array:
        return -self.play_rad * state.approach
'''


def test_an_effect_of_the_users_own_works_in_every_command(
    call: Call, cell: Path, samples: Path, tmp_path: Path
) -> None:
    file, base, better = tmp_path / "own.py", tmp_path / "base.toml", tmp_path / "better.toml"
    file.write_text(OWN)
    data = cell / "fit.csv"
    assert call("fit", data, "--robot", "irb4600_60_205", "--effects", f"{BASE},{file}", "-o", better).code == 0
    assert "[effects.play]" in better.read_text()
    assert call("fit", data, "--robot", "irb4600_60_205", "--effects", BASE, "-o", base).code == 0
    added = call("add", base, "play", "--data", data, "--effects", file, "--json")
    assert added.code == 0, added.err
    assert json.loads(added.out)["held_out_rms_mm"] < 1.4 * NOISE_MM
    assert call("compare", better, data, "--effects", file).code == 0
    assert call("predict", better, data, "--effects", file, "-o", tmp_path / "p.csv").code == 0
    assert (
        call("compensate", samples / "corner_arc.mod", "-m", better, "--effects", file, "-o", tmp_path / "c.mod").code
        == 0
    )
    unknown = call("compare", better, data)
    assert unknown.code == 2
    assert "error[MOD003]: there is no effect `play`" in unknown.err


def test_poses_that_would_tell_two_effects_apart(call: Call, cell: Path, tmp_path: Path) -> None:
    model, poses, program = tmp_path / "m.toml", tmp_path / "poses.csv", tmp_path / "measure.mod"
    data = cell / "fit.csv"
    assert call("fit", data, "--robot", "irb4600_60_205", "--effects", f"{BASE},backlash", "-o", model).code == 0
    pair = ("--between", "backlash,arm_load")
    outcome = call("plan", model, data, *pair, "-n", "7", "-o", poses, "--rapid", program, "--json")
    assert outcome.code == 0, outcome.err
    document = json.loads(outcome.out)
    assert document["schema"] == "postproc/plan/1"
    assert document["after"] > document["before"]
    assert len(poses.read_text().splitlines()) == 8
    shown = json.loads(call("inspect", program, "--json").out)
    assert [row["instruction"] for row in shown["statements"]] == ["MoveAbsJ"] * 14
    assert shown["diagnostics"] == []
    for wrong in ("arm_load", "arm_load,arm_load", "a,b,c"):
        assert "error[CLI010]" in call("plan", model, data, "--between", wrong).err


def test_the_next_command_reads_the_table_in_the_same_way(call: Call, cell: Path, tmp_path: Path) -> None:
    fitted = call(
        "fit", cell / "fit.csv", "--robot", "irb4600_60_205", "--effects", BASE, "--noise", "0.03", "-o", tmp_path / "m"
    )
    assert f"`postproc diagnose {tmp_path / 'm'} {cell / 'fit.csv'} --noise 0.03`" in fitted.err
    read = MeasuredOptions(columns="my map.toml", program="p.mod", side_files=(Path("u.sys"),)).words()
    assert read == ["--program", "p.mod", "--columns", "my map.toml", "--with", "u.sys"]
    assert ArmOptions(effects=(Path("own.py"),), cell=Path("c.toml")).words() == [
        "--effects",
        "own.py",
        "--cell",
        "c.toml",
    ]
    assert MeasuredOptions(noise=0.03).sigma == pytest.approx(3e-5)


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """What `diagnose` finds, as the test fills it in: nothing is missing."""
    state = SimpleNamespace(approach=1, payload_mass=1)
    base = SimpleNamespace(held_out_rms=1e-4, data=SimpleNamespace(state=state))
    fields = {"missing": (), "suspects": (), "beside": (), "untold": False, "misleading": False, "verdict": "missing"}
    result = SimpleNamespace(diagnostics=(), base=base, **fields)
    shown = Document(title="", values={"schema": "postproc/diagnose/1"}, sentence="The model lacks ..")
    monkeypatch.setattr("postproc.results.diagnosis.diagnosis_document", lambda *_: shown)
    monkeypatch.setattr("postproc.identification.diagnose.diagnose", lambda *_, **__: result)
    return result


def lacking(key: str, rivals: tuple[str, ...], after: float) -> SimpleNamespace:
    return SimpleNamespace(key=key, not_separable=rivals, held_out_after=after)


def test_a_diagnosis_ends_with_the_commands_that_follow(
    call: Call, cell: Path, samples: Path, found: SimpleNamespace
) -> None:
    # The last effect is worth next to nothing, which the sentence says: no command adds it.
    rivals = ("payload_error", "dress_pack")
    found.missing = [lacking("arm_load", rivals, 6e-5), lacking("backlash", (), 3e-5), lacking("x", (), 2.98e-5)]
    model, data = samples / "models" / "irb4600_60_205.toml", cell / "fit.csv"
    outcome = call("diagnose", model, data, "--noise", "0.05")
    assert (outcome.code, outcome.out) == (0, "The model lacks ..\n")
    model, data = shlex.quote(str(model)), shlex.quote(str(data))
    assert outcome.err.splitlines()[1:] == [
        f"next: `postproc add {model} arm_load backlash --data {data} --noise 0.05 -o BETTER.toml` writes the model that "
        "has them",
        f"or: `postproc plan {model} {data} --between arm_load,payload_error --noise 0.05 -o POSES.csv` chooses poses that "
        "tell them apart",
    ]


def test_the_command_that_follows_a_draft_adds_it_with_what_has_a_name(
    call: Call, cell: Path, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: SimpleNamespace
) -> None:
    found.missing, found.verdict = [lacking("backlash", ("servo_lag",), 6e-5)], "unknown"
    found.suspects = [SimpleNamespace(share=0.95, drafts=True)]
    monkeypatch.setattr("postproc.render.effect_file.effect_file", lambda *_: ("own", "# what remains"))
    model, data, own = samples / "models" / "irb4600_60_205.toml", cell / "fit.csv", tmp_path / "own.py"
    lines = call("diagnose", model, data, "--draft", own).err.splitlines()[1:]
    model, data, own = (shlex.quote(str(path)) for path in (model, data, own))
    assert lines == [
        f"next: `postproc add {model} backlash own --data {data} --effects {own} -o BETTER.toml` adds what was found, the "
        "draft included",
        f"or: `postproc plan {model} {data} --between backlash,servo_lag -o POSES.csv` chooses poses that tell them apart",
    ]


def test_what_follows_can_be_copied_into_a_shell(
    call: Call, cell: Path, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: SimpleNamespace
) -> None:
    found.verdict = "complete"
    monkeypatch.setattr("postproc.identification.diagnosis.too_few", lambda *_: False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my cell.toml").write_bytes((samples / "models" / "irb4600_60_205.toml").read_bytes())
    first, then = call("diagnose", "my cell.toml", cell / "fit.csv").err.split("\n", 1)
    command = "next: `postproc compensate PROGRAM -m 'my cell.toml' -o OUT` corrects a program with this model\n"
    assert first == "arm `irb4600_60_205`; effects joint_compliance; noise from the table; model `my cell.toml`"
    assert then == command
    (tmp_path / "play.py").write_text(OWN)
    own = call("diagnose", "my cell.toml", cell / "fit.csv", "--noise", "0.05", "--effects", "play.py")
    assert "; noise 0.05 mm per axis; " in own.err.splitlines()[0]
    assert own.err.split("\n", 1)[1] == command.replace("-o OUT", "--effects play.py -o OUT")
    drafted = call("diagnose", "my cell.toml", cell / "fit.csv", "--draft", "own.py")
    assert drafted.err.splitlines()[1].startswith("info[DAT028]")
    assert not (tmp_path / "own.py").exists()


def test_what_has_no_name_becomes_an_effect_of_the_users_own(call: Call, samples: Path, tmp_path: Path) -> None:
    data, base, own = samples / "measurements" / "simulated_step.csv", tmp_path / "m.toml", tmp_path / "wrist step.py"
    call("fit", data, "--robot", "irb4600_60_205", "-o", base)
    outcome = call("diagnose", base, data, "--draft", own)
    assert "joint 4 and follows q4 (step near" in outcome.out
    words = shlex.split(outcome.err.split("next: `")[1].split("`")[0])
    assert words[:4] == ["postproc", "add", str(base), "wrist_step"]
    added = call(*words[1:-2], "-o", tmp_path / "better.toml", "--json")
    assert added.code == 0 and not re.search(r"^(error|warning|info|next)\b", added.err, re.MULTILINE)
    document = json.loads(added.out)
    assert document["rms_mm"] < 1.2 * document["noise_mm"] < 0.6 * document["before"]["rms_mm"]
    # The draft was chosen on all rows of this table: none is held out of it.
    assert document["held_out_rms_mm"] is None and document["before"]["held_out_rms_mm"] is not None
    assert "held_out_rms_mm" not in tomllib.loads((tmp_path / "better.toml").read_text("utf-8"))["fit"]


def test_a_fit_without_the_frame_of_the_instrument_is_told_so(call: Call, cell: Path, tmp_path: Path) -> None:
    fit, model = ("fit", cell / "fit.csv", "--robot", "irb4600_60_205", "--effects"), tmp_path / "m.toml"
    outcome = call(*fit, "backlash", "-o", model)
    assert outcome.code == 2 and not model.exists()
    assert outcome.err.splitlines()[1].startswith(
        "error[DAT030]: without `instrument_frame` and `tool_frame` the model misses"
    )
    outcome = call(*fit, "tool_frame,joint_offset", "-o", model)
    assert outcome.code == 0 and model.exists()
    assert outcome.err.splitlines()[1].startswith("warning[DAT030]: without `instrument_frame` the model misses")


def test_heights_that_are_not_this_arms_give_no_model(call: Call, cell: Path, tmp_path: Path) -> None:
    """One coordinate cannot be held against the nominal arm: what the fit leaves says that it is another table."""
    rows = list(csv.reader((cell / "fit.csv").read_text("utf-8").splitlines()))
    x, y, z = (rows[0].index(name) for name in ("x_mm", "y_mm", "z_mm"))
    heights = [row[z] for row in rows[1:]]
    for row, other in zip(rows[1:], [*heights[40:], *heights[:40]], strict=True):
        row[z] = other
    table, model = tmp_path / "other.csv", tmp_path / "m.toml"
    table.write_text("\n".join(",".join(c for k, c in enumerate(row) if k not in (x, y)) for row in rows), "utf-8")
    outcome = call("fit", table, "--robot", "irb4600_60_205", "-o", model)
    assert outcome.code == 2 and not model.exists()
    assert "error[DAT009]: half of the rows lie over" in outcome.err and "from the fitted model" in outcome.err


def test_an_effect_that_the_model_holds_is_fitted_again_and_told(call: Call, cell: Path, tmp_path: Path) -> None:
    base, again = tmp_path / "base.toml", tmp_path / "again.toml"
    call("fit", cell / "fit.csv", "--robot", "irb4600_60_205", "--effects", f"{BASE},backlash", "-o", base)
    outcome = call("add", base, "backlash,servo_lag", "--data", cell / "fit.csv", "-o", again)
    assert (outcome.code, "DAT021" in outcome.err) == (2, True)  # both were read: there is no speed in the table
    outcome = call("add", base, "backlash", "--data", cell / "fit.csv", "-o", again)
    assert outcome.err.splitlines()[1] == "info[DAT029]: `backlash` is in the model: it is fitted again"
    assert outcome.out.startswith("Adding `backlash` does not help")
    assert "next:" not in outcome.err


def test_tables_of_two_days_are_one(call: Call, cell: Path, tmp_path: Path) -> None:
    """The second day the instrument stands a metre away; a row that was read wrongly is named with its file."""
    lines = (cell / "fit.csv").read_text().splitlines()
    middle = len(lines) * 2 // 3
    x = lines[0].split(",").index("x_mm")

    def shifted(line: str, by: float) -> str:
        cells = line.split(",")
        return ",".join([*cells[:x], f"{float(cells[x]) + by:.4f}", *cells[x + 1 :]])

    later = [shifted(line, 1000.0) for line in lines[middle:]]
    later[4] = shifted(later[4], 30.0)
    days = [tmp_path / "monday.csv", tmp_path / "friday.csv"]
    for path, rows in zip(days, (lines[1:middle], later), strict=True):
        path.write_text("\n".join([lines[0], *rows]) + "\n")

    model, better = tmp_path / "two.toml", tmp_path / "better.toml"
    fitted = call("fit", *days, "--robot", "irb4600_60_205", "-o", model)
    assert fitted.code == 0, fitted.err
    assert f"Row 5 of {days[1]} was left out" in fitted.err + fitted.out
    assert str(days[1]) in fitted.err.split("next:")[1]
    text = model.read_text()
    assert 'session = ["friday"]' in text and 'data = ["monday.csv", "friday.csv"]' in text
    compared = json.loads(call("compare", model, *days, "--json").out)
    assert compared["rows"] == len(lines) - 1 and compared["worst"][0]["file"] == str(days[1])
    added = call("add", model, "backlash", "--data", days[0], "--data", days[1], "-o", better, "--json")
    document = json.loads(added.out)
    assert document["set_aside_rows"] == [5] and document["set_aside_files"] == [str(days[1])]
    assert document["held_out_rms_mm"] < 1.4 * NOISE_MM
    assert {row["without"] for row in document["leave_one_out"]} == {"joint_offset", "joint_compliance", "backlash"}
    places = tmp_path / "predicted.csv"
    assert call("predict", better, cell / "validate_true.csv", "-o", places).code == 0
    assert np.sqrt(np.mean((positions(places)[1] - positions(cell / "validate_true.csv")[1]) ** 2)) < 0.6 * NOISE_MM


def test_a_gauge_along_one_axis_tells_what_it_can(call: Call, cell: Path, tmp_path: Path) -> None:
    """Figures of heights alone are those of the heights, and nowhere stands what nobody measured."""
    model, heights, places = tmp_path / "base.toml", tmp_path / "z.csv", tmp_path / "predicted.csv"
    assert call("fit", cell / "fit.csv", "--robot", "irb4600_60_205", "-o", model).code == 0
    assert call("predict", model, cell / "fit.csv", "-o", places).code == 0
    rows = list(csv.DictReader((cell / "fit.csv").read_text().splitlines()))
    with heights.open("w", newline="") as file:
        writer = csv.DictWriter(file, [name for name in rows[0] if name not in ("x_mm", "y_mm")], extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    found = call("compare", model, heights, "--json", "--report", tmp_path / "z.html")
    assert found.code == 0 and "along z alone" in found.err
    document = json.loads(found.out)
    off = positions(cell / "fit.csv")[1][:, 2] - positions(places)[1][:, 2]
    assert document["rms_mm"] == pytest.approx(np.sqrt(np.mean(off**2)), abs=2e-5)
    assert document["maximum_mm"] == pytest.approx(np.abs(off).max(), abs=2e-5)
    assert list(document["per_axis_mm"]) == ["z"]
    by_pose = [
        np.mean([o for o, r in zip(off, rows, strict=True) if r["pose_id"] == p]) for p in {r["pose_id"] for r in rows}
    ]
    assert document["iso9283"]["accuracy_mean_mm"] == pytest.approx(np.mean(np.abs(by_pose)), abs=1e-4)
    assert document["bound_mm"] < 0.5 * document["rms_mm"]
    assert {c["channel"] for c in document["channels"]} >= {"dir5", "q2", "load3"}
    text = call("compare", model, heights)
    assert "says along z," in text.out and "nan" not in text.out.lower()
    page = (tmp_path / "z.html").read_text("utf-8")
    assert "nan" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL).lower()


def test_an_arm_that_hangs_is_fitted_as_it_hangs(call: Call, tmp_path: Path) -> None:
    make_set(tmp_path, seed=8, plan=Plan(hung=True), noise_mm=NOISE_MM, poses=80)
    data, model = tmp_path / "fit.csv", tmp_path / "hung.toml"
    standing = call("fit", data, "--robot", "irb4600_60_205", "-o", model)
    assert "is negative" in standing.out and "where the arm hangs, `postproc fit --mounting 180,0,0`" in standing.out
    fitted = call("fit", data, "--robot", "irb4600_60_205", "--mounting", "180,0,0", "-o", model)
    assert fitted.code == 0 and "is negative" not in fitted.out
    assert "rpy_deg = [180.0, 0.0, 0.0]" in model.read_text()
    assert call("predict", model, tmp_path / "validate_true.csv", "-o", tmp_path / "out.csv").code == 0
    _, predicted = positions(tmp_path / "out.csv")
    _, true = positions(tmp_path / "validate_true.csv")
    assert np.sqrt(np.mean((predicted - true) ** 2)) < 0.6 * NOISE_MM
