"""A table with an external axis through the commands: the cell is named once, and the model keeps it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.independent import external_axes as X


@pytest.fixture(scope="module")
def measured() -> X.Measured:
    return X.measured(X.askew, "track", "a", 9001)


def test_a_track_that_stands_askew(call: Call, measured: X.Measured, tmp_path: Path) -> None:
    table, true, cell, model, better = (tmp_path / n for n in ("t.csv", "true.csv", "cell.toml", "m.toml", "b.toml"))
    for path, text in ((table, measured.fit_csv), (true, measured.true_csv), (cell, measured.station.text)):
        path.write_text(text)
    call("fit", table, "--robot", "irb4600_60_205", "--cell", cell, "-o", model)
    written = tomllib.loads(model.read_text())["external_axes"]
    assert written[0]["axis"] == "a" and written[0]["carries"] == "robot" and written[0]["limits"] == [0.0, 4000.0]
    found = json.loads(call("diagnose", model, table, "--json").out)
    assert [m["effect"] for m in found["missing"]] == ["external_axis_frame"]
    call("add", model, "external_axis_frame", "--data", table, "-o", better)
    predicted = call("predict", better, true).out
    known, told = (
        np.genfromtxt(text.splitlines(), delimiter=",", names=True) for text in (measured.true_csv, predicted)
    )
    off = np.column_stack([known[name] - told[name] for name in ("x_mm", "y_mm", "z_mm")])
    assert np.sqrt(np.mean(off**2)) < 0.5 * measured.noise
    assert tomllib.loads(better.read_text())["external_axes"] == written
    poses = call("plan", better, table, "-n", 4, "--rapid", tmp_path / "visit.mod").out.splitlines()
    first = f"{float(poses[1].rpartition(',')[2]):.3f}"
    assert f"[{first},9E9,9E9,9E9,9E9,9E9]" in (tmp_path / "visit.mod").read_text()
    assert poses[0].endswith(",eax_a") and all(0 <= float(row.rpartition(",")[2]) <= 4000 for row in poses[1:])
    told = json.loads(call("compare", better, table, "--json").out)
    assert told["rms_mm"] < 1.2 * measured.noise
    before, _, after = better.read_text().partition("[[external_axes]]")
    better.write_text(before + after[after.index("\n[") + 1 :])  # a model that does not know its cell
    assert json.loads(call("compare", better, table, "--cell", cell, "--json").out) == told
