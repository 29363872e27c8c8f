"""Predictions: every row, with the deviation of the pose and of a measurement, from where the instrument stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc import text as text_of
from postproc.diagnostics import PostprocError
from postproc.effects.base import Displacement, Effect, param
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.recorded import recorded_model
from postproc.identification.compare import compare
from postproc.identification.predict import predict_rows
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.equilibrium import predict
from postproc.results.comparison import comparison_values
from postproc.results.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds
from tests.measure.tables import source, table

ARM = load_robot("irb4600_60_205")
ELSEWHERE = Rotation.from_rotvec([0.02, -0.03, 0.8]), np.array([0.4, -0.7, 0.2])


def seen_from_elsewhere(data):
    R, shift = ELSEWHERE
    return replace(data, position=data.position @ R.as_matrix().T + shift)


def covered(told, data, sigma):
    """Share of single coordinates inside 1.96 standard deviations."""
    return float(np.mean(np.abs(data.position - told.position) < 1.96 * sigma[:, None]))


@pytest.mark.parametrize("repeats", [True, False])
def test_measurements_lie_within_the_deviation_of_a_measurement(repeats):
    inside, narrow = [], []
    for seed in range(500, 504):
        data, true = cell(seed=seed)
        data = data if repeats else data.rows(np.unique(data.repeats, return_index=True)[1])
        model = recorded_model(fit_model(base_fit(data).model, data))
        noise = np.random.default_rng(seed).normal(0, 3e-5, true.position.shape)
        measured = replace(true, position=true.position + noise)
        told = predict_rows(model, measured)
        inside.append(covered(told, measured, told.measured))
        narrow.append(covered(told, measured, told.sigma))
        assert covered(told, true, told.sigma) > 0.9
    assert 0.93 < np.mean(inside) < 0.975 and np.mean(narrow) < 0.85


def test_the_two_deviations_are_written():
    data, true = cell(seed=500)
    lines = predict_rows(recorded_model(base_fit(data)), true).as_csv().splitlines()
    assert lines[0] == "pose_id,x_mm,y_mm,z_mm,sigma_mm,sigma_measured_mm" and len(lines) == len(true) + 1
    pose, measured = (float(x) for x in lines[1].split(",")[4:])
    assert measured == pytest.approx(np.hypot(pose, 0.03), rel=0.2)


def test_the_arm_repeats_a_pose_worse_than_the_instrument_sees_it():
    data, _ = cell(seed=500)
    stated = replace(data, sigma=np.full(len(data), 1e-5))
    fit = fit_model(base_fit(data).model, stated)
    expected = np.sqrt(0.03**2 - 0.01**2)
    assert fit_values(fit)["noise_repeatability_mm"] == pytest.approx(expected, rel=0.25)
    bare = stated.rows(np.unique(data.repeats, return_index=True)[1])
    alone = fit_model(base_fit(data).model, bare)
    document = fit_values(alone)
    assert document["noise_repeatability_mm"] == pytest.approx(expected, rel=0.25)
    assert document["noise_mm"] == pytest.approx(0.03, rel=0.2)
    assert "how well the arm repeats a pose" in text_of(alone)


def test_rows_of_a_better_instrument_weigh_no_more_than_the_arm_repeats():
    data, _ = cell(seed=500)
    sigma = np.where(np.arange(len(data)) % 2, 1e-6, 1e-5)
    values = fit_model(base_fit(data).model, replace(data, sigma=sigma)).problem.weights.values
    assert values.max() / values.min() < 1.2


def test_a_row_of_another_length_keeps_its_place():
    lines = table(30)
    fit = fit_model(base_fit(cell(seed=500)[0]).model, read_measurements(source(lines), ARM))
    lines[4] += ",7"
    told = predict_rows(recorded_model(fit), read_measurements(source(lines), ARM, measured=False))
    rows = told.as_csv().splitlines()[1:]
    assert len(rows) == 30 and rows[3] == f"{lines[4].split(',')[0]},,,,,"
    assert all(cell for cell in rows[4].split(","))


def test_an_instrument_that_was_set_up_anew_is_hinted_at_and_placed():
    data, true = cell(seed=500)
    model, moved = recorded_model(base_fit(data)), seen_from_elsewhere(true)
    told = predict_rows(model, moved)
    (hint,) = (d for d in told.diagnostics if d.code == "DAT035")
    assert "`--place`" in hint.help and hint.severity == "warning"
    inside = []
    for seed in range(8):
        seen = moved.position + np.random.default_rng(seed).normal(0, 3e-5, moved.position.shape)
        few = replace(moved, position=np.where(np.arange(len(moved))[:, None] < 8, seen, np.nan))
        placed = predict_rows(model, few, place=True)
        off = np.linalg.norm(placed.position - moved.position, axis=1)
        assert np.sqrt(np.mean(off**2)) < 1e-4
        inside.append(covered(placed, moved, placed.sigma))
    assert 0.85 < np.mean(inside) < 0.995
    assert np.nanmedian(placed.sigma) > 1.5 * np.nanmedian(told.sigma)
    two = replace(moved, position=np.where(np.arange(len(moved))[:, None] < 2, moved.position, np.nan))
    with pytest.raises(PostprocError, match="do not place the instrument"):
        predict_rows(model, two, place=True)


def test_orientations_of_a_probe_mounted_anew_do_not_drag_the_placement():
    data, true = cell(seed=501)
    model = base_fit(data).model
    R, _ = ELSEWHERE
    turns = Rotation.from_matrix(predict(model, true.state)[:, :3, :3]) * Rotation.from_rotvec([2e-3, -1e-3, 2e-3])
    moved = seen_from_elsewhere(true)
    oriented = replace(moved, rotation=(R * turns).as_matrix())
    without, with_it = compare(model, moved), compare(model, oriented)
    assert comparison_values(with_it)["rms_mm"] == pytest.approx(comparison_values(without)["rms_mm"], rel=0.02)
    assert comparison_values(with_it)["rotation_rms_mrad"] > 1.0


class Settling(Effect, reads=("row",)):
    """The instrument settles while rows are measured."""

    size_m: float = param(unit="m", low=-1.0, high=1.0, typical=1e-4)

    def displacement(self, state):
        return Displacement(instrument=np.outer(self.size_m * np.exp(-state.channels["row"] / 50), np.eye(6)[0]))


def rows_of(seed: int, **more):
    return read_measurements(source(table(40, seed=seed)), ARM, terms=Reading(rows_in_order=True, **more))


def test_a_law_in_the_rows_of_one_table_is_not_applied_to_another():
    first, other = rows_of(1), rows_of(2)
    fit = fit_model(base_fit(cell(seed=500)[0]).model, first, [Settling(size_m=2e-4)])
    model = replace(
        recorded_model(fit), effects=fit.model.with_effects(*fit.model.effects, Settling(size_m=2e-4)).effects
    )
    assert np.isfinite(predict_rows(model, first).position).all()
    for use in (lambda: predict_rows(model, other), lambda: evaluate(model, other)):
        with pytest.raises(PostprocError) as error:
            use()
        assert error.value.diagnostics[0].code == "DAT034" and "--accept DAT034" in error.value.diagnostics[0].help
    told = predict_rows(model, rows_of(2, accept=frozenset({"DAT034"})))
    assert any(d.code == "DAT034" and d.severity == "warning" for d in told.diagnostics)
    unordered = read_measurements(source(table(40, seed=2)), ARM)
    assert any(d.code == "DAT021" for d in predict_rows(model, unordered).diagnostics)


@pytest.mark.parametrize(("later", "stops"), [(0.0, False), (1e6, True)])
def test_a_drift_in_the_time_of_one_session_stays_there(later, stops):
    data, _ = cell(kinds.frame_drift, seed=502)
    fit = base_fit(data, more=("frame_drift",))
    timed = [f"{line},{'time_s' if i == 0 else 60 * i + later}" for i, line in enumerate(table(40))]
    other = read_measurements(source(timed), ARM, measured=False)
    if stops:
        with pytest.raises(PostprocError, match="another: its times lie beyond"):
            predict_rows(recorded_model(fit), other)
    else:
        assert any(d.code == "DAT034" for d in predict_rows(recorded_model(fit), other).diagnostics)
