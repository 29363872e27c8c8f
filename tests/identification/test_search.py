"""What a search adds, replaces and refuses, and what else could stand behind a name."""

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
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.loads.payload_error import PayloadError
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.library.structure.thermal_growth import ThermalGrowth
from postproc.effects.registry import effect_library
from postproc.estimation.evidence import CLOSE_EVIDENCE
from postproc.estimation.fitted import Fit
from postproc.estimation.held_out import neighbouring_blocks
from postproc.estimation.least_squares import fit_model
from postproc.estimation.problem import Weights
from postproc.estimation.solving.settle import settled
from postproc.estimation.solving.solve import Terms
from postproc.identification.acceptance import impossible, judged, predicts_better, refit
from postproc.identification.add import add_effects
from postproc.identification.curves.families import curve_forms
from postproc.identification.indistinguishable import contenders, indistinguishable
from postproc.identification.screen.candidate import Candidate, Screen
from postproc.identification.screen.composition import compose
from postproc.identification.screen.forms import columns_of, forms_of
from postproc.identification.screen.gain import gain, score_tests
from postproc.identification.search import accepted, backward, search, without_redundant_names
from postproc.identification.state import SearchState
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.robot.catalogue import load_robot
from tests.identification.cells import base_fit, cell, curve_candidate
from tests.independent import library_effects as kinds
from tests.independent.arm import ARMS, Wrenches, point_load
from tests.independent.cells import Hidden, column, draw_cell, draw_states, measure
from tests.measure.tables import ARM, HEADER, Source, points

PHASE = np.random.default_rng(8).uniform(0, 6.3, 9)
LIBRARY = effect_library()


def joints(*laws, name: str = "laws"):
    """A kind of effect: joints turned by some laws of the states."""
    kind = lambda g, arm: Hidden(name, "", joint=lambda s, tau: sum(law(s) for law in laws))  # noqa: E731
    return kind


def wave(joint: int, order: float, size: float = 2e-4, phase: float = 0.5):
    return lambda s: column(joint, size * np.sin(order * s.q[:, joint] + phase))


def smooth(joint: int):
    return lambda s: column(joint, sum(6e-5 * np.sin(k * s.q[:, joint] + PHASE[k]) for k in range(1, 9)))


def started(base: Fit, *effects: Effect) -> SearchState:
    """A search that has added these effects already."""
    fit = fit_model(base.model, base.data, effects)
    found = [Candidate(e.key, e, fit.free[e.key], "", 1.0, 1.0, 4, 0.0, 1.0, 0.0) for e in effects]
    return SearchState(base, fit, LIBRARY, None, tuple(found))


NINE = wave(2, 9, 1e-4, 0.0)
WAVES = joints(wave(1, 1, 8e-4, 0.4), NINE)
SHORT = joints(NINE)
LOOSE = joints(lambda s: -np.array([0, 2e-4, 2.5e-4, 0, 4e-4, 0]) * s.approach)


@pytest.mark.parametrize(
    ("laws", "lines", "expected"),
    [
        ((wave(2, 2), wave(2, 5)), [(3, 2), (3, 5)], {"transmission_error": {3}}),
        ((smooth(2), wave(3, 4)), [(3, 2), (4, 4), (3, 5)], {"transmission_error": {4}, "joint_error_map": {3}}),
    ],
    ids=["two lines", "a smooth function and a line of another joint"],
)
def test_lines_give_way_to_a_map_where_it_predicts_better(laws, lines, expected):
    base = base_fit(cell(joints(*laws), seed=640130, poses=120)[0])
    joint, order = zip(*lines, strict=True)
    begin = started(base, TransmissionError(joint=joint, order=order))
    found = backward(begin)
    assert {key: set(found.fit.model.effect(key).joint) for key in found.keys} == expected
    assert found.fit.held_out_rms <= begin.fit.held_out_rms


