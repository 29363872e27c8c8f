"""Masses of links that are estimates: what rows tell of them, and how far they leave the arm's own sag open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.channels.state import State
from postproc.estimation.fitted import Fit
from postproc.estimation.link_mass import link_mass_directions
from postproc.estimation.recorded import recorded_model
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import read_uncertainty, sigma_parts
from postproc.robot.catalogue import load_robot
from tests.bench.shop.arms import Shop, shop
from tests.bench.shop.judge import unseen_rows
from tests.bench.shop.refit import tcp
from tests.bench.shop.sets import gauges, real_tcp, table
from tests.estimation.test_setups import fitted, read

ROBOT = "irb1600_10_145"
FACTOR = load_robot(ROBOT).mass_factor
assert FACTOR is not None
SPREAD = np.log(FACTOR[1:])


def heavier(seed: int, logarithms: np.ndarray) -> Shop:
    """A shop whose arm has springs and link masses of its own, the masses by their logarithms (6,) over the file's."""
    s = shop(ROBOT, seed, geometry=False)
    mass = s.cell.arm.mass * np.exp([0.0, *logarithms])
    cell = replace(s.cell, arm=replace(s.cell.arm, mass=mass), offset=np.zeros(6), tool=s.nominal.tool)
    return replace(s, cell=cell)


def by_gauge(s: Shop, seed: int) -> Fit:
    return fitted(gauges(np.random.default_rng(seed), s), s, ("joint_compliance",))


def states(fit: Fit, s: Shop, seed: int) -> tuple[State, np.ndarray]:
    """Unseen postures under loads, and where the true TCP is there, (n, 3)."""
    asked = unseen_rows(s, seed)
    state = read(asked, s, measured=False).state.with_(T_flange_tcp=fit.model.T_flange_tcp)
    return state, real_tcp(s, asked.states)


def test_readings_under_a_load_tell_nothing_of_the_masses_and_leave_the_sag_open_by_them() -> None:
    """The deviation by masses alone, against an arm in plain numpy with each mass changed by a little."""
    s = heavier(3, np.zeros(6))
    fit = by_gauge(s, 3)
    directions = link_mass_directions(fit)
    masses = directions[:, -6:]
    expected = np.exp(SPREAD**2 / 2) * np.sqrt(np.expm1(SPREAD**2))
    np.testing.assert_allclose(np.sqrt(np.sum(masses**2, axis=0)), expected, rtol=0.02)
    asked, step = unseen_rows(s, 3), 1e-4
    alone = replace(s.cell, compliance=fit.model.effects[-1].vector())
    sag = [
        (tcp(replace(alone, arm=replace(alone.arm, mass=s.cell.arm.mass * np.exp(step * np.eye(7)[b]))), asked.states)
         - tcp(alone, asked.states)) / step
        for b in range(1, 7)
    ]  # fmt: skip
    by_masses = np.sqrt(np.sum((np.stack(sag, axis=2) * expected) ** 2, axis=(1, 2)) / 3)
    model, (state, _) = recorded_model(fit), states(fit, s, 3)
    known = read_uncertainty(model)
    assert known is not None and len(known.link_mass) == 6
    with_masses, without = (
        sigma_parts(replace(model, fit=table), state, False)[0]
        for table in (model.fit, {k: v for k, v in model.fit.items() if k != "link_mass"})
    )
    np.testing.assert_allclose(np.sqrt(with_masses**2 - without**2), by_masses, rtol=0.05)


def test_arms_of_other_masses_sag_within_what_is_expected() -> None:
    """Three quarters of unseen postures or more, over arms with masses drawn as the file says; without them few are."""
    inside, without = [], []
    for seed in range(6):
        s = heavier(seed, SPREAD * np.random.default_rng([seed, 9]).normal(size=6))
        fit = by_gauge(s, seed)
        state, true = states(fit, s, seed)
        model = recorded_model(fit)
        away = np.linalg.norm(predict(model, state)[:, :3, 3] - true, axis=1)
        for found, fitted_only in ((inside, False), (without, True)):
            stated = {k: v for k, v in model.fit.items() if not (fitted_only and k == "link_mass")}
            found.append(np.mean(away < 2.796 * np.hypot(*sigma_parts(replace(model, fit=stated), state, False))))
    assert np.mean(inside) > 0.75
    assert np.mean(without) < 0.4


def test_positions_tell_how_far_the_arm_sags() -> None:
    """A prediction is four times as sure as the masses alone would let it be."""
    s = heavier(1, np.array([0.2, 0.3, -0.2, 0.2, 0.0, 0.0]))
    fit = fitted(table("position", s, 1), s, ("instrument_frame", "joint_compliance"))
    sag = fit.problem.sensitivity.by_link_mass()[:, :3] * SPREAD
    sure, _ = sigma_parts(recorded_model(fit), fit.problem.sensitivity.state)
    assert 4 * np.sqrt(np.mean(sure**2)) < np.sqrt(np.mean(np.sum(sag**2, axis=(1, 2))) / 3)


def test_stated_masses_leave_nothing_open() -> None:
    s = shop("ur10", 1, geometry=False)
    fit = fitted(gauges(np.random.default_rng(1), s), s, ("joint_compliance",))
    assert link_mass_directions(fit).size == 0
    assert "link_mass" not in recorded_model(fit).fit
