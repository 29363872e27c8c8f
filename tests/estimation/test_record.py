"""Rows read while the arm moves: delays, and noise that repeats itself from row to row."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.estimation.findings import cautions, data_findings, one_path
from postproc.estimation.least_squares import fit_model
from postproc.identification.diagnose import diagnose
from postproc.measure.read.table import read_measurements
from postproc.measure.trajectory import is_record
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.robot.catalogue import load_robot
from tests.identification.cells import BASE, effect_library
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


def base(source: Source):
    arm = load_robot("irb4600_60_205")
    data = read_measurements(source, arm)
    return fit_model(Model(arm), data, [effect_library()[key].null() for key in BASE])


def diagnosis(source: Source):
    fit = base(source)
    return diagnose(fit.model, fit.data)


def test_a_delay_is_found_without_a_speed_column():
    found = diagnosis(record(DELAY_S, 2))
    assert [m.key for m in found.missing] == ["servo_lag"]
    assert found.final.model.effect("servo_lag").lag_s[:5] == pytest.approx(DELAY_S, rel=0.25)


def test_noise_that_repeats_itself_is_no_effect():
    found = diagnosis(record(0.0, 3))
    assert found.missing == ()
    assert found.verdict == "complete"


def test_what_a_delay_leaves_of_a_fast_record_is_no_noise():
    late, clean = (base(record(delay, 5, rows=1500, rate=125.0)) for delay in (DELAY_S / 2, 0.0))
    assert late.rms > 2 * clean.rms
    assert clean.serial == pytest.approx(0.1 / 1.9, rel=0.4)
    assert late.serial == pytest.approx(clean.serial, rel=0.4)


def test_rows_of_an_arm_that_stands_are_no_record():
    g = np.random.default_rng(6)
    q = np.cumsum(np.where(np.arange(200) % 20 == 0, 1.0, 0.0))[:, None] * np.array([3, 2, -1, 5, 2, 4.0])
    table = np.hstack(
        [q, points(q) + 0.03 * g.normal(size=(200, 3)), np.zeros((200, 6)), 0.1 * np.arange(200)[:, None]]
    )
    head = ",".join([HEADER, *(f"v{j}_deg_s" for j in range(1, 7)), "time_s"])
    body = "".join(f"P{i}," + ",".join(f"{x:.6f}" for x in row) + "\n" for i, row in enumerate(table))
    state = read_measurements(Source("record.csv", f"{head}\n{body}".encode()), load_robot("irb4600_60_205")).state
    assert state.v is not None and not is_record(state)
    assert is_record(read_measurements(record(0.0, 5), load_robot("irb4600_60_205")).state)


def test_rows_of_one_path_say_how_far_they_tell():
    """A path of two seconds tells its own rows far better than poses between them; one of a minute goes everywhere."""
    short, long = base(record(0.0, 7, rows=200, rate=100.0)), base(record(0.0, 7, rows=300, rate=5.0))
    assert one_path(long) == []
    (found,) = one_path(short)
    assert (found.code, found.severity) == ("DAT032", "warning")
    assert found in cautions(short) and found in data_findings(short)
    q = short.data.state.q
    away = np.random.default_rng(8).uniform(q.min(axis=0), q.max(axis=0), (200, 6))
    seen = predict(short.model, short.model.state(away))[:, :3, 3]
    error = np.sqrt(np.mean((1e3 * seen - points(np.degrees(away))) ** 2))
    told = float(re.search(r"good to (\S+) mm", found.message)[1])
    assert error > 3e3 * short.held_out_rms
    assert 0.3 * error < told < 3 * error
