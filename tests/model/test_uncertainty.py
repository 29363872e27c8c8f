"""Standard deviations of predictions: closed forms, coverage on simulated fits, ranges."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.cli.output import write_model
from postproc.effects.base import Effect, param, structure
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.registry import effect_library
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.file import default_model, read_model
from postproc.model.uncertainty import (
    Uncertainty,
    beyond_range,
    position_covariance,
    predict_sigma,
    range_table,
    read_uncertainty,
    uncertainty_table,
)
from postproc.robot.kinematics import forward
from tests.model.arms import parameters, pose_derivatives, with_parameters

RNG = np.random.default_rng(29)


def model_with(known: Uncertainty | None = None):  # type: ignore[no-untyped-def]
    model = default_model()
    model = model.with_effects(*model.effects, JointOffset(offset_rad=[1e-4] * 6), InstrumentFrame())
    return model if known is None else replace(model, fit=uncertainty_table(model, known))


def test_an_uncertain_base_turn_grows_with_the_radius() -> None:
    model = model_with(Uncertainty((("joint_offset", 0),), np.array([[1e-8]]), 3e-6))
    state = model.state(np.zeros((1, 6)))
    reach = predict(model, state)[0, 0, 3]
    expected = np.sqrt((1e-4 * reach) ** 2 / 3 + 3e-6**2)
    assert predict_sigma(model, state)[0] == pytest.approx(expected, rel=1e-3)


def test_the_instruments_frame_does_not_count_in_the_base() -> None:
    model = model_with(Uncertainty((("instrument_frame", 0), ("instrument_frame", 1)), np.diag([4e-8, 4e-8])))
    state = model.state(RNG.uniform(-1, 1, (3, 6)))
    assert predict_sigma(model, state) == pytest.approx(2e-4 * np.sqrt(2 / 3))
    assert predict_sigma(model, state, instrument=False) == pytest.approx(0.0)


def test_coverage_of_the_truth() -> None:
    """Fits of simulated measurements: the error of the prediction lies within 1.96 sigma in about 95 % of cases."""
    truth = model_with()
    x = parameters(truth)
    used = np.arange(12)  # compliances and offsets
    q = RNG.uniform(-1.2, 1.2, (40, 6))
    state = truth.state(q, payload_mass=RNG.uniform(5, 60, 40))
    new = truth.state(RNG.uniform(-1.2, 1.2, (30, 6)), payload_mass=np.full(30, 20.0))
    D = pose_derivatives(truth, state)[:, :3, used].reshape(-1, len(used))
    noise = 3e-5
    covariance = noise**2 * np.linalg.pinv(D.T @ D)
    listed = tuple(("joint_compliance", i) for i in range(6)) + tuple(("joint_offset", i) for i in range(6))
    known = model_with(Uncertainty(listed, covariance))
    sigma = predict_sigma(known, new)
    there = predict(truth, new)[:, :3, 3]
    inside = []
    for _ in range(40):
        step = np.zeros_like(x)
        step[used] = np.linalg.pinv(D) @ (RNG.normal(size=len(D)) * noise)
        error = predict(with_parameters(truth, x + step), new)[:, :3, 3] - there
        inside.append(np.abs(error) < 1.96 * sigma[:, None])
    assert 0.90 < np.mean(inside) < 0.98


def test_a_free_function_is_as_uncertain_as_its_prior_where_it_has_learned_nothing() -> None:
    """Functions drawn from their prior and learned over half of joint 1 by plain normal equations: 95 % hold 95 %."""
    rng, order, noise = np.random.default_rng(7), 6, 2e-5
    size = np.tile(3e-4 / np.arange(1, order + 1), 2)

    def columns(q: np.ndarray) -> np.ndarray:
        angle = q[:, None] * np.arange(1, order + 1)
        return np.hstack([np.sin(angle), np.cos(angle)])

    learned, asked = rng.uniform(-1.5, 0.5, 60), np.linspace(-1.5, 2.8, 44)
    A = columns(learned)
    P = np.linalg.inv(A.T @ A / noise**2 + np.diag(1 / size**2))
    robot = default_model().robot
    state = Model(robot).state(np.outer(asked, [1, 0, 0, 0, 0, 0]))
    nominal = forward(robot, state.q)[:, :3, 3]
    across = np.stack([-nominal[:, 1], nominal[:, 0], 0 * asked], axis=1)  # a turn about z moves the place by so much
    inside, wide = [], []
    for _ in range(60):
        true = rng.normal(size=2 * order) * size
        x = P @ A.T @ (A @ true + noise * rng.normal(size=60)) / noise**2
        known = Uncertainty(tuple(("joint_error_map", i) for i in range(2 * order)), P)
        own = JointErrorMap(joint=(1,), order=order, low_rad=(-1.5,) * 6, high_rad=(0.5,) * 6).with_vector(
            np.append(x, 0.0)
        )
        model = Model(robot, (own,))
        model = replace(model, fit=uncertainty_table(model, known))
        error = predict(model, state)[:, :3, 3] - nominal - across * (columns(asked) @ true)[:, None]
        sigma = predict_sigma(model, state)
        inside.append(np.linalg.norm(error, axis=1) < 1.96 * np.sqrt(3) * sigma)
        wide.append(sigma)
    beyond = asked > 0.5
    for rows in (beyond, ~beyond):
        assert 0.90 < np.mean(np.array(inside)[:, rows]) < 0.99
    far = asked > 1.5
    assert np.mean(np.array(wide)[:, far]) > 10 * np.mean(np.array(wide)[:, ~beyond])


def test_a_file_carries_it(tmp_path: Path) -> None:
    known = Uncertainty((("joint_offset", 1), ("joint_compliance", 2)), np.array([[1e-8, 1e-13], [1e-13, 1e-16]]), 2e-5)
    model = model_with(known)
    state = model.state(RNG.uniform(-1, 1, (4, 6)), payload_mass=np.full(4, 10.0))
    write_model(tmp_path / "m.toml", replace(model, fit={**model.fit, "range": range_table(state)}))
    again = read_model(tmp_path / "m.toml")
    assert again.fit["parameters"] == ["joint_offset.offset_rad[2]", "joint_compliance.compliance_rad_per_Nm[3]"]
    assert predict_sigma(again, state) == pytest.approx(predict_sigma(model, state), rel=1e-8)
    plain = {key: value for key, value in again.fit.items() if key not in ("sigma", "correlation")}
    by_hand = replace(again, fit={**plain, "covariance": [[1e-8, 1e-13], ["1e-13", "1e-16"]]})
    older = replace(again, fit={**plain, "covariance": ["1e-8", "1e-13 1e-16"]})
    assert predict_sigma(older, state) == pytest.approx(predict_sigma(by_hand, state), rel=1e-12)
    assert predict_sigma(by_hand, state) == pytest.approx(predict_sigma(model, state), rel=1e-12)
    assert beyond_range(again, state) == ()
    far = state.with_(q=state.q + np.array([0, 2.0, 0, 0, 0, 0]), payload_mass=np.full(4, 30.0))
    first, second = beyond_range(again, far)
    assert (first.channel, second.channel) == ("q2", "payload")
    assert (second.low, second.high, second.reached) == (10.0, 10.0, 30.0)
    assert first.reached == pytest.approx(far.q[:, 1].max())
    # An effect taken out of the model takes its part of the covariance with it.
    fewer = again.with_effects(*(e for e in again.effects if e.key != "joint_offset"))
    assert read_uncertainty(fewer).parameters == (("joint_compliance", 2),)  # type: ignore[union-attr]


def test_a_side_from_which_no_row_came_is_outside_the_range() -> None:
    side = np.where(RNG.random((40, 6)) < 0.5, -1.0, 1.0)
    side[:, 0], side[:, 3] = 1.0, 0.0
    model = default_model()
    state = model.state(RNG.uniform(-1, 1, (40, 6)), approach=side)
    fitted = replace(model, fit={"range": range_table(state)})
    assert beyond_range(fitted, state) == ()
    assert beyond_range(fitted, state.with_(approach=np.where(side == -1.0, 0.0, side))) == ()
    [found] = beyond_range(fitted, state.with_(approach=-side))
    assert found.rows.all() and found.text == "joint 1 comes from its - side, and was measured from the other alone"


def test_a_model_without_a_fit_says_so() -> None:
    model = default_model()
    assert np.isnan(predict_sigma(model, model.state(np.zeros((2, 6))))).all()
    assert beyond_range(model, model.state(np.zeros((2, 6)))) == ()


@pytest.mark.parametrize("key", ["link_geometry", "bearing_tilt", "base_compliance", "link_compliance"])
def test_a_parameter_that_stands_at_null_counts_too(key: str) -> None:
    """Some bodies move by nothing yet: sigma is the change of the prediction per change of the parameter."""
    null = effect_library()[key]()
    model = default_model()
    model = model.with_effects(*model.effects, null)
    state = model.state(RNG.uniform(-1, 1, (3, 6)), payload_mass=np.full(3, 20.0))
    for index in range(len(null.vector())):
        size = 1e-3 * null.scale()[index]
        known = replace(model, fit=uncertainty_table(model, Uncertainty(((key, index),), np.array([[size**2]]))))
        ends = []
        for side in (1, -1):
            x = null.vector()
            x[index] += side * size
            ends.append(predict(model.with_effects(*model.effects[:-1], null.with_vector(x)), state)[:, :3, 3])
        expected = np.linalg.norm(ends[0] - ends[1], axis=1) / 2 / np.sqrt(3)
        assert predict_sigma(known, state) == pytest.approx(expected, rel=1e-3, abs=1e-12), index


class Jump(Effect, reads=("q",), drafted=True):
    """Joint 1 jumps. Source: a draft."""

    size_rad: float = param(unit="rad", low=-1.0, high=1.0, typical=1e-3)
    edge_rad: float = structure(0.0, low=-0.1, high=0.2)

    def displacement(self, state):
        return np.outer(self.size_rad * (state.q[:, 0] > self.edge_rad), np.eye(6)[0])


def test_between_the_rows_beside_an_edge_a_prediction_is_off_by_half_of_the_step():
    """A turn of joint 1 moves a point by the angle times its distance from the axis, which stands upright."""
    model = default_model("irb4600_60_205").with_effects(Jump(size_rad=2e-3))
    q = np.array([[first, 0.3, -0.2, 0.4, 0.7, 0.0] for first in (-0.2, -0.05, 0.1, 0.3)])
    found = position_covariance(model, State(q), Uncertainty((), np.zeros((0, 0))))
    reach = np.linalg.norm(forward(model.robot, q)[:, :2, 3], axis=1)
    expected = np.array([0.0, 1e-3, 1e-3, 0.0]) * reach
    np.testing.assert_allclose(np.sqrt(np.trace(found, axis1=1, axis2=2)), expected, rtol=2e-3)
    library = model.with_effects(Jump())
    assert not position_covariance(library, State(q), Uncertainty((), np.zeros((0, 0)))).any()
