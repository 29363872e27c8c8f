"""What an arm's type says of it goes into fitted models and, under a program's loads, into what is said of the program."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.independent import library_effects as kinds
from tests.independent.hidden_effects import Plan, make_set

SAMPLES = Path(__file__).parents[2] / "samples"
TABLE, PROGRAM = SAMPLES / "measurements" / "simulated_backlash.csv", SAMPLES / "hull_seam.mod"
FORCE = ("--force", "200,-200,-200")


def test_a_program_with_a_force_is_told_what_no_row_told(call: Call, tmp_path: Path) -> None:
    model = tmp_path / "cell.toml"
    assert call("fit", TABLE, "--robot", "irb4600_60_205", "-o", model).code == 0
    words = ("compensate", PROGRAM, "-m", model, "-o", tmp_path / "out.mod")
    loaded, unloaded = (json.loads(call(*words, *more, "--json").out) for more in (FORCE, ()))
    most = loaded["undetermined_parameter"]
    assert most["parameter"] == "joint_compliance.compliance_rad_per_Nm[1]"
    assert np.flatnonzero(most["pull"]).tolist() == [1]
    assert loaded["undetermined_under_load_mm"] > 0.5 > 4 * unloaded["undetermined_under_load_mm"]
    assert loaded["expected_accuracy"]["within_95_percent_mm"] >= loaded["undetermined_under_load_mm"]
    said = call(*words, *FORCE).err
    assert "pull with 100 N along y of the base at 3 poses" in said
    assert "pull with" not in call(*words).err


@pytest.mark.parametrize(
    ("kind", "noise"), [(kinds.backlash, 1.0), (kinds.gravity_compensator, 0.03), (kinds.arm_load, 1.0)]
)
def test_every_model_that_is_written_is_taken(call: Call, tmp_path: Path, kind, noise: float) -> None:  # type: ignore[no-untyped-def]
    """Also where so few rows are so loud that they alone would have springs negative."""
    make_set(tmp_path, 8801, Plan([kind]), noise, 120 if noise < 0.1 else 25)
    table, model, better = tmp_path / "fit.csv", tmp_path / "m.toml", tmp_path / "b.toml"
    assert call("fit", table, "--robot", "irb4600_60_205", "-o", model).code == 0
    assert call("add", model, kind.__name__, "--data", table, "-o", better).code == 0
    for file in (model, better):
        done = call("compensate", PROGRAM, "-m", file, "-o", tmp_path / "out.mod")
        assert done.code == 0, done.err
