"""Rows of a table: some that stand out, very many, and those of an arm that moves."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc import text as text_of
from postproc.channels.state import State
from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.estimation import least_squares
from postproc.estimation.findings import cautions, data_findings
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.identification.diagnose import diagnose
from postproc.identification.refits import thinned
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.trajectory import is_record
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.results.improve.fit import fit_values
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.identification.cells import BASE, base_fit, cell
from tests.independent.cells import Hidden, column
from tests.measure.tables import HEADER, points

ROOT = Path(__file__).resolve().parents[2]
ARM = load_robot("irb4600_60_205")
SIDES = np.where(np.arange(5600) % 2, 1.0, -1.0)[:, None] * np.ones(6)
"""Approach that alternates from row to row."""


def worn_tooth(g: np.random.Generator, arm: object) -> Hidden:
    """Joint 3 is 0.4 mrad off, but only within a few degrees of -20 deg."""

    def turn(s, tau):
        return column(2, 4e-4 * np.exp(-0.5 * ((s.q[:, 2] - np.radians(-20.0)) / np.radians(2.5)) ** 2))

    return Hidden("worn_tooth", "unknown", channels=("q3",), joint=turn)


def test_poses_that_show_a_local_error_are_one_finding_and_not_taken_for_bad_readings():
    """The farthest is named first, then those whose distance noise does not explain either."""
    data, _ = cell(worn_tooth, seed=911, poses=80, noise=0.01)
    fit = base_fit(data)
    (finding,) = (d for d in data_findings(fit) if d.code == "DAT025")
    size = 1e3 * np.linalg.norm(fit.position_error, axis=1)
    rows = [int(n) - 1 for n in re.findall(r"row (\d+)", finding.message)]
    ordered = np.argsort(-size)
    assert finding.message.startswith(f"row {ordered[0] + 1} lies {size[ordered[0]]:.2f} mm from the fitted model")
    assert finding.place.split(":")[1] == str(fit.data.line[ordered[0]])
    assert 1 < len(rows) < 10 and set(rows) == set(ordered[: len(rows)].tolist())
    found = diagnose(fit.model, data)
    assert found.verdict == "unknown" and "q3" in [s.channel for s in found.remaining[:3]]


def test_typing_errors_are_findings_about_the_data():
    data, _ = cell(seed=921, poses=80, outliers=3)
    found = diagnose(base_fit(data).model, data)
    assert len(found.final.excluded_rows) >= 2
    assert (found.verdict, found.remaining) == ("complete", ())


def offset_arm(rows: int) -> Measurements:
    """Random poses of the nominal arm with another offset at joint 2, measured with noise."""
    g = np.random.default_rng(3)
    q = g.uniform(np.maximum(ARM.lower, -2.0), np.minimum(ARM.upper, 2.0), (rows, 6))
    T = forward(ARM, q + np.array([0.0, 4e-4, 0.0, 0.0, 0.0, 0.0]))
    return Measurements(State(q), T[:, :3, 3] + 0.3 * T[:, :3, 2] + g.normal(0.0, 2e-5, (rows, 3)))


def sided(rows: int, **channels: np.ndarray) -> Measurements:
    data = offset_arm(rows)
    return replace(data, state=data.state.with_(approach=SIDES[:rows], **channels))


PEAK = """
from tests.cost import peak_mb
import sys
from postproc.estimation import least_squares
least_squares.MOST_ROWS_FITTED //= 10  # so that a short table has many more
from tests.estimation.test_rows import offset_arm
from tests.identification.cells import base_fit
fit = base_fit(offset_arm(int(sys.argv[1])))
print(round(1048576 * peak_mb()), fit.rms)
"""


def test_memory_of_a_fit_does_not_grow_with_the_rows_of_a_table():
    """At most 6,000 bytes a row beyond those that are fitted; 25,000 with all of them in the fit."""

    def peak(rows: int) -> list[float]:
        words = [sys.executable, "-c", PEAK, str(rows)]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
        return [float(word) for word in done.stdout.split()]

    (few, rms), (many, _) = peak(5_000), peak(30_000)
    assert (many - few) / 25_000 < 6_000
    assert rms == pytest.approx(2e-5, rel=0.02)


def test_rows_that_a_fit_takes_are_told_and_lose_nothing_that_alternates(monkeypatch):
    """Every fourth row would have come from one side alone."""
    monkeypatch.setattr(least_squares, "MOST_ROWS_FITTED", 200)
    monkeypatch.setattr(least_squares, "THINNED_POSES", 10)
    fit = base_fit(sided(799))
    assert 150 <= len(fit.data) <= 200 and fit.data.sampled_from == 799
    assert 0.3 < np.mean(fit.data.state.approach == 1.0) < 0.7
    assert [d.code for d in cautions(fit)][:1] == ["DAT037"]
    assert f"Of 799 rows {len(fit.data)} are used" in text_of(fit)
    assert "DAT037" in [d["code"] for d in fit_values(fit)["diagnostics"]]


def test_a_few_poses_that_are_repeated_very_often_stay_all(monkeypatch):
    monkeypatch.setattr(least_squares, "MOST_ROWS_FITTED", 200)
    data = offset_arm(30).rows(np.repeat(np.arange(30), 40))
    noise = np.random.default_rng(4).normal(0.0, 2e-5, data.position.shape)
    fit = base_fit(replace(data, position=data.position + noise, pose_id=tuple(f"P{i // 40}" for i in range(1200))))
    assert len(np.unique(fit.data.repeats)) == 30 and len(fit.data) == 200


def test_a_search_on_some_of_the_poses_loses_nothing_that_alternates():
    fit = thinned(base_fit(sided(1000, time=np.arange(1000) * 20.0).in_order))
    assert len(fit.data) == 500 and 0.4 < np.mean(fit.data.state.approach == 1.0) < 0.6


def record(delay: float, seed: int, rows: int = 300, rate: float = 10.0) -> Source:
    """A path of slow waves, the tool where the joints were `delay` ago; noise of 30 um, 0.9 of it from row to row."""
    g, time, kept = np.random.default_rng(seed), np.arange(rows) / rate, 0.9
    size, phase, turns = np.array([50, 25, 20, 80, 50, 90.0]), g.uniform(0, 6, (2, 6)), g.uniform(0.3, 1.3, (2, 6))

    def angles(t: np.ndarray) -> np.ndarray:
        waves = [np.sin(turns[k] * t[:, None] + phase[k]) for k in range(2)]
        return np.array([0, 10, 0, 0, 40, 0]) + 0.6 * size * (waves[0] + waves[1])

    e = g.normal(size=(rows, 3))
    for i in range(1, rows):
        e[i] = kept * e[i - 1] + np.sqrt(1 - kept**2) * e[i]
    return written(angles(time), points(angles(time - delay)) + 0.03 * e, time)


def written(q: np.ndarray, places: np.ndarray, time: np.ndarray, *v: np.ndarray) -> Source:
    """A table of a record, with the speeds of the joints where they are given."""
    names = [HEADER, *(f"v{j}_deg_s" for _ in v for j in range(1, 7)), "time_s"]
    table = np.column_stack([q, places, *v, time])
    body = "".join(f"P{i}," + ",".join(f"{x:.6f}" for x in row) + "\n" for i, row in enumerate(table))
    return Source("record.csv", f"{','.join(names)}\n{body}".encode())


def fitted(source: Source) -> Fit:
    library = effect_library()
    return fit_model(Model(ARM), read_measurements(source, ARM), [library[key].null() for key in BASE])


@pytest.mark.parametrize(("delay", "seed", "missing"), [(3e-3, 2, ["servo_lag"]), (0.0, 3, [])])
def test_a_delay_is_found_without_a_speed_column_and_noise_that_repeats_itself_is_no_effect(delay, seed, missing):
    fit = fitted(record(delay, seed))
    found = diagnose(fit.model, fit.data)
    assert [m.key for m in found.missing] == missing
    assert found.verdict == ("missing" if missing else "complete")
    if missing:
        assert found.final.model.effect("servo_lag").lag_s[:5] == pytest.approx(delay, rel=0.25)


def test_what_a_delay_leaves_of_a_fast_record_is_no_noise():
    late, clean = (fitted(record(delay, 5, rows=1500, rate=125.0)) for delay in (1.5e-3, 0.0))
    assert late.rms > 2 * clean.rms
    assert clean.serial == pytest.approx(0.1 / 1.9, rel=0.4)
    assert late.serial == pytest.approx(clean.serial, rel=0.4)


def test_rows_of_an_arm_that_stands_are_no_record():
    g, turns = np.random.default_rng(6), np.cumsum(np.arange(200) % 20 == 0)
    q = np.outer(turns, [3, 2, -1, 5, 2, 4.0])
    standing = written(q, points(q) + 0.03 * g.normal(size=(200, 3)), 0.1 * np.arange(200), np.zeros((200, 6)))
    state = read_measurements(standing, ARM).state
    assert state.v is not None and not is_record(state)
    assert is_record(read_measurements(record(0.0, 5), ARM).state)


def test_rows_of_one_path_say_how_far_they_tell():
    """A path of two seconds tells its own rows far better than poses between them; one of a minute goes everywhere."""
    short, long = fitted(record(0.0, 7, rows=200, rate=100.0)), fitted(record(0.0, 7, rows=300, rate=5.0))
    (finding,) = (d for d in cautions(short) if d.code == "DAT032")
    assert finding.severity == "warning" and finding in data_findings(short)
    assert "DAT032" not in [d.code for d in cautions(long)]
    q = short.data.state.q
    between = np.random.default_rng(8).uniform(q.min(axis=0), q.max(axis=0), (200, 6))
    seen = predict(short.model, short.model.state(between))[:, :3, 3]
    error = np.sqrt(np.mean((1e3 * seen - points(np.degrees(between))) ** 2))
    assert error > 3e3 * short.held_out_rms
    assert 0.3 * error < float(re.search(r"good to (\S+) mm", finding.message)[1]) < 3 * error
