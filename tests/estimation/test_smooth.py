"""How fine a free function is: chosen on rows that the fit has not seen."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear, basis_of
from postproc.estimation.solving import smooth
from postproc.estimation.solving.smooth import likeliest
from postproc.estimation.solving.solve import Terms
from tests.identification.cells import base_fit, cell, true_error
from tests.independent.cells import Hidden


def broadband(g: np.random.Generator, arm: object) -> Hidden:
    """Every joint has its own errors of orders 1 to 40, 200 microradians in all."""
    k = np.arange(1, 41)
    size = 2e-4 / np.sqrt(k * np.sum(1 / k))
    phase = g.uniform(0, 2 * np.pi, (6, len(k)))
    return Hidden(
        "broadband",
        "joint_error_map",
        channels=(),
        joint=lambda s, tau: np.sum(np.sqrt(2) * size * np.sin(k * s.q[:, :, None] + phase), axis=2),
    )


def few(g: np.random.Generator, arm: object) -> Hidden:
    """Every joint has three smooth waves."""
    k = np.arange(1, 4)
    size = g.normal(0, 1e-4, (2, 6, len(k)))
    return Hidden(
        "few",
        "joint_error_map",
        channels=(),
        joint=lambda s, tau: np.sum(
            size[0] * np.sin(k * s.q[:, :, None]) + size[1] * np.cos(k * s.q[:, :, None]), axis=2
        ),
    )


def eight(g: np.random.Generator, arm: object) -> Hidden:
    """Every joint has eight waves, and turns a little too far."""
    k, phase = np.arange(1, 9), g.uniform(0, 2 * np.pi, (6, 8))
    return Hidden(
        "eight",
        "joint_error_map",
        channels=(),
        joint=lambda s, tau: 3e-4 * (np.sum(np.sin(k * s.q[:, :, None] + phase) / k**2, axis=2) + s.q / np.pi),
    )


def everywhere(order: int) -> JointErrorMap:
    return JointErrorMap(joint=(1, 2, 3, 4, 5, 6), order=order)


def held_at(base, order: int, true) -> float:
    """True error of a map of a stated order, with the strength that suits it."""

    class Stated(JointErrorMap, key="joint_error_map"):
        def resolutions(self, state):
            return ((self,),)

    return true_error(fit_model(base.model, base.data, [Stated(joint=(1, 2, 3, 4, 5, 6), order=order)]), true)


def test_broadband_errors_get_more_coefficients_than_rows_could_determine():
    data, true = cell(broadband, seed=951, poses=150, noise=0.02)
    base = base_fit(data)
    fit = fit_model(base.model, data, [everywhere(8)])
    found = fit.model.effect("joint_error_map")
    assert found.order >= 25
    assert 12 * found.order > 150
    assert true_error(fit, true) < 0.8 * held_at(base, 8, true)


def one_joint(g: np.random.Generator, arm: object) -> Hidden:
    """One joint has errors of orders 1 to 40."""
    whole = broadband(g, arm).joint
    return Hidden("one_joint", "joint_error_map", joint=lambda s, tau: whole(s, tau) * (np.arange(6) == 1))


def test_a_map_of_one_joint_is_as_fine_as_its_rows_can_carry():
    data, true = cell(one_joint, seed=953, poses=200, noise=0.02)
    fit = fit_model(base_fit(data).model, data, [JointErrorMap(joint=(2,), order=16)])
    assert fit.model.effect("joint_error_map").order >= 40
    assert true_error(fit, true) < 0.02e-3


def test_smooth_errors_get_few():
    data, true = cell(few, seed=952, poses=150, noise=0.02)
    fit = fit_model(base_fit(data).model, data, [everywhere(25)])
    assert fit.model.effect("joint_error_map").order <= 8
    assert true_error(fit, true) < 0.015e-3


def test_a_coarser_map_says_as_much_as_the_likeliest_and_its_ends_need_not_meet():
    """Not as much as the finest, which pays for what there is nothing of."""
    data, true = cell(eight, seed=957, poses=200, noise=0.01)
    low, high = data.state.q.min(axis=0), data.state.q.max(axis=0)
    whole = JointErrorMap(joint=(1, 2, 3, 4, 5, 6), low_rad=tuple(low), high_rad=tuple(high))
    fit = fit_model(base_fit(data).model, data, [whole])
    found = fit.model.effect("joint_error_map")
    assert found.order == 8
    assert found.slope_rad[3] == pytest.approx(3e-4, rel=0.1)
    assert true_error(fit, true) < 0.004e-3


def test_a_map_on_three_joints_is_tried_on_all_that_move():
    data, _ = cell(broadband, seed=951, poses=150, noise=0.02)
    wide = JointErrorMap(joint=(1, 2, 3), order=8).resolutions(data.state)
    assert {e.joint for forms in wide for e in forms} == {(1, 2, 3), (1, 2, 3, 4, 5, 6)}
    narrow = JointErrorMap(joint=(2,), order=8).resolutions(data.state)
    assert {e.joint for forms in narrow for e in forms} == {(2,)}
    assert 2 * max(e.order for forms in narrow for e in forms) <= len(data)


def test_a_model_with_more_coefficients_than_numbers_is_fitted_again_on_its_own_data():
    data, true = cell(broadband, seed=5, noise=0.02, poses=60)
    more = everywhere(25)
    assert len(more.vector()) > 3 * len(data)
    fit = fit_model(base_fit(data).model, data, [more], terms=Terms(strength={"joint_error_map": 1.0}))
    assert fit.freedom > 0 and true_error(fit, true) < true_error(base_fit(data), true)


def test_a_free_function_beside_an_effect_of_which_nothing_is_fitted():
    data, _ = cell(seed=731, poses=60)
    base = base_fit(data)
    none = {**base.free, "joint_compliance": np.zeros(6, dtype=bool)}
    fit = fit_model(base.model, data, [JointErrorMap(joint=(2,), order=8)], terms=Terms(none))
    assert not any(key == "joint_compliance" for key, _ in fit.parameters)


def test_the_chosen_strength_is_the_likeliest():
    """Against the density of M y itself: y in coordinates that the fitted parameters cannot reach, one Gaussian."""
    data, _ = cell(few, seed=953, poses=60, noise=0.02)
    fit = base_fit(data)
    q = data.state.q
    form = JointErrorMap(joint=(2, 3), order=4, fall=2.0)
    null = np.linalg.svd(fit.columns)[0][:, fit.columns.shape[1] :]
    y = null.T @ fit.problem.residual
    waves = np.array([f(k * q[:, j]) for f in (np.sin, np.cos) for j in (1, 2) for k in range(1, 5)])
    size = np.tile(1e-4 / np.arange(1, 5.0), 4)
    J = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, 1:3])
    of = [0, 0, 0, 0, 1, 1, 1, 1] * 2 + [0, 1]
    waves, size = np.vstack([waves, q[:, 1:3].T / np.pi]), np.append(size, [1e-4, 1e-4])
    Z = null.T @ np.stack([J[:, j] * np.repeat(w, 3) * s for j, w, s in zip(of, waves, size, strict=True)], axis=1)

    def likelihood(strength: float) -> float:
        K = np.eye(len(y)) + Z @ Z.T / strength**2
        return -0.5 * (len(y) * np.log(y @ np.linalg.solve(K, y)) + np.linalg.slogdet(K)[1])

    known = Linear(fit.problem.residual, basis_of(fit.columns, fit.penalty), fit.problem.row)
    found = likeliest(known, fit.problem, form)
    best = max(np.geomspace(1e-3, 1e3, 601), key=likelihood)
    assert found.strength == pytest.approx(best, rel=0.07)
    assert found.likelihood == pytest.approx(likelihood(found.strength), abs=1e-3)


def test_a_function_that_could_take_up_everything_leaves_half_of_the_numbers():
    """What is as smooth as the penalty expects, without noise: at any strength below it is all as likely."""
    rng = np.random.default_rng(2)
    form = JointErrorMap(joint=(1, 2, 3, 4, 5, 6), order=40)
    columns = 3e4 * rng.normal(size=(150, len(form.vector())))
    y = columns @ (rng.normal(size=columns.shape[1]) * form.scale() / form.roughness())
    known = Linear(y, np.zeros((150, 0)), np.arange(150))
    found = likeliest(known, SimpleNamespace(columns=lambda form, mask: columns), form)
    own = columns * (form.scale() / form.roughness())
    value = np.maximum(np.linalg.eigvalsh(own @ own.T), 0.0)
    assert np.sum(value / (value + found.strength**2)) <= 75


def test_how_smooth_a_map_is_many_rows_need_not_be_asked(monkeypatch):
    data, _ = cell(broadband, seed=903, poses=300)
    base = base_fit(data)
    whole = fit_model(base.model, data, [everywhere(8)])
    monkeypatch.setattr(smooth, "MOST_NUMBERS_SMOOTHED", 400)
    few = fit_model(base.model, data, [everywhere(8)])
    assert few.strength != whole.strength and few.data is not whole.data and len(few.data) == len(data)
    assert few.held_out_rms == pytest.approx(whole.held_out_rms, rel=0.05)