def test_a_line_that_a_curve_leaves_nothing_to_tell_goes():
    """Joint 3 jumps at an angle, joint 2 has a line: the line of joint 3 stood in for the jump."""
    jump = lambda s: column(2, 2e-4 * (s.q[:, 2] > 0.1))  # noqa: E731
    base = base_fit(cell(joints(wave(1, 4), jump), seed=640131, poses=120)[0])
    begin = started(base, TransmissionError(joint=(2, 3), order=(4.0, 1.0)))
    q3 = State(q=base.data.state.q * [0, 0, 1, 0, 0, 0], T_base_body=np.tile(np.eye(4), (len(base.data), 7, 1, 1)))
    begin = replace(begin, forms=curve_forms(q3, base.problem.site, seen=False))
    paid = replace(begin.missing[0], price=2 * np.log(20 * 240.0**2))
    begin = replace(begin, missing=(paid,))
    begin = begin.with_curves(tuple(begin.ranked_curves())[:1])
    found = backward(begin)
    assert [m.label for m in found.missing] == ["joint 2, order 4"] and found.curves[0].curve.where == "joint 3"


def test_beside_its_curves_a_search_keeps_only_names_that_tell_more():
    """Joint 3 jumps at an angle, joints 2, 3, 5 have lost motion: a line of joint 3 stood in for the jump."""
    jump, gap = (
        lambda s: column(2, 2e-4 * (s.q[:, 2] > 0.1)),
        lambda s: -np.array([0, 1e-4, 1e-4, 0, 2e-4, 0]) * s.approach,
    )
    base = base_fit(cell(joints(jump, gap), seed=640132, poses=120)[0])
    begin = started(base, Backlash(), TransmissionError(joint=(3,), order=(1.0,)))
    q3 = State(q=base.data.state.q * [0, 0, 1, 0, 0, 0], T_base_body=np.tile(np.eye(4), (len(base.data), 7, 1, 1)))
    begin = replace(begin, forms=curve_forms(q3, base.problem.site, seen=False))
    assert without_redundant_names(begin) is begin
    found = without_redundant_names(begin.with_curves(tuple(begin.ranked_curves())[:1]))
    assert found.keys == ("backlash",) and found.curves[0].curve.where == "joint 3"


def test_a_name_takes_the_place_of_a_curve_that_was_taken_before_it():
    """Beside others a temperature may look like something without a name; once they are in, it is the joint's drift."""
    base = base_fit(cell(kinds.thermal_joint_drift, seed=31, poses=60)[0])
    forms = curve_forms(base.problem.sensitivity.state, base.problem.site)
    begin = SearchState(base, base, {ThermalJointDrift.key: ThermalJointDrift}, forms)
    early = begin.with_curves(tuple(begin.ranked_curves())[:1])
    assert early.curves and not early.missing
    found = search(early)
    assert found.keys == ("thermal_joint_drift",) and not found.curves
    assert found.log_evidence > early.log_evidence


def two_rates(g, arm) -> Hidden:
    knee, more = g.uniform(350, 600), g.uniform(3e-7, 8e-7)
    law = lambda t: more * np.sign(t) * np.maximum(np.abs(t) - knee, 0)  # noqa: E731
    return Hidden("two_rates", "nonlinear_compliance", joint=lambda s, tau: column(1, law(tau[:, 1])))


def test_a_law_that_was_taken_before_the_other_effect_gives_way_to_the_one_that_suits_both():
    base = base_fit(cell(two_rates, joints(wave(1, 1, 3e-4)), seed=7)[0])
    some = {c.key: c for c in (NonlinearCompliance, TransmissionError)}
    begin = SearchState(base, base, some, None)
    for key, change in (("nonlinear_compliance", {"law": "tanh"}), ("transmission_error", {})):
        first = compose(begin.screen, begin.fit.linear, key)
        first = replace(first, effect=replace(first.effect, **change), label=change.get("law", first.label))
        after = refit(begin.fit, first)
        begin = begin.with_effect(judged(begin.fit, after, first), after)
    found = backward(begin)
    assert {m.key: getattr(m.effect, "law", "") for m in found.missing} == {
        "nonlinear_compliance": "piecewise",
        "transmission_error": "",
    }
    assert found.fit.linear.square < begin.fit.linear.square - 15 and backward(found).fit is found.fit


def swaying(data: Measurements, size: float = 1e-3) -> tuple[Fit, Candidate]:
    """The instrument goes to and fro from row to row [m]; and the curve of that."""
    rows = np.sin(np.arange(len(data)) / 3.0)
    moved = replace(data, position=data.position + size * rows[:, None] * [1.0, -0.5, 0.3])
    moved = replace(moved, state=moved.state.with_(channels={"sway": rows}))
    base = base_fit(moved)
    return base, curve_candidate(base, "instrument", "sway", rows)


