"""Commands on models, on cells that independent code simulates: the error falls, and what is odd is said."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.estimation import test_wrong_rows
from tests.independent import external_axes as X
from tests.independent import library_effects as hidden
from tests.independent.hidden_effects import Plan, make_set

from .conftest import ARM, Call

BASE = "instrument_frame,tool_frame,joint_offset,joint_compliance"
NOISE_MM = 0.03


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``fit.csv`` and ``validate_true.csv`` of an arm with backlash."""
    folder = tmp_path_factory.mktemp("cell")
    make_set(folder, seed=5, plan=Plan([hidden.backlash]), noise_mm=NOISE_MM, poses=120)
    return folder


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def write_rows(path: Path, rows: list[dict[str, str]], without: tuple[str, ...] = ()) -> Path:
    names = [name for name in rows[0] if name not in without]
    lines = [",".join(names), *(",".join(row[name] for name in names) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def positions(path: Path) -> np.ndarray:
    return np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows_of(path)])


def is_near(predicted: Path, true: Path) -> bool:
    """Whether places that a fitted model predicts are better than the instrument."""
    assert [row["pose_id"] for row in rows_of(predicted)] == [row["pose_id"] for row in rows_of(true)]
    return bool(np.sqrt(np.mean((positions(predicted) - positions(true)) ** 2)) < 0.6 * NOISE_MM)


def document(call: Call, *words: str | Path) -> dict[str, Any]:
    outcome = call(*words, "--json")
    assert outcome.code == 0, outcome.err
    found: dict[str, Any] = json.loads(outcome.out)
    return found


def test_the_error_falls_when_the_missing_effect_is_added(call: Call, cell: Path, tmp_path: Path) -> None:
    base, better, data, page = (*(tmp_path / name for name in ("base.toml", "better.toml")), cell / "fit.csv", tmp_path)
    assert document(call, "fit", data, *ARM, "--effects", BASE, "-o", base)["schema"] == "postproc/fit/1"
    base.write_text("# our cell\n" + base.read_text())
    compared = document(call, "compare", base, data, "--report", page / "compare.html")
    assert compared["schema"] == "postproc/compare/1"
    assert compared["noise_mm"] == pytest.approx(NOISE_MM, rel=0.5) and compared["rms_mm"] > 1.5 * NOISE_MM
    diagnosed = document(call, "diagnose", base, data, "--report", page / "diagnose.html")
    assert (diagnosed["verdict"], [m["effect"] for m in diagnosed["missing"]]) == ("missing", ["backlash"])
    for name, words in (("compare.html", "from where the model says"), ("diagnose.html", "backlash")):
        assert words in (page / name).read_text("utf-8").split('class="sentence">')[1].split("</p>")[0]
    added = document(call, "add", base, "backlash", "--data", data, "-o", better)
    assert 1.5 * added["held_out_rms_mm"] < added["before"]["held_out_rms_mm"]
    assert added["held_out_rms_mm"] < 1.4 * NOISE_MM
    assert better.read_text().startswith("# our cell\n")
    assert call("predict", better, cell / "validate_true.csv", "-o", tmp_path / "out.csv").code == 0
    assert is_near(tmp_path / "out.csv", cell / "validate_true.csv")


def test_too_few_poses_are_followed_by_more_poses(call: Call, cell: Path, tmp_path: Path) -> None:
    few, base = write_rows(tmp_path / "few.csv", rows_of(cell / "fit.csv")[:9]), tmp_path / "base.toml"
    assert call("fit", few, *ARM, "--effects", BASE, "-o", base).code == 0
    diagnosed = call("diagnose", base, few)
    assert diagnosed.out.startswith("Too few poses to tell") and "compensate" not in diagnosed.err
    assert f"next: `postproc plan {base} {few} -o POSES.csv` chooses them" in diagnosed.err


def test_a_fit_without_the_frame_of_the_instrument_is_told_so(call: Call, cell: Path, tmp_path: Path) -> None:
    outcome = call("fit", cell / "fit.csv", *ARM, "--effects", "tool_frame,joint_offset", "-o", tmp_path / "m.toml")
    assert outcome.code == 0 and "warning[DAT030]: without `instrument_frame` the model misses" in outcome.err


def test_heights_that_are_not_this_arms_give_no_model(call: Call, cell: Path, tmp_path: Path) -> None:
    """One coordinate cannot be held against the nominal arm: what the fit leaves says that it is another table."""
    rows, model = rows_of(cell / "fit.csv"), tmp_path / "m.toml"
    heights = [row["z_mm"] for row in rows]
    rows = [{**row, "z_mm": z} for row, z in zip(rows, [*heights[40:], *heights[:40]], strict=True)]
    outcome = call("fit", write_rows(tmp_path / "other.csv", rows, ("x_mm", "y_mm")), *ARM, "-o", model)
    assert outcome.code == 2 and not model.exists()
    assert "error[DAT009]: half of the rows lie over" in outcome.err and "from the fitted model" in outcome.err


