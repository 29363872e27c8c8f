"""Verdicts on cells with hidden effects, and the loop that follows them."""

from __future__ import annotations

import gc
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from postproc import text as text_of
from postproc.channels.state import State
from postproc.effects.base import Displacement, Effect, param
from postproc.effects.library.joints.thermal_joint_drift import ThermalJointDrift
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.solve import Terms
from postproc.identification import refits
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.plan import MeasuringPlan as PosePlan
from postproc.identification.plan import plan_poses
from postproc.identification.predict import predict_rows
from postproc.identification.screen.candidate import Screen
from postproc.identification.compare import joint_errors
from postproc.results.addition import addition_values
from postproc.results.comparison import comparison_values
from postproc.results.diagnosis import diagnosis_values
from postproc.results.plan import plan_sentence, plan_values
from postproc.results.sentences import headline
from tests.identification.cells import base_fit, cell, hidden_found, true_error
from tests.independent import library_effects as kinds
from tests.independent import unknown_effects as strange
from tests.independent.arm import Wrenches
from tests.independent.cells import Hidden, column

NOISE = 3e-5


def test_a_clean_cell_is_complete():
    data, _ = cell(seed=101)
    often = gc.get_threshold()
    found = diagnose(base_fit(data).model, data)
    assert (found.verdict, found.missing, found.suspects) == ("complete", (), ())
    assert gc.get_threshold() == often


@pytest.mark.parametrize(
    "kind",
    [kinds.backlash, kinds.transmission_error, kinds.thermal_growth, kinds.servo_lag, kinds.gravity_compensator],
    ids=lambda k: k.__name__,
)
def test_one_missing_effect_is_named_alone_and_the_error_falls_to_the_floor(kind):
    _, true = cell(kind, seed=211, poses=80)
    found = hidden_found(kind, seed=211, poses=80)
    assert found.verdict == "missing"
    assert [m.key for m in found.missing] == [kind.__name__]
    assert found.missing[0].p_value < 1e-6
    assert true_error(found.final, true) < 0.6 * NOISE


