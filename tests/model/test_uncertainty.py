"""Standard deviations of predictions: closed forms, coverage on simulated fits, ranges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.cli.output import write_model
from postproc.effects.library.curve import ChannelCurve
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.registry import effect_library
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.file import default_model, read_model
from postproc.model.uncertainty.prediction import (
    Uncertainty,
    beyond_range,
    position_covariance,
    predict_sigma,
    range_table,
    read_uncertainty,
    uncertainty_table,
)
from postproc.robot.kinematics import forward
from tests.model.arms import parameter_slope, parameters, pose_derivatives, with_more, with_parameters

ARM = default_model()
FITTED = with_more(ARM, JointOffset(offset_rad=[1e-4] * 6), InstrumentFrame())


def knowing(model: Model, listed, covariance, unexplained: float = 0.0) -> Model:
    """The model with what a fit of these parameters noted of its uncertainty."""
    return replace(model, fit=uncertainty_table(model, Uncertainty(tuple(listed), np.array(covariance), unexplained)))


def draws(n: int, seed: int = 29) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (n, 6))


def test_an_uncertain_base_turn_grows_with_the_radius_and_the_instruments_frame_does_not_count_in_the_base():
    base = knowing(FITTED, [("joint_offset", 0)], [[1e-8]], 3e-6)
    state = base.state(np.eye(3, 6))
    reach = np.linalg.norm(predict(base, state)[:, :2, 3], axis=1)
    assert predict_sigma(base, state) == pytest.approx(np.sqrt((1e-4 * reach) ** 2 / 3 + 3e-6**2), rel=1e-3)
    frame = knowing(FITTED, [("instrument_frame", 0), ("instrument_frame", 1)], np.diag([4e-8, 4e-8]))
    assert predict_sigma(frame, state) == pytest.approx(2e-4 * np.sqrt(2 / 3))
    assert predict_sigma(frame, state, instrument=False) == pytest.approx(0.0)


def test_coverage_of_the_truth():
    """Fits of simulated measurements: the error of the prediction lies within 1.96 sigma in about 95 % of cases."""
    g, noise, used = np.random.default_rng(29), 3e-5, np.arange(12)  # compliances and offsets
    state = FITTED.state(draws(40), payload_mass=g.uniform(5, 60, 40))
    new = FITTED.state(draws(30, seed=30), payload_mass=np.full(30, 20.0))
    D = pose_derivatives(FITTED, state)[:, :3, used].reshape(-1, len(used))
    listed = [*(("joint_compliance", i) for i in range(6)), *(("joint_offset", i) for i in range(6))]
    sigma = predict_sigma(knowing(FITTED, listed, noise**2 * np.linalg.pinv(D.T @ D)), new)
    truth, inside = predict(FITTED, new)[:, :3, 3], []
    for _ in range(40):
        x = parameters(FITTED)
        x[used] += np.linalg.pinv(D) @ (g.normal(size=len(D)) * noise)
        inside.append(np.abs(predict(with_parameters(FITTED, x), new)[:, :3, 3] - truth) < 1.96 * sigma[:, None])
    assert 0.90 < np.mean(inside) < 0.98


def test_a_free_function_is_as_uncertain_as_its_prior_where_it_has_learned_nothing():
    """Functions drawn from their prior and learned over half of joint 1 by plain normal equations: 95 % hold 95 %."""
    rng, order, noise = np.random.default_rng(7), 6, 2e-5
    size = np.tile(3e-4 / np.arange(1, order + 1), 2)

    def columns(q: np.ndarray) -> np.ndarray:
        angle = q[:, None] * np.arange(1, order + 1)
        return np.hstack([np.sin(angle), np.cos(angle)])

    learned, wanted = rng.uniform(-1.5, 0.5, 60), np.linspace(-1.5, 2.8, 44)
    A = columns(learned)
    P = np.linalg.inv(A.T @ A / noise**2 + np.diag(1 / size**2))
    state = ARM.state(np.outer(wanted, [1, 0, 0, 0, 0, 0]))
    nominal = forward(ARM.robot, state.q)[:, :3, 3]
    across = np.stack([-nominal[:, 1], nominal[:, 0], 0 * wanted], axis=1)  # a turn about z moves the place by so much
    empty = JointErrorMap(joint=(1,), order=order, low_rad=(-1.5,) * 6, high_rad=(0.5,) * 6)
    inside, wide = [], []
    for _ in range(60):
        true = rng.normal(size=2 * order) * size
        x = P @ A.T @ (A @ true + noise * rng.normal(size=60)) / noise**2
        bare = Model(ARM.robot, (empty.with_vector(np.append(x, 0.0)),))
        model = knowing(bare, [("joint_error_map", i) for i in range(2 * order)], P)
        error = predict(model, state)[:, :3, 3] - nominal - across * (columns(wanted) @ true)[:, None]
        sigma = predict_sigma(model, state)
        inside.append(np.linalg.norm(error, axis=1) < 1.96 * np.sqrt(3) * sigma)
        wide.append(sigma)
    beyond = wanted > 0.5
    for rows in (beyond, ~beyond):
        assert 0.90 < np.mean(np.array(inside)[:, rows]) < 0.99
    assert np.mean(np.array(wide)[:, wanted > 1.5]) > 10 * np.mean(np.array(wide)[:, ~beyond])


def test_a_file_carries_it_and_a_model_without_a_fit_has_none(tmp_path):
    listed = [("joint_offset", 1), ("joint_compliance", 2)]
    model = knowing(FITTED, listed, [[1e-8, 1e-13], [1e-13, 1e-16]], 2e-5)
    state = model.state(draws(4), payload_mass=np.full(4, 10.0))
    write_model(tmp_path / "m.toml", model)
    again = read_model(tmp_path / "m.toml")
    sigma, plain = (
        predict_sigma(model, state),
        {k: v for k, v in again.fit.items() if k not in ("sigma", "correlation")},
    )
    assert again.fit["parameters"] == ["joint_offset.offset_rad[2]", "joint_compliance.compliance_rad_per_Nm[3]"]
    assert predict_sigma(again, state) == pytest.approx(sigma, rel=1e-8)
    assert np.isnan(predict_sigma(FITTED, state)).all()
    for rows in ([[1e-8, 1e-13], ["1e-13", "1e-16"]], ["1e-8", "1e-13 1e-16"]):  # by hand, and of older files
        stated = replace(again, fit={**plain, "covariance": rows})
        assert predict_sigma(stated, state) == pytest.approx(sigma, rel=1e-12)
    # An effect taken out of the model takes its part of the covariance with it.
    fewer = read_uncertainty(again.with_effects(*(e for e in again.effects if e.key != "joint_offset")))
    assert fewer is not None and fewer.parameters == (("joint_compliance", 2),)


def test_states_beyond_the_measured_range_are_named():
    state = FITTED.state(draws(4), payload_mass=np.full(4, 10.0))
    fitted = replace(FITTED, fit={"range": range_table(state)})
    assert beyond_range(fitted, state) == beyond_range(ARM, state) == ()
    far = state.with_(q=state.q + np.array([0, 2.5, 0, 0, 0, 0]), payload_mass=np.full(4, 30.0))
    first, second = beyond_range(fitted, far)
    assert (first.channel, first.reached) == ("q2", pytest.approx(far.q[:, 1].max()))
    assert second.text == "payload is 30.0 kg, measured from 10.0 to 10.0"


def test_angles_that_no_row_had_are_within_the_range_of_a_model_of_springs_alone():
    state = ARM.state(draws(4), payload_mass=np.full(4, 10.0))
    far = state.with_(q=state.q + 2.5, payload_mass=np.full(4, 30.0))
    springs, zeros = (replace(arm, fit={"range": range_table(state)}) for arm in (ARM, FITTED))
    assert [b.channel for b in beyond_range(springs, far)] == ["payload"]
    assert [b.channel for b in beyond_range(zeros, far)][-2:] == ["q6", "payload"]


def test_a_side_from_which_no_row_came_is_outside_the_range():
    side = np.where(np.random.default_rng(29).random((40, 6)) < 0.5, -1.0, 1.0)
    side[:, 0], side[:, 3] = 1.0, 0.0
    state = ARM.state(draws(40), approach=side)
    fitted = replace(ARM, fit={"range": range_table(state)})
    assert beyond_range(fitted, state) == ()
    assert beyond_range(fitted, state.with_(approach=np.where(side == -1.0, 0.0, side))) == ()
    [beyond] = beyond_range(fitted, state.with_(approach=-side))
    assert beyond.rows.all() and beyond.text == "joint 1 comes from its - side, and was measured from the other alone"


@pytest.mark.parametrize("key", ["link_geometry", "bearing_tilt", "base_compliance", "link_compliance"])
def test_a_parameter_that_stands_at_null_counts_too(key):
    """Some bodies move by nothing yet: sigma is the change of the prediction per change of the parameter."""
    null = effect_library()[key]()
    model = with_more(ARM, null)
    state = model.state(draws(3), payload_mass=np.full(3, 20.0))
    for index, scale in enumerate(null.scale()):
        size, k = 1e-3 * scale, len(parameters(ARM)) + index
        expected = size * np.linalg.norm(parameter_slope(model, state, k, size)[:, :3], axis=1) / np.sqrt(3)
        sigma = predict_sigma(knowing(model, [(key, index)], [[size**2]]), state)
        assert sigma == pytest.approx(expected, rel=1e-3, abs=1e-12), index


JUMP = ChannelCurve(place=("joint 1",), channels=("q1",), basis=("step",), numbers=(0.05,), gap=(0.3,), largest=(1.0,))


def test_between_the_rows_beside_an_edge_a_prediction_is_off_by_half_of_the_step():
    """A turn of joint 1 moves a point by the angle times its distance from the axis, which stands upright."""
    nothing = Uncertainty((), np.zeros((0, 0)))
    q = np.array([[first, 0.3, -0.2, 0.4, 0.7, 0.0] for first in (-0.2, -0.05, 0.1, 0.3)])
    covariance = position_covariance(ARM.with_effects(JUMP.with_vector(np.array([2e-3]))), State(q), nothing)
    reach = np.linalg.norm(forward(ARM.robot, q)[:, :2, 3], axis=1)
    expected = np.array([0.0, 1e-3, 1e-3, 0.0]) * reach
    np.testing.assert_allclose(np.sqrt(np.trace(covariance, axis1=1, axis2=2)), expected, rtol=2e-3)
    assert not position_covariance(ARM.with_effects(JUMP), State(q), nothing).any()