def test_tables_of_two_days_are_one(call: Call, cell: Path, tmp_path: Path) -> None:
    """The second day the instrument stands a metre away; a row that was read wrongly is named with its file."""
    rows, middle = rows_of(cell / "fit.csv"), 2 * len(rows_of(cell / "fit.csv")) // 3
    later = [{**row, "x_mm": f"{float(row['x_mm']) + 1000 + 30 * (i == 4):.4f}"} for i, row in enumerate(rows[middle:])]
    monday, friday = write_rows(tmp_path / "monday.csv", rows[:middle]), write_rows(tmp_path / "friday.csv", later)
    model, better = tmp_path / "two.toml", tmp_path / "better.toml"
    fitted = call("fit", monday, friday, *ARM, "-o", model)
    assert fitted.code == 0 and f"Row 5 of {friday} was left out" in fitted.err + fitted.out, fitted.err
    assert str(friday) in fitted.err.split("next:")[1]
    text = model.read_text()
    assert 'session = ["friday"]' in text and 'data = ["monday.csv", "friday.csv"]' in text
    compared = document(call, "compare", model, monday, friday)
    assert compared["rows"] == len(rows) and compared["worst"][0]["file"] == str(friday)
    added = document(call, "add", model, "backlash", "--data", monday, "--data", friday, "-o", better)
    assert added["set_aside_rows"] == [5] and added["set_aside_files"] == [str(friday)]
    assert added["held_out_rms_mm"] < 1.4 * NOISE_MM
    assert {row["without"] for row in added["leave_one_out"]} == {"joint_offset", "joint_compliance", "backlash"}
    call("predict", better, cell / "validate_true.csv", "-o", tmp_path / "out.csv")
    assert is_near(tmp_path / "out.csv", cell / "validate_true.csv")


def test_a_gauge_along_one_axis_tells_what_it_can(call: Call, cell: Path, tmp_path: Path) -> None:
    """Figures of heights alone are those of the heights, and nowhere stands what nobody measured."""
    model, places, page, rows = (*(tmp_path / n for n in ("m.toml", "out.csv", "z.html")), rows_of(cell / "fit.csv"))
    assert call("fit", cell / "fit.csv", *ARM, "-o", model).code == 0
    assert call("predict", model, cell / "fit.csv", "-o", places).code == 0
    heights = write_rows(tmp_path / "z.csv", rows, ("x_mm", "y_mm"))
    compared = document(call, "compare", model, heights, "--report", page)
    off = (positions(cell / "fit.csv") - positions(places))[:, 2]
    assert compared["rms_mm"] == pytest.approx(np.sqrt(np.mean(off**2)), abs=2e-5)
    assert compared["maximum_mm"] == pytest.approx(np.abs(off).max(), abs=2e-5)
    poses = np.array([row["pose_id"] for row in rows])
    by_pose = [abs(off[poses == pose].mean()) for pose in set(poses)]
    assert compared["iso9283"]["accuracy_mean_mm"] == pytest.approx(np.mean(by_pose), abs=1e-4)
    assert list(compared["per_axis_mm"]) == ["z"] and compared["bound_mm"] < 0.5 * compared["rms_mm"]
    assert {c["channel"] for c in compared["channels"]} >= {"dir5", "q2", "load3"}
    shown = call("compare", model, heights)
    assert "along z alone" in shown.err and "says along z," in shown.out
    packed = r"<script.*?</script>|&quot;data&quot;:&quot;[^&]*&quot;"
    without_scripts = re.sub(packed, "", page.read_text("utf-8"), flags=re.DOTALL)
    assert "nan" not in (shown.out + without_scripts).lower()


def test_an_arm_that_hangs_is_fitted_as_it_hangs(call: Call, tmp_path: Path) -> None:
    make_set(tmp_path, seed=8, plan=Plan(hung=True), noise_mm=NOISE_MM, poses=80)
    data, model, true = tmp_path / "fit.csv", tmp_path / "hung.toml", tmp_path / "validate_true.csv"
    standing = call("fit", data, *ARM, "-o", model)
    assert (
        "would be negative" in standing.out and "where the arm hangs, `postproc fit --mounting 180,0,0`" in standing.out
    )
    assert "warning[DAT026]" in standing.err and "next:" not in standing.err and "contradicted = [" in model.read_text()
    fitted = call("fit", data, *ARM, "--mounting", "180,0,0", "-o", model)
    assert "contradicted" not in model.read_text()
    assert fitted.code == 0 and "is negative" not in fitted.out
    assert "rpy_deg = [180.0, 0.0, 0.0]" in model.read_text()
    call("predict", model, true, "-o", tmp_path / "out.csv")
    assert is_near(tmp_path / "out.csv", true)


