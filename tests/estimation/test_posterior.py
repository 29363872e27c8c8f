"""Posterior of a fit: springs that rows do not tell, positive springs, earlier tables, what it costs under a load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from postproc.diagnostics import PostprocError, Source
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.posterior import Objective
from postproc.estimation.priors import prior_of, with_earlier_fit
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects, fit_effects
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model, StatedPrior
from postproc.model.doubts import below_least
from postproc.model.equilibrium import predict
from postproc.model.file import default_model, parse_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty import Uncertainty, predict_sigma, uncertainty_table
from postproc.model.undetermined import undetermined_under_load
from postproc.results.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.identification.cells import BASE, base_fit, cell

ARM = load_robot("irb4600_60_205")
SPRINGS = "joint_compliance"
LIBRARY = effect_library()
FACTOR = 1.5
"""Within which 95 % of arms lie about a stiffness that was measured on one of their type."""


def lognormal_deviation(median: float) -> float:
    """Standard deviation of log-normal numbers about their median, 95 % of which lie within ``FACTOR``."""
    spread = np.log(FACTOR) / 1.959964
    return float(median * np.exp(spread**2 / 2) * np.sqrt(np.exp(spread**2) - 1))


def fitted(data: Measurements, *more: str):
    return fit_effects(Model(ARM, robot_name=ARM.name), data, [LIBRARY[key] for key in (*BASE, *more)])


def test_a_spring_that_gravity_does_not_load_is_as_the_type_has_it():
    fit = fitted(cell(seed=11)[0])
    springs = fit.model.effect(SPRINGS).vector()
    assert springs[0] == pytest.approx(ARM.joint_compliance[0], rel=1e-9)
    assert fit.sigma[SPRINGS, 0] == pytest.approx(lognormal_deviation(springs[0]), rel=1e-6)
    assert fit.sigma[SPRINGS, 1] < 0.05 * springs[1]
    told = {entry["parameter"]: entry for entry in fit_values(fit)["undetermined"]}
    first = told[f"{SPRINGS}.compliance_rad_per_Nm[1]"]
    assert first["value"] == pytest.approx(springs[0], rel=1e-9) and "irb4600_60_205, measured" in first["source"]
    assert f"{SPRINGS}.compliance_rad_per_Nm[2]" not in told


def test_the_likeliest_parameters_are_where_a_general_minimiser_finds_them():
    g = np.random.default_rng(3)
    A = g.normal(size=(9, 4)) * [3.0, 1.0, 0.3, 0.01]
    gram, start = A.T @ A, np.array([0.4, -0.2, 0.5, 2.0])
    median, spread = np.array([1.0, 0.5, 2.0, 1.5]), np.array([0.5, 2.0, 0.3, 0.7])
    log = np.array([True, False, True, True])
    pull = A.T @ g.normal(size=9)

    def cost(z):
        x = np.where(log, np.exp(z), z)
        off = np.where(log, z - np.log(median), z - median)
        return (x - start) @ gram @ (x - start) - 2 * pull @ (x - start) + np.sum((off / spread) ** 2)

    z = minimize(cost, np.where(log, np.log(median), median), method="Nelder-Mead", options=dict(
        xatol=1e-9, fatol=1e-12, maxiter=20000, maxfev=20000, adaptive=True)).x  # fmt: skip
    found = Objective(gram, pull, start, median, spread, log).minimum()
    assert found == pytest.approx(np.where(log, np.exp(z), z), rel=1e-4)


def test_springs_stay_positive_where_rows_alone_would_have_them_negative():
    """Twenty targets that were touched up by eye, good to a millimetre each, say little of six springs."""
    signs = []
    for seed in range(4):
        data, _ = cell(seed=740 + seed, noise=1.0, poses=20)
        plain = base_fit(data)
        fit = fitted(data)
        signs.append(plain.model.effect(SPRINGS).vector().min())
        assert (fit.model.effect(SPRINGS).vector() > 0).all()
        again = parse_model(Source("m.toml", render_model(recorded_model(fit)).encode()))
        assert not below_least(again, again.effect(SPRINGS)).any()
    assert min(signs) < 0


def pulled(seed: int) -> tuple[Measurements, float]:
    """A table of a true arm in which half of the rows are pulled sideways, and its compliance of joint 1."""
    plain, _ = cell(seed=seed)
    compliance = np.array(ARM.joint_compliance) * [0.8, 1.1, 0.9, 1.1, 1.0, 1.0]
    true = Model(ARM).with_effects(LIBRARY[SPRINGS].null().with_vector(compliance))
    n = len(plain)
    wrench = np.zeros((n, 6))
    wrench[::2, 1] = 300.0
    state = plain.state.with_(wrench=wrench, T_flange_tcp=Model(ARM).T_flange_tcp)
    seen = predict(true, state)[:, :3, 3] + np.random.default_rng(seed).normal(0, 3e-5, (n, 3))
    return replace(plain, state=plain.state.with_(wrench=wrench), position=seen), float(compliance[0])


def test_what_an_earlier_table_told_is_kept_by_a_later_one_that_is_silent():
    side, true = pulled(12)
    first = recorded_model(fitted(replace(side, sources=(Source("pulled.csv", b"pulled"),))))
    told = first.effect(SPRINGS).vector()[0]
    assert told == pytest.approx(true, rel=0.03)
    later = replace(cell(seed=13)[0], sources=(Source("gravity.csv", b"gravity"),))
    name = f"{SPRINGS}.compliance_rad_per_Nm[1]"
    model = with_earlier_fit(first, later)
    assert model.priors[name].value == told and "pulled.csv" in model.priors[name].source
    added = add_effects(first, later, ["wrist_coupling"])
    kept = added.model
    assert kept.effect(SPRINGS).vector()[0] == pytest.approx(told, rel=1e-9)
    assert added.fit.sigma[SPRINGS, 0] < 0.2 * lognormal_deviation(ARM.joint_compliance[0])
    # The priors are written, so that a third fit to the same rows does not count them twice.
    again = parse_model(Source("m.toml", render_model(kept).encode()))
    assert again.priors == kept.priors
    assert with_earlier_fit(again, later).priors == again.priors


def test_a_prior_that_a_user_states_counts():
    data, _ = cell(seed=11)
    model = replace(Model(ARM), priors={f"{SPRINGS}.compliance_rad_per_Nm[1]": StatedPrior(2e-6, 1e-8, "pulled")})
    fit = fit_effects(model, data, [LIBRARY[key] for key in BASE])
    assert fit.model.effect(SPRINGS).vector()[0] == pytest.approx(2e-6)
    assert fit.sigma[SPRINGS, 0] == pytest.approx(1e-8, rel=1e-3)
    offset = prior_of(LIBRARY["joint_offset"].null(), model)
    assert offset.value == pytest.approx(0) and set(offset.source) == {"ordinary size"}


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ('"joint_ofset.offset_rad[2]" = [0.0, 1e-4, "a"]', "MOD002"),
        ('"joint_offset.offset[2]" = [0.0, 1e-4, "a"]', "MOD002"),
        ('"joint_offset.offset_rad[2]" = [0.0, 0.0, "a"]', "MOD002"),
        ('"joint_offset.offset_rad[2]" = [0.0, 1e-4]', "MOD002"),
    ],
)
def test_a_prior_that_means_nothing_is_refused(line: str, code: str):
    text = f'robot = "irb4600_60_205"\n[priors]\n{line}\n'
    with pytest.raises(PostprocError) as refused:
        parse_model(Source("m.toml", text.encode()))
    assert {d.code for d in refused.value.diagnostics} == {code}
    assert refused.value.diagnostics[0].span is not None


def test_what_no_row_told_costs_as_much_as_the_lever_and_the_torque_say():
    """Joint 1 under a force across the arm: the TCP moves by sigma x force x radius^2."""
    name, sigma, force = f"{SPRINGS}.compliance_rad_per_Nm[1]", 9e-7, 150.0
    model = default_model(ARM.name)
    known = Uncertainty((), np.zeros((0, 0)), 0.0, ((SPRINGS, 0),), np.array([[sigma]]))
    table = uncertainty_table(model, known) | {"undetermined": [name]}
    model = replace(model, fit=table)
    q = np.array([[0.0, 0.3, 0.1, 0.0, 0.6, 0.0]])
    state = model.state(q, wrench=np.array([[0.0, force, 0.0, 0.0, 0.0, 0.0]]))
    radius = float(predict(model.with_effects(), state)[0, 0, 3])
    found = undetermined_under_load(model, state, np.sqrt(3))
    assert found is not None and found.name == name
    assert found.within_95 == pytest.approx(sigma * force * radius**2, rel=0.01)
    assert np.flatnonzero(found.pull).tolist() == [1]
    assert found.told == pytest.approx(sigma * 100.0 * radius**2, rel=0.01)
    assert predict_sigma(model, state)[0] * np.sqrt(3) == pytest.approx(found.within_95, rel=1e-6)


def test_a_model_of_the_type_itself_leaves_nothing_to_say():
    model = default_model(ARM.name)
    assert undetermined_under_load(model, model.state(np.zeros((1, 6))), 1.0) is None


def test_a_fit_begins_from_the_arm_and_not_from_rigid_joints():
    data, _ = cell(seed=11)
    fit = fit_model(Model(ARM), data, [LIBRARY[key].null() for key in BASE])
    assert fit.model.effect(SPRINGS).vector()[0] == ARM.joint_compliance[0]