def test_a_small_load_is_taken_beside_a_large_law_as_it_is_without_one():
    data, _ = cell(kinds.arm_load, seed=71, noise=0.02)
    base, curve = swaying(data)
    begin = SearchState(base, base, {ArmLoad.key: ArmLoad}, None)
    assert not any(c.evidence > 0 for c in begin.ranked)
    both = begin.with_curves((curve,))
    found = accepted(both, both.ranked[0])
    assert found is not None and found.missing[0].evidence > 10.0
    alone = fit_model(base_fit(data).model, base_fit(data).data, [found.fit.model.effect("arm_load")])
    quiet, x = alone.model.effect("arm_load").vector(), found.fit.model.effect("arm_load").vector()
    sigma = np.array([found.fit.sigma.get(("arm_load", i), np.inf) for i in range(len(x))])
    assert np.abs(x - quiet).max() > 0 and (np.abs(x - quiet) < 4 * sigma).all()


def test_what_forms_an_effect_stays_where_the_curves_are_taken_away():
    base, curve = swaying(cell(two_rates, seed=7, noise=0.02)[0])
    both = SearchState(base, base, {NonlinearCompliance.key: NonlinearCompliance}, None).with_curves((curve,))
    found = accepted(both, both.ranked[0])
    bare = found.with_curves(())
    one, other = (s.fit.model.effect(NonlinearCompliance.key) for s in (found, bare))
    forms = ~one.amplitudes() & found.fit.free[NonlinearCompliance.key]
    assert forms.any() and (one.vector()[forms] == other.vector()[forms]).all()
    assert bare.fit.model.effect("curve") is None and bare.fit.rms > 5 * found.fit.rms
    assert bare.with_curves(()) is bare and found.with_curves((curve,)) is found
    assert both.with_curves((curve, replace(curve))).with_curves(()).fit is base


def test_all_that_was_added_is_worth_the_same_however_large_the_noise_was_said_to_be():
    base = base_fit(cell(two_rates, seed=7)[0])
    heavy = base.problem.weighted(Weights(3.0 * base.problem.weights.values))
    quiet = replace(base, problem=heavy, columns=3.0 * base.columns)
    assert quiet.linear.square > 8.0 * base.linear.square
    one, other = (SearchState(base, fit, {}, None).log_evidence for fit in (base, quiet))
    assert other == pytest.approx(one, abs=1e-6)


def test_better_is_what_predicts_better_in_most_regions():
    base = base_fit(cell(SHORT, seed=640120, poses=80)[0])
    right = fit_model(base.model, base.data, [TransmissionError(joint=[3], order=[9])])
    assert predicts_better(right, base, 2.0) and not predicts_better(base, right, 0.0)
    assert not predicts_better(base, base, 0.0)
    first = neighbouring_blocks(base.data.repeats, base.data.state.q) == 0

    def only_there(fit: Fit, share: float) -> SimpleNamespace:
        return SimpleNamespace(
            held_out_by=lambda blocks: fit.held_out_by(blocks) * np.where(first, share, 1.0)[:, None]
        )

    # One region of ten that gains is one standard error; one that nothing but itself determines is no doubt.
    assert predicts_better(only_there(base, 0.1), base, 0.0) and not predicts_better(only_there(base, 0.1), base, 1.1)
    assert predicts_better(only_there(right, 100.0), base, 1.5)


@pytest.mark.parametrize(("worse", "better"), [(0, True), (1, True), (4, False)])
def test_a_region_that_gains_far_more_than_the_others_is_no_doubt(worse, better):
    q = np.random.default_rng(3).uniform(-1, 1, (100, 6))
    data = SimpleNamespace(repeats=np.arange(100), fold_group=np.arange(100), state=SimpleNamespace(q=q))
    blocks = neighbouring_blocks(data.repeats, q)
    before = 1.0 + 9.0 * (blocks == 9)[:, None] * np.ones((100, 3))
    after = before * np.select([blocks < worse, blocks == 9], [1.02, 0.1], 0.95)[:, None]
    fits = (SimpleNamespace(data=data, held_out_by=lambda blocks, error=error: error) for error in (after, before))
    assert predicts_better(*fits, 2.0) is better


