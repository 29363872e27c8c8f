"""95 % intervals hold the truth in about 95 of 100 cases, whether or not repeats tell the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.estimation.findings import cautions
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.solve import Terms
from postproc.estimation.solving.step import sizes
from postproc.measure.measurements import Measurements
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import predict_sigma
from postproc.results.improve.fit import fit_values
from tests.bench.coverage import ARMS, compliances, predictions, single
from tests.identification.cells import base_fit, cell, true_compliance, true_error
from tests.independent import library_effects as kinds
from tests.independent.arm import ARMS as ARMS_BY_NAME
from tests.independent.cells import STEPS, Hidden, States, base_slope, draw_cell, draw_states, measure


@pytest.mark.parametrize("repeats", [True, False])
def test_intervals_hold_the_truth(repeats):
    inside, known = [], []
    for i in range(9):
        terms = {"seed": 5100 + i, "robot": ARMS[i % 3], "poses": 60, "noise": (0.012, 0.03, 0.06)[i // 3 % 3]}
        data, true = cell(**terms)
        fit = base_fit(data if repeats else single(data), terms["robot"])
        assert (fit.noise.sigma is not None) == repeats
        inside.append(predictions(fit, true))
        known.append(compliances(fit, true_compliance(**terms)))
    assert 0.90 < np.mean(inside) < 0.99  # nothing is missing here, which a fit cannot know
    assert 0.90 < np.mean(np.concatenate(known)) < 1.0


@pytest.mark.parametrize("kind", [kinds.backlash, kinds.transmission_error, kinds.thermal_joint_drift])
def test_noise_and_missing_physics_are_told_apart_without_repeats(kind):
    data, true = cell(kind, seed=5151, poses=100, noise=0.03)
    lacking = base_fit(single(data))
    assert lacking.unexplained == pytest.approx(true_error(lacking, true), rel=0.25)
    assert 0.88 < predictions(lacking, true).mean() <= 0.98


def test_pure_noise_is_taken_for_noise():
    data, _ = cell(seed=101)
    fit = base_fit(single(data))
    assert fit.residual_split.noise_share > 0.98
    assert fit.residual_split.held_out == pytest.approx(fit.held_out_rms, rel=0.1)


def test_free_functions_come_near_the_noise_where_physics_is_missing():
    data, _ = cell(kinds.backlash, seed=211)
    fit = base_fit(data)
    left = fit.residual_split
    assert fit.rms > 2 * 3e-5
    assert left.held_out < 1.3 * 3e-5
    assert left.noise_share * fit.variance * fit.noise.sigma**2 == pytest.approx(9e-10, rel=0.2)


def test_repeats_tell_nothing_new_about_what_the_model_misses():
    """Ten readings of every pose or one: the same knowledge where the error is missing physics."""
    data, _ = cell(kinds.transmission_error, seed=5190, poses=60, noise=0.01)
    one = single(data)
    g = np.random.default_rng(4)
    many = one.rows(np.tile(np.arange(len(one)), 10))
    many = replace(many, position=many.position + g.normal(0, 1e-5, many.position.shape))
    often, once = base_fit(many), base_fit(one)
    widths = [fit.intervals["joint_compliance"][1:5] for fit in (often, once)]
    assert often.unexplained > 3e-5
    np.testing.assert_allclose(*widths, rtol=0.2)


def test_a_joint_without_load_that_stops_at_its_bound_is_no_sign_of_missing_physics():
    data, _ = cell(seed=5191, poses=60)
    fit = base_fit(data)
    effect = fit.model.effect("joint_compliance")
    last = np.arange(6) == 5
    stopped = effect.with_vector(np.where(last, -1e-5, effect.vector()))
    held = fit_model(fit.model, data, [stopped], terms=Terms({**fit.free, effect.key: ~last}))
    assert cautions(replace(held, at_bound=((effect.key, 5),))) == []


def test_too_few_poses_are_said():
    data, _ = cell(seed=5192, poses=200)
    few = data.rows(np.isin(data.repeats, data.repeats[:8]))
    assert "DAT016" in [d.code for d in cautions(base_fit(few))]
    assert cautions(base_fit(data)) == []


def with_still_wrist(seed: int, rows: int = 60):
    """A cell measured with a wrist that stands still, and poses where it moves: rows, States and the true places."""
    g = np.random.default_rng(seed)
    arm = ARMS_BY_NAME["irb4600_60_205"]()
    cell_ = draw_cell(g, arm, ())
    s = draw_states(g, rows + 40, arm, False, False)
    q = s.q.copy()
    q[:rows, 3:] = np.radians([0.0, 30.0, 0.0])
    s = replace(s, q=q)
    places = measure(cell_, s)
    seen = places + g.normal(0, 2e-5, places.shape) * (np.arange(len(places)) < rows)[:, None]
    state = State(s.q, approach=s.approach, payload_mass=s.mass, payload_center=s.center)
    whole = Measurements(state, seen, pose_id=tuple(map(str, range(len(places)))), row=tuple(range(1, len(places) + 1)))
    return whole.rows(np.arange(rows)), whole.rows(np.arange(rows, len(places))), cell_, s


def test_what_was_held_is_not_known():
    """Poses that the wrist never took: each offset held may be off by its ordinary size, and predictions say so."""
    inside, sigma, off = [], [], []
    for seed in range(6):
        few, others, *_ = with_still_wrist(7900 + seed)
        fit = base_fit(few)
        assert {("joint_offset", 4), ("joint_offset", 5)} <= set(fit.unidentifiable)
        model = recorded_model(fit)
        sigma.append(predict_sigma(model, others.state))
        off.append(predict(model, others.state)[:, :3, 3] - others.position)
        inside.append(np.abs(off[-1]) < 1.96 * sigma[-1][:, None])
        assert np.median(predict_sigma(model, few.state)) < 2e-5
    assert np.mean(inside) > 0.9 and np.sqrt(np.mean(np.square(sigma))) < 4 * np.sqrt(np.mean(np.square(off)))


def test_how_far_what_was_held_may_be_off_is_bayes_rule():
    """D (A^T A / s^2 + P)^-1 D^T with slopes of the independent arm, and P for what was held alone."""
    few, others, cell_, s = with_still_wrist(7910)
    fit = base_fit(few)
    slope = base_slope(cell_, s) / STEPS
    A, D = slope[:180], slope[180:]
    keys = [*[("instrument_frame", i) for i in range(6)], *[("tool_frame", i) for i in range(3)]]
    keys += [("joint_offset", i) for i in range(6)] + [("joint_compliance", i) for i in range(6)]
    ordinary = {e.key: sizes(fit.problem, e) for e in fit.model.effects}
    prior = np.array([1 / ordinary[key][i] ** 2 if (key, i) in fit.unidentifiable else 0.0 for key, i in keys])
    prior[15:] *= cell_.compliance**2  # its slopes are those of a share
    scale = np.linalg.norm(A, axis=0) / 2e-5 + np.sqrt(prior)
    inverse = np.linalg.inv((A.T @ A / 4e-10 + np.diag(prior)) / np.outer(scale, scale)) / np.outer(scale, scale)
    expected = np.sqrt(np.einsum("np,pq,nq->n", D, inverse, D).reshape(-1, 3).mean(axis=1))
    np.testing.assert_allclose(predict_sigma(recorded_model(fit), others.state), expected, rtol=0.05)


def warm_rounds(seed: int, noise: float):
    """Twelve poses measured again in a later, warmer round of a cell whose joints drift with temperature."""
    g = np.random.default_rng(seed)
    arm = ARMS_BY_NAME["irb4600_60_205"]()
    cell_ = draw_cell(g, arm, (kinds.thermal_joint_drift(g, arm),))
    s = draw_states(g, 100, arm, False, False)
    later = replace(s.take(np.arange(0, 96, 8)), temperature=np.full(12, 45.0), time=np.linspace(30000, 31000, 12))
    parts = {k: (s, later) for k in ("q", "approach", "temperature", "time", "mass", "center")}
    whole = States(**{k: np.concatenate([getattr(a, k), getattr(b, k)]) for k, (a, b) in parts.items()})
    places = measure(cell_, whole) + g.normal(0, noise, (112, 3))
    state = State(
        whole.q,
        approach=whole.approach,
        temperature=whole.temperature,
        time=whole.time,
        payload_mass=whole.mass,
        payload_center=whole.center,
    )
    ids = [*range(100), *range(0, 96, 8)]
    return Measurements(state, places, pose_id=tuple(str(i) for i in ids), row=tuple(range(1, 113)), line=(1,) * 112)


def test_repeats_of_a_warmer_round_tell_the_noise_once_the_drift_is_known():
    data = warm_rounds(71, 2e-5)
    lacking, whole = base_fit(data), base_fit(data, more=("thermal_joint_drift",))
    assert lacking.noise.sigma > 2 * 2e-5
    assert whole.noise.sigma == pytest.approx(2e-5, rel=0.25)
    assert whole.problem.weights.values.max() == pytest.approx(1 / whole.noise.sigma)
    assert 0.7 < whole.variance < 1.4
    assert fit_values(whole)["noise_mm"] == pytest.approx(0.02, rel=0.25)


def test_a_stated_noise_that_cannot_be_is_said():
    data, _ = cell(seed=5180, noise=0.02, poses=40)
    model = base_fit(data).model
    assert "DAT027" not in {d.code for d in cautions(fit_model(model, data, noise=5e-5))}
    (said,) = (d for d in cautions(fit_model(model, data, noise=0.02)) if d.code == "DAT027")
    assert said.message.startswith("the stated noise of 20.000 mm cannot be: the fit leaves 0.0")


def slips(g, arm):
    """Six slips of every joint, as wide as a tooth: no function is so smooth everywhere."""
    at, size = g.uniform(-1, 1, (6, 6)), g.normal(0, 3e-4, (6, 6))
    return Hidden(
        "slips",
        "joint_error_map",
        channels=(),
        joint=lambda s, tau: np.sum(size * np.tanh((s.q[:, :, None] - at) / 0.03), axis=2),
    )


def test_a_map_of_few_poses_is_no_surer_than_right():
    inside = []
    for seed in (7701, 7702, 7703):
        data, true = cell(slips, seed=seed, poses=100, noise=0.02)
        base = base_fit(single(data))
        fit = fit_model(base.model, base.data, [JointErrorMap(joint=(1, 2, 3, 4, 5, 6), order=8)])
        inside.append(predictions(fit, true).mean())
    assert min(inside) > 0.9 and 0.92 < np.mean(inside) < 0.98
