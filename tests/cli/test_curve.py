"""A law without a name, from a table to a corrected program by commands alone."""

from __future__ import annotations

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from postproc.identification import regions
from tests.independent import unknown_effects as strange
from tests.independent.hidden_effects import Plan, make_set

from .conftest import Call


def error_mm(predicted: Path, true: Path) -> float:
    """Root mean square per axis of predicted places."""
    places = []
    for path in (predicted, true):
        with path.open(newline="") as file:
            places.append([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)])
    return float(np.sqrt(np.mean((np.array(places[0]) - np.array(places[1])) ** 2)))


def test_a_law_without_a_name_is_diagnosed_added_and_compensated(
    call: Call, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(regions, "SEARCHED_REGIONS", 3)  # the same is said of fewer
    make_set(tmp_path, seed=401, plan=Plan([strange.angle_step]), noise_mm=0.02, poses=80)
    data, true = tmp_path / "fit.csv", tmp_path / "validate_true.csv"
    base, better, out = (tmp_path / name for name in ("base.toml", "better.toml", "out.mod"))
    effects = "instrument_frame,tool_frame,joint_offset,joint_compliance"
    assert call("fit", data, "--robot", "irb4600_60_205", "--effects", effects, "-o", base).code == 0
    told = call("diagnose", base, data)
    assert "verdict unknown" in told.out
    assert f"next: `postproc add {base} curve --data {data} -o BETTER.toml`" in told.err
    added = call("add", base, "curve", "--data", data, "-o", better, "--json")
    assert added.code == 0 and not any(
        x.startswith(("error", "warning", "info", "next")) for x in added.err.splitlines()
    )
    figures = json.loads(added.out)
    assert figures["rms_mm"] < 1.2 * figures["noise_mm"] < 0.6 * figures["before"]["rms_mm"]
    parts = figures["regions"]["left_out"]
    assert (
        parts["after_mm"] == figures["held_out_rms_mm"] < 0.3 * parts["before_mm"] and not figures["regions"]["local"]
    )
    law = call("effects", "show", "curve", "--model", better).out
    assert "mrad [q" in law and "In symbols: delta q" in told.out and law.split("mrad [")[1].split("]")[0] in told.out
    curve = tomllib.loads(better.read_text())["effects"]["curve"]
    assert curve["basis"][0] == "step" and curve["place"][0].startswith("joint")
    errors = []
    for model in (base, better):
        assert call("predict", model, true, "-o", tmp_path / "predicted.csv").code == 0
        errors.append(error_mm(tmp_path / "predicted.csv", true))
    assert errors[1] < 0.02 and errors[1] < 0.5 * errors[0]
    written = []
    for model in (base, better):
        assert call("compensate", samples / "paper_case.mod", "-m", model, "-o", out).code in (0, 1)
        written.append(out.read_text())
    assert written[0] != written[1]


def test_where_nothing_remains_no_curve_is_added(call: Call, tmp_path: Path) -> None:
    make_set(tmp_path, seed=402, plan=Plan([]), noise_mm=0.03, poses=60)
    data, base = tmp_path / "fit.csv", tmp_path / "base.toml"
    effects = "instrument_frame,tool_frame,joint_offset,joint_compliance"
    assert call("fit", data, "--robot", "irb4600_60_205", "--effects", effects, "-o", base).code == 0
    added = call("add", base, "curve", "--data", data)
    assert added.code == 1 and "DAT028" in added.err and "nothing that remains follows a channel" in added.err
