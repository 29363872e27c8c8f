"""Commands on tables some of whose rows cannot be right."""

from __future__ import annotations

import json

from tests.estimation.test_wrong_rows import N, table


def test_rows_that_are_left_out_stand_in_the_document(call, tmp_path):
    wrong = table(tmp_path / "rows.csv", 12)
    found = call("fit", tmp_path / "rows.csv", "--robot", "irb4600_60_205", "--json")
    document = json.loads(found.out)
    assert found.code == 0 and document["set_aside_rows"] == (wrong + 1).tolist() and document["rows"] == N
    assert "12 of 224 rows" in found.err
    model = tmp_path / "model.toml"
    call("fit", tmp_path / "rows.csv", "--robot", "irb4600_60_205", "-o", model)
    compared = json.loads(call("compare", model, tmp_path / "rows.csv", "--json").out)
    assert compared["set_aside_rows"] == (wrong + 1).tolist() and compared["rms_mm"] < 0.04
    assert {x["row"] for x in compared["worst"]} <= set((wrong + 1).tolist())


def test_a_model_farther_off_than_the_nominal_arm_is_not_written(call, tmp_path):
    """Who insists on rows that cannot be right gets no model."""
    table(tmp_path / "rows.csv", 60)
    model = tmp_path / "model.toml"
    found = call("fit", tmp_path / "rows.csv", "--robot", "irb4600_60_205", "--accept", "DAT007", "-o", model)
    assert found.code == 1 and "DAT039" in found.err and not model.exists()
