"""What is named, and what else could stand behind the name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.effects.base import Effect, param
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.thermal_joint_drift import ThermalJointDrift
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.loads.payload_error import PayloadError
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.library.structure.thermal_growth import ThermalGrowth
from postproc.estimation.held_out import contiguous_blocks, neighbouring_blocks
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Weights
from postproc.estimation.solving.solve import Terms
from postproc.identification.acceptance import (
    impossible,
    judged,
    predicts_better,
    refit,
)
from postproc.identification.add import add_effects
from postproc.identification.diagnose import diagnose
from postproc.identification.indistinguishable import indistinguishable
from postproc.identification.screen.candidate import Candidate, Screen
from postproc.identification.screen.composition import compose
from postproc.identification.screen.forms import forms_of
from postproc.identification.screen.gain import laplace
from postproc.identification.screen.suspects import Suspect, places
from postproc.identification.search import accepted
from postproc.identification.state import SearchState
from postproc.measure.measurements import Measurements
from postproc.model.equilibrium import predict
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit, cell, law
from tests.independent import library_effects as kinds
from tests.independent.arm import ARMS, Wrenches, point_load
from tests.independent.cells import Hidden, column, draw_cell, draw_states, measure


def _waves(g, arm):
    """Once a turn of joint 2, as a balancer would turn it through the spring of joint 2, and nine times of joint 3."""
    return Hidden("waves", "transmission_error", joint=lambda s, tau: _once(s) + _nine_times(s))


def _short_wave(g, arm):
    return Hidden("wave", "transmission_error", joint=lambda s, tau: _nine_times(s))


def _long_wave(g, arm):
    return Hidden("wave", "transmission_error", joint=lambda s, tau: column(1, 8e-4 * np.sin(3 * s.q[:, 1])))


def _lifted(g, arm):
    """A balloon under the forearm: 4000 N upwards."""

    def force(s, f):
        p = f.body[3][:, :3, 3] + f.body[3][:, :3, :3] @ [0.3, 0, 0.1]
        return Wrenches([point_load(3, p, np.broadcast_to([0.0, 0, 4000.0], p.shape))])

    return Hidden("balloon", "", force=force)


def _loose(g, arm):
    gaps = np.array([0, 2e-4, 2.5e-4, 0, 4e-4, 0])
    return Hidden("backlash", "backlash", joint=lambda s, tau: -gaps * s.approach)


def _once(s):
    return column(1, 8e-4 * np.sin(s.q[:, 1] + 0.4))


def _nine_times(s):
    return column(2, 1e-4 * np.sin(9 * s.q[:, 2]))


def _soft_bearing(g, arm):
    def body(s, f, wrench):
        xi = np.zeros((len(s), 7, 6))
        xi[:, 4, 3:] = 1.3e-5 * wrench[:, 4, 3:] @ (np.eye(3) - np.outer(arm.axis[4], arm.axis[4]))
        return xi

    return Hidden("bearing", "bearing_tilt", body=body)


def test_what_is_far_larger_than_ordinary_is_fitted_as_well():
    """A bearing of the wrist a hundred times softer than a main bearing: at ten ordinary sizes it would not be seen."""
    data, _ = cell(_soft_bearing, seed=640128, noise=0.3)
    base = base_fit(data)
    found = compose(Screen(base.problem, {"bearing_tilt": BearingTilt}, base.free), base.linear, "bearing_tilt")
    after = refit(base, found)
    assert (
        found.label == "joint 5" and found.evidence > 10 and base.linear.square - after.linear.square > 0.9 * found.fall
    )
    assert abs(after.model.effect("bearing_tilt").tilt_rad_per_Nm[4] / 1.3e-5 - 1) < 0.4


def test_a_balancer_that_hides_behind_one_of_several_waves_is_said_to_do_so():
    data, _ = cell(_waves, seed=640120, poses=80)
    (missing,) = diagnose(base_fit(data).model, data).missing
    assert missing.key == "transmission_error" and "gravity_compensator" in missing.not_separable
    data, _ = cell(_short_wave, seed=640120, poses=80)
    (missing,) = diagnose(base_fit(data).model, data).missing
    assert missing.key == "transmission_error" and "gravity_compensator" not in missing.not_separable


def test_rows_that_only_stand_out_beside_an_effect_are_no_merit_of_it():
    data, _ = cell(_long_wave, seed=640122, poses=80)
    wrong = data.position.copy()
    wrong[[7, 40]] += [1.5e-3, 0, 0]
    base = base_fit(replace(data, position=wrong))
    candidate = compose(
        Screen(base.problem, {"transmission_error": TransmissionError}), base.linear, "transmission_error"
    )
    after = refit(base, candidate)
    assert not base.excluded and len(after.excluded) == 2
    mistakes = after.problem.squares()[list(after.excluded)].sum()
    found = judged(base, after, candidate)
    assert found.fall == pytest.approx(base.linear.square - after.linear.square - mistakes, rel=1e-3)
    assert mistakes > 0.05 * base.linear.square and abs(found.fall - candidate.fall) < 0.5 * mistakes


def test_what_no_arm_can_be_is_worth_nothing_but_can_be_added(monkeypatch):
    # A spring that pushes the forearm up as three times its weight would pull it down.
    data, _ = cell(_lifted, seed=640121, poses=60)
    base = base_fit(data)
    screen = Screen(base.problem, {"arm_load": ArmLoad})
    candidate = compose(screen, base.linear, "arm_load")
    after = refit(base, candidate)
    own = base.model.robot.mass[list(after.model.effect("arm_load").body)]
    assert (after.model.effect("arm_load").mass_kg < -own).any()
    assert judged(base, after, candidate).evidence == -np.inf
    monkeypatch.setattr(
        "postproc.identification.diagnose.effect_library", lambda: {"arm_load": ArmLoad}
    )  # it has no rival
    assert diagnose(base.model, data).missing == ()
    assert add_effects(base.model, data, ["arm_load"]).fit.rms < 0.5 * base.rms


class TwoWaves(Effect, reads=("q",)):
    """Joint 3 goes nine times up and down in a turn; and joint 6 is further off than it can be."""

    wave_rad: list[float] = param(unit="rad", shape=(2,), low=-0.01, high=(0.01, 1e-5), typical=1e-4)

    def displacement(self, state):
        dq = np.zeros((len(state), 6))
        dq[:, 2], dq[:, 5] = (self.wave_rad * np.sin(9 * state.q[:, [2, 5]])).T
        return dq


class Denied(TwoWaves):
    """The same, and any wave of joint 6 is said to be impossible."""

    wave_rad: list[float] = param(unit="rad", shape=(2,), low=-0.01, high=0.01, typical=1e-4)

    def impossible(self, robot, beside):
        return np.array([False, self.wave_rad[1] != 0])


def _nine_and_six(g, arm):
    return Hidden("two", "", joint=lambda s, tau: _nine_times(s) + column(5, 4e-4 * np.sin(9 * s.q[:, 5])))


@pytest.mark.parametrize("cls", [TwoWaves, Denied])
def test_what_no_arm_can_be_is_held_and_the_rest_is_judged(cls):
    """A bound that is reached, or what the effect itself denies, of joint 6 is no reason to doubt joint 3."""
    data, _ = cell(_nine_and_six, seed=640122, poses=60)
    base = base_fit(data)
    candidate = Candidate(cls.key, cls(), np.array([True, True]), "", 1.0, 0.0, 2, 0.0, 1.0, 1.0)
    after = refit(base, candidate)
    assert after.model.effect(cls.key).wave_rad[1] == 0.0
    assert after.free[cls.key].tolist() == [True, False]
    assert abs(after.model.effect(cls.key).wave_rad[0]) > 5e-5
    assert judged(base, after, candidate).evidence > 0
    alone = replace(candidate, free=np.array([False, True]))
    assert judged(base, refit(base, alone), alone).evidence == -np.inf


def test_a_payload_that_was_stated_and_never_taken_up_is_nothing_impossible():
    g = np.random.default_rng(640123)
    arm = ARMS["irb4600_60_205"]()
    s = draw_states(g, 50, arm, False, False)
    places = measure(draw_cell(g, arm, ()), replace(s, mass=np.zeros(50))) + g.normal(0, 3e-5, (50, 3))
    state = State(s.q, approach=s.approach, payload_mass=s.mass, payload_center=s.center)
    base = base_fit(Measurements(state, places, row=tuple(range(1, 51)), line=(1,) * 50))
    free = np.array([name == "fraction" for name in PayloadError().names()])
    fit = fit_model(base.model, base.data, [PayloadError()], terms=Terms({**base.free, "payload_error": free}))
    assert fit.model.effect("payload_error").fraction == pytest.approx(-1.0, abs=0.1)
    assert not impossible(fit, "payload_error").any()


def test_better_is_what_predicts_better_in_most_blocks():
    data, _ = cell(_short_wave, seed=640120, poses=80)
    base = base_fit(data)
    wave = TransmissionError(joint=[3], order=[9])
    right = fit_model(base.model, base.data, [wave])
    assert predicts_better(right, base, 2.0) and not predicts_better(base, right, 0.0)
    assert not predicts_better(base, base, 0.0)
    # The same gain in one block of ten is one standard error: no more than a place where something else is wrong.
    first = neighbouring_blocks(base.data.repeats, base.data.state.q) == 0
    one = SimpleNamespace(held_out_by=lambda blocks: base.held_out_by(blocks) * np.where(first, 0.1, 1.0)[:, None])
    assert predicts_better(one, base, 0.0) and not predicts_better(one, base, 1.1)
    # Nor is one block that nothing but itself determines, and that is farther off than all others gain.
    bad = SimpleNamespace(held_out_by=lambda blocks: right.held_out_by(blocks) * np.where(first, 100.0, 1.0)[:, None])
    assert predicts_better(bad, base, 1.5)


def test_what_tells_poses_by_their_like_alone_is_not_predicted_elsewhere():
    """Forty places seen twice, hours apart, each off by what no law tells: a map of an angle learns them all."""
    g = np.random.default_rng(640131)
    data, _ = cell(seed=640120, poses=40)
    again = g.permutation(np.repeat(np.arange(40), 2))
    data, arm = data.rows(again), base_fit(data).model
    q = data.state.q + g.normal(0, 1e-3, (80, 6))
    off = np.column_stack([g.normal(0, 3e-4, 40)[again], np.zeros((80, 5))])
    places = predict(arm, replace(data.state, q=q + off))[:, :3, 3] + g.normal(0, 3e-5, (80, 3))
    base = base_fit(replace(data, state=replace(data.state, q=q), position=places, rotation=None))
    after = fit_model(base.model, base.data, [JointErrorMap(joint=(1,), order=25)])
    assert not predicts_better(after, base, 2.0)
    free = np.ones(len(after.model.effect("joint_error_map").vector()), dtype=bool)
    effect, fall = after.model.effect("joint_error_map"), base.linear.square - after.linear.square
    learnt = Candidate("joint_error_map", effect, free, "joint 1", 100.0, fall, 50, 0.0, 9.0, 0.0, fit=after)
    assert accepted(SearchState(base, base, {"joint_error_map": JointErrorMap}, None), learnt) is None
    data, _ = cell(_short_wave, seed=640120, poses=80)
    base = base_fit(data)
    assert predicts_better(fit_model(base.model, base.data, [TransmissionError(joint=[3], order=[9])]), base, 2.0)


@pytest.mark.parametrize(("worse", "further"), [(0, True), (1, True), (4, False)])
def test_a_part_that_gains_far_more_than_the_others_is_no_doubt(worse, further):
    q = np.random.default_rng(3).uniform(-1, 1, (100, 6))
    data = SimpleNamespace(repeats=np.arange(100), state=SimpleNamespace(q=q))
    blocks = neighbouring_blocks(data.repeats, q)
    before = 1.0 + 9.0 * (blocks == 9)[:, None] * np.ones((100, 3))
    after = before * np.select([blocks < worse, blocks == 9], [1.02, 0.1], 0.95)[:, None]
    fits = (SimpleNamespace(data=data, held_out_by=lambda blocks, error=error: error) for error in (after, before))
    assert predicts_better(*fits, 2.0) is further


def test_what_hides_is_told_from_fits_that_use_other_rows():
    data, _ = cell(_waves, seed=640120, poses=80)
    before = base_fit(data)
    after = base_fit(data.rows(np.arange(len(data)) % 9 > 0), more=("transmission_error",))
    wave = TransmissionError(joint=[2, 3], order=[1, 9])
    after = fit_model(after.model.with_effects(*after.model.effects[:-1], wave), after.data)
    screen = Screen(before.problem, {c.key: c for c in (GravityCompensator, ThermalJointDrift)})
    ranking = [compose(screen, before.linear, key) for key in screen.classes]
    ranking = [replace(c, evidence=1.0) for c in ranking]
    chosen = replace(ranking[0], key="transmission_error", evidence=1e9, fall=before.linear.square)
    assert indistinguishable(ranking, chosen, before, after) == ((), ("gravity_compensator",))


def test_what_explains_no_more_than_noise_hides_behind_nothing():
    """Of a link's many lengths each takes its share of the noise, beside any effect."""
    data, _ = cell(seed=523, poses=80)
    before, after = base_fit(data), base_fit(data, more=("backlash",))
    screen = Screen(before.problem, {LinkGeometry.key: LinkGeometry})
    some = replace(compose(screen, before.linear, LinkGeometry.key), evidence=1.0)
    chosen = replace(some, key="backlash", evidence=1e9, fall=before.linear.square)
    assert indistinguishable([some], chosen, before, after) == ((), ())


