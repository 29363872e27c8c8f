"""Both ends of a hose, the knee of a gearbox: found before anything is fitted in full."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from postproc.effects.asking import load_of, loads_of
from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear
from postproc.identification.add import add_effects
from postproc.identification.screen.candidate import Screen
from postproc.identification.screen.composition import compose
from postproc.identification.screen.nonlinear import SubsampledProblem, optimise_nonlinear, refit_form, subsampled
from postproc.model.derivatives.places import load_parts
from postproc.model.equilibrium import predict
from tests.identification.cells import base_fit, cell, true_error
from tests.independent import library_effects as kinds
from tests.independent.arm import Wrenches, point_load
from tests.independent.cells import Hidden, column

NOISE = 3e-5


def _hose(g, arm):
    """1500 N/m from the housing to a point beside the flange, always taut."""

    def force(s, f):
        p = f.body[3][:, :3, 3] + f.body[3][:, :3, :3] @ [0.1, 0.05, 0.3]
        e = f.flange[:, :3, 3] + f.flange[:, :3, :3] @ [0.08, -0.1, 0.05]
        d = p - e
        length = np.linalg.norm(d, axis=1, keepdims=True)
        pull = 1500 * np.maximum(length - 0.3, 0) * d / length
        return Wrenches([point_load(6, e, pull), point_load(3, p, -pull)])

    return Hidden("hose", "dress_pack", force=force)


def _hung(g, arm):
    """120 N/m from a gantry above the shoulder to a point beside the flange, slack at times."""

    def force(s, f):
        e = f.flange[:, :3, 3] + f.flange[:, :3, :3] @ [0.08, -0.1, 0.05]
        d = np.array([0.3, -0.4, 1.4]) - e
        length = np.linalg.norm(d, axis=1, keepdims=True)
        pull = 120 * np.maximum(length - 1.0, 0) * d / length
        return Wrenches([point_load(6, e, pull)])

    return Hidden("hung", "dress_pack", force=force)


def _wrist(g, arm):
    """900 N/m from the upper arm to a point beside the wrist's second axis, slack at times."""

    def force(s, f):
        p = f.body[2][:, :3, 3] + f.body[2][:, :3, :3] @ [0.1, 0.15, 0.2]
        e = f.body[5][:, :3, 3] + f.body[5][:, :3, :3] @ [0.1, -0.08, 0.06]
        d = p - e
        length = np.linalg.norm(d, axis=1, keepdims=True)
        pull = 900 * np.maximum(length - np.quantile(length, 0.4), 0) * d / length
        return Wrenches([point_load(5, e, pull), point_load(2, p, -pull)])

    return Hidden("wrist", "dress_pack", force=force)


def _balancer(g, arm):
    return Hidden(
        "balancer", "gravity_compensator", force=lambda s, f: Wrenches([], column(1, -3000 * np.sin(s.q[:, 1])))
    )


@cache
def _fitted(*hidden):
    data, true = cell(*hidden, seed=640112, poses=150)
    return base_fit(data), data, true


def test_the_answer_to_an_effect_is_what_it_does_to_the_prediction():
    fit, data, _ = _fitted(_hose)
    effect = DressPack(stiffness_N_per_m=400.0, slack_m=0.4, from_m=[0.1, 0, 0.2], to_m=[0, 0.1, 0])
    seen = SubsampledProblem(fit.problem, fit.linear)
    moved = predict(fit.model.with_effects(*fit.model.effects, effect), data.state) - predict(fit.model, data.state)
    expected = (moved[:, :3, 3] * fit.problem.weights.values)[fit.problem.weights.used]
    assert seen.answers([effect])[:, 0] == pytest.approx(expected, abs=0.02 * np.abs(expected).max())


def _together_as_alone(some, state):
    every = load_parts(loads_of(some, state))
    for k, one in enumerate(some):
        alone = load_parts(load_of(one, state))
        assert set(alone) == set(every)
        for at, share in alone.items():
            assert every[at][:, :, k] == pytest.approx(share, abs=1e-9)
    return every


def test_many_effects_load_the_arm_at_once_as_each_does_alone():
    state = _fitted(_hose)[0].problem.sensitivity.state
    one = DressPack(body_from=2, stiffness_N_per_m=400.0, slack_m=0.4, from_m=[0.1, 0, 0.2], to_m=[0, 0.1, 0])
    hoses = [one, replace(one, slack_m=1.3, from_m=[0.3, -0.2, 0.1]), replace(one, stiffness_N_per_m=90.0)]
    assert np.ptp(_together_as_alone(hoses, state)[6 + 6 * 6][:, 0, 1]) > 1.0
    assert not _together_as_alone([replace(one, body_from=6)], state)
    # Those that do not say it at once: on bodies, and on joints.
    _together_as_alone([ArmLoad(body=(3,), mass_kg=[m], moment_kgm=[[0, 0, 0.1]]) for m in (2.0, 5.0)], state)
    _together_as_alone([GravityCompensator(sine_Nm=[a]) for a in (300.0, 400.0)], state)


