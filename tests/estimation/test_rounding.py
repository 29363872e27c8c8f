"""Joint angles of few digits: an error where they were rounded when written, none where they were commanded so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.channels.state import State
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.problem import Problem, make_weights
from postproc.estimation.solving.rounding import blurred
from postproc.identification.add import add_effects
from postproc.identification.diagnose import diagnose
from postproc.measure.checks.repeats import Noise, estimate_noise
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.robot.catalogue import load_robot
from tests.bench.coverage import ARMS
from tests.identification.cells import BASE, base_fit, cell
from tests.independent import library_effects as kinds
from tests.independent.arm import ARMS as ARMS_BY_NAME
from tests.independent.cells import draw_cell, draw_states, measure


def rounded(data):
    """The same rows with joint angles as a pendant shows them."""
    return replace(data, state=data.state.with_(q=np.radians(np.round(np.degrees(data.state.q), 2))))


def test_rounded_angles_are_an_error_that_coordinates_and_repeats_share():
    data = rounded(cell(seed=5160, noise=0.02, poses=40)[0])
    problem, noise = base_fit(data).problem, 2e-5
    weights = make_weights(data, estimate_noise(data, load_robot("irb4600_60_205"), noise))
    seen, _ = blurred(Problem(problem.model, data, weights), Noise(noise, np.inf, None, "user"))
    J = seen.sensitivity.matrix[:, :3, :6]
    g = np.random.default_rng(7)
    each = np.bincount(data.repeats)[data.repeats]
    shared = g.uniform(-0.5, 0.5, (2000, data.repeats.max() + 1, 6))[:, data.repeats] * np.radians(0.01)
    error = np.einsum("nij,knj->kni", J, shared) + g.normal(0, noise, (2000, len(data), 3))
    white = seen.weights.whiten(np.moveaxis(error, 0, 2))
    alone = white[each == 1]
    covariance = np.einsum("nik,njk->nij", alone, alone) / 2000
    np.testing.assert_allclose(covariance, np.broadcast_to(np.eye(3), covariance.shape), atol=0.1)
    group = white[data.repeats == data.repeats[each == 3][0]].sum(axis=0) / np.sqrt(3)
    np.testing.assert_allclose(group @ group.T / 2000, np.eye(3), atol=0.1)
    np.testing.assert_allclose(seen.weights.measured(white[:, :, 0][seen.weights.used]), error[0], atol=1e-12)


def test_orientations_share_the_error_of_rounded_angles_with_their_positions():
    data = rounded(cell(seed=5160, noise=0.02, poses=40)[0])
    problem, noise, turning = base_fit(data).problem, 2e-5, 2.5e-5
    figures = Noise(noise, np.inf, turning, "user")
    data = replace(data, rotation=problem.equilibrium.T_base_tcp[:, :3, :3])
    seen, _ = blurred(Problem(problem.model, data, make_weights(data, figures)), figures)
    g = np.random.default_rng(8)
    error = g.uniform(-0.5, 0.5, (4000, len(data), 6)) * np.radians(0.01)
    error = np.einsum("nij,knj->kni", seen.sensitivity.matrix[:, :, :6], error)
    error += g.normal(0, [noise] * 3 + [turning] * 3, error.shape)
    white = seen.weights.whiten(np.moveaxis(error, 0, 2))[np.bincount(data.repeats)[data.repeats] == 1]
    covariance = np.einsum("nik,njk->nij", white, white) / 4000
    np.testing.assert_allclose(covariance, np.broadcast_to(np.eye(6), covariance.shape), atol=0.1)
    np.testing.assert_allclose(seen.weights.measured(seen.residual), seen.error, atol=1e-12)


def test_orientations_of_rounded_angles_that_nobody_repeated_weigh_as_positions_do():
    data = cell(seed=5161, noise=0.01, poses=100)[0]
    exact = predict(base_fit(data).model, data.state)[:, :3, :3]
    data = replace(rounded(data), rotation=exact)
    data = data.rows(np.isin(np.arange(len(data)), np.unique(data.repeats, return_index=True)[1]))
    fit = fit_model(base_fit(data).model, data, noise=1e-5)
    assert fit.data.rounded and fit.problem.weights.turn is not None
    left = fit.problem.weights.whiten(fit.problem.error[:, :, None])[:, :, 0]
    np.testing.assert_allclose(np.std(left[:, 3:6]), np.std(left[:, :3]), rtol=0.15)


def test_orientations_that_repeats_know_weigh_by_that_where_angles_are_rounded():
    data = cell(seed=5164, noise=0.01, poses=40)[0]
    turned = Rotation.from_rotvec(np.random.default_rng(5164).normal(0, 3e-5, (len(data), 3))).as_matrix()
    exact = predict(base_fit(data).model, data.state)[:, :3, :3]
    fit = base_fit(replace(rounded(data), rotation=turned @ exact, rounded=True))
    np.testing.assert_allclose(fit.problem.weights.values[:, 3:6], 1 / fit.noise.rotation, rtol=1e-9)


def test_significance_is_honest_where_angles_are_rounded():
    deviations = []
    for i in range(12):
        data = rounded(cell(seed=5170 + i, noise=0.012, poses=80, robot=ARMS[i % 3])[0])
        fit = base_fit(data, ARMS[i % 3], more=("wrist_coupling", "thermal_joint_drift"))
        # By the rows alone: the priors of such effects are about as narrow as what these rows tell.
        square = fit.scatter_of_parameters * np.diag(fit.inverse)
        sigma = dict(zip(fit.parameters, np.sqrt(square), strict=True))
        deviations += [
            fit.model.effect(k).vector()[i] / s
            for (k, i), s in sigma.items()
            if k in ("wrist_coupling", "thermal_joint_drift")
        ]
    assert len(deviations) > 100
    assert 0.85 < np.std(deviations) < 1.15


def stated(digits: int, written: bool, noise: float, *kind, seed: int = 5300, poses: int = 90) -> Measurements:
    """Poses of the independent arm, no repeats, with angles of few digits: rounded when written, or commanded so."""
    g = np.random.default_rng(seed)
    arm = ARMS_BY_NAME["irb4600_60_205"]()
    place = draw_cell(g, arm, tuple(k(g, arm) for k in kind))
    s = draw_states(g, poses, arm, False, False)
    q = np.radians(np.round(np.degrees(s.q), digits))
    places = measure(place, s if written else replace(s, q=q)) + g.normal(0, noise, (poses, 3))
    channels = {"approach": s.approach, "temperature": s.temperature, "time": s.time}
    state = State(q, payload_mass=s.mass, payload_center=s.center, **channels)
    rows = tuple(range(1, poses + 1))
    return Measurements(state, places, pose_id=tuple(map(str, rows)), row=rows, line=(1,) * poses)


def base(data: Measurements, noise: float):
    library = effect_library()
    robot = "irb4600_60_205"
    return fit_model(Model(load_robot(robot), robot_name=robot), data, [library[k].null() for k in BASE], noise=noise)


@pytest.mark.parametrize(("digits", "noise"), [(1, 5e-5), (2, 3e-5), (3, 8e-6)])
@pytest.mark.parametrize("written", [True, False])
def test_whether_angles_were_rounded_or_commanded_so_is_told_by_the_points(digits, noise, written):
    fit = base(stated(digits, written, noise), noise)
    assert fit.data.rounded is written
    assert (fit.noise.sigma > noise) is written
    assert fit.noise.stated == pytest.approx(noise)
    assert 0.75 < fit.variance < 1.3


@pytest.mark.parametrize("seed", [6034, 6036])
def test_rounded_angles_are_believed_also_where_chance_speaks_against_them(seed):
    """The two of 120 such tables that speak against it most, by a log-likelihood of 3.5 and 3.8."""
    assert base(stated(2, True, 3e-5, seed=seed), 3e-5).data.rounded is True


def test_fine_angles_ask_no_question():
    fit = base(stated(5, True, 3e-5), 3e-5)
    assert fit.data.rounded is None
    assert fit.problem.weights.turn is None


def test_rounded_angles_are_no_missing_effect():
    found = diagnose(base(stated(2, True, 3e-5), 3e-5).model, stated(2, True, 3e-5), noise=3e-5)
    assert found.verdict == "complete"
    assert not found.suspects


@pytest.mark.parametrize("written", [True, False])
def test_a_missing_effect_does_not_pass_for_rounded_angles(written):
    """What looks like rounding at first is asked again once the effect is in."""
    data = stated(2, written, 3e-5, kinds.backlash, seed=5303)
    found = diagnose(base(data, 3e-5).model, data, noise=3e-5)
    assert [m.key for m in found.missing] == ["backlash"]
    assert found.verdict == "missing"
    assert found.final.data.rounded is written
    added = add_effects(found.base.model, data, ["backlash"], noise=3e-5)
    assert added.fit.data.rounded is written


def test_rounded_angles_beside_one_coordinate_are_the_error_of_that_one():
    """Of z alone: the noise is that of repeats and what rounding moves z by, as rounded and true angles give it."""
    exact = cell(seed=5160, noise=0.02, poses=60)[0]
    data = replace(rounded(exact), position=np.where([False, False, True], exact.position, np.nan))
    model = base_fit(exact).model
    moved = predict(model, data.state)[:, 2, 3] - predict(model, exact.state)[:, 2, 3]
    fit = fit_model(model, data)
    assert fit.data.rounded
    assert fit.noise.rounding == pytest.approx(np.std(moved), rel=0.25)
    assert fit.parts.origin == "repeats and rounded angles"
    assert fit.noise.sigma == pytest.approx(np.hypot(2e-5, np.std(moved)), rel=0.25)