def test_held_out_blocks_are_predicted_with_the_patterns_beside():
    """Each block by least squares on the rows of the others, the pattern's columns among the fitted ones."""
    data, _ = cell(_short_wave, seed=521, poses=60)
    fit = base_fit(data)
    wave, moves = np.sin(9 * data.state.q[:, 2]), places(fit.problem)["joint 3"]
    one = Suspect("joint 3", moves, law("q3", wave), 0.0, 0.0, 0.0, "q3")
    columns = np.hstack([fit.columns, one.columns(fit.problem)])
    blocks = contiguous_blocks(data.repeats)
    at, y, weights = blocks[fit.problem.row], fit.problem.residual, fit.problem.weights
    wanted = []
    for block in range(blocks.max() + 1):
        own = at == block
        x = np.linalg.lstsq(columns[~own], y[~own], rcond=None)[0]
        wanted.append(np.sum(((y[own] - columns[own] @ x) / weights.values[weights.used][own]) ** 2))
    beside = SearchState(fit, fit, {}, None).beside((one,)).fit
    found = np.bincount(blocks, np.nansum(beside.held_out_error**2, axis=1))
    assert found == pytest.approx(np.array(wanted), rel=1e-2)
    assert found.sum() < 0.5 * np.nansum(fit.held_out_error**2)


