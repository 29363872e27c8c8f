"""Gear lines, or a smooth function of the joint's angle: what predicts rows held out decides."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.identification.curves.families import curve_forms
from postproc.identification.diagnose import _validated, diagnose
from postproc.identification.screen.candidate import Candidate, Screen
from postproc.identification.screen.composition import _sharpened, compose
from postproc.identification.screen.forms import columns_of, forms_of
from postproc.identification.screen.gain import gain
from postproc.identification.screen.suspects import Suspect
from postproc.identification.search import backward
from postproc.identification.state import SearchState
from tests.identification.cells import base_fit, cell, law
from tests.independent.cells import Hidden, column

PHASE = np.random.default_rng(8).uniform(0, 6.3, 9)


def _smooth(s, joint=2):
    return column(joint, sum(6e-5 * np.sin(k * s.q[:, joint] + PHASE[k]) for k in range(1, 9)))


def _line(joint, order):
    return lambda s: column(joint, 2e-4 * np.sin(order * s.q[:, joint] + 0.5))


def _hidden(*shares):
    return lambda g, arm: Hidden("gears", "", joint=lambda s, tau: sum(share(s) for share in shares))


@pytest.mark.parametrize(
    ("shares", "waves", "expected"),
    [
        ((_smooth,), [(3, 2), (3, 5)], {"joint_error_map"}),
        ((_line(2, 2), _line(2, 5)), [(3, 2), (3, 5)], {"transmission_error"}),
        ((_smooth, _line(3, 4)), [(3, 2), (4, 4), (3, 5)], {"transmission_error", "joint_error_map"}),
    ],
    ids=["a smooth function", "two lines", "a smooth function and a line of another joint"],
)
def test_lines_give_way_to_a_map_where_it_predicts_better(shares, waves, expected):
    data, _ = cell(_hidden(*shares), seed=640130, poses=120)
    base = base_fit(data)
    joint, order = zip(*waves, strict=True)
    wave = TransmissionError(joint=joint, order=order)
    fit = fit_model(base.model, base.data, [wave])
    candidate = Candidate(wave.key, wave, fit.free[wave.key], "", 1.0, 1.0, 4, 0.0, 1.0, 0.0)
    search = backward(SearchState(base, fit, effect_library(), None, (candidate,)))
    assert set(search.keys) == expected
    assert expected <= {e.key for e in search.fit.model.effects}
    kept = search.fit.model.effect(wave.key)
    assert kept is None or kept.joint == tuple(j for j in joint if len(expected) == 1 or j == 4)
    assert search.fit.held_out_rms <= fit.held_out_rms


@pytest.mark.parametrize("broad", [True, False], ids=["a smooth function", "two lines"])
def test_lines_beside_a_map_give_way_to_a_map_of_both_joints(broad):
    others = (lambda s: _smooth(s, 1),) if broad else (_line(1, 2), _line(1, 5))
    data, _ = cell(_hidden(_smooth, *others), seed=640134, poses=120)
    base = base_fit(data)
    wave, known = TransmissionError(joint=(2, 2), order=(2.0, 5.0)), JointErrorMap(joint=(3,), order=8)
    fit = fit_model(base.model, base.data, [known, wave])
    told = [Candidate(e.key, e, fit.free[e.key], "", 1.0, 1.0, 4, 0.0, 1.0, 0.0) for e in (known, wave)]
    search = backward(SearchState(base, fit, effect_library(), None, tuple(told)))
    assert search.keys == ((known.key,) if broad else (known.key, wave.key))
    assert set(search.fit.model.effect(known.key).joint) == ({2, 3} if broad else {3})


def test_a_line_that_a_pattern_leaves_nothing_to_tell_goes():
    """Joint 3 jumps at an angle, joint 2 has a line: the line of joint 3 stood in for the jump."""
    data, _ = cell(_hidden(_line(1, 4), lambda s: column(2, 2e-4 * (s.q[:, 2] > 0.1))), seed=640131, poses=120)
    base = base_fit(data)
    wave = TransmissionError(joint=(2, 3), order=(4.0, 1.0))
    fit = fit_model(base.model, base.data, [wave])
    # Two lines among 6 joints and 40 orders, of one effect among 20; a step among 10,000 patterns without a name.
    paid, tried = 2 * np.log(20 * 240.0**2), 2 * np.log(1e4 * 3000)
    told = [Candidate(wave.key, wave, fit.free[wave.key], "", 1.0, 1.0, 4, paid, 1.0, 0.0)]
    place = fit.problem.sensitivity.matrix[:, :, 2:3]
    jump = Suspect("joint 3", place, law("q3", 1.0 * (data.state.q[:, 2] > 0.1)), 1.0, 1.0, tried, "q3")
    state, position = fit.problem.sensitivity.state, fit.problem.rest.T_base_tcp[:, :3, 3]
    every = curve_forms({"q3": state.q[:, 2]}, state, position)
    search = SearchState(base, fit, effect_library(), every, tuple(told)).beside((jump,))
    anew = backward(search)
    assert anew.fit.model.effect(wave.key).joint == (2,)
    assert [m.label for m in anew.missing] == ["joint 2, order 4"]


@pytest.mark.parametrize(("new", "order"), [(2, 11.0), (1, 11.4)])
def test_a_line_moves_to_its_order_once_the_other_is_in(new, order):
    """Where the first was found, the second was missing."""
    data, _ = cell(_hidden(_line(2, 2), _line(2, 11)), seed=640133, poses=60)
    fit = base_fit(data)
    early = TransmissionError(joint=(3, 3), order=(11.4, 2.0))
    before = gain(fit.linear, columns_of(fit.problem, early, np.ones(4, dtype=bool)))
    found = _sharpened(fit.problem, fit.linear, early, before, new)
    assert (early if found is None else found[0].effect).order[0] == order


def test_joint_zeros_come_before_what_else_could_say_the_same():
    """An offset of joint 5 in a base without offsets is a turn of its casting, and half a wave of its gear."""
    data, _ = cell(lambda g, arm: Hidden("zero", "", joint=lambda s, tau: column(4, 2e-3 + 0 * s.q[:, 4])), seed=62)
    found = base_fit(data)
    kept = [e for e in found.model.effects if e.key != "joint_offset"]
    base = fit_model(found.model.with_effects(*kept), found.data)
    library = effect_library()
    names = ("joint_offset", "link_geometry", "transmission_error")
    ranked = SearchState(base, base, {key: library[key] for key in names}, None).ranked
    assert ranked[0].key == "joint_offset" and ranked[0].evidence > 100
    assert next(c for c in ranked if c.key == "link_geometry").evidence <= 0


def test_a_second_line_of_a_motor_is_the_same_effect_on_another_joint():
    data, _ = cell(_hidden(_line(2, 23), _line(4, 39)), seed=640131, poses=100, noise=0.02)
    found = diagnose(base_fit(data).model, data)
    (missing,) = found.missing
    effect = found.final.model.effect("transmission_error")
    assert missing.key == "transmission_error" and found.verdict == "missing"
    assert set(zip(effect.joint, effect.order, strict=True)) == {(3, 23.0), (5, 39.0)}


def test_no_effect_has_columns_that_are_not_its_own():
    for key in effect_library():
        _taken_from_alone(key)


def test_a_line_beside_others_has_the_columns_that_it_has_alone():
    fit = base_fit(cell(seed=640132, poses=40)[0])
    alone = Screen(fit.problem, {TransmissionError.key: TransmissionError}).forms(TransmissionError.key, None)
    held = TransmissionError(joint=(2, 5), order=(3.0, 8.16))
    fresh = {f.label: f for f in forms_of(fit.problem, TransmissionError, held)}
    for line in list(alone)[::50]:
        beside, made = line.beside(held), fresh[line.label]
        assert beside.effect.to_file() == made.effect.to_file()
        np.testing.assert_allclose(beside.columns, made.columns, atol=1e-9 * np.abs(made.columns).max())
        np.testing.assert_array_equal(beside.screened, made.screened)
        np.testing.assert_array_equal(beside.refit, made.refit)


def _taken_from_alone(key):
    fit, cls = base_fit(cell(seed=640132, poses=40)[0]), effect_library()[key]
    alone = Screen(fit.problem, {key: cls}).forms(key, None)
    for held in list(alone)[:: max(1, len(alone) // 3)]:
        taken, made = (forms_of(fit.problem, cls, held.effect, some) for some in (alone, ()))
        assert [f.label for f in taken] == [f.label for f in made]
        for a, b in list(zip(taken, made, strict=True))[:: max(1, len(made) // 20)]:
            np.testing.assert_allclose(a.columns, b.columns, atol=1e-6 * np.abs(b.columns).max())
            np.testing.assert_array_equal(a.screened, b.screened)
            np.testing.assert_array_equal(a.effect.vector(), b.effect.vector())
            assert (a.odds, a.forming) == (b.odds, b.forming)


def test_a_third_line_on_a_joint_that_the_model_has_two_of_is_no_form():
    data, _ = cell(seed=640133, poses=40)
    fit = fit_model(base_fit(data).model, data, [TransmissionError(joint=(3, 3), order=(5.0, 7.0))])
    screen = Screen(fit.problem, {TransmissionError.key: TransmissionError}, fit.free)
    odds = screen.odds(TransmissionError.key, None)
    joints = {f.effect.joint[-1] for f, p in zip(screen.forms(TransmissionError.key, None), odds, strict=True) if p}
    assert 3 not in joints and 2 in joints


def _all_joints(s):
    g = np.random.default_rng(3)
    shares = np.zeros((len(s.q), 6))
    for j in range(6):
        size, phase = g.normal(size=25) / np.arange(1, 26), g.uniform(0, 6.3, 25)
        size *= 2.8e-4 / np.linalg.norm(size)
        shares[:, j] = np.sin(s.q[:, j, None] * np.arange(1, 26) + phase) @ size
    return shares


def test_lines_of_three_joints_give_way_to_a_map_that_few_rows_do_not_earn_joint_by_joint():
    data, _ = cell(_hidden(_all_joints), seed=640150, poses=60)
    base = base_fit(data)
    wave = TransmissionError(joint=(2, 1, 5), order=(3.0, 1.0, 1.0))
    fit = fit_model(base.model, base.data, [wave])
    candidate = Candidate(wave.key, wave, fit.free[wave.key], "", 1.0, 1.0, 6, 0.0, 1.0, 0.0)
    search = backward(SearchState(base, fit, effect_library(), None, (candidate,)))
    assert search.keys == ("joint_error_map",)
    assert search.fit.model.effect("joint_error_map").joint == (1, 2, 3, 4, 5, 6)
    assert search.fit.held_out_rms < 0.9 * fit.held_out_rms


def test_a_map_is_called_by_the_orders_that_the_model_has():
    screened, fitted = (JointErrorMap(joint=(1, 2), order=k) for k in (16, 40))
    none = np.zeros(64, dtype=bool)
    found = Candidate("joint_error_map", screened, none, screened.label, 9.0, 9.0, 1, 0.0, 9.0, 1e-9)
    final = SimpleNamespace(model=SimpleNamespace(effect=lambda key: fitted), held_out_rms=2e-5)
    (told,) = _validated([found], final)
    assert told.label == "joints 1 and 2, orders to 40" and told.held_out_after == 2e-5


def test_a_line_finer_than_any_map_stands_beside_it():
    """A strain-wave gear of 101 to 1 behind a smooth function of three joints, and no line that the map could tell."""
    smooth = tuple(lambda s, j=j: _smooth(s, j) for j in range(3))
    data, _ = cell(_hidden(*smooth, _line(0, 202)), seed=640201, poses=200)
    base = base_fit(data)
    mapped = fit_model(base.model, base.data, [JointErrorMap(joint=(1, 2, 3), order=8)])
    screen = Screen(mapped.problem, {TransmissionError.key: TransmissionError}, mapped.free)
    found = compose(screen, mapped.linear, TransmissionError.key)
    assert found.label == "joint 1, order 202" and found.evidence > 100
    terms = [TransmissionError(joint=(j,), order=(n,)) for j, n in ((1, 12.0), (4, 60.0), (1, 202.0), (4, 90.0))]
    others = {e.key: e for e in mapped.model.effects}
    assert TransmissionError.rooms(terms, None, others).tolist() == [False, False, True, True]
    two = TransmissionError(joint=(1, 1), order=(202.0, 101.0))
    assert TransmissionError.rooms(terms, two, others).tolist() == [False, False, False, True]
