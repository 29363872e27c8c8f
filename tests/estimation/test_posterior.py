"""Posterior of a fit: springs that rows do not tell, positive springs, earlier tables, what it costs under a load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.posterior import Objective
from postproc.estimation.priors import Prior, with_earlier_fit
from postproc.estimation.recorded import recorded_model
from postproc.identification.add import add_effects, fit_effects
from postproc.identification.diagnose import diagnose
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model, StatedPrior
from postproc.model.equilibrium import predict
from postproc.model.file import default_model, parse_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty.prediction import Uncertainty, predict_sigma, uncertainty_table
from postproc.model.uncertainty.undetermined import undetermined_under_load
from postproc.results.improve.fit import fit_values
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.identification.cells import BASE, base_fit, cell

ARM = load_robot("irb4600_60_205")
SPRINGS = "joint_compliance"
FIRST, SECOND = (f"{SPRINGS}.compliance_rad_per_Nm[{j}]" for j in (1, 2))
LIBRARY = effect_library()


def lognormal_deviation(median: float) -> float:
    """Standard deviation of log-normal numbers about their median, 95 % of which lie within a factor of 2.2."""
    spread = np.log(2.2) / 1.959964
    return float(median * np.exp(spread**2 / 2) * np.sqrt(np.exp(spread**2) - 1))


def fitted(data: Measurements, model: Model | None = None) -> Fit:
    return fit_effects(model or Model(ARM, robot_name=ARM.name), data, [LIBRARY[key] for key in BASE])


def read_back(model: Model) -> Model:
    return parse_model(Source("m.toml", render_model(model).encode()))


def springs(fit: Fit) -> np.ndarray:
    return fit.model.effect(SPRINGS).vector()


@pytest.mark.parametrize(
    ("deviation", "least", "most"),
    [(7e-3, 0.0, 1e-3), (4e-3, 16e-3, 20e-3), (1e-4, 19.99e-3, 20e-3)],  # of rows that have 20 mrad
)
def test_a_value_of_many_ordinary_sizes_needs_rows_that_say_so(deviation: float, least: float, most: float) -> None:
    """The zero of joint 1 against the turn of the instrument: the difference is told to 1 µrad, the sum hardly."""
    tied, sum_ = np.array([[1.0, 1.0]]) / 1e-6, np.array([[1.0, -1.0]]) / (2 * deviation)
    rows, start = np.vstack([tied, sum_]), np.array([20e-3, -20e-3])
    yes, normal = np.array([True, False]), np.zeros(2, dtype=bool)
    prior = Prior(np.zeros(2), np.array([1e-3, np.inf]), normal, yes, ("ordinary size", ""))
    x = Objective(rows.T @ rows, np.zeros(2), start, prior).minimum()
    assert x[0] + x[1] == pytest.approx(0, abs=1e-6) and least <= x[0] <= most
    assert prior.deviation(x)[0] == pytest.approx(max(1e-3, x[0] / 2))


def test_a_spring_that_gravity_does_not_load_is_as_the_type_has_it():
    data, _ = cell(seed=11)
    fit = fitted(data)
    assert springs(fit)[0] == pytest.approx(ARM.joint_compliance[0], rel=1e-9)
    assert fit.sigma[SPRINGS, 0] == pytest.approx(lognormal_deviation(springs(fit)[0]), rel=1e-6)
    assert fit.sigma[SPRINGS, 1] < 0.05 * springs(fit)[1]
    undetermined = {entry["parameter"]: entry for entry in fit_values(fit)["undetermined"]}
    assert undetermined[FIRST]["value"] == pytest.approx(springs(fit)[0], rel=1e-9)
    assert "irb4600_60_205, measured" in undetermined[FIRST]["source"] and SECOND not in undetermined
    plain = fit_model(Model(ARM), data, [LIBRARY[key].null() for key in BASE])
    assert springs(plain)[0] == ARM.joint_compliance[0]  # a fit begins from the arm and not from rigid joints


def test_priors_and_rows_add_up_by_the_rule_of_bayes():
    """Precisions add, and means by their weights, where a user states the offsets of joints 2 and 3."""
    data, _ = cell(seed=11)
    plain, joints = fitted(data), [1, 2]
    at = [plain.posterior.names.index(("joint_offset", j)) for j in joints]
    C, mean = plain.posterior.covariance, plain.posterior.mean[at]
    spread = np.sqrt(np.diag(C)[at]) * [0.5, 2.0]
    stated = mean + spread * [3.0, -3.0]
    names = [f"joint_offset.offset_rad[{j + 1}]" for j in joints]
    priors = {n: StatedPrior(float(v), float(s), "stated") for n, v, s in zip(names, stated, spread, strict=True)}
    fit = fitted(data, replace(Model(ARM, robot_name=ARM.name), priors=priors))
    # The usual prior of an offset, about zero, is so wide that it hardly counts; the stated one takes its place.
    gain = C[np.ix_(at, at)] @ np.linalg.inv(C[np.ix_(at, at)] + np.diag(spread**2))
    moved = fit.model.effect("joint_offset").vector()[joints]
    np.testing.assert_allclose(moved, mean + gain @ (stated - mean), atol=0.05 * spread.min())
    expected = np.diag(C[np.ix_(at, at)] - gain @ C[np.ix_(at, at)])
    np.testing.assert_allclose(fit.posterior.deviations[at] ** 2, expected, rtol=0.05)


def test_springs_stay_positive_where_rows_alone_would_have_them_negative():
    """Twenty targets that were touched up by eye, good to a millimetre each, say little of six springs."""
    lowest = []
    for seed in range(740, 744):
        data, _ = cell(seed=seed, noise=1.0, poses=20)
        lowest.append(springs(base_fit(data)).min())
        fit = fitted(data)
        assert (springs(fit) > 0).all() and (read_back(recorded_model(fit)).effect(SPRINGS).vector() > 0).all()
    assert min(lowest) < 0


def pulled(seed: int) -> tuple[Measurements, float]:
    """A table of a true arm in which half of the rows are pulled sideways, and its compliance of joint 1."""
    plain, _ = cell(seed=seed)
    compliance = np.array(ARM.joint_compliance) * [0.8, 1.1, 0.9, 1.1, 1.0, 1.0]
    true = Model(ARM).with_effects(LIBRARY[SPRINGS].null().with_vector(compliance))
    state = plain.state.with_(wrench=np.outer(np.arange(len(plain)) % 2 == 0, [0, 300.0, 0, 0, 0, 0]))
    seen = predict(true, state.with_(T_flange_tcp=Model(ARM).T_flange_tcp))[:, :3, 3]
    noise = np.random.default_rng(seed).normal(0, 3e-5, seen.shape)
    return replace(plain, state=state, position=seen + noise), float(compliance[0])


def test_what_an_earlier_table_told_is_kept_by_a_later_one_that_is_silent():
    side, true = pulled(12)
    first = recorded_model(fitted(replace(side, sources=(Source("pulled.csv", b"pulled"),))))
    told = first.effect(SPRINGS).vector()[0]
    later = replace(cell(seed=13)[0], sources=(Source("gravity.csv", b"gravity"),))
    prior, added = with_earlier_fit(first, later).priors[FIRST], add_effects(first, later, ["wrist_coupling"])
    assert told == pytest.approx(true, rel=0.03)
    assert prior.value == told and "pulled.csv" in prior.source
    assert added.model.effect(SPRINGS).vector()[0] == pytest.approx(told, rel=1e-9)
    assert added.fit.sigma[SPRINGS, 0] < 0.2 * lognormal_deviation(ARM.joint_compliance[0])
    # The priors are written, so that a third fit to the same rows does not count them twice.
    again = read_back(added.model)
    assert again.priors == added.model.priors == with_earlier_fit(again, later).priors


def test_add_and_diagnose_begin_with_the_same_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    first = recorded_model(fitted(replace(pulled(12)[0], sources=(Source("pulled.csv", b"pulled"),))))
    later, begun = replace(cell(seed=13)[0], sources=(Source("gravity.csv", b"gravity"),)), []

    def begin(model: Model, *_: object, **__: object) -> None:
        begun.append(model.priors)
        raise InterruptedError

    for module, command in (
        ("add", lambda: add_effects(first, later, ["backlash"])),
        ("diagnose", lambda: diagnose(first, later)),
    ):
        monkeypatch.setattr(f"postproc.identification.{module}.fit_model", begin)
        with pytest.raises(InterruptedError):
            command()
    assert begun[0] == begun[1] == with_earlier_fit(first, later).priors != first.priors


def test_a_prior_that_a_user_states_counts():
    fit = fitted(cell(seed=11)[0], replace(Model(ARM), priors={FIRST: StatedPrior(2e-6, 1e-8, "pulled")}))
    assert springs(fit)[0] == pytest.approx(2e-6)
    assert fit.sigma[SPRINGS, 0] == pytest.approx(1e-8, rel=1e-3)


@pytest.mark.parametrize(
    "line",
    [
        '"joint_ofset.offset_rad[2]" = [0.0, 1e-4, "a"]',
        '"joint_offset.offset[2]" = [0.0, 1e-4, "a"]',
        '"joint_offset.offset_rad[2]" = [0.0, 0.0, "a"]',
        '"joint_offset.offset_rad[2]" = [0.0, 1e-4]',
    ],
)
def test_a_prior_that_means_nothing_is_refused(line: str):
    text = f'robot = "irb4600_60_205"\n[priors]\n{line}\n'
    found = refused(lambda: parse_model(Source("m.toml", text.encode())))
    assert {d.code for d in found} == {"MOD002"} and found[0].span is not None


def test_what_no_row_told_costs_as_much_as_the_lever_and_the_torque_say():
    """Joint 1 under a force across the arm: the TCP moves by sigma x force x radius^2."""
    sigma, force, plain = 9e-7, 150.0, default_model(ARM.name)
    unknown = Uncertainty((), np.zeros((0, 0)), 0.0, ((SPRINGS, 0),), np.array([[sigma]]))
    model = replace(plain, fit=uncertainty_table(plain, unknown) | {"undetermined": [FIRST]})
    wrench = np.array([[0.0, force, 0.0, 0.0, 0.0, 0.0]])
    state = model.state(np.array([[0.0, 0.3, 0.1, 0.0, 0.6, 0.0]]), wrench=wrench)
    radius = float(predict(model.with_effects(), state)[0, 0, 3])
    found = undetermined_under_load(model, state, np.sqrt(3))
    assert found.name == FIRST and np.flatnonzero(found.pull).tolist() == [1]
    assert found.within_95 == pytest.approx(sigma * force * radius**2, rel=0.01)
    assert found.pull_displacement == pytest.approx(sigma * 100.0 * radius**2, rel=0.01)
    assert predict_sigma(model, state)[0] * np.sqrt(3) == pytest.approx(found.within_95, rel=1e-6)
    assert undetermined_under_load(plain, plain.state(np.zeros((1, 6))), 1.0) is None