def test_two_missing_effects_are_both_named():
    data, true = cell(kinds.backlash, kinds.arm_load, seed=222, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert {m.key for m in found.missing} == {"backlash", "arm_load"}
    assert true_error(found.final, true) < 0.6 * NOISE


def test_every_step_of_a_thinned_search_is_told_for_all_rows(monkeypatch):
    monkeypatch.setattr(refits, "MOST_NUMBERS_SEARCHED", 220)
    data, _ = cell(kinds.backlash, kinds.arm_load, seed=222, poses=120)
    found = diagnose(base_fit(data).model, data)
    assert len(found.screened.data) < 0.7 * len(data)
    first, last = found.missing
    added = add_effects(found.base.model, data, [first.key]).fit
    alone = fit_model(added.model, data, terms=Terms(added.free))  # by the rows alone, as a search judges
    assert first.held_out_after == pytest.approx(alone.held_out_rms, rel=1e-3)
    assert last.held_out_after == found.final.held_out_rms


def test_a_hose_is_not_taken_for_a_wave_of_joint_5():
    # 0.5 of the noise rms: a first harmonic of joint 5 explains almost as much with two numbers instead of eight.
    data, true = cell(kinds.dress_pack, seed=553007, poses=150)
    found = diagnose(base_fit(data).model, data)
    assert [m.key for m in found.missing] == ["dress_pack"]
    assert true_error(found.final, true) < 0.6 * NOISE


def test_a_floor_and_a_main_bearing_that_tilt_alike_are_said_to_do_so():
    data, _ = cell(kinds.bearing_tilt, seed=871100, noise=0.02, poses=90)
    (missing,) = diagnose(base_fit(data).model, data).missing
    assert missing.key == "base_compliance" and "bearing_tilt" in missing.not_separable


@pytest.mark.parametrize(("hidden", "named"), [("housing", "link_compliance"), ("bearing", "bearing_tilt")])
def test_a_housing_that_bends_and_a_bearing_of_the_shoulder_that_tilts(hidden, named):
    data, true = cell({"housing": _soft_housing, "bearing": _soft_shoulder}[hidden], seed=408006, poses=150)
    found = diagnose(base_fit(data).model, data)
    assert [m.key for m in found.missing] == [named]
    assert true_error(found.final, true) < 0.6 * NOISE


def _soft_housing(g, arm):
    compliance = kinds.beam(0.175, 1.0e6, 0.5e6, 4e9, 2)
    return _sprung(3, lambda w: w[:, 3] @ compliance.T)


def _soft_shoulder(g, arm):
    return _sprung(1, lambda w: 4e-7 * w[:, 1] * [0, 0, 0, 1, 0, 1])


def _sprung(b, spring):
    def body(s, f, w):
        xi = np.zeros((len(s), 7, 6))
        xi[:, b] = spring(w)
        return xi

    return Hidden("spring", "spring", body=body)


def test_a_soft_bearing_of_a_small_arm_is_no_beam():
    # 2e-5 rad/(N m) is 200 times what is ordinary on an arm of 60 kg payload, and 13 times on one of 10 kg.
    data, true = cell(_soft_elbow, seed=523001, poses=80, robot="ur10")
    found = diagnose(base_fit(data, "ur10").model, data)
    assert [m.key for m in found.missing] == ["bearing_tilt"]
    assert true_error(found.final, true) < 0.6 * NOISE


def _soft_elbow(g, arm):
    return _sprung(2, lambda w: 2e-5 * w[:, 2] * [0, 0, 0, 1, 1, 0])


def test_more_of_an_effect_that_the_model_holds_is_fitted_with_what_it_holds():
    data, _ = cell(seed=101)
    held = fit_model(
        base_fit(data).model,
        data,
        [ThermalJointDrift.null()],
        terms=Terms({**base_fit(data).free, "thermal_joint_drift": _only(3)}),
    )
    screen = Screen(held.problem, {"thermal_joint_drift": ThermalJointDrift}, held.free)
    forms = {form.label: form for form in screen.forms("thermal_joint_drift", None)}
    np.testing.assert_array_equal(forms["joint 2"].refit, _only(2) | _only(3))
    assert "joint 3" not in forms


def _only(joint):
    return np.arange(1, 7) == joint


def test_one_casting_and_a_wave_of_high_order_are_found():
    data, true = cell(_short_wrist, _motor_wave, seed=7, poses=100)
    found = diagnose(base_fit(data).model, data)
    assert {m.key for m in found.missing} == {"link_geometry", "transmission_error"}
    assert true_error(found.final, true) < 0.6 * NOISE


@pytest.mark.parametrize("order", [10.37, 11.0])
def test_the_order_of_a_gear_in_stages_need_not_be_whole(order):
    def wave(g, arm):
        return Hidden("wave", "transmission_error", joint=lambda s, tau: column(0, 1e-4 * np.sin(order * s.q[:, 0])))

    data, true = cell(wave, seed=978, poses=80)
    found = diagnose(base_fit(data).model, data)
    assert [m.key for m in found.missing] == ["transmission_error"]
    assert found.verdict == "missing"
    assert found.final.model.effect("transmission_error").order == pytest.approx(
        (order,), abs=0.0 if order.is_integer() else 0.06
    )
    assert true_error(found.final, true) < 0.6 * NOISE


def test_a_strong_balancer_is_found_although_the_base_has_bent_its_compliance():
    # 4500 N m: frames, offsets and compliance without it take joint 2 for stiff, and a load needs that joint to show.
    data, true = cell(_balancer, seed=976001, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert [m.key for m in found.missing] == ["gravity_compensator"]
    assert "transmission_error" in found.missing[0].not_separable
    assert true_error(found.final, true) < 0.6 * NOISE


def _balancer(g, arm):
    return Hidden(
        "balancer",
        "gravity_compensator",
        force=lambda s, f: Wrenches([], column(1, -4500 * np.sin(s.q[:, 1] - 0.1))),
    )


def test_angles_that_jump_from_pose_to_pose_are_no_wave():
    # The best of 1500 waves explains some of 150 random numbers by chance; three coordinates of a pose do not make 450.
    data, _ = cell(_jumping, seed=318004, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown" and not found.missing


def _jumping(g, arm):
    return Hidden("jumping", "unknown", joint=lambda s, tau: column(2, 1.5e-4 * np.sin(12345.678 * s.q[:, 2])))


def _short_wrist(g, arm):
    xi = np.zeros((7, 6))
    xi[4] = [0, 3e-4, 0, 0, 0, 4e-4]
    return Hidden("short", "link_geometry", body=lambda s, f, w: np.broadcast_to(xi, (len(s), 7, 6)))


def _motor_wave(g, arm):
    return Hidden("wave", "transmission_error", joint=lambda s, tau: column(2, 1e-4 * np.sin(41.3 * s.q[:, 2])))


def test_an_effect_outside_the_library_is_unknown_and_its_channel_is_named():
    found = hidden_found(strange.angle_step, seed=401)
    assert found.verdict == "unknown"
    suspect = found.suspects[0]
    assert suspect.where == f"joint {suspect.channel[1]}" and suspect.pattern.startswith("step near")
    assert 0.8 * found.floor < found.unnamed < 1.2 * found.floor < 0.6 * found.base.held_out_rms
    table = text_of(found).split("The error on rows that the fit has not seen")[1].splitlines()
    assert table[2].split()[:8] == [
        *["+", "what", "was", "found,", "without", "a", "name"],
        f"{1e3 * found.unnamed:.3f}",
    ]
    assert "at best: its form was chosen on these rows" in table[2]
    values = diagnosis_values(found)
    assert 1e3 * found.unnamed == pytest.approx(values["rms_mm_unnamed"], abs=1e-5)
    assert not any("unnamed" in key for key in values if key.startswith("held_out"))
    # A pattern of several channels is told with all of them, columns of the table's own first.
    data = found.base.data
    data = replace(data, state=data.state.with_(channels={"door": np.zeros(len(found.base.data))}))
    own = replace(found.base, problem=replace(found.base.problem, data=data))
    [(curve, signal)] = suspect.form.factors
    several = replace(signal, names=(suspect.channel, "q9", "door"))
    form = replace(suspect.form, factors=((curve, several),))
    more = tuple(replace(suspect, form=form, channel=name) for name in form.channels)
    assert f"follows door, {suspect.channel} and q9 (step near" in headline(replace(found, base=own, suspects=more))


def test_shuffled_channels_win_nothing():
    data, _ = cell(kinds.frame_drift, seed=241, poses=80)
    order = np.random.default_rng(1).permutation(len(data))
    state = data.state
    shuffled = state.with_(time=state.time[order], temperature=state.temperature[order], approach=state.approach[order])
    found = diagnose(base_fit(data).model, replace(data, state=shuffled, pose_id=()))
    assert not {"frame_drift", "backlash", "thermal_growth", "thermal_joint_drift"} & {m.key for m in found.missing}


def test_json_keeps_its_contract_and_text_speaks_first():
    found = hidden_found(kinds.backlash, seed=211, poses=80)
    j = json.loads(json.dumps(diagnosis_values(found), allow_nan=False))
    assert j["schema"] == "postproc/diagnose/1"
    keys = {
        "verdict",
        "noise_mm",
        "rms_mm",
        "held_out_rms_mm",
        "missing",
        "candidates",
        "suspects",
        "floor_mm",
        "bound_mm",
    }
    assert keys | {"blind_to", "diagnostics"} <= set(j)
    assert {"effect", "held_out_rms_mm_after", "p_value", "not_separable_from", "parameters"} <= set(j["missing"][0])
    assert {"effect", "rms_mm_after", "p_value", "testable", "why_not"} <= set(j["candidates"][0])
    assert len(j["missing"][0]["parameters"]["half_gap_rad"]) == 6
    assert {"effect": "servo_lag", "why": "the table has no `v1_deg_s` .. `v6_deg_s`"} in j["blind_to"]
    assert re.match(
        r"The model lacks `backlash` \(joints 2 and 4\): a joint stops short on the side from which it came\. "
        r"With it, the error on rows the fit has not seen falls from [\d.]+ to [\d.]+ mm per axis\.",
        text_of(found),
    )
    value, sigma = j["missing"][0]["parameters"]["half_gap_rad"][1]
    told = re.search(r"^  backlash +half_gap\[2\] +(\S+) ± (\S+) +mrad$", text_of(found), re.M)
    assert told and [float(x) for x in told.groups()] == pytest.approx([1e3 * value, 1e3 * sigma], rel=0.05)


def test_few_poses_tell_nothing():
    data, _ = cell(kinds.backlash, seed=211)
    few = data.rows(np.arange(9))
    found = diagnose(base_fit(few).model, few)
    assert found.verdict == "unknown"  # nine rows without a repeat
    assert text_of(found).startswith("Too few poses to tell: 27 measured numbers for 17 parameters.")
    assert "measure 8 more poses at least" in text_of(found).splitlines()[0]


def test_adding_prints_the_ladder_down_to_the_floor():
    data, true = cell(kinds.backlash, kinds.arm_load, seed=222, poses=150)
    added = add_effects(base_fit(data).model, data, ["backlash", "arm_load"])
    steps = [s.fit.held_out_rms for s in added.ladder]
    assert steps[0] > steps[1] > steps[2] and added.ladder[-1].share > 0.9
    assert true_error(added.fit, true) < 0.6 * NOISE
    j = json.loads(json.dumps(addition_values(added), allow_nan=False))
    assert j["schema"] == "postproc/fit/1" and [s["step"] for s in j["ladder"]] == ["base", "+ backlash", "+ arm_load"]
    assert "without backlash" in text_of(added) and f"the noise is {1e3 * added.floor:.3f} mm" in text_of(added)


def test_where_no_noise_is_known_a_bound_is_called_one():
    data, _ = cell(kinds.backlash, seed=222, poses=60)
    single = data.rows(np.unique(data.repeats, return_index=True)[1])
    text = text_of(add_effects(base_fit(single).model, single, ["backlash"]))
    assert "any smooth function of the channels would leave" in text and "floor" not in text


def test_comparing_shows_where_the_residual_lives():
    data, _ = cell(kinds.backlash, seed=211)
    found = compare(recorded_model(base_fit(data)), data)
    j = json.loads(json.dumps(comparison_values(found), allow_nan=False))
    assert j["rms_mm"] > j["bound_mm"] > 0.5 * j["noise_mm"]
    assert j["channels"][0]["channel"].startswith("dir") and j["channels"][0]["where"].startswith("joint")
    assert j["worst"][0]["error_mm"] == j["maximum_mm"]
    assert f"brings it to {j['bound_mm']:.3f} mm" in text_of(found)
    distance = 1e3 * np.linalg.norm(found.error, axis=1)
    assert list(j["percentiles_mm"].values()) == pytest.approx(np.percentile(distance, [50, 95, 99]), abs=1e-5)
    [told] = [t["share"] for t in j["channels"] if (t["channel"], t["where"]) == ("dir2", "joint 2")]
    off, side = joint_errors(found.fit)[:, 1], found.fit.data.state.approach[:, 1]
    off = off - off.mean()
    explained = sum((side == s).sum() * off[side == s].mean() ** 2 for s in np.unique(side)) / (off @ off)
    chance = (len(np.unique(side)) - 1) / (len(off) - 1)
    assert told == pytest.approx((explained - chance) / (1 - chance), abs=1e-4)
    clean, _ = cell(seed=101)
    assert "What is left is of the size of the noise." in text_of(compare(recorded_model(base_fit(clean)), clean))


def test_predictions_keep_the_rows_and_carry_their_deviation():
    data, true = cell(kinds.backlash, seed=211)
    model = add_effects(base_fit(data).model, data, ["backlash"]).model
    found = predict_rows(model, true)
    lines = found.as_csv().splitlines()
    assert lines[0] == "pose_id,x_mm,y_mm,z_mm,sigma_mm,sigma_measured_mm" and len(lines) == len(true) + 1
    error = np.abs(found.position - true.position) / found.sigma[:, None]
    assert 0.85 < np.mean(error < 1.96) <= 1.0


def test_what_is_left_out_of_a_prediction_is_said():
    data, true = cell(kinds.thermal_joint_drift, seed=212)
    model = base_fit(data).model.with_effects(ThermalJointDrift(drift_rad_per_K=np.full(6, 1e-5)))
    assert "DAT021" not in [d.code for d in predict_rows(model, true).diagnostics]
    found = predict_rows(model, replace(true, state=true.state.with_(temperature=None))).diagnostics
    assert [d.message for d in found if d.code == "DAT021"] == [
        "`thermal_joint_drift` is left out: the table has no `temperature_C`"
    ]


def test_planned_poses_separate_what_the_data_could_not():
    data, _ = cell(seed=101)
    one_side = replace(data, state=data.state.with_(approach=np.ones((len(data), 6))))  # lost motion is then an offset
    fit = base_fit(one_side)
    few = one_side
    plan = plan_poses(fit.model, few, 12, ("backlash", "joint_offset"))
    assert plan.before < 1.0 and plan.after > 5.0
    robot = fit.model.robot
    assert ((plan.state.q > robot.lower) & (plan.state.q < robot.upper)).all()
    assert set(np.unique(plan.state.approach)) <= {-1.0, 1.0}
    assert len(plan.as_csv().splitlines()) == 13
    sharper = plan_poses(fit.model, few, 8)
    assert sharper.after < sharper.before
    assert ("joint_offset", 0) in sharper.never and not set(sharper.never) & set(sharper.worst)
    assert "joint_offset.offset_rad[1]" in plan_values(sharper)["no_pose_determines"]
    assert "No pose determines joint_offset offset[1 6]" in plan_sentence(sharper)
    told = f"to ± {sharper.before:.2g} times the ordinary size of such a parameter now, to ± {sharper.after:.2g} times with"
    assert told in plan_sentence(sharper) and ("as good as unknown" in plan_sentence(sharper)) == (sharper.after > 1.0)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (6.0, 9.0, "9.0 standard deviations (now 6.0); the data so far tells them apart already."),
        (3.0, 5.5, "5.5 standard deviations (now 3.0); enough to tell them apart."),
        (3.0, 4.0, "4.0 standard deviations (now 3.0); 5 tell them apart: ask for more poses with `-n`."),
    ],
)
def test_a_plan_says_whether_it_is_enough(before, after, says):
    state = State(q=np.zeros((4, 6)))
    assert says in plan_sentence(PosePlan(None, state, np.zeros((4, 4, 4)), ("backlash", "arm_load"), before, after))


def test_a_pair_that_does_the_same_is_said_to_do_so():
    data, _ = cell(seed=101)
    plan = plan_poses(base_fit(data).model, data, 5, ("gravity_compensator", "transmission_error"))
    assert plan.after < 3.0 and plan_sentence(plan).startswith("Even with these 5 poses")


def test_what_drifts_from_one_moving_pose_to_the_next_is_no_noise():
    data, _ = cell(kinds.servo_lag, kinds.frame_drift, seed=60, poses=90)
    found = diagnose(base_fit(data).model, data)
    assert {m.key for m in found.missing} == {"servo_lag", "frame_drift"}
    assert found.verdict == "missing"


class Settling(Effect, reads=("row",)):
    """The base settles. Source: none."""

    size_m: float = param(unit="m", low=-1e-2, high=1e-2, typical=1e-4)

    def displacement(self, state):
        return Displacement(instrument=np.outer(self.size_m * np.exp(-state.channels["row"] / 50), np.eye(6)[0]))


def test_a_prediction_by_the_row_says_where_it_has_it_from():
    data, true = cell(seed=211)
    model = base_fit(data).model.with_effects(Settling(size_m=1e-4))
    numbered = true.state.with_(channels={**true.state.channels, "row": np.arange(7.0, 7 + len(true))})
    [said] = [
        d.message for d in predict_rows(model, replace(true, state=numbered)).diagnostics if "`settling`" in d.message
    ]
    assert said.startswith("`settling` follows `row` of the table that it was fitted to, and this is another")