def test_growth_at_the_reference_counts_once_growth_with_temperature_is_seen():
    """A hall that is warmer than the reference on the whole: castings are longer at the mean temperature, too."""
    data, _ = cell(kinds.thermal_growth, seed=903, noise=0.03, poses=160)
    assert data.state.temperature is not None
    base = base_fit(data.rows(data.state.temperature > 30.0))
    found = compose(Screen(base.problem, {ThermalGrowth.key: ThermalGrowth}), base.linear, ThermalGrowth.key)
    nu, square = base.linear.freedom, base.linear.square
    assert found.evidence > 0.8 * nu * np.log(square / (square - found.fall))


def _from_another_temperature_on(g, arm):
    """All castings grow from 26 deg C on, the third nearly twice as much."""

    def body(s, f, wrench):
        xi = np.zeros((len(s), 7, 6))
        for b in range(7):
            xi[:, b, :3] = (1.15e-5 + 1e-5 * (b == 3)) * (s.temperature - 26.0)[:, None] * arm.link[b][:3, 3]
        return xi

    return Hidden("growth", "thermal_growth", body=body)


def test_a_casting_that_grows_beyond_the_others_does_so_from_any_temperature_on():
    """Its constant goes along with what it grows: the strain that all have in common does not stand for it."""
    data, _ = cell(_from_another_temperature_on, seed=905, noise=0.02, poses=120)
    base = base_fit(data)
    found = compose(Screen(base.problem, {ThermalGrowth.key: ThermalGrowth}), base.linear, ThermalGrowth.key)
    assert found.label == "all castings; body 3"
    fit = refit(base, found)
    growth = fit.model.effect(ThermalGrowth.key)
    assert growth.extra_per_K[3] == pytest.approx(1e-5, rel=0.2)
    assert growth.extra_strain[3] == pytest.approx(-6e-5, rel=0.4)
    # The base has no geometry: a constant of the third casting alone is none of growth.
    alone, _ = cell(_longer, seed=906, noise=0.02, poses=120)
    base = base_fit(alone)
    found = compose(Screen(base.problem, {ThermalGrowth.key: ThermalGrowth}), base.linear, ThermalGrowth.key)
    assert "body 3" not in found.label


