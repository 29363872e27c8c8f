"""How measured numbers weigh: orientations, repeats, instruments, and joint angles of few digits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc import text as text_of
from postproc.channels.state import State
from postproc.effects.library.curve import ChannelCurve
from postproc.effects.registry import effect_library
from postproc.estimation.findings import cautions
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.results.improve.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.bench.coverage import ARMS
from tests.identification.cells import BASE, base_fit, cell, true_error
from tests.independent import library_effects as kinds
from tests.independent.arm import ARMS as ARMS_BY_NAME
from tests.independent.cells import draw_cell, draw_states, measure

NOISE = 3e-5


def once(data: Measurements) -> Measurements:
    """Each pose once."""
    return data.rows(np.isin(np.arange(len(data)), np.unique(data.repeats, return_index=True)[1]))


def places(data: Measurements) -> np.ndarray:
    """(n, 4, 4) where the fitted arm stands."""
    return predict(base_fit(data).model, data.state)


def shaken(T: np.ndarray, turn: float | np.ndarray, g: np.random.Generator) -> np.ndarray:
    """(n, 3, 3) orientations with noise [rad]."""
    noise = g.normal(0, 1, (len(T), 3)) * np.broadcast_to(turn, len(T))[:, None]
    return Rotation.from_rotvec(noise).as_matrix() @ T[:, :3, :3]


def test_orientations_are_weighted_by_their_own_noise():
    data, true = cell(seed=11)
    turned = Rotation.from_rotvec([0.4, -1.2, 2.0]).as_matrix()
    fit = base_fit(replace(data, rotation=shaken(places(data), 5e-4, np.random.default_rng(1)) @ turned))
    tool = Rotation.from_rotvec(fit.model.effect("tool_frame").vector()[3:]).as_matrix()
    np.testing.assert_allclose(tool, turned, atol=5e-4)
    assert true_error(fit, true) < 0.6 * NOISE


@pytest.mark.parametrize("together", [True, False])
def test_orientations_weigh_by_their_own_scatter_where_rows_state_that_of_positions(together):
    data = once(cell(seed=640140, poses=120)[0])
    g, T, own = np.random.default_rng(7), places(data), np.array([0.5, 1.0, 2.0])[np.arange(len(data)) % 3]
    turn = 6e-5 * (own if together else np.ones(len(data)))
    rotation = shaken(T, turn, g)
    position = T[:, :3, 3] + g.normal(0, NOISE, (len(data), 3)) * own[:, None]
    fit = base_fit(replace(data, position=position, rotation=rotation, sigma=NOISE * own))
    np.testing.assert_allclose(fit.problem.weights.values[:, 3:6] * turn[:, None], 1.0, rtol=0.15)


def test_orientations_weigh_by_what_remains_beside_a_curve():
    """The reflector sits elsewhere in half of the rows: positions are off by many times their noise, axes are not."""
    data = once(cell(seed=408, noise=0.02, poses=60)[0])
    T, half = places(data), (np.arange(len(data)) % 2)[:, None]
    position = data.position + half * (T[:, :3, :3] @ [1e-3, -1e-3, 5e-4])
    turned = replace(data, position=position, rotation=shaken(T, 1e-4, np.random.default_rng(8)))
    fit = fit_model(base_fit(data).model, turned, noise=2e-5)
    known = replace(fit.data, state=fit.data.state.with_(channels={"half": half[:, 0].astype(float)}))
    seen = fit_model(fit.model, known, [ChannelCurve(place=("tool",), channels=("half",))], noise=2e-5)
    assert fit.problem.weights.values[0, 3] > 3e4
    np.testing.assert_allclose(seen.problem.weights.values[:, 3:], 1e4, rtol=0.25)


def test_a_bad_position_is_set_aside_beside_coarse_orientations():
    """Before their noise is known, orientations of 0.3 mrad weigh ten times as much as positions of 0.03 mm."""
    data = once(cell(seed=640140, poses=80)[0])
    g, T = np.random.default_rng(11), places(data)
    rotation = shaken(T, 3e-4, g)
    position = T[:, :3, 3] + g.normal(0, NOISE, (len(data), 3))
    position[17] += np.array([0.6e-3, -0.5e-3, 0.5e-3])
    fit = base_fit(replace(data, position=position, rotation=rotation))
    assert fit.excluded == (17,)


def test_the_arm_repeats_a_pose_worse_than_the_instrument_sees_it():
    """Whether repeats say so, or what follows no channel."""
    data, _ = cell(seed=500)
    stated = replace(data, sigma=np.full(len(data), 1e-5))
    expected = np.sqrt(0.03**2 - 0.01**2)
    once_each = stated.rows(np.unique(data.repeats, return_index=True)[1])
    for rows, said in ((stated, "how well the arm repeats a pose"), (once_each, "what no column explains")):
        fit = fit_model(base_fit(data).model, rows)
        document = fit_values(fit)
        assert document["noise_repeatability_mm"] == pytest.approx(expected, rel=0.25)
        assert document["noise_mm"] == pytest.approx(0.03, rel=0.2)
        assert said in text_of(fit)


def test_rows_of_a_better_instrument_weigh_no_more_than_the_arm_repeats():
    data, _ = cell(seed=500)
    sigma = np.where(np.arange(len(data)) % 2, 1e-6, 1e-5)
    values = fit_model(base_fit(data).model, replace(data, sigma=sigma)).problem.weights.values
    assert values.max() / values.min() < 1.2


@pytest.mark.parametrize(("stated", "warned"), [(2e-5, True), (3e-5, False), (1e-3, True)])
def test_a_noise_that_cannot_be_is_a_finding(stated, warned):
    """Repeats speak against one that is too small, the fit against one that is too large."""
    data, _ = cell(seed=101)
    found = diagnose(base_fit(data).model, data, noise=stated)
    assert found.verdict == "complete" and ("DAT027" in [d.code for d in found.diagnostics]) == warned
    assert ("DAT027" in [d.code for d in cautions(found.base)]) == (stated > 1e-4)


def rounded(data: Measurements) -> Measurements:
    """The same rows with joint angles as a pendant shows them."""
    return replace(data, state=data.state.with_(q=np.radians(np.round(np.degrees(data.state.q), 2))))


def test_rounded_angles_are_an_error_that_coordinates_and_repeats_share():
    """Errors as the noise and the rounding make them are white once they are weighted, and so are means of repeats."""
    data, g = rounded(cell(seed=5160, noise=0.02, poses=40)[0]), np.random.default_rng(7)
    base = base_fit(data)
    assert compare(base.model, data).fit.noise.sigma == pytest.approx(base.noise.sigma, rel=1e-3)
    fit = fit_model(base.model, replace(data, rounded=True), noise=2e-5)
    J, times = fit.problem.sensitivity.matrix[:, :3, :6], np.bincount(data.repeats)[data.repeats]
    turn = g.uniform(-0.5, 0.5, (2000, data.repeats.max() + 1, 6))[:, data.repeats] * np.radians(0.01)
    error = np.einsum("nij,knj->kni", J, turn) + g.normal(0, 2e-5, (2000, len(data), 3))
    white = fit.problem.weights.whiten(np.moveaxis(error, 0, 2))
    group = white[data.repeats == data.repeats[times == 3][0]].sum(axis=0) / np.sqrt(3)
    for numbers in (*white[times == 1], group):
        np.testing.assert_allclose(numbers @ numbers.T / 2000, np.eye(3), atol=0.1)


def test_orientations_of_rounded_angles_that_nobody_repeated_weigh_as_positions_do():
    data = cell(seed=5161, noise=0.01, poses=100)[0]
    fit = fit_model(base_fit(data).model, once(replace(rounded(data), rotation=places(data)[:, :3, :3])), noise=1e-5)
    residual = fit.problem.weights.whiten(fit.problem.error[:, :, None])[:, :, 0]
    assert fit.data.rounded and fit.problem.weights.turn is not None
    np.testing.assert_allclose(np.std(residual[:, 3:6]), np.std(residual[:, :3]), rtol=0.15)


def test_orientations_that_repeats_know_weigh_by_that_where_angles_are_rounded():
    data = cell(seed=5164, noise=0.01, poses=40)[0]
    fit = base_fit(
        replace(rounded(data), rotation=shaken(places(data), NOISE, np.random.default_rng(5164)), rounded=True)
    )
    np.testing.assert_allclose(fit.problem.weights.values[:, 3:6], 1 / fit.noise.rotation, rtol=1e-9)


def test_significance_is_honest_where_angles_are_rounded():
    """By the rows alone: the priors of such effects are about as narrow as what these rows tell."""
    extra, deviations = ("wrist_coupling", "thermal_joint_drift"), []
    for i in range(12):
        fit = base_fit(
            rounded(cell(seed=5170 + i, noise=0.012, poses=80, robot=ARMS[i % 3])[0]), ARMS[i % 3], more=extra
        )
        sigma = np.sqrt(fit.scatter_of_parameters * np.diag(fit.inverse))
        named = zip(fit.parameters, sigma, strict=True)
        deviations += [fit.model.effect(key).vector()[j] / s for (key, j), s in named if key in extra]
    assert len(deviations) > 100 and 0.85 < np.std(deviations) < 1.15


def stated(digits: int, written: bool, noise: float, *kind, seed: int = 5300, poses: int = 90) -> Measurements:
    """Poses of the independent arm, no repeats, with angles of few digits: rounded when written, or commanded so."""
    g, arm = np.random.default_rng(seed), ARMS_BY_NAME["irb4600_60_205"]()
    place, s = draw_cell(g, arm, tuple(k(g, arm) for k in kind)), draw_states(g, poses, arm, False, False)
    q = np.radians(np.round(np.degrees(s.q), digits))
    seen = measure(place, s if written else replace(s, q=q)) + g.normal(0, noise, (poses, 3))
    channels = {"approach": s.approach, "temperature": s.temperature, "time": s.time}
    rows = tuple(range(1, poses + 1))
    state = State(q, payload_mass=s.mass, payload_center=s.center, **channels)
    return Measurements(state, seen, pose_id=tuple(map(str, rows)), row=rows, line=(1,) * poses)


def fitted(data: Measurements, noise: float = NOISE) -> Fit:
    library, robot = effect_library(), "irb4600_60_205"
    return fit_model(Model(load_robot(robot), robot_name=robot), data, [library[k].null() for k in BASE], noise=noise)


@pytest.mark.parametrize(
    ("digits", "noise", "written", "seed"),
    [
        *(
            (digits, noise, written, 5300)
            for digits, noise in ((1, 5e-5), (2, 3e-5), (3, 8e-6))
            for written in (True, False)
        ),
        # The two of 120 tables of rounded angles that speak against it most, by a log-likelihood of 3.5 and 3.8.
        *((2, 3e-5, True, seed) for seed in (6034, 6036)),
    ],
)
def test_whether_angles_were_rounded_or_commanded_so_is_told_by_the_points(digits, noise, written, seed):
    fit = fitted(stated(digits, written, noise, seed=seed), noise)
    assert fit.data.rounded is written and (fit.noise.sigma > noise) is written
    assert fit.noise.stated == pytest.approx(noise) and 0.75 < fit.variance < 1.3


def test_fine_angles_ask_no_question():
    fit = fitted(stated(5, True, NOISE))
    assert fit.data.rounded is None and fit.problem.weights.turn is None


@pytest.mark.parametrize(("kind", "written"), [(None, True), (kinds.backlash, True), (kinds.backlash, False)])
def test_rounded_angles_are_no_missing_effect_and_a_missing_effect_is_not_rounded_angles(kind, written):
    """What looks like rounding at first is asked again once the effect is in."""
    data = stated(2, written, NOISE, *([kind] if kind else []), seed=5303 if kind else 5300)
    found = diagnose(fitted(data).model, data, noise=NOISE)
    assert [m.key for m in found.missing] == (["backlash"] if kind else [])
    assert found.verdict == ("missing" if kind else "complete") and not (found.remaining and not kind)
    assert found.final.data.rounded is written
    if kind:
        assert add_effects(found.base.model, data, ["backlash"], noise=NOISE).fit.data.rounded is written


def test_rounded_angles_beside_one_coordinate_are_the_error_of_that_one():
    """Of z alone: the noise is that of repeats and what rounding moves z by, as rounded and true angles give it."""
    exact = cell(seed=5160, noise=0.02, poses=60)[0]
    data = replace(rounded(exact), position=np.where([False, False, True], exact.position, np.nan))
    model = base_fit(exact).model
    moved = np.std(predict(model, data.state)[:, 2, 3] - predict(model, exact.state)[:, 2, 3])
    fit = fit_model(model, data)
    assert fit.data.rounded and fit.parts.origin == "repeats and rounded angles"
    assert fit.noise.rounding == pytest.approx(moved, rel=0.25)
    assert fit.noise.sigma == pytest.approx(np.hypot(2e-5, moved), rel=0.25)