def test_what_tells_poses_by_their_like_alone_is_refused():
    """Forty places seen twice, hours apart, each off by what no law tells: a map of an angle learns them all."""
    g = np.random.default_rng(640131)
    data, _ = cell(seed=640120, poses=40)
    again = g.permutation(np.repeat(np.arange(40), 2))
    data, arm = data.rows(again), base_fit(data).model
    q = data.state.q + g.normal(0, 1e-3, (80, 6))
    off = np.column_stack([g.normal(0, 3e-4, 40)[again], np.zeros((80, 5))])
    seen = predict(arm, replace(data.state, q=q + off))[:, :3, 3] + g.normal(0, 3e-5, (80, 3))
    base = base_fit(replace(data, state=replace(data.state, q=q), position=seen, rotation=None))
    after = fit_model(base.model, base.data, [JointErrorMap(joint=(1,), order=25)])
    effect, fall = after.model.effect("joint_error_map"), base.linear.square - after.linear.square
    free = np.ones(len(effect.vector()), dtype=bool)
    learnt = Candidate(effect.key, effect, free, "joint 1", 100.0, fall, 50, 0.0, 9.0, 0.0, fit=after)
    assert accepted(SearchState(base, base, {effect.key: JointErrorMap}, None), learnt) is None


def test_rows_that_only_stand_out_beside_an_effect_are_no_merit_of_it():
    data, _ = cell(joints(wave(1, 3, 8e-4, 0.0)), seed=640122, poses=80)
    wrong = data.position.copy()
    wrong[[7, 40]] += [1.5e-3, 0, 0]
    base = base_fit(replace(data, position=wrong))
    one = compose(Screen(base.problem, {TransmissionError.key: TransmissionError}), base.linear, TransmissionError.key)
    after = refit(base, one)
    assert not base.excluded and len(after.excluded) == 2
    mistakes = after.problem.squares()[list(after.excluded)].sum()
    fall = judged(base, after, one).rss_reduction
    assert fall == pytest.approx(base.linear.square - after.linear.square - mistakes, rel=1e-3)
    assert mistakes > 0.05 * base.linear.square and abs(fall - one.rss_reduction) < 0.5 * mistakes


def lifted(g, arm) -> Hidden:
    """A balloon under the forearm, 4000 N upwards: three times its weight."""

    def force(s, f):
        p = f.body[3][:, :3, 3] + f.body[3][:, :3, :3] @ [0.3, 0, 0.1]
        return Wrenches([point_load(3, p, np.broadcast_to([0.0, 0, 4000.0], p.shape))])

    return Hidden("balloon", "", force=force)


def test_what_no_arm_can_be_is_worth_nothing_but_can_be_added():
    base = base_fit(cell(lifted, seed=640121, poses=60)[0])
    one = compose(Screen(base.problem, {ArmLoad.key: ArmLoad}), base.linear, ArmLoad.key)
    after = refit(base, one)
    declared = base.model.robot.mass[list(after.model.effect(ArmLoad.key).body)]
    assert (after.model.effect(ArmLoad.key).mass_kg < -declared).any()
    assert judged(base, after, one).evidence == -np.inf
    assert add_effects(base.model, base.data, [ArmLoad.key]).fit.rms < 0.5 * base.rms


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


@pytest.mark.parametrize("cls", [TwoWaves, Denied])
def test_what_no_arm_can_be_is_held_and_the_rest_is_judged(cls):
    """A bound that is reached, or what the effect itself denies, of joint 6 is no reason to doubt joint 3."""
    base = base_fit(cell(joints(NINE, wave(5, 9, 4e-4, 0.0)), seed=640122, poses=60)[0])
    one = Candidate(cls.key, cls(), np.array([True, True]), "", 1.0, 0.0, 2, 0.0, 1.0, 1.0)
    after = refit(base, one)
    assert after.model.effect(cls.key).wave_rad[1] == 0.0 and after.free[cls.key].tolist() == [True, False]
    assert abs(after.model.effect(cls.key).wave_rad[0]) > 5e-5 and judged(base, after, one).evidence > 0
    alone = replace(one, free=np.array([False, True]))
    assert judged(base, refit(base, alone), alone).evidence == -np.inf


