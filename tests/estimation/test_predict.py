"""Predictions: every row, with the deviation of the pose and of a measurement, from where the instrument stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.effects.base import Displacement, Effect, param
from postproc.effects.library.curve import ChannelCurve
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.compare import compare
from postproc.identification.predict import predict_rows
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.equilibrium import predict
from postproc.results.improve.comparison import comparison_values
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds
from tests.measure.tables import source, table

ARM, NOISE = load_robot("irb4600_60_205"), 3e-5
TURN, SHIFT = Rotation.from_rotvec([0.02, -0.03, 0.8]).as_matrix(), np.array([0.4, -0.7, 0.2])


def seen_from_elsewhere(data: Measurements) -> Measurements:
    return replace(data, position=data.position @ TURN.T + SHIFT)


def covered(told, data: Measurements, sigma: np.ndarray) -> float:
    """Share of single coordinates inside 1.96 standard deviations."""
    return float(np.mean(np.abs(data.position - told.position) < 1.96 * sigma[:, None]))


def placed_by(data: Measurements, count: int, seed: int) -> Measurements:
    """The rows, of which only the first ones hold a measured position."""
    noise = np.random.default_rng(seed).normal(0, NOISE, data.position.shape)
    return replace(data, position=np.where(np.arange(len(data))[:, None] < count, data.position + noise, np.nan))


@pytest.mark.parametrize("repeats", [True, False])
def test_measurements_lie_within_the_deviation_of_a_measurement(repeats):
    inside, narrow = [], []
    for seed in range(500, 504):
        data, true = cell(seed=seed)
        data = data if repeats else data.rows(np.unique(data.repeats, return_index=True)[1])
        noise = np.random.default_rng(seed).normal(0, NOISE, true.position.shape)
        measured = replace(true, position=true.position + noise)
        told = predict_rows(recorded_model(fit_model(base_fit(data).model, data)), measured)
        inside.append(covered(told, measured, told.measured))
        narrow.append(covered(told, measured, told.sigma))
        assert covered(told, true, told.sigma) > 0.9
    assert 0.93 < np.mean(inside) < 0.975 and np.mean(narrow) < 0.85


def test_the_two_deviations_are_written():
    data, true = cell(seed=500)
    lines = predict_rows(recorded_model(base_fit(data)), true).as_csv().splitlines()
    words = "sigma_mm,sigma_measured_mm,sigma_parameters_mm,sigma_unexplained_mm,sigma_noise_mm"
    assert lines[0] == f"pose_id,x_mm,y_mm,z_mm,{words}" and len(lines) == len(true) + 1
    pose, measured, *parts = (float(x) for x in lines[1].split(",")[4:])
    assert measured == pytest.approx(np.hypot(pose, 0.03), rel=0.2)
    assert pose == pytest.approx(np.hypot(*parts[:2]), abs=2e-5) and measured == pytest.approx(
        np.linalg.norm(parts), abs=2e-5
    )


def test_a_row_of_another_length_keeps_its_place():
    lines = table(30)
    fit = fit_model(base_fit(cell(seed=500)[0]).model, read_measurements(source(lines), ARM))
    lines[4] += ",7"
    told = predict_rows(recorded_model(fit), read_measurements(source(lines), ARM, measured=False))
    rows = told.as_csv().splitlines()[1:]
    assert len(rows) == 30 and rows[3] == f"{lines[4].split(',')[0]}{8 * ','}"
    assert all(rows[4].split(","))


def test_an_instrument_that_was_set_up_anew_is_hinted_at_and_placed():
    data, true = cell(seed=500)
    model, moved = recorded_model(base_fit(data)), seen_from_elsewhere(true)
    told, inside = predict_rows(model, moved), []
    (hint,) = (d for d in told.diagnostics if d.code == "DAT035")
    assert hint.severity == "warning" and "`--place`" in hint.help
    for seed in range(8):
        placed = predict_rows(model, placed_by(moved, 8, seed), place=True)
        assert np.sqrt(np.mean(np.sum((placed.position - moved.position) ** 2, axis=1))) < 1e-4
        inside.append(covered(placed, moved, placed.sigma))
    assert 0.85 < np.mean(inside) < 0.995
    assert np.nanmedian(placed.sigma) > 1.5 * np.nanmedian(told.sigma)
    (found,) = refused(lambda: predict_rows(model, placed_by(moved, 2, 0), place=True))
    assert "do not place the instrument" in found.message


def test_orientations_of_a_probe_mounted_anew_do_not_drag_the_placement():
    data, true = cell(seed=501)
    model, moved = base_fit(data).model, seen_from_elsewhere(true)
    probe = Rotation.from_rotvec([2e-3, -1e-3, 2e-3]).as_matrix()
    oriented = replace(moved, rotation=TURN @ predict(model, true.state)[:, :3, :3] @ probe)
    without, seen = (comparison_values(compare(model, rows)) for rows in (moved, oriented))
    assert seen["rms_mm"] == pytest.approx(without["rms_mm"], rel=0.02)
    assert seen["rotation_rms_mrad"] > 1.0


class Settling(Effect, reads=("row",)):
    """The instrument settles while rows are measured."""

    size_m: float = param(unit="m", low=-1.0, high=1.0, typical=1e-4)

    def displacement(self, state):
        return Displacement(instrument=np.outer(self.size_m * np.exp(-state.channels["row"] / 50), np.eye(6)[0]))


def rows_of(seed: int, **terms) -> Measurements:
    return read_measurements(source(table(40, seed=seed)), ARM, terms=Reading(**terms))


def test_a_law_in_the_rows_of_one_table_is_not_applied_to_another():
    first, other = (rows_of(seed, rows_in_order=True) for seed in (1, 2))
    fit = fit_model(base_fit(cell(seed=500)[0]).model, first, [Settling(size_m=2e-4)])
    model = recorded_model(fit)
    model = replace(model, effects=model.with_effects(*fit.model.effects, Settling(size_m=2e-4)).effects)
    assert np.isfinite(predict_rows(model, first).position).all()
    for use in (predict_rows, evaluate):
        found, *_ = refused(lambda use=use: use(model, other))
        assert found.code == "DAT034" and "--accept DAT034" in found.help
    for accept, code in (
        (rows_of(2, rows_in_order=True, accept=frozenset({"DAT034"})), "DAT034"),
        (rows_of(2), "DAT021"),
    ):
        assert (code, "warning") in [(d.code, d.severity) for d in predict_rows(model, accept).diagnostics]


@pytest.mark.parametrize(
    ("channels", "direct"),
    [("lag(temperature, 900 s)", False), ("creep(load3, 900 s)", False), ("time", True), ("time * q3", True)],
)
def test_a_law_that_lags_is_derived_anew_in_another_session(channels, direct):
    """What a channel left behind follows the times of any table; a law of the time itself is one session's."""
    parts = channels.split(" * ")
    curve = ChannelCurve.null(
        place=("joint 2",),
        channels=(channels,),
        basis=(" * ".join(["line"] * len(parts)),),
        numbers=(0.0,) * len(parts),
    )
    assert "time" in curve.reads and curve.follows("time") is direct


@pytest.mark.parametrize(("later", "stops"), [(0.0, False), (1e6, True)])
def test_a_drift_in_the_time_of_one_session_stays_there(later, stops):
    data, _ = cell(kinds.frame_drift, seed=502)
    model = recorded_model(base_fit(data, more=("frame_drift",)))
    timed = [f"{line},{'time_s' if i == 0 else 60 * i + later}" for i, line in enumerate(table(40))]
    other = read_measurements(source(timed), ARM, measured=False)
    if stops:
        assert "another: its times lie beyond" in refused(lambda: predict_rows(model, other))[0].message
    else:
        assert "DAT034" in [d.code for d in predict_rows(model, other).diagnostics]
