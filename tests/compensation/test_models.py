"""What the model of the arm has to say: its effects, mounting and weights, what was measured, what is an estimate."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc import text as text_of
from postproc.arrays import GRAVITY
from postproc.channels.state import State
from postproc.compensation.correction.inverse import command
from postproc.compensation.judgement.accuracy import WITHIN_95
from postproc.diagnostics import PostprocError
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.model.uncertainty.field import Field
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import Pose
from postproc.rapid.motions.units import pose_matrix
from postproc.report.page import render_certificate, render_page
from postproc.results.certificate import Verdict, program_certificate
from postproc.results.convert.conclusion import conclusion, unknown_accuracy
from postproc.results.convert.conversion import conversion_document
from postproc.robot.cells.cell import Cell, CellArm
from postproc.robot.cells.station import Station
from postproc.robot.kinematics import forward
from tests.build import AXES, FORCE, arm, codes, convert, events, places, written
from tests.compensation.build import NO_FORCE, PROCESS, TWO, brief, effect, errors, findings, model, shifts, small
from tests.independent.arm import ARMS, joint_springs
from tests.independent.verify import check


def springs(second: str = "3e-7") -> str:
    return effect("joint_compliance", f"compliance_rad_per_Nm = [4e-6, {second}, 4e-7, 2e-6, 2e-6, 3e-6]")


def offset(*rad: float) -> str:
    return effect("joint_offset", f"offset_rad = {[*rad, *[0] * (6 - len(rad))]}")


def fitted(variance: str, parameter: str = "joint_compliance.compliance_rad_per_Nm[2]") -> str:
    return f'[fit]\nparameters = ["{parameter}"]\ncovariance = ["{variance}"]\n'


def lifted(kg: float) -> str:
    return effect("arm_load", "body = [3]", f"mass_kg = [{kg}]", "moment_kgm = [[0, 0, 0]]")


def payload(kg: float) -> str:
    return effect("payload_error", f"mass_kg = {kg}")


WARM = effect("thermal_joint_drift", "reference_C = 20", "drift_rad_per_K = [0, 2e-5, 0, 0, 0, 0]")
BY_OFFSET = "most of it by `joint_offset`"
NO_ARM_HAS = "no arm has `compliance_rad_per_Nm[2] = {}` of `joint_compliance`"
DOUBTS: list[tuple[str, dict[str, Any], str, str | None, str]] = [
    # 0.2 deg of joint 2 written where radians are meant move the torch by a quarter of a metre.
    (springs() + offset(0, 0.002), {}, "CMP015", None, ""),
    (springs() + offset(0, 0.01), {}, "CMP015", "warning", BY_OFFSET),
    (springs() + offset(0, 0.01), {"largest_correction_m": 0.008}, "CMP015", "error", BY_OFFSET),
    (springs() + offset(0, 0.02), {}, "CMP015", "error", BY_OFFSET),
    (springs() + offset(0, 0.02), {"largest_correction_m": 0.04}, "CMP015", "warning", BY_OFFSET),
    (springs() + offset(0, 0.2), {}, "CMP015", "error", BY_OFFSET),
    (springs() + "[mounting]\nrpy_deg = [0, 0, 0]\n", {}, "CMP014", None, ""),
    (springs() + "[mounting]\nrpy_deg = [180, 0, 0]\n", {}, "CMP014", "warning", ""),
    # A fitted spring may be below zero by chance alone.
    (springs("-3e-8") + fitted("1e-14"), {}, "MOD005", None, ""),
    (springs("-3e-7") + fitted("1e-14"), {}, "MOD005", "error", NO_ARM_HAS.format("-3e-07")),
    (springs("-1e-9") + fitted("1e-24"), {}, "MOD005", "error", NO_ARM_HAS.format("-1e-09")),
    # A link may be lighter than its estimate, a tool than stated, but not than nothing; the flange weighs 3 kg.
    (springs() + lifted(-20), {}, "MOD005", None, ""),
    (springs() + lifted(-250) + fitted("1e-14"), {}, "MOD005", "error", ""),
    (springs() + payload(-3), {}, "MOD005", None, ""),
    (springs() + payload(-9), {}, "MOD005", "error", "weigh -1 kg"),
    (springs() + payload(3), {}, "MOD005", None, ""),
    (springs() + WARM, {"channels": (("temperature", 30.0), ("temprature", 3.0))}, "CMP016", "error", ""),
    (springs() + WARM, {"channels": (("temperature", 30.0), ("payload", 3.0))}, "CMP016", "error", ""),
]


@pytest.mark.parametrize(("text", "options", "code", "severity", "words"), DOUBTS, ids=brief)
def test_what_no_arm_is_like_is_doubted_or_refused(
    text: str, options: dict[str, Any], code: str, severity: str | None, words: str
) -> None:
    conversion = convert(TWO, model(text), force=NO_FORCE, **options)
    doubts = [d for d in findings(conversion, code) if d.severity != "info"]
    assert {d.severity for d in doubts} == ({severity} if severity else set())
    assert all(words in d.message for d in doubts)
    assert bool(conversion.outputs) == (severity != "error")


@pytest.mark.parametrize(("deviation", "left_open"), [(7e-3, True), (1e-4, False)])
def test_a_large_correction_by_what_the_fit_left_open_says_so(deviation: float, left_open: bool) -> None:
    name = "joint_offset.offset_rad[2]"
    text = springs() + offset(0, 0.02) + fitted(str(deviation**2), name)
    (doubt,) = findings(convert(TWO, model(text), force=NO_FORCE), "CMP015")
    assert (f"`{name}` is 0.02 ± 0.007" in doubt.help and "`[priors]`" in doubt.help) is left_open


@pytest.mark.parametrize(
    ("table", "code", "line"),
    [
        ("joint_compliance]\ncompliance_rad_per_Nm = [4e-6, -3e-7, 4e-7, 2e-6, 2e-6, 3e-6]", "MOD005", 3),
        ("backlash]\nhalf_gap_rad = [0, -8e-5, 0, 0, 0, 0]", "EFF024", 3),
        ("bearing_tilt]\ntilt_rad_per_Nm = [0, -1e-8, 0, 0, 0, 0]", "MOD005", 3),
        ("base_compliance]\ntilt_rad_per_Nm = [-1e-8, 0]", "MOD005", 3),
        ("link_compliance]\nbody = [2]\nbending_per_Nm2 = [-1e-7]", "MOD005", 4),
        ("dress_pack]\nstiffness_N_per_m = -100", "EFF024", 3),
        ("arm_load]\nbody = [3]\nmass_kg = [-250]", "MOD005", 4),
    ],
)
def test_a_sign_that_no_arm_has_is_an_error_at_its_place(table: str, code: str, line: int) -> None:
    with pytest.raises(PostprocError) as caught:
        model(f"[effects.{table}\n")
    (finding,) = caught.value.diagnostics
    assert (finding.code, finding.place) == (code, f"arm.toml:{line}:1")


def test_an_arm_without_weight_or_springs_is_refused() -> None:
    """Without masses 0.023 mm were corrected where masses give 0.162 mm: nothing said so."""
    shipped = arm()
    weightless = replace(shipped, robot=replace(shipped.robot, mass=np.zeros(7)))
    turned = JointOffset(offset_rad=[0, 1e-4, 0, 0, 0, 0])
    for of, force, severities in (
        (weightless, NO_FORCE, {"KIN010": "error"}),
        (shipped.with_effects(), NO_FORCE, {"MOD006": "error"}),
        (shipped.with_effects(JointOffset()), (10.0, 0.0, 0.0), {"MOD006": "error"}),
        (shipped.with_effects(turned), NO_FORCE, {"MOD006": "warning"}),
        (shipped.with_effects(JointCompliance()), NO_FORCE, {}),
    ):
        conversion = convert(TWO, of, force=force)
        doubts = {d.code: d.severity for d in conversion.diagnostics if d.code in ("KIN010", "MOD006")}
        assert doubts == severities
        assert bool(conversion.outputs) == ("error" not in severities.values())


def test_advice_for_an_arm_that_hangs_says_so() -> None:
    hung = replace(default_model("irb4600_40_255"), R_world_base=np.diag([1.0, -1.0, -1.0]))
    said = text_of(convert(TWO, hung, force=NO_FORCE))
    assert "`postproc plan irb4600_40_255 --mounting 180,0,0 -n " in said


def test_a_fit_that_contradicts_itself_promises_nothing() -> None:
    name = "joint_compliance.compliance_rad_per_Nm[2]"
    for why in ([], ["the gauges contradict each other"]):
        fit = {"parameters": [name], "covariance": ["1e-20"], "contradicted": why}
        conversion = convert(TWO, replace(arm(), fit=fit), force=NO_FORCE)
        assert [why[0] in d.message for d in findings(conversion, "MOD015")] == [True] * len(why)
        assert (conversion.report["expected_accuracy"] is None) is bool(why)
        assert ("contradicts itself" in unknown_accuracy(conversion.diagnostics)) is bool(why)
        certificate = render_certificate(program_certificate("p.mod", conversion))
        assert ("not known: what the model was fitted to contradicts" in certificate) is bool(why)


def test_an_estimated_stiffness_says_what_it_means() -> None:
    estimate = convert(TWO, default_model("irb4600_40_255"), force=NO_FORCE)
    low, high = estimate.report["expected_remaining_fraction"]
    least, most = estimate.report["expected_remaining_fraction_after_gauge"]
    assert 0.0 < least < low < 0.5 < most < high
    sentence = (
        f"the stiffness of this arm is not measured: with that of its type {100 * low:.0f} to {100 * high:.0f} % of its own deflection"
        " remain"
    )
    plan = "`postproc plan irb4600_40_255 -n 6 --kind gauge --load 40 --pull 100 -o gauge.csv`"
    readings = f"six set-ups of a dial gauge leave about {100 * least:.0f} to {100 * most:.0f} % of it: {plan}"
    assert f"! {sentence}\n" in written(estimate) and f"! {readings}\n" in written(estimate)
    certificate = render_certificate(program_certificate("p.mod", estimate))
    assert f"T{sentence[1:]}" in render_page(conversion_document("p.mod", estimate))
    assert f"T{sentence[1:]}" in certificate and Verdict.NOT_SHOWN.value in certificate


def test_arms_of_the_type_weld_as_near_as_expected() -> None:
    """60 arms about the estimate, driven along the written seam: 95 % of their largest deviations are expected."""
    name, g = "irb4600_40_255", np.random.default_rng(5)
    line = f"ArcLStart @{{1350,-400}},{PROCESS},fine,tT; ArcLEnd @{{1200,-100}},{PROCESS},fine,tT;"
    text = small(f"MoveJ @{{1350,-500}},v200,fine,tT; {line}")
    conversion, usual, real = (
        convert(text, default_model(name)),
        default_model(name).robot.joint_compliance,
        ARMS[name](),
    )
    factor, spread = np.array([4, 3, 2.5, 2.5, 3.5, 2.5]), np.array([1.0, 1.5, 1.7, 1.6, 1.8, 2.3, 4.0])
    low, high = conversion.report["expected_on_arm_mm"]
    inside = []
    for _ in range(40):
        heavy = replace(real, mass=real.mass * spread ** g.normal(size=7))
        springs = joint_springs(usual * factor ** (g.normal(size=6) / 1.96))
        report = check(text, written(conversion), heavy, np.array(FORCE), displace=springs, step=0.05)
        inside.append(low <= max(s.after for s in report.segments if s.welding) <= high)
    assert 0.87 <= np.mean(inside) <= 1.0 and high < 40 * low


def test_a_stiffness_that_others_published_scatters_less_and_a_stated_one_not_at_all() -> None:
    published = convert(TWO, force=NO_FORCE)
    low, high = published.report["expected_remaining_fraction"]
    guessed = replace(arm(), stiffness_source="estimated", robot=replace(arm().robot, stiffness_source="estimated"))
    assert 0.0 < low < high < convert(TWO, guessed, force=NO_FORCE).report["expected_remaining_fraction"][1]
    assert "estimated" not in text_of(published) + written(published)
    for known in (
        replace(arm(), stiffness_source="user"),
        arm().with_effects(JointCompliance(compliance_rad_per_Nm=[1e-6] * 6)),
    ):
        conversion = convert(TWO, known, force=NO_FORCE)
        assert conversion.report["expected_remaining_fraction"] is None is conversion.report["expected_on_arm_mm"]
        assert "kept in the model; what the arm does is not known." in written(conversion)
        assert "is kept in the model; what the arm does is not known." in text_of(conversion)


def test_a_gantry_turns_the_correction_round() -> None:
    """Hanging upside down, gravity pulls the other way in base axes: the correction changes its sign."""
    floor = shifts(convert(TWO, force=NO_FORCE))
    gantry = shifts(convert(TWO, replace(arm(), R_world_base=np.diag([1.0, -1.0, -1.0])), force=NO_FORCE))
    assert floor[:, 2].min() > 0.3
    assert np.abs(gantry + floor).max() < 0.02


def test_the_base_frame_takes_the_program_from_the_world_to_the_arm() -> None:
    """One cell stated twice: in a world at the base, and in one 3.7 m away and turned by 90 deg."""
    base = Pose((3700.0, -200.0, 500.0), (0.6, 0.0, 0.0, 0.8))
    frame = pose_mult(base, Pose((1000.0, -300.0, 500.0)))

    def standing(base: Pose) -> Model:
        T = pose_matrix(base.trans, base.rot)
        down = T[:3, :3].T @ np.array([0.0, 0.0, -GRAVITY])
        return replace(arm(), station=Station(Cell(arms={"robot": CellArm("robot", "", None, T, down)})))

    near = small(r"MoveJ @{350,-200,200},v200,fine,tT\WObj:=wT; MoveL @{350,200,200},v50,fine,tT\WObj:=wT;")
    far = near.replace("[[1000,-300,500],[1,0,0,0]]", f"[{list(frame.trans)},{list(frame.rot)}]")
    assert near != far
    here, there = convert(near), convert(far, standing(base))
    np.testing.assert_allclose(places(written(there)), places(written(here)), atol=0.002)
    assert there.report["max_error_before_mm"] == pytest.approx(here.report["max_error_before_mm"], abs=1e-4)
    tilted = convert(far, standing(replace(base, rot=(0.8, 0.6, 0.0, 0.0))))
    assert "CMP014" in errors(tilted) and not tilted.outputs


def test_a_moment_turns_the_tool() -> None:
    none, turned = (convert(TWO, force=NO_FORCE, moment=m) for m in (NO_FORCE, (0.0, 60.0, 0.0)))
    assert np.abs(shifts(turned) - shifts(none)).max() > 0.02
    assert turned.report["max_error_after_mm"] <= 0.01


def test_a_correction_of_the_orientation_alone_is_a_correction() -> None:
    """Axis 6 stands 0.2 deg off and the torch lies on its axis: the TCP stays where it is, the torch turns."""
    conversion = convert(TWO, model(offset(0, 0, 0, 0, 0, 0.0035)), force=NO_FORCE)
    assert np.abs(shifts(conversion)).max() < 1e-3
    assert [o.status for o in conversion.outcomes] == ["compensated"] * 2
    after, before = (np.array(events(text)[0].target.rot) for text in (written(conversion), TWO))  # type: ignore[union-attr]
    assert 2 * np.arccos(min(1.0, abs(after @ before))) == pytest.approx(0.0035, rel=1e-2)


def test_torque_limits_hold_the_weight_as_the_arm_hangs() -> None:
    """On a wall axis 1 has the weight of the whole arm to hold."""
    weak = replace(arm(), robot=replace(arm().robot, torque=np.array([300.0, 8000.0, 5000.0, 900.0, 900.0, 900.0])))
    wall = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert convert(TWO, weak, force=NO_FORCE).exit_code == 0
    assert "MOT010" in codes(convert(TWO, replace(weak, R_world_base=wall), force=NO_FORCE))


def test_what_reads_a_channel_that_no_program_states_is_left_out_and_said() -> None:
    warm = convert(TWO, model(springs() + WARM + fitted("1e-14")), force=NO_FORCE)
    (finding,) = findings(warm, "CMP016")
    assert finding.severity == "warning" and "`temperature`" in finding.message
    assert "--channel temperature=NUMBER" in finding.help
    assert "thermal_joint_drift" not in written(warm)
    assert warm.report["expected_accuracy"] is None
    np.testing.assert_array_equal(shifts(warm), shifts(convert(TWO, model(springs()), force=NO_FORCE)))


def test_a_stated_channel_acts_along_the_whole_program() -> None:
    """30 K above the reference joint 2 stands 0.6 mrad ahead: the corrected program puts it that much back."""
    warm, cold = (
        convert(TWO, model(springs() + WARM), force=NO_FORCE, channels=(("temperature", degrees),))
        for degrees in (50.0, 20.0)
    )
    assert "thermal_joint_drift" in written(warm) and "CMP016" not in codes(warm)
    assert warm.report["max_error_after_mm"] < 0.01
    q = [conversion.plan.exact.q_goal for conversion in (warm, cold) if conversion.plan is not None]
    np.testing.assert_allclose(q[0] - q[1], np.tile([0, -6e-4, 0, 0, 0, 0], (len(q[0]), 1)), atol=2e-6)


def test_the_frame_of_the_instrument_moves_no_target() -> None:
    frame = effect("instrument_frame", "shift_m = [0.8, -1.2, 0.3]", "turn_rad = [0, 0, 0.4]")
    both, alone = (
        shifts(convert(TWO, model(text), force=NO_FORCE))[0] for text in (offset(5e-4) + frame, offset(5e-4))
    )
    assert np.abs(both - alone).max() < 1e-9
    assert np.linalg.norm(alone) == pytest.approx(0.5 * np.hypot(1.35, 0.5), abs=2e-3)


def test_the_error_of_another_tool_is_left_out_and_said() -> None:
    other = convert(TWO, model(offset(5e-4) + effect("tool_frame", "shift_m = [0.001, 0, 0]")), force=NO_FORCE)
    assert "tT" in findings(other, "CMP011")[0].message
    assert np.abs(shifts(other) - shifts(convert(TWO, model(offset(5e-4)), force=NO_FORCE))).max() < 1e-9


@pytest.mark.parametrize(
    "text",
    [
        "[tool]\nxyz_mm = [0, 0, 350]\n" + effect("tool_frame", "shift_m = [0.001, 0, 0]"),
        effect("tool_frame", "shift_m = [0.001, 0, 0.350]"),  # fitted from tool0, as `fit` writes it
    ],
)
def test_the_error_of_the_measured_tool_is_corrected(text: str) -> None:
    """The TCP lies 1 mm off along the tool's own x axis: the command moves by 1 mm against it."""
    measured = convert(TWO, model(text), force=NO_FORCE)
    assert "1.00 mm" in findings(measured, "CMP011")[0].message
    rot = np.array(events(TWO)[0].target.rot)  # type: ignore[union-attr]
    w, x, y, z = rot / np.linalg.norm(rot)
    x_axis = np.array([w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert shifts(measured)[0] == pytest.approx(-x_axis, abs=1e-3)


def measured(low: float = -3.0) -> Model:
    """An offset of joint 1 known to 20 microradians, 0.05 mm without explanation, measured from an angle on."""
    table = {
        "parameters": ["joint_offset.offset_rad[1]"],
        "covariance": [[(2e-5) ** 2]],
        "unexplained_mm": 0.05,
        "range": {"q1": [low, 3.0]},
    }
    return replace(model(offset(5e-4)), fit=table)


def test_expected_accuracy_in_closed_form() -> None:
    """An offset of axis 1 known to sigma moves the TCP by sigma times its distance from the axis."""
    reach = np.array([np.hypot(1350, 500), np.hypot(1350, 100)])
    each = np.sqrt(((2e-5 * reach) ** 2 + 3 * 0.05**2) / 3)
    document = convert(TWO, measured(), force=NO_FORCE).report
    claim = document["expected_accuracy"]
    assert claim["sigma_mm"] == pytest.approx(np.sqrt(np.mean(each**2)), rel=2e-3)
    parts = np.sqrt(np.mean((2e-5 * reach) ** 2) / 3), 0.05
    assert [claim["sigma_parts_mm"][k] for k in ("parameters", "unexplained")] == pytest.approx(parts, rel=2e-3)
    assert claim["within_95_percent_mm"] == pytest.approx(2.796 * each.max(), rel=2e-3)
    drawn = np.random.default_rng(4).normal(size=(200_000, 3))
    assert np.mean(np.linalg.norm(drawn, axis=1) < WITHIN_95) == pytest.approx(0.95, abs=0.002)
    errors = np.linalg.norm(drawn * np.hypot([2e-5 * reach[0], 0.0, 0.0], 0.05), axis=1)
    ends = np.hypot(np.quantile(errors, [0.025, 0.975]), document["max_error_after_mm"])
    assert document["expected_on_arm_mm"] == pytest.approx(ends, rel=0.01, abs=5e-4)
    # A weld nearer to axis 1 than the way there is known better; the model claims both apart, and no weld beyond its own.
    weld = f"MoveJ p1,v200,fine,tT; ArcLStart p2,{PROCESS},fine,tT; ArcLEnd p3,{PROCESS},fine,tT;"
    conversion = convert(
        small(weld, "p1 1350 -500, p2 1350 -100, p3 1350 100"), measured(), force=NO_FORCE, tolerance_m=1e-5
    )
    (_, line), claim = conclusion(conversion)[1], conversion.report["expected_accuracy"]
    assert document["expected_accuracy"]["within_95_percent_at_welds_mm"] is None
    assert claim["within_95_percent_at_welds_mm"] == pytest.approx(2.796 * each[1], rel=2e-3)
    sizes = [f"{2.796 * x:.3f} mm" for x in (each[1], each[0])]
    assert (
        line == f"The fitted model itself may be off by up to {sizes[0]} (95 %) where it welds, {sizes[1]} in the air."
    )
    assert conversion.report["figures"][0]["expected_on_arm_mm"][1] >= claim["within_95_percent_at_welds_mm"]


def test_outside_the_measured_range() -> None:
    """The program turns axis 1 below -20 deg; the model was measured down to -10 deg only."""
    outside, inside = (convert(TWO, measured(low), force=NO_FORCE) for low in (np.radians(-10), -3.0))
    (finding,) = findings(outside, "CMP010")
    assert "joint 1" in finding.message and "-10.0" in finding.message
    assert outside.exit_code == 0 and findings(inside, "CMP010") == []
    for made, said in ((outside, True), (inside, False)):
        header = [line for line in written(made).splitlines() if "lines and arcs" in line]
        assert len(header) == 2 and all(("a guess" in line) == said for line in header)


@pytest.mark.parametrize(("turned", "share"), [(0.0, 1.0), (0.3, None), (3.0, 0.0)])
def test_what_holds_near_measured_rows_alone_is_left_out_of_a_program_away_from_them(turned, share) -> None:
    """Rows at the program's own joint angles, or turned away from these about axis 1."""
    held = model(offset(5e-4))
    plain = convert(TWO, held, force=NO_FORCE)
    assert plain.plan is not None
    motion = plain.plan.motion
    rows = motion.at(motion.samples.goal[[0, -1]]).q + turned * np.eye(6)[0]
    near = Field(tuple(f"q{j + 1}" for j in range(6)), np.full(6, 0.5), rows, 1e-6)
    table = {"measured": near.table(), "local": ["joint_offset"]}
    part = convert(TWO, replace(held, fit=table, surest=held.with_effects()), force=NO_FORCE)
    told = near.known(State(rows - turned * np.eye(6)[0]))
    np.testing.assert_allclose(shifts(part), told[:, None] * shifts(plain), atol=2e-3)
    assert part.exit_code == 0
    if share is not None:
        assert told == pytest.approx(share, abs=0.01)
    far = findings(part, "CMP010")
    assert bool(far) == bool((told < 0.5).any())
    if share == 0.0:
        assert "falls back to the rest of the model, by 100 %" in far[0].message and "`joint_offset`" in far[0].message


def test_nothing_is_claimed_where_nothing_was_measured() -> None:
    conversion = convert(TWO)
    assert arm().fit == {} and conversion.report["expected_accuracy"] is None
    assert not {"CMP010", "CMP011"} & set(codes(conversion))


def test_a_joint_that_turns_back_on_the_way_does_not_end_the_timing() -> None:
    """Where joint 3 turns back toppra's linear program ended in NaN, after what it remembered of the points behind."""
    text = small(
        f"MoveJ [[55,945,1176],[0.3266,0.6355,-0.6374,0.2885],[0,0,-1,0],{AXES}],vmax,fine,tG;"
        f"MoveL [[-220,1645,-8],[0.1943,-0.2762,-0.9101,-0.2401],[1,-1,1,0],{AXES}],vmax,z50,tG;"
        f"MoveL [[-290,1653,-39],[0.2434,-0.6704,-0.655,-0.2496],[1,0,2,0],{AXES}],v40,fine,tG;",
        data="PERS tooldata tG:=[TRUE,[[91.6931,0.827393,389.803],[0.922078,-0.000834299,0.387004,-0.000212223]],"
        "[5.3,[31.7,-4.1,38.8],[1,0,0,0],0,0,0]];",
    )
    conversion = convert(text, default_model("irb2600id_8_200"), force=NO_FORCE, tolerance_m=1e-4, air_tolerance_m=2e-4)
    assert conversion.exit_code == 0
    assert [o.status for o in conversion.outcomes] == ["compensated"] * 3


def test_near_a_straight_wrist_the_arm_keeps_its_elbow() -> None:
    """Axes 4 and 6 turn far for a millimetre there: another elbow may then be nearer by the largest joint change."""
    robot, g = arm().robot, np.random.default_rng(0)
    q = np.radians(g.uniform([-120, -20, -40, -150, -0.01, -170], [120, 50, 30, 150, 0.01, 170], (4000, 6)))
    desired = forward(robot, q)
    desired[:, :3, :3] = Rotation.from_rotvec(1e-3 * g.normal(size=(4000, 3))).as_matrix() @ desired[:, :3, :3]
    solved = command(arm().with_effects(), arm().state(q, T_flange_tcp=np.eye(4)), desired).q
    assert np.abs(forward(robot, solved) - desired).max() < 1e-6
    assert np.abs(solved - q)[:, :3].max() < 0.05