def _longer(g, arm):
    def body(s, f, wrench):
        xi = np.zeros((len(s), 7, 6))
        for b in range(7):
            xi[:, b, :3] = (1.15e-5 * (s.temperature - 20.0) + 2e-4 * (b == 3))[:, None] * arm.link[b][:3, 3]
        return xi

    return Hidden("longer", "thermal_growth", body=body)


def test_lost_motion_of_three_joints_is_told_as_theirs():
    """After the largest, all joints at once would tell more than one more of them."""
    data, _ = cell(_loose, seed=904, noise=0.02, poses=100)
    base = base_fit(data)
    found = compose(Screen(base.problem, {Backlash.key: Backlash}), base.linear, Backlash.key)
    assert sorted(found.label.split("; ")) == ["joint 2", "joint 3", "joint 5"]


def test_what_follows_loads_is_asked_anew_beside_a_further_load_and_nothing_else_is():
    data, _ = cell(_loose, seed=904, noise=0.02, poses=100)
    base = base_fit(data)
    loaded = replace(base, problem=base.problem.at([*base.model.effects, ArmLoad(body=(3,), mass_kg=[200.0])]))
    search = SearchState(base, base, {c.key: c for c in (NonlinearCompliance, Backlash, PayloadError)}, None)
    beside = replace(search, fit=loaded)
    same = {key: search.screen.forms(key, None) is beside.screen.forms(key, None) for key in search.classes}
    assert same == {"nonlinear_compliance": False, "backlash": True, "payload_error": True}


