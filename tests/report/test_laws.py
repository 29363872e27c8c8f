"""The laws that pages draw are those of the effects, worked out here from their equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.effects.base import Effect, Load, param
from postproc.effects.library.joints.backlash import Backlash
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.report.drawing.laws import Law, law_charts, laws_of
from tests.report.test_improve import sample


def law(fit: Fit, key: str, where: str) -> Law:
    [found] = [one for one in laws_of(fit, [key]) if one.where == where]
    return found


@pytest.fixture(scope="module")
def fitted() -> Fit:
    model, data = sample("simulated_backlash.csv")
    return fit_model(model, data, [Backlash.null()])


def test_a_spring_is_a_line_through_the_load(fitted: Fit) -> None:
    """Compliance C of joint 2: mrad = 1000 C N m, its band 1000 sigma_C N m."""
    effect = fitted.model.effect("joint_compliance")
    assert effect is not None
    found = law(fitted, "joint_compliance", "joint 2")
    assert (found.channel, found.unit) == ("load2", "mrad")
    C = effect.vector()[1]
    assert found.curve.y == pytest.approx(1e3 * C * found.curve.x, rel=1e-6, abs=1e-9)
    sigma = fitted.sigma["joint_compliance", 1]
    assert found.curve.sigma == pytest.approx(1e3 * sigma * np.abs(found.curve.x), rel=1e-3)
    # The data scatter about the law by the noise at the lever of the arm, not by the deflection itself.
    rest = found.y - 1e3 * C * found.x
    assert np.nanstd(rest) < 0.2 * np.nanstd(found.y)


def test_lost_motion_is_a_step_of_the_approach(fitted: Fit) -> None:
    effect = fitted.model.effect("backlash")
    assert effect is not None
    found = law(fitted, "backlash", "joint 4")
    assert found.channel == "dir4" and found.curve.x.tolist() == [-1.0, 1.0]
    gap = 1e3 * effect.vector()[3]
    assert np.abs(found.curve.y) == pytest.approx([gap, gap]) and found.curve.y[0] == -found.curve.y[1]


def test_what_is_the_same_everywhere_is_no_law(fitted: Fit) -> None:
    assert laws_of(fitted, ["joint_offset", "tool_frame", "instrument_frame", "unknown"]) == []


class ForearmSpring(Effect, reads=("q", "pose", "robot")):
    """A spring pulls the forearm up, k sin q2 [N] in z at its joint. Source: this test."""

    stiffness_N: float = param(unit="N", typical=100.0)

    def load(self, state: State) -> Load:
        T = np.asarray(state.T_base_body)
        force = np.zeros((len(state), 3))
        force[:, 2] = self.stiffness_N * np.sin(state.q[:, 1])
        point = T[:, 3, :3, 3] + 0.4 * T[:, 3, :3, 0]
        return Load(body={3: np.hstack([force, np.cross(point, force)])})


def test_a_force_is_drawn_as_torques_on_the_joints(fitted: Fit) -> None:
    """Virtual work: the torque on a joint is f . dp/dq, here from plain differences of the forward kinematics."""
    effect = ForearmSpring(stiffness_N=200.0)
    problem = replace(fitted.problem, model=fitted.model.with_effects(*fitted.model.effects, effect))
    fit = replace(fitted, problem=problem)
    found = law(fit, "forearm_spring", "torque on joint 2")
    assert found.unit == "N m"
    robot, state = fit.model.robot, fit.problem.sensitivity.state

    def point(q: np.ndarray) -> np.ndarray:
        T = np.eye(4)
        for j in range(3):
            x, y, z = robot.axis[j]
            S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            turn = np.eye(4)
            turn[:3, :3] += np.sin(q[j]) * S + (1 - np.cos(q[j])) * S @ S
            T = T @ robot.link[j] @ turn
        return T[:3, 3] + 0.4 * T[:3, 0]

    # The bodies stand where the deflected arm has them, a millimetre or so from here.
    step = 1e-5 * np.eye(6)[1]
    lever = np.array([(point(q + step) - point(q - step))[2] / 2e-5 for q in state.q])
    assert found.y == pytest.approx(200.0 * np.sin(state.q[:, 1]) * lever, abs=1.0)


def test_every_law_has_a_chart(fitted: Fit) -> None:
    charts = law_charts(laws_of(fitted, ["backlash"]))
    assert charts and all(chart.count('class="line law"') == 2 for chart in charts)
    assert "backlash: joint 4" in charts[0]
