"""Tables of very many rows: memory that does not grow with them, and nothing lost that alternates from row to row."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc import text as text_of
from postproc.channels.state import State
from postproc.estimation import least_squares
from postproc.estimation.findings import cautions
from postproc.estimation.solving.smooth import enough_for_smoothness
from postproc.identification.refits import thinned
from postproc.measure.measurements import Measurements
from postproc.results.fit import fit_values
from tests.identification.cells import base_fit

ROOT = Path(__file__).resolve().parents[2]
PEAK = """
from tests.cost import peak_mb
import sys
from postproc.estimation import least_squares
least_squares.MOST_ROWS_FITTED //= 10  # so that a short table has many more
from tests.estimation.test_many import table
from tests.identification.cells import base_fit
fit = base_fit(table(int(sys.argv[1])))
print(round(1048576 * peak_mb()), fit.rms)
"""
MOST = 6_000  # bytes a row beyond those that are fitted; 25,000 with all of them in the fit
NOISE = 2e-5


def table(rows: int) -> Measurements:
    """Random poses of the nominal arm with another offset at joint 2, measured with noise."""
    from postproc.robot.catalogue import load_robot
    from postproc.robot.kinematics import forward

    random, arm = np.random.default_rng(3), load_robot("irb4600_60_205")
    q = random.uniform(np.maximum(arm.lower, -2.0), np.minimum(arm.upper, 2.0), (rows, 6))
    T = forward(arm, q + np.array([0.0, 4e-4, 0.0, 0.0, 0.0, 0.0]))
    position = T[:, :3, 3] + 0.3 * T[:, :3, 2] + random.normal(0.0, NOISE, (rows, 3))
    return Measurements(State(q), position)


def peak(rows: int) -> tuple[float, float]:
    """Peak memory [byte] of a process that fits so many rows, and the error that is left [m]."""
    done = subprocess.run([sys.executable, "-c", PEAK, str(rows)], cwd=ROOT, capture_output=True, text=True, check=True)
    memory, rms = done.stdout.split()
    return float(memory), float(rms)


def test_memory_of_a_fit_does_not_grow_with_the_rows_of_a_table():
    (few, rms), (many, _) = peak(5_000), peak(30_000)
    assert (many - few) / 25_000 < MOST
    assert rms == pytest.approx(NOISE, rel=0.02)


def test_rows_that_a_fit_takes_are_told_and_lose_nothing_that_alternates(monkeypatch):
    monkeypatch.setattr(least_squares, "MOST_ROWS_FITTED", 200)
    monkeypatch.setattr(least_squares, "THINNED_POSES", 10)
    data = table(799)
    side = np.where(np.arange(799) % 2, 1.0, -1.0)[:, None] * np.ones(6)
    fit = base_fit(replace(data, state=data.state.with_(approach=side)))
    assert 150 <= len(fit.data) <= 200 and fit.data.whole == 799
    assert 0.3 < np.mean(fit.data.state.approach == 1.0) < 0.7  # every fourth row would have come from one side alone
    assert [d.code for d in cautions(fit)][:1] == ["DAT037"]
    assert f"Of 799 rows {len(fit.data)} are used" in text_of(fit)
    assert "DAT037" in [d["code"] for d in fit_values(fit)["diagnostics"]]


def test_a_search_on_some_of_the_poses_loses_nothing_that_alternates():
    data = table(1000)
    side = np.where(np.arange(1000) % 2, 1.0, -1.0)[:, None] * np.ones(6)
    time = np.arange(1000) * 20.0
    fit = thinned(base_fit(replace(data, state=data.state.with_(approach=side, time=time)).in_order))
    assert len(fit.data) == 500 and 0.4 < np.mean(fit.data.state.approach == 1.0) < 0.6
    few = enough_for_smoothness(
        base_fit(replace(table(5600), state=table(5600).state.with_(payload_mass=np.tile([0.0, 9.0], 2800)))).problem
    )
    assert len(few.data) < 2800 and set(few.data.state.payload_mass) == {0.0, 9.0}


def test_a_few_poses_that_are_repeated_very_often_stay_all(monkeypatch):
    monkeypatch.setattr(least_squares, "MOST_ROWS_FITTED", 200)
    data = table(30).rows(np.repeat(np.arange(30), 40))
    noise = np.random.default_rng(4).normal(0.0, NOISE, data.position.shape)
    fit = base_fit(replace(data, position=data.position + noise, pose_id=tuple(f"P{i // 40}" for i in range(1200))))
    assert len(np.unique(fit.data.repeats)) == 30 and len(fit.data) == 200
