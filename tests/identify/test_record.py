"""Rows read while the arm moves: delays, and noise that repeats itself from row to row."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.identify.diagnose import diagnose
from postproc.identify.fit import fit_model
from postproc.measure.table import read_measurements
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from tests.identify.cells import BASE, effect_library
from tests.measure.tables import HEADER, points

DELAY_S = 3e-3


def record(delay: float, seed: int, rows: int = 300, rate: float = 10.0, kept: float = 0.9) -> Source:
    """A path of slow waves, the tool where the joints were `delay` ago; noise of 30 um, `kept` of it from row to row."""
    g = np.random.default_rng(seed)
    time = np.arange(rows) / rate
    size, phase = np.array([50, 25, 20, 80, 50, 90.0]), g.uniform(0, 6, (2, 6))
    turns = g.uniform(0.3, 1.3, (2, 6))

    def angles(t: np.ndarray) -> np.ndarray:
        waves = [np.sin(turns[k] * t[:, None] + phase[k]) for k in range(2)]
        return np.array([0, 10, 0, 0, 40, 0]) + 0.6 * size * (waves[0] + waves[1])

    e = g.normal(size=(rows, 3))
    for i in range(1, rows):
        e[i] = kept * e[i - 1] + np.sqrt(1 - kept**2) * e[i]
    table = np.hstack([angles(time), points(angles(time - delay)) + 0.03 * e, time[:, None]])
    body = "".join(f"P{i}," + ",".join(f"{x:.6f}" for x in row) + "\n" for i, row in enumerate(table))
    return Source("record.csv", f"{HEADER},time_s\n{body}".encode())


def diagnosis(source: Source):
    arm = load_robot("irb4600_60_205")
    data = read_measurements(source, arm)
    base = fit_model(Model(arm), data, [effect_library()[key].null() for key in BASE])
    return diagnose(base.model, data)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_delay_is_found_without_a_speed_column(seed):
    found = diagnosis(record(DELAY_S, seed))
    assert [m.candidate.key for m in found.missing] == ["servo_lag"]
    assert found.final.model.effect("servo_lag").lag_s[:5] == pytest.approx(DELAY_S, rel=0.25)


@pytest.mark.parametrize("seed", [3, 4])
def test_noise_that_repeats_itself_is_no_effect(seed):
    found = diagnosis(record(0.0, seed))
    assert found.missing == ()
    assert found.verdict == "complete"
