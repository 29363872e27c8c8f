"""Fits of tables some of whose rows cannot be right: cells of the independent arm, spoilt in known rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import postproc
from postproc.diagnostics import PostprocError
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import no_farther_than_nominal
from postproc.measure.measurements import Measurements
from postproc.model.equilibrium import predict
from tests.identification.cells import base_fit, cell
from tests.independent import arm as A
from tests.independent.cells import draw_cell, draw_states, measure
from tests.independent.hidden_effects import write_table

NOISE, POSES = 3e-5, 200
AGAIN = np.concatenate([np.arange(POSES), *[np.arange(0, POSES, 17)] * 2])
N = len(AGAIN)
TURN = Rotation.from_euler("z", 35, degrees=True).as_matrix()


def table(path: Path, bad: int, seed: int = 5) -> np.ndarray:
    """Write 224 rows, so many of them in turned axes; the index of these."""
    g = np.random.default_rng(seed)
    arm = A.ARMS["irb4600_60_205"]()
    hidden, states = draw_cell(g, arm, ()), draw_states(g, POSES, arm, False, False)
    y = measure(hidden, states)[AGAIN] + g.normal(0, NOISE, (N, 3))
    wrong = np.sort(g.choice(N, bad, replace=False))
    y[wrong] = y[wrong] @ TURN.T
    write_table(path, states.take(AGAIN), y, [f"P{i:03d}" for i in AGAIN], 4)
    return wrong


def true_error(model, path: Path, seed: int = 5) -> float:
    """Error per axis [m] at other poses of the same cell."""
    g = np.random.default_rng(seed)
    arm = A.ARMS["irb4600_60_205"]()
    hidden = draw_cell(g, arm, ())
    states = draw_states(np.random.default_rng(99), 100, arm, False, False)
    true = measure(hidden, states)
    write_table(path, states, true, [f"T{i}" for i in range(100)], 6)
    asked = postproc.read_measurements(path, "irb4600_60_205")
    return float(np.sqrt(np.mean((predict(model, asked.state)[:, :3, 3] - true) ** 2)))


@pytest.mark.parametrize("bad", [0, 11, 12, 40, 67])
def test_there_is_no_number_of_wrong_rows_at_which_a_fit_falls_off(bad, tmp_path):
    wrong = table(tmp_path / "rows.csv", bad)
    fit = postproc.fit(postproc.read_measurements(tmp_path / "rows.csv", "irb4600_60_205"), "irb4600_60_205")
    assert [row for _, row in fit.excluded_rows] == (wrong + 1).tolist()
    assert true_error(fit.model, tmp_path / "true.csv") < 0.5 * NOISE


def test_a_model_farther_off_than_the_nominal_arm_is_given_to_nobody(tmp_path):
    table(tmp_path / "rows.csv", 60)
    with pytest.raises(PostprocError, match="DAT039"):
        data = postproc.read_measurements(tmp_path / "rows.csv", "irb4600_60_205")
        postproc.fit(replace(data, wrong=frozenset()), "irb4600_60_205")


def test_a_fit_of_right_rows_is_no_farther_than_the_nominal_arm():
    for seed in (401, 921):
        no_farther_than_nominal(base_fit(cell(seed=seed)[0]))


def test_few_rows_do_not_stop_a_fit():
    data: Measurements = cell(seed=401)[0].rows(np.arange(30, 40))
    fit = base_fit(data)
    no_farther_than_nominal(fit_model(fit.model, data))