def test_some_poses_are_fitted_as_a_penalty_asks_of_their_share(monkeypatch):
    monkeypatch.setattr("postproc.identification.screen.nonlinear.SCREENED_POSES", 30)
    fit, data, _ = _fitted(_hose)
    rng = np.random.default_rng(3)
    problem = replace(fit.problem, data=data)
    n = len(problem.residual)
    columns, penalty = rng.normal(size=(n, 7)), np.array([0, 0, 0, 20.0, 30.0, 40.0, 50.0])
    U = columns @ np.linalg.inv(np.linalg.cholesky(columns.T @ columns + np.diag(penalty**2))).T
    linear = Linear(problem.residual, U, problem.row)
    few = subsampled(Screen(problem, {}), linear)
    step = round(len(data) / 30)
    assert step > 1
    some = (np.arange(len(data)) % step == 0)[problem.row]
    A = np.vstack([columns[some], np.diag(penalty / np.sqrt(step))])
    x = np.linalg.lstsq(A, np.concatenate([problem.residual[some], np.zeros(7)]), rcond=None)[0]
    assert few.linear.projected_residual == pytest.approx(problem.residual[some] - columns[some] @ x, abs=1e-9)


@pytest.mark.parametrize("start", [[0.3, -0.3, 0.0], [-0.2, 0.2, 0.5]])
def test_both_ends_of_a_hose_are_found_from_far_away(start):
    fit, _, _ = _fitted(_hose)
    far = DressPack(slack_m=0.6, from_m=start, to_m=[-0.1, 0.1, 0.1])
    seen = subsampled(Screen(fit.problem, {}), fit.linear)
    found, square = optimise_nonlinear(seen, far, np.ones(8, dtype=bool))
    left = seen.linear.projected_residual - seen.linear.project(seen.answers([found]))[:, 0]
    assert square == pytest.approx(left @ left)
    assert seen.linear.square > 3 * len(left) and square < 1.2 * len(left)


@pytest.mark.parametrize("start", [[0.3, -0.3, 0.0], [-0.2, 0.2, 0.5], [0.1, 0.4, 0.2]])
def test_a_full_fit_finds_a_hose_from_far_away(start):
    """Full steps would leave it without pull, or swing along what its stiffness and its slack have in common."""
    fit, data, _ = _fitted(_hose)
    far = DressPack(stiffness_N_per_m=800.0, slack_m=0.6, from_m=start, to_m=[-0.1, 0.1, 0.1])
    after = fit_model(fit.model, data, [far])
    assert after.linear.square < 1.2 * after.freedom


def test_bodies_are_chosen_after_the_ends_of_every_pair_were_looked_for():
    found, fit = _formed(DressPack, *_fitted(_hose)[:1])
    best = found.starts[0].effect
    assert isinstance(best, DressPack) and (best.body_from, best.body_to) == (3, 6)
    assert fit.linear.square - found.fall < 1.2 * len(fit.linear.residual)


def test_a_hose_may_end_before_the_last_joint():
    fit, _, _ = _fitted(_wrist)
    screen = Screen(fit.problem, {"dress_pack": DressPack}, fit.free)
    best = refit_form(screen, fit.linear, compose(screen, fit.linear, "dress_pack"))
    assert (best.effect.body_from, best.effect.body_to) == (2, 5) and best.label == "from body 2 to 5, slack at times"
    flange = max((c for c in best.starts if c.effect.body_to == 6), key=lambda c: c.evidence, default=None)
    assert flange is None or flange.evidence < best.evidence - 8


def test_a_hose_hangs_from_a_gantry():
    found, fit = _formed(DressPack, *_fitted(_hung)[:1])
    best = found.starts[0].effect
    assert isinstance(best, DressPack) and (best.body_from, best.body_to) == (0, 6)
    assert fit.linear.square - found.fall < 1.2 * len(fit.linear.residual)


def test_a_knee_between_those_of_the_forms_is_found():
    data, _ = cell(kinds.nonlinear_tanh, seed=640113, poses=150)
    found, fit = _formed(NonlinearCompliance, base_fit(data))
    assert fit.linear.square - found.fall < 1.2 * len(fit.linear.residual)


def _formed(cls, fit):
    screen = Screen(fit.problem, {cls.key: cls})
    candidate = compose(screen, fit.linear, cls.key)
    assert candidate is not None and candidate.effect.is_null
    return refit_form(screen, fit.linear, candidate), fit


def test_a_hose_that_is_added_first_is_looked_for_again_beside_the_others():
    _, data, true = _fitted(_hose, _balancer)
    added = add_effects(base_fit(data).model, data, ["dress_pack", "gravity_compensator"])
    assert true_error(added.fit, true) < 0.6 * NOISE