@pytest.mark.parametrize(
    ("key", "table", "robot", "none"),
    [
        ("thermal_growth", {"growth_per_K": 46e-6}, "irb4600_60_205", False),  # aluminium that warms twice as much
        ("thermal_growth", {"growth_per_K": 145e-6}, "irb4600_60_205", True),
        ("thermal_joint_drift", {"drift_rad_per_K": [0, -4e-4, 0, 0, 0, 0]}, "irb4600_60_205", True),
        ("payload_error", {"mass_kg": -31.4}, "irb4600_60_205", False),  # of 60 kg that were stated
        ("payload_error", {"mass_kg": -31.4}, "ur10", True),
    ],
)
def test_a_size_that_no_arm_has_is_no_name(key, table, robot, none):
    model = Model(load_robot(robot)).with_effects(effect_library()[key](**table))
    assert impossible(SimpleNamespace(model=model, at_bound=()), key).any() == none


def test_a_payload_that_was_stated_and_never_taken_up_is_nothing_impossible():
    g = np.random.default_rng(640123)
    arm = ARMS["irb4600_60_205"]()
    s = draw_states(g, 50, arm, False, False)
    seen = measure(draw_cell(g, arm, ()), replace(s, mass=np.zeros(50))) + g.normal(0, 3e-5, (50, 3))
    state = State(s.q, approach=s.approach, payload_mass=s.mass, payload_center=s.center)
    base = base_fit(Measurements(state, seen, row=tuple(range(1, 51)), line=(1,) * 50))
    free = np.array([name == "fraction" for name in PayloadError().names()])
    fit = fit_model(base.model, base.data, [PayloadError()], terms=Terms({**base.free, "payload_error": free}))
    assert fit.model.effect("payload_error").fraction == pytest.approx(-1.0, abs=0.1)
    assert not impossible(fit, "payload_error").any()


def test_what_hides_behind_an_effect_is_told_also_from_fits_that_use_other_rows():
    data, _ = cell(WAVES, seed=640120, poses=80)
    before = base_fit(data)
    line = TransmissionError(joint=[2, 3], order=[1, 9])
    after = fit_model(before.model, data.rows(np.arange(len(data)) % 9 > 0), [line])
    screen = Screen(before.problem, {c.key: c for c in (GravityCompensator, ThermalJointDrift)})
    ranking = [replace(compose(screen, before.linear, key), evidence=1.0) for key in screen.classes]
    chosen = replace(ranking[0], key="transmission_error", evidence=1e9, rss_reduction=before.linear.square)
    assert indistinguishable(ranking, chosen, before, after) == ((), ("gravity_compensator",))


def test_what_explains_no_more_than_noise_hides_behind_nothing():
    data, _ = cell(seed=523, poses=80)
    before, after = base_fit(data), base_fit(data, more=("backlash",))
    one = compose(Screen(before.problem, {LinkGeometry.key: LinkGeometry}), before.linear, LinkGeometry.key)
    chosen = replace(one, key="backlash", evidence=1e9, rss_reduction=before.linear.square)
    assert indistinguishable([replace(one, evidence=1.0)], chosen, before, after) == ((), ())


@pytest.mark.parametrize(("few", "expected"), [(True, ["arm_load"]), (False, [])])
def test_what_most_poses_say_is_told_beside_what_a_few_say_loudly(few, expected):
    """Lost motion of joint 2 in 14 poses of 120, or in all; and a load on body 3 in every pose."""
    data, _ = cell(seed=981)
    fit = base_fit(data)
    loud, load = (np.zeros(120), np.full(120, 0.7)) if few else (np.full(120, 1.2), np.full(120, 0.5))
    loud[np.random.default_rng(2).choice(120, 14, replace=False)] += 8.0 * few
    y, effects = np.random.default_rng(5).normal(size=len(fit.linear.residual)), []
    for effect, free, size in (
        (Backlash.null(), np.arange(6) == 1, loud),
        (ArmLoad(body=(3,)), np.arange(4) == 0, load),
    ):
        columns = columns_of(fit.problem, effect, free)
        seen = fit.linear.project(columns)[:, 0]
        y = y + seen / np.sqrt(np.mean(seen**2)) * size[data.repeats][fit.linear.row]
        effects.append((effect, free, columns))
    linear = replace(fit.linear, residual=y)
    worth = [(e, free, gain(linear, columns)) for e, free, columns in effects]
    ranked = [Candidate(e.key, e, free, "", w.evidence, w.rss_reduction, 1, 0.0, 9.0, 1e-9) for e, free, w in worth]
    first, second = ranked = sorted(ranked, key=lambda c: -c.evidence)
    assert (
        first.key == "backlash"
        and second.evidence > 0
        and (first.evidence - second.evidence > CLOSE_EVIDENCE or not few)
    )
    assert contenders(ranked, first, SimpleNamespace(linear=linear, data=data, problem=fit.problem)) == expected


