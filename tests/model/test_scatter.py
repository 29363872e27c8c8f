"""What remains of the deflection where the stiffness is an estimate, beside arms drawn in plain numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.diagnostics import Source
from postproc.model.file import default_model, parse_model
from postproc.model.rewrite import render_model
from postproc.model.scatter import remaining_fraction
from tests.independent import arm as A

TCP = A.transform(np.eye(3), np.array([0.0, 0.0, 0.35]))
NAME = "irb4600_40_255"


def states(seed: int, n: int) -> State:
    g = np.random.default_rng(seed)
    q = np.array([0.0, 0.4, 0.1, 0.0, 0.9, 0.0]) + g.uniform(-0.4, 0.4, (n, 6))
    wrench = np.tile([150.0, -100.0, -200.0, 0.0, 0.0, 0.0], (n, 1))
    return State(
        q, payload_mass=np.full(n, 12.0), payload_center=np.tile([0, 0, 0.15], (n, 1)), wrench=wrench, T_flange_tcp=TCP
    )


def droop(arm: A.Arm, compliance: np.ndarray, state: State) -> np.ndarray:
    """Deflection of the TCP (n, 3) [m] under weight, payload and force of an arm, to first order."""
    f = arm.forward(state.q, TCP)
    load = A.Load(12.0, np.array([0, 0, 0.15]), np.array([150.0, -100.0, -200.0]))
    tau, _ = A.spring_loads(f, A.dead_loads(arm, f, load))
    tip = f.tcp[:, :3, 3]
    moved = np.zeros((len(tip), 3))
    for j in range(6):
        moved += np.cross(f.axis[j], tip - f.pivot[j]) * (compliance[j] * tau[:, j])[:, None]
    return moved


def test_the_interval_holds_the_arms_that_are_drawn() -> None:
    """400 arms about the estimate, each corrected by the estimate: 95 % of them leave a share inside the interval."""
    model, arm, state = default_model(NAME), A.ARMS[NAME](), states(3, 40)
    assert model.robot.joint_compliance is not None
    low, high = remaining_fraction(model, state)
    g = np.random.default_rng(11)
    factor, spread = np.array([4, 3, 2.5, 2.5, 3.5, 2.5]), np.array([1.0, 1.5, 1.7, 1.6, 1.8, 2.3, 4.0])
    corrected = droop(arm, model.robot.joint_compliance, state)
    left = []
    for _ in range(400):
        compliance = model.robot.joint_compliance * factor ** (g.normal(size=6) / 1.96)
        other = replace(arm, mass=arm.mass * spread ** g.normal(size=7))
        real = droop(other, compliance, state)
        left.append(np.linalg.norm(real - corrected) / np.linalg.norm(real))
    inside = np.mean((np.array(left) >= low) & (np.array(left) <= high))
    assert abs(inside - 0.95) < 0.03
    assert high == pytest.approx(np.quantile(left, 0.975), rel=0.2)
    assert 0.0 < low < 0.4 < high


def test_what_is_known_leaves_nothing() -> None:
    model = default_model(NAME)
    sure = replace(model.robot, stiffness_factor=np.ones(6), mass_factor=np.ones(7))
    assert remaining_fraction(replace(model, robot=sure), states(4, 5)) == (0.0, 0.0)


def test_one_spring_alone_has_a_closed_form() -> None:
    """Joint 2 alone, masses known: 95 % of arms leave |1 - 1/f| with f log-normal, which rises on both sides of 1."""
    model = default_model(NAME)
    springs = model.effects[0].with_vector(np.array([0, 1e-6, 0, 0, 0, 0.0]))
    robot = replace(model.robot, mass_factor=np.ones(7), stiffness_factor=np.full(6, 3.0))
    low, high = remaining_fraction(replace(model, robot=robot, effects=(springs,)), states(5, 8))
    z = np.random.default_rng(0).normal(size=400_000)
    exact = np.quantile(np.abs(1 - 3 ** (-z / 1.959964)), [0.025, 0.975])
    assert (low, high) == pytest.approx(tuple(exact), rel=0.03)


def test_a_model_file_keeps_where_its_stiffness_comes_from() -> None:
    text = f'robot = "{NAME}"\nstiffness_source = "estimated"\n[effects.joint_compliance]\n'
    model = parse_model(Source("m.toml", text.encode()))
    assert model.stiffness_source == "estimated"
    assert 'stiffness_source = "estimated"' in render_model(model, text)
    fitted = replace(model, fit={"parameters": ["joint_compliance.compliance_rad_per_Nm[2]"], "covariance": ["1e-14"]})
    assert 'stiffness_source = "measured"' in render_model(fitted, text)
    assert default_model("irb4600_60_205").stiffness_source == "measured"
    assert default_model("irb1200_5_09").stiffness_source == "estimated"