@pytest.mark.parametrize(
    ("kind", "noise", "poses"),
    [(hidden.backlash, 1.0, 25), (hidden.gravity_compensator, 0.03, 60)],
)
def test_every_model_that_is_written_is_taken(
    call: Call, samples: Path, tmp_path: Path, kind: Callable[..., Any], noise: float, poses: int
) -> None:
    """Also where so few rows are so loud that they alone would have springs negative."""
    make_set(tmp_path, 8801, Plan([kind]), noise, poses)
    table, model, better = tmp_path / "fit.csv", tmp_path / "m.toml", tmp_path / "b.toml"
    assert call("fit", table, *ARM, "-o", model).code == 0
    assert call("add", model, kind.__name__, "--data", table, "-o", better).code == 0
    for file in (model, better):
        done = call("compensate", samples / "paper_case.mod", "-m", file, "-o", tmp_path / "out.mod")
        assert done.code == 0, done.err


def test_rows_that_cannot_be_right_stand_in_the_document_and_in_no_figure(call: Call, tmp_path: Path) -> None:
    rows, model = tmp_path / "rows.csv", tmp_path / "model.toml"
    wrong = (test_wrong_rows.table(rows, 12) + 1).tolist()
    outcome = call("fit", rows, *ARM, "--json")
    fitted = json.loads(outcome.out)
    assert fitted["set_aside_rows"] == wrong and fitted["rows"] == test_wrong_rows.N
    assert outcome.code == 0 and "12 of 224 rows" in outcome.err
    call("fit", rows, *ARM, "-o", model)
    compared = document(call, "compare", model, rows)
    assert compared["set_aside_rows"] == wrong and compared["rms_mm"] < 0.04
    assert {x["row"] for x in compared["worst"]} <= set(wrong)


def test_a_model_farther_off_than_the_nominal_arm_is_not_written(call: Call, tmp_path: Path) -> None:
    """Who insists on rows that cannot be right gets no model."""
    test_wrong_rows.table(tmp_path / "rows.csv", 60)
    outcome = call("fit", tmp_path / "rows.csv", *ARM, "--accept", "DAT007", "-o", tmp_path / "model.toml")
    assert outcome.code == 1 and "DAT039" in outcome.err and not (tmp_path / "model.toml").exists()


def test_a_track_that_stands_askew_is_named_once_and_the_model_keeps_it(call: Call, tmp_path: Path) -> None:
    measured = X.measured(X.askew, "track", "a", 9001)
    files = {"t.csv": measured.fit_csv, "true.csv": measured.true_csv, "cell.toml": measured.station.text}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    table, true, cell, model, better, visit = (tmp_path / n for n in (*files, "m.toml", "b.toml", "visit.mod"))
    call("fit", table, *ARM, "--cell", cell, "-o", model)
    (axis,) = written = tomllib.loads(model.read_text())["external_axes"]
    assert (axis["axis"], axis["carries"], axis["limits"]) == ("a", "robot", [0.0, 4000.0])
    assert [m["effect"] for m in document(call, "diagnose", model, table)["missing"]] == ["external_axis_frame"]
    call("add", model, "external_axis_frame", "--data", table, "-o", better)
    assert tomllib.loads(better.read_text())["external_axes"] == written
    call("predict", better, true, "-o", tmp_path / "out.csv")
    off = positions(true) - positions(tmp_path / "out.csv")
    assert np.sqrt(np.mean(off**2)) < 0.5 * measured.noise
    head, *poses = call("plan", better, table, "-n", "4", "--rapid", visit).out.splitlines()
    places = [float(row.rpartition(",")[2]) for row in poses]
    assert head.endswith(",eax_a") and all(0 <= place <= 4000 for place in places)
    assert f"[{places[0]:.3f},9E9,9E9,9E9,9E9,9E9]" in visit.read_text()
    compared = document(call, "compare", better, table)
    assert compared["rms_mm"] < 1.2 * measured.noise
    before, _, after = better.read_text().partition("[[external_axes]]")
    better.write_text(before + after[after.index("\n[") + 1 :])  # a model that does not know its cell
    assert document(call, "compare", better, table, "--cell", cell) == compared