def soft_bearing(g, arm) -> Hidden:
    def body(s, f, wrench):
        xi = np.zeros((len(s), 7, 6))
        xi[:, 4, 3:] = 1.3e-5 * wrench[:, 4, 3:] @ (np.eye(3) - np.outer(arm.axis[4], arm.axis[4]))
        return xi

    return Hidden("bearing", "bearing_tilt", body=body)


def growing(g, arm) -> Hidden:
    """All castings grow from 26 deg C on, the third nearly twice as much."""

    def body(s, f, wrench):
        xi = np.zeros((len(s), 7, 6))
        for b in range(7):
            xi[:, b, :3] = (1.15e-5 + 1e-5 * (b == 3)) * (s.temperature - 26.0)[:, None] * arm.link[b][:3, 3]
        return xi

    return Hidden("growth", "thermal_growth", body=body)


@pytest.mark.parametrize(
    ("kind", "cls", "labels", "values"),
    [
        (LOOSE, Backlash, {"joint 2", "joint 3", "joint 5"}, {}),
        # A hundred times softer than a main bearing: at ten ordinary sizes it would not be seen.
        (soft_bearing, BearingTilt, {"joint 5"}, {"tilt_rad_per_Nm": (4, 1.3e-5)}),
        # Its constant goes along with what it grows: the strain that all have in common does not stand for it.
        (growing, ThermalGrowth, {"all castings", "body 3"}, {"extra_per_K": (3, 1e-5), "extra_strain": (3, -6e-5)}),
        (joints(wave(0, 202, 2e-4), *map(smooth, range(3))), TransmissionError, {"joint 1, order 202"}, {}),
    ],
)  # fmt: skip
def test_an_effect_is_composed_of_the_parts_that_it_has(kind, cls, labels, values):
    base = base_fit(cell(kind, seed=905, noise=0.02, poses=140)[0])
    if cls is TransmissionError:  # behind a map that tells all but what is finer than itself
        base = fit_model(base.model, base.data, [JointErrorMap(joint=(1, 2, 3), order=8)])
    found = compose(Screen(base.problem, {cls.key: cls}, base.free), base.linear, cls.key)
    assert set(found.label.split("; ")) == labels and found.evidence > 10
    effect = refit(base, found).model.effect(cls.key)
    for name, (k, value) in values.items():
        assert getattr(effect, name)[k] == pytest.approx(value, rel=0.4)


def test_joint_zeros_come_before_what_else_could_say_the_same():
    """An offset of joint 5 in a base without offsets is a turn of its casting, and half a wave of its gear."""
    full = base_fit(cell(joints(lambda s: column(4, 2e-3 + 0 * s.q[:, 4])), seed=62)[0])
    base = fit_model(full.model.with_effects(*(e for e in full.model.effects if e.key != "joint_offset")), full.data)
    names = ("joint_offset", "link_geometry", "transmission_error")
    ranked = SearchState(base, base, {key: LIBRARY[key] for key in names}, None).ranked
    assert ranked[0].key == "joint_offset" and ranked[0].evidence > 100
    assert next(c for c in ranked if c.key == "link_geometry").evidence <= 0


def test_what_was_computed_for_other_loads_or_weights_is_computed_anew():
    base = base_fit(cell(LOOSE, seed=904, noise=0.02, poses=100)[0])
    begin = SearchState(base, base, {c.key: c for c in (NonlinearCompliance, Backlash, PayloadError)}, None)
    loaded = replace(base, problem=base.problem.at([*base.model.effects, ArmLoad(body=(3,), mass_kg=[200.0])]))
    further = replace(begin, fit=loaded)
    same = {key: begin.screen.forms(key, None) is further.screen.forms(key, None) for key in begin.classes}
    assert same == {"nonlinear_compliance": False, "backlash": True, "payload_error": True}
    heavier = base.problem.weighted(Weights(base.problem.weights.values * [1.0, 2.0, 3.0]))
    again = replace(begin, fit=replace(base, problem=heavier)).screen.forms(Backlash.key, None)
    for one, other in zip(again, forms_of(heavier, Backlash), strict=True):
        assert one.columns(heavier) == pytest.approx(other.columns(heavier), rel=1e-12)


