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
from tests.report.build import BACKLASH, chain, sample


def law(fit: Fit, key: str, where: str) -> Law:
    [law] = [law for law in laws_of(fit, [key]) if law.where == where]
    return law


def parameter(fit: Fit, key: str, index: int) -> tuple[float, float]:
    """Value and standard deviation."""
    effect = fit.model.effect(key)
    assert effect is not None
    return float(effect.vector()[index]), fit.sigma[key, index]


@pytest.fixture(scope="module")
def fitted() -> Fit:
    return fit_model(*sample(BACKLASH), [Backlash.null()])


def test_a_spring_is_a_line_through_the_load(fitted: Fit) -> None:
    """Compliance C of joint 2: mrad = 1000 C N m, its band 1000 sigma_C N m."""
    spring = law(fitted, "joint_compliance", "joint 2")
    C, sigma = parameter(fitted, "joint_compliance", 1)
    assert (spring.channel, spring.unit) == ("load2", "mrad")
    assert spring.curve.y == pytest.approx(1e3 * C * spring.curve.x, rel=1e-6, abs=1e-9)
    assert spring.curve.sigma == pytest.approx(1e3 * sigma * np.abs(spring.curve.x), rel=1e-3)
    # The data scatter about the law by the noise at the lever of the arm, not by the deflection itself.
    assert np.nanstd(spring.y - 1e3 * C * spring.x) < 0.2 * np.nanstd(spring.y)


def test_lost_motion_is_a_step_of_the_approach(fitted: Fit) -> None:
    step = law(fitted, "backlash", "joint 4")
    gap = 1e3 * parameter(fitted, "backlash", 3)[0]
    assert step.channel == "dir4" and step.curve.x.tolist() == [-1.0, 1.0]
    assert np.abs(step.curve.y) == pytest.approx([gap, gap]) and step.curve.y[0] == -step.curve.y[1]


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


@pytest.mark.parametrize("joint", [2, 3])
def test_a_force_is_drawn_as_torques_on_the_joints(fitted: Fit, joint: int) -> None:
    """Virtual work: the torque on a joint is f . dp/dq, here from plain differences of the forward kinematics."""
    model = fitted.model.with_effects(*fitted.model.effects, ForearmSpring(stiffness_N=200.0))
    fit = replace(fitted, problem=replace(fitted.problem, model=model))
    robot, q = model.robot, fit.problem.sensitivity.state.q
    torque = law(fit, "forearm_spring", f"torque on joint {joint}")

    def height(q: np.ndarray) -> float:
        forearm = chain(robot.link, robot.axis, q)[2]
        return float((forearm @ [0.4, 0.0, 0.0, 1.0])[2])

    # The bodies stand where the deflected arm has them, a millimetre or so from here.
    step = 1e-5 * np.eye(6)[joint - 1]
    lever = np.array([(height(row + step) - height(row - step)) / 2e-5 for row in q])
    assert torque.unit == "N m" and torque.y == pytest.approx(200.0 * np.sin(q[:, 1]) * lever, abs=1.0)


def test_every_law_has_a_chart(fitted: Fit) -> None:
    charts = law_charts(laws_of(fitted, ["backlash"]))
    assert charts and all(chart.count('class="line law"') == 2 for chart in charts)
    assert "backlash: joint 4" in charts[0]
