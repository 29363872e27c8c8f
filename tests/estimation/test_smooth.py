"""How fine a free function is: chosen on rows that the fit has not seen."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear, basis_of
from postproc.estimation.solving.smooth import likeliest
from postproc.estimation.solving.solve import Terms
from tests.identification.cells import base_fit, cell, true_error
from tests.independent.cells import Hidden

EVERY = (1, 2, 3, 4, 5, 6)


def waves(orders: int, size, joints=EVERY, slope: float = 0.0):
    """A hidden effect: errors of orders 1 to ``orders`` of some joints, each of size(order) [rad], and a slope."""
    k = np.arange(1, orders + 1)
    chosen = np.isin(np.arange(1, 7), joints)

    def kind(g, arm):
        phase = g.uniform(0, 2 * np.pi, (6, orders))

        def turn(s, tau):
            return chosen * (np.sum(size(k) * np.sin(k * s.q[:, :, None] + phase), axis=2) + slope * s.q / np.pi)

        return Hidden("waves", "joint_error_map", channels=(), joint=turn)

    return kind


def as_root(k: np.ndarray) -> np.ndarray:
    """200 microradian in all, as 1 over the root of the order."""
    return 2e-4 * np.sqrt(2 / k) / np.sqrt(np.sum(1 / k))


BROADBAND = waves(40, as_root)
ONE_JOINT = waves(40, as_root, joints=(2,))
FEW = waves(3, lambda k: 1.4e-4 + 0 * k)
EIGHT = waves(8, lambda k: 3e-4 / k**2, slope=3e-4)


@pytest.mark.parametrize(
    ("kind", "seed", "poses", "noise", "start", "orders", "error_mm"),
    [
        (BROADBAND, 951, 150, 0.02, JointErrorMap(joint=EVERY, order=8), (25, 64), None),
        (ONE_JOINT, 953, 200, 0.02, JointErrorMap(joint=(2,), order=16), (40, 64), 0.02),
        (FEW, 952, 150, 0.02, JointErrorMap(joint=EVERY, order=25), (3, 8), 0.015),
        # Not as fine as the finest, which pays for what there is nothing of; its ends need not meet.
        (EIGHT, 957, 200, 0.01, None, (8, 8), 0.004),
    ],
)
def test_a_map_is_as_fine_as_its_rows_can_carry_and_no_finer_than_the_error(
    kind, seed, poses, noise, start, orders, error_mm
):
    data, true = cell(kind, seed=seed, poses=poses, noise=noise)
    low, high = tuple(data.state.q.min(axis=0)), tuple(data.state.q.max(axis=0))
    fit = fit_model(base_fit(data).model, data, [start or JointErrorMap(joint=EVERY, low_rad=low, high_rad=high)])
    found = fit.model.effect("joint_error_map")
    assert orders[0] <= found.order <= orders[1]
    if error_mm is not None:
        assert true_error(fit, true) < 1e-3 * error_mm
    if kind is EIGHT:
        assert found.slope_rad[3] == pytest.approx(3e-4, rel=0.1)
    if kind is BROADBAND:  # more coefficients than rows could determine are worth it
        assert 12 * found.order > poses and true_error(fit, true) < 0.8 * error_of_order(data, true, 8)


def error_of_order(data, true, order: int) -> float:
    """True error of a map of a stated order, with the strength that suits it."""

    class Stated(JointErrorMap, key="joint_error_map"):
        def resolutions(self, state):
            return ((self,),)

    return true_error(fit_model(base_fit(data).model, data, [Stated(joint=EVERY, order=order)]), true)


@pytest.mark.parametrize(("joints", "tried"), [((1, 2, 3), {(1, 2, 3), EVERY}), ((2,), {(2,)})])
def test_a_map_on_three_joints_is_tried_on_all_that_move(joints, tried):
    state = cell(BROADBAND, seed=951, poses=150, noise=0.02)[0].state
    forms = [e for series in JointErrorMap(joint=joints, order=8).resolutions(state) for e in series]
    assert {e.joint for e in forms} == tried
    assert len(joints) > 1 or 2 * max(e.order for e in forms) <= len(state)


def test_a_model_with_more_coefficients_than_numbers_is_fitted_again_on_its_own_data():
    data, true = cell(BROADBAND, seed=5, noise=0.02, poses=60)
    fine = JointErrorMap(joint=EVERY, order=25)
    fit = fit_model(base_fit(data).model, data, [fine], terms=Terms(strength={"joint_error_map": 1.0}))
    assert len(fine.vector()) > 3 * len(data)
    assert fit.freedom > 0 and true_error(fit, true) < true_error(base_fit(data), true)


def test_a_free_function_beside_an_effect_of_which_nothing_is_fitted():
    base = base_fit(cell(seed=731, poses=60)[0])
    none = {**base.free, "joint_compliance": np.zeros(6, dtype=bool)}
    fit = fit_model(base.model, base.data, [JointErrorMap(joint=(2,), order=8)], terms=Terms(none))
    assert not any(key == "joint_compliance" for key, _ in fit.parameters)


def test_the_chosen_strength_is_the_likeliest():
    """Against the density of M y itself: y in coordinates that the fitted parameters cannot reach, one Gaussian."""
    fit = base_fit(cell(FEW, seed=953, poses=60, noise=0.02)[0])
    q, form = fit.data.state.q, JointErrorMap(joint=(2, 3), order=4, fall=2.0)
    null = np.linalg.svd(fit.columns)[0][:, fit.columns.shape[1] :]
    y, J = null.T @ fit.problem.residual, fit.problem.turns[:, 1:3]
    waves = [f(k * q[:, j]) * 1e-4 / k for f in (np.sin, np.cos) for j in (1, 2) for k in range(1, 5)]
    waves += [1e-4 * q[:, j] / np.pi for j in (1, 2)]
    joint = [0, 0, 0, 0, 1, 1, 1, 1] * 2 + [0, 1]
    Z = null.T @ np.stack([J[:, j] * wave[fit.problem.row] for j, wave in zip(joint, waves, strict=True)], axis=1)

    def likelihood(strength: float) -> float:
        K = np.eye(len(y)) + Z @ Z.T / strength**2
        return -0.5 * (len(y) * np.log(y @ np.linalg.solve(K, y)) + np.linalg.slogdet(K)[1])

    found = likeliest(
        Linear(fit.problem.residual, basis_of(fit.columns, fit.penalty), fit.problem.row), fit.problem, form
    )
    assert found.strength == pytest.approx(max(np.geomspace(1e-3, 1e3, 601), key=likelihood), rel=0.07)
    assert found.likelihood == pytest.approx(likelihood(found.strength), abs=1e-3)