def test_forms_follow_the_weights_of_the_present_fit():
    """Orientations weigh by what a fit leaves of them: what was whitened for a worse fit is not what it was."""
    data, _ = cell(_loose, seed=904, noise=0.02, poses=100)
    base = base_fit(data)
    search = SearchState(base, base, {Backlash.key: Backlash}, None)
    first = search.screen.forms(Backlash.key, None)
    values = base.problem.weights.values
    heavier = Weights(values * [1.0, 2.0, 3.0])
    beside = replace(search, fit=replace(base, problem=base.problem.weighted(heavier)))
    found = beside.screen.forms(Backlash.key, None)
    for one, other in zip(found, forms_of(base.problem.weighted(heavier), Backlash), strict=True):
        assert one.columns == pytest.approx(other.columns, rel=1e-12)
    alike = replace(search, fit=replace(base, problem=base.problem.weighted(Weights(values * 1.001))))
    again = replace(search)
    assert again.screen.forms(Backlash.key, None) is not first
    assert alike.screen.forms(Backlash.key, None) is again.screen.forms(Backlash.key, None)
    fewer = Weights(np.where(np.arange(len(values))[:, None] == 3, 0.0, values))
    less = replace(search, fit=replace(base, problem=base.problem.weighted(fewer)))
    assert less.screen.forms(Backlash.key, None)[0].columns.shape[0] == first[0].columns.shape[0] - 3


def test_a_further_joint_is_one_among_the_forms_of_its_effect_alone():
    base = base_fit(cell(_loose, seed=904, noise=0.02, poses=100)[0])
    there = base.problem.at([*base.model.effects, Backlash()])
    some = {"backlash": Backlash, "arm_load": ArmLoad}
    paid = [Screen(problem, some).rarity("backlash") for problem in (base.problem, there)]
    assert paid == [pytest.approx(2 * np.log(2)), 0.0]


def test_a_hose_that_is_tied_far_away_costs_what_its_ends_are_off_in_ordinary_sizes():
    """Each by a normal law of three ordinary sizes of 0.2 m: the floor would do what a weight does."""
    rng = np.random.default_rng(4)
    linear, rest = Linear(rng.normal(size=300), np.zeros((300, 0)), np.arange(300) // 3), 200.0

    def worth(end):
        hose = DressPack(from_m=end, to_m=[0.0, -0.06, 0.0], slack_m=0.3)
        return laplace(linear, rest, np.zeros((2, 2)), hose, load_robot("irb4600_60_205"), np.array([0, 1]))

    def left(*places):
        return 1 + np.sum((np.array(places) / 0.6) ** 2) / 298

    assert worth([0, 0, 0.3]) - worth([0, -0.3, -1.5]) == pytest.approx(
        300 * np.log(left(0.06, 0.3, 1.5) / left(0.06, 0.3))
    )
