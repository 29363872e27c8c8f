"""What remains of the deflection where the stiffness is an estimate, beside arms drawn in plain numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from postproc.channels.state import State
from postproc.compensation.judgement.type_scatter import type_scatter
from postproc.model.file import default_model
from postproc.model.uncertainty.scatter import scatter_of
from tests.independent import arm as A

TCP = A.shift(0.0, 0.0, 0.35)
NAME = "irb4600_40_255"
MODEL = default_model(NAME)
LOAD = A.Load(12.0, np.array([0, 0, 0.15]), np.array([150.0, -100.0, -200.0]))


def states(seed: int, n: int) -> State:
    q = np.array([0.0, 0.4, 0.1, 0.0, 0.9, 0.0]) + np.random.default_rng(seed).uniform(-0.4, 0.4, (n, 6))
    load = {"payload_mass": np.full(n, 12.0), "payload_center": np.tile(LOAD.center, (n, 1))}
    return State(q, wrench=np.tile([*LOAD.force, 0.0, 0.0, 0.0], (n, 1)), T_flange_tcp=TCP, **load)


def droop(arm: A.Arm, compliance: np.ndarray, q: np.ndarray, load: A.Load = LOAD) -> np.ndarray:
    """Deflection of the TCP (n, 3) [m] under weight, payload and force of an arm, to first order."""
    f = arm.forward(q, TCP)
    tau, _ = A.spring_loads(f, A.dead_loads(arm, f, load))
    tip = f.tcp[:, :3, 3]
    levers = [np.cross(f.axis[j], tip - f.pivot[j]) for j in range(6)]
    return sum(lever * (c * t)[:, None] for lever, c, t in zip(levers, compliance, tau.T, strict=True))


def test_the_interval_holds_the_arms_that_are_drawn():
    """400 arms about the estimate, each corrected by the estimate: 95 % of them leave a share inside the interval."""
    arm, state, g = A.ARMS[NAME](), states(3, 40), np.random.default_rng(11)
    found = scatter_of(MODEL, state)
    low, high = found.remaining
    factor, spread = np.array([4, 3, 2.5, 2.5, 3.5, 2.5]), np.array([1.0, 1.5, 1.7, 1.6, 1.8, 2.3, 4.0])
    corrected, shares, sizes = droop(arm, MODEL.robot.joint_compliance, state.q), [], []
    for _ in range(400):
        compliance = MODEL.robot.joint_compliance * factor ** (g.normal(size=6) / 1.96)
        real = droop(replace(arm, mass=arm.mass * spread ** g.normal(size=7)), compliance, state.q)
        shares.append(np.linalg.norm(real - corrected) / np.linalg.norm(real))
        sizes.append(np.linalg.norm(real - corrected) / np.linalg.norm(corrected))
    assert abs(np.mean((np.array(shares) >= low) & (np.array(shares) <= high)) - 0.95) < 0.03
    assert high == pytest.approx(np.quantile(shares, 0.975), rel=0.2)
    assert np.quantile(sizes, [0.025, 0.975]) == pytest.approx(found.of_estimate, rel=0.2)
    assert 0.0 < low < 0.4 < high


def test_what_is_known_leaves_nothing():
    sure = replace(MODEL.robot, stiffness_factor=np.ones(6), mass_factor=np.ones(7))
    assert scatter_of(replace(MODEL, robot=sure), states(4, 5)).remaining == (0.0, 0.0)


def test_one_spring_alone_has_a_closed_form():
    """Joint 2 alone, masses known: 95 % of arms leave |1 - 1/f| with f log-normal, which rises on both sides of 1."""
    springs = MODEL.effects[0].with_vector(np.array([0, 1e-6, 0, 0, 0, 0.0]))
    robot = replace(MODEL.robot, mass_factor=np.ones(7), stiffness_factor=np.full(6, 3.0))
    interval = scatter_of(replace(MODEL, robot=robot, effects=(springs,)), states(5, 8)).remaining
    z = np.random.default_rng(0).normal(size=400_000)
    assert interval == pytest.approx(tuple(np.quantile(np.abs(1 - 3 ** (-z / 1.959964)), [0.025, 0.975])), rel=0.03)


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (0.0, 0.0, -300.0)])
def test_readings_of_a_gauge_leave_what_is_said(force: tuple[float, float, float]) -> None:
    """200 arms, each read twelve times with a weight or a pull, fitted in plain numpy, and corrected by that fit."""
    arm, state, g = A.ARMS[NAME](), states(3, 40), np.random.default_rng(12)
    state = state.with_(wrench=np.tile([*force, 0.0, 0.0, 0.0], (40, 1)))
    load = replace(LOAD, force=np.array(force))
    found = type_scatter(MODEL, state)
    assert found is not None and found.after_gauge is not None
    prior, spread = np.log([4, 3, 2.5, 2.5, 3.5, 2.5]) / 1.96, np.array([1.0, 1.5, 1.7, 1.6, 1.8, 2.3, 4.0])
    usual, axis = MODEL.robot.joint_compliance, np.arange(6) % 3
    pulls = np.array([100.0, 100.0, 9.81 * MODEL.robot.payload])[axis]
    f = arm.forward(state.q[np.linspace(0, 39, 6).round().astype(int)], TCP)
    moves = np.array([np.cross(f.axis[j], f.tcp[:, :3, 3] - f.pivot[j]) for j in range(6)])
    h = pulls[:, None] * moves[:, np.arange(6), axis].T ** 2 * usual
    shares = []
    for _ in range(200):
        real = np.exp(prior * g.normal(size=6))
        read = h @ real + np.sqrt(2) * 1e-5 * g.normal(size=6)

        def residuals(x: np.ndarray, read: np.ndarray = read) -> np.ndarray:
            return np.concatenate([(h @ np.exp(x) - read) / (np.sqrt(2) * 1e-5), x / prior])

        fitted = np.exp(least_squares(residuals, np.zeros(6)).x)
        away = droop(replace(arm, mass=arm.mass * spread ** g.normal(size=7)), usual * real, state.q, load)
        shares.append(np.linalg.norm(away - droop(arm, usual * fitted, state.q, load)) / np.linalg.norm(away))
    assert np.quantile(shares, [0.025, 0.975]) == pytest.approx(found.after_gauge, rel=0.3, abs=0.01)
    assert found.after_gauge[1] < 0.75 * found.remaining[1]
