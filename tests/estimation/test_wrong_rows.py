"""Fits of tables some of whose rows cannot be right: cells of the independent arm, spoilt in known rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import postproc
from postproc.estimation.recorded import no_farther_than_nominal
from postproc.model.equilibrium import predict
from tests.build import refused
from tests.identification.cells import base_fit, cell
from tests.independent import arm as A
from tests.independent.cells import draw_cell, draw_states, measure
from tests.independent.hidden_effects import write_table

ARM, NOISE, POSES = "irb4600_60_205", 3e-5, 200
AGAIN = np.concatenate([np.arange(POSES), *[np.arange(0, POSES, 17)] * 2])
"""Pose of each row."""
N = len(AGAIN)


def table(path: Path, bad: int) -> np.ndarray:
    """Write 224 rows, so many of them in turned axes: the index of these; other poses, true, to `true.csv`."""
    g, arm = np.random.default_rng(5), A.ARMS["irb4600_60_205"]()
    hidden, states = draw_cell(g, arm, ()), draw_states(g, POSES, arm, False, False)
    y = measure(hidden, states)[AGAIN] + g.normal(0, NOISE, (N, 3))
    wrong = np.sort(g.choice(N, bad, replace=False))
    y[wrong] = y[wrong] @ Rotation.from_euler("z", -35, degrees=True).as_matrix()
    others = draw_states(np.random.default_rng(99), 100, arm, False, False)
    write_table(path, states.take(AGAIN), y, [f"P{i:03d}" for i in AGAIN], 4)
    write_table(path.with_name("true.csv"), others, measure(hidden, others), [f"T{i}" for i in range(100)], 6)
    return wrong


@pytest.mark.parametrize("bad", [0, 11, 12, 40, 67])
def test_there_is_no_number_of_wrong_rows_at_which_a_fit_falls_off(bad, tmp_path):
    wrong = table(tmp_path / "rows.csv", bad)
    fit = postproc.fit(postproc.read_measurements(tmp_path / "rows.csv", ARM), ARM)
    assert [row for _, row in fit.excluded_rows] == (wrong + 1).tolist()
    true = postproc.read_measurements(tmp_path / "true.csv", ARM)
    error = predict(fit.model, true.state)[:, :3, 3] - true.position
    assert np.sqrt(np.mean(error**2)) < 0.5 * NOISE


def test_a_model_farther_off_than_the_nominal_arm_is_given_to_nobody(tmp_path):
    """One of right rows is not, and few rows do not stop a fit."""
    table(tmp_path / "rows.csv", 60)
    data = replace(postproc.read_measurements(tmp_path / "rows.csv", ARM), wrong=frozenset())
    assert refused(lambda: postproc.fit(data, ARM))[0].code == "DAT039"
    for seed in (401, 921):
        no_farther_than_nominal(base_fit(cell(seed=seed)[0]))
    no_farther_than_nominal(base_fit(cell(seed=401)[0].rows(np.arange(30, 40))))