def test_forms_that_are_screened_together_have_the_columns_that_each_has_alone():
    """Of every effect, and beside what the model has of it; they gain what their columns do."""
    fit, asked = base_fit(cell(seed=640132, poses=40)[0]), 0
    for key, cls in LIBRARY.items():
        testable = not cls.null().missing(fit.problem.sensitivity.state) and cls.unlikely < np.inf
        alone = list(Screen(fit.problem, {key: cls}).forms(key, None)) if testable else []
        asked += bool(alone)
        for form in alone[:: max(1, len(alone) // 8)]:
            columns = columns_of(fit.problem, form.effect, form.screened)
            np.testing.assert_allclose(form.columns(fit.problem), columns, atol=1e-6 * np.abs(columns).max())
        for held in alone[:: max(1, len(alone) // 2)]:
            taken, made = (forms_of(fit.problem, cls, held.effect, some) for some in (alone, ()))
            assert [f.label for f in taken] == [f.label for f in made]
            for a, b in list(zip(taken, made, strict=True))[:: max(1, len(made) // 10)]:
                ours, theirs = (form.columns(fit.problem) for form in (a, b))
                np.testing.assert_allclose(ours, theirs, atol=1e-6 * np.abs(theirs).max())
                assert a.screened.tolist() == b.screened.tolist() and a.effect.to_file() == b.effect.to_file()
    assert asked > 12
    lines = Screen(fit.problem, {TransmissionError.key: TransmissionError}).forms(TransmissionError.key, None)
    found = score_tests(fit.problem, fit.linear, lines)
    for i in range(0, len(lines), 97):
        one = gain(fit.linear, lines[i].columns(fit.problem))
        assert (found.of(i).rss_reduction, found.of(i).evidence) == pytest.approx(
            (one.rss_reduction, one.evidence), rel=1e-9
        )


def test_what_stood_in_for_a_missing_effect_does_not_stay():
    """Geometry that mimicked a lag of 3 ms in a short record, and cannot be determined beside it, goes back to null."""
    rows, off = 100, []
    time = np.arange(rows)[:, None] * 2.0 / rows
    size, rate = np.array([30, 20, 20, 20, 15, 30.0]), 2 * np.pi * np.array([0.311, 0.427, 0.523, 0.617, 0.733, 0.4])
    for g in map(np.random.default_rng, (4, 5)):
        turn = rate * time + g.uniform(0, 6, 6)
        q, v = size * np.sin(turn) + 10, size * rate * np.cos(turn)
        seen = points(q - 0.003 * v) + g.normal(0, 0.02, (rows, 3))
        lines = [f"P{i}," + ",".join(f"{x:.6f}" for x in row) for i, row in enumerate(np.hstack([q, seen, time]))]
        data = read_measurements(Source("a.csv", "\n".join([f"{HEADER},time_s", *lines]).encode()), ARM)
        keys = ("instrument_frame", "tool_frame", "joint_offset", "link_geometry")
        base = fit_model(Model(ARM), data, [LIBRARY[key].null() for key in keys])
        fit = refit(
            base, Candidate("servo_lag", LIBRARY["servo_lag"](), np.ones(6, bool), "", 1.0, 0.0, 6, 0.0, 1.0, 1.0)
        )
        null = [fit.model.effect(key).vector()[k] == 0.0 for key, k in fit.unidentifiable]
        assert len(null) > 10 and np.mean(null) > 0.9
        # Deviations are those of the posterior, and the fit by the rows alone stands far from it.
        last, lag = settled(fit), [("servo_lag", k) for k in range(6)]
        after = last.posterior
        names = (*after.names, *after.unidentifiable)
        assert {k for k in lag if names.index(k) in after.undetermined} == {lag[5]}
        off += [(last.model.effect("servo_lag").vector()[k] - 0.003) / last.sigma[key, k] for key, k in lag[:5]]
        ends = np.array([last.model.effect(key).vector()[k] for key, k in names])
        assert (np.abs(ends - after.mean) < 0.05 * after.deviations).all()
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.7
