"""What the model of the arm has to say: mounting, weight of the tool, no effects at all, another geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc import text as text_of
from postproc.arrays import GRAVITY
from postproc.compensation.conversion import Conversion
from postproc.diagnostics import PostprocError, Source
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.model.arm import Model
from postproc.model.file import default_model, parse_model
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import Pose, RobTarget
from postproc.rapid.motions.units import pose_matrix
from postproc.report.page import render_certificate, render_page
from postproc.results.certificate import Verdict, program_certificate
from postproc.results.conversion import conversion_document
from postproc.robot.cells.cell import Cell, CellArm
from postproc.robot.cells.station import Station
from postproc.robot.kinematics import jacobian
from tests.build import arm, codes, convert, events, module, places, target, written

TEXT = module(
    f"CONST robtarget p1:={target(1350, -500)};\nCONST robtarget p2:={target(1350, -100)};",
    "MoveJ p1,v200,fine,tT;\nMoveL p2,v50,fine,tT;",
)
NO_FORCE = (0.0, 0.0, 0.0)
FITTED = '[fit]\nparameters = ["joint_compliance.compliance_rad_per_Nm[2]"]\ncovariance = ["{}"]\n'
SPRINGS = (
    'robot = "irb4600_60_205"\n[effects.joint_compliance]\ncompliance_rad_per_Nm = [4e-6, {}, 4e-7, 2e-6, 2e-6, 3e-6]\n'
)


def model(text: str) -> Model:
    return parse_model(Source("arm.toml", text.encode()))


def shifts(found: Conversion, text: str = TEXT) -> np.ndarray:
    """How far the goals of the two statements were moved (2, 3) [mm]."""
    goals = places(written(found))
    return np.subtract([goals[0], goals[-1]], places(text))


def test_a_gantry_turns_the_correction_round() -> None:
    """Hanging upside down, gravity pulls the other way in base axes: the correction changes its sign."""
    floor = shifts(convert(TEXT, force=NO_FORCE))
    gantry = shifts(convert(TEXT, replace(arm(), R_world_base=np.diag([1.0, -1.0, -1.0])), force=NO_FORCE))
    assert floor[:, 2].min() > 0.3
    assert np.abs(gantry + floor).max() < 0.02


@pytest.mark.parametrize(
    ("turn", "allowed", "severity"),
    [
        (0.002, 0.015, None),
        (0.01, 0.015, "warning"),
        (0.01, 0.008, "error"),
        (0.02, 0.015, "error"),
        (0.02, 0.04, "warning"),
        (0.2, 0.015, "error"),
    ],
)
def test_a_correction_that_no_arm_needs_is_not_written(turn: float, allowed: float, severity: str | None) -> None:
    """0.2 deg of joint 2 written where radians are meant move the torch by a quarter of a metre."""
    offset = f"[effects.joint_offset]\noffset_rad = [0, {turn}, 0, 0, 0, 0]\n"
    found = convert(TEXT, model(SPRINGS.format("3e-7") + offset), force=NO_FORCE, largest_correction_m=allowed)
    doubts = [d for d in found.diagnostics if d.code == "CMP015"]
    assert [d.severity for d in doubts] == ([severity] if severity else [])
    assert all("most of it by `joint_offset`" in d.message for d in doubts)
    assert bool(found.outputs) == (severity != "error")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SPRINGS.format("3e-7") + "[mounting]\nrpy_deg = [0, 0, 0]\n", []),
        (SPRINGS.format("3e-7") + "[mounting]\nrpy_deg = [180, 0, 0]\n", ["CMP014"]),
    ],
)
def test_a_turned_base_is_a_warning(text: str, said: list[str]) -> None:
    found = convert(TEXT, model(text), force=NO_FORCE).diagnostics
    assert [d.code for d in found if d.severity == "warning" and d.code == "CMP014"] == said


@pytest.mark.parametrize(
    ("value", "sigma", "refused"),
    [("-3e-8", "1e-14", False), ("-3e-7", "1e-14", True), ("-1e-9", "1e-24", True)],
)
def test_a_fitted_spring_may_be_below_zero_by_chance_alone(value: str, sigma: str, refused: bool) -> None:
    found = convert(TEXT, model(SPRINGS.format(value) + FITTED.format(sigma)), force=NO_FORCE)
    told = [d.message for d in found.diagnostics if d.code == "MOD005" and d.severity == "error"]
    assert told == (
        [f"no arm has `compliance_rad_per_Nm[2] = {float(value):g}` of `joint_compliance`"] if refused else []
    )
    assert bool(found.outputs) != refused


LIFTED = "[effects.arm_load]\nbody = [3]\nmass_kg = [{}]\nmoment_kgm = [[0, 0, 0]]\n"


@pytest.mark.parametrize(
    ("effect", "code", "line"),
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
def test_a_sign_that_no_arm_has_is_an_error_at_its_place(effect: str, code: str, line: int) -> None:
    with pytest.raises(PostprocError) as caught:
        model(f'robot = "irb4600_60_205"\n[effects.{effect}\n')
    (finding,) = caught.value.diagnostics
    assert (finding.code, finding.place) == (code, f"arm.toml:{line}:1")


def test_a_link_may_be_lighter_than_its_estimate_but_not_than_nothing() -> None:
    assert convert(TEXT, model(SPRINGS.format("3e-7") + LIFTED.format(-20)), force=NO_FORCE).outputs
    fitted = model(SPRINGS.format("3e-7") + LIFTED.format(-250) + FITTED.format("1e-14"))
    found = convert(TEXT, fitted, force=NO_FORCE)
    assert [d.severity for d in found.diagnostics if d.code == "MOD005"] == ["error"] and not found.outputs


@pytest.mark.parametrize(
    ("effect", "refused"),
    [
        ("[effects.payload_error]\nmass_kg = -3\n", False),  # a tool of 2 kg that tooldata calls one of 5 kg
        ("[effects.payload_error]\nmass_kg = -9\n", True),  # the flange itself weighs 3 kg
        ("[effects.payload_error]\nmass_kg = 3\n", False),
    ],
)
def test_a_tool_may_be_lighter_than_stated_but_not_than_nothing(effect: str, refused: bool) -> None:
    found = convert(TEXT, model(SPRINGS.format("3e-7") + effect), force=NO_FORCE)
    told = [d for d in found.diagnostics if d.code == "MOD005"]
    assert bool(told) == refused and bool(found.outputs) != refused
    assert all(d.severity == "error" and d.span and "weigh -1 kg" in d.message for d in told)


def test_an_estimated_stiffness_says_what_it_means() -> None:
    found = convert(TEXT, default_model("irb4600_40_255"), force=NO_FORCE)
    low, high = found.report["expected_remaining_fraction"]
    assert 0.0 < low < 0.5 < high
    before = found.report["max_error_before_mm"]
    said = (
        f"the stiffness of this arm is estimated: {100 * low:.0f} to {100 * high:.0f} % of its deflection,"
        f" {before * low:.2f} to {before * high:.2f} mm, is expected to remain"
    )
    assert f"! {said}" in written(found)
    page, certificate = (
        render_page(conversion_document("p.mod", found)),
        render_certificate(program_certificate("p.mod", found)),
    )
    assert said in page and said in certificate and Verdict.NOT_SHOWN.value in certificate
    known = convert(TEXT, force=NO_FORCE)
    assert known.report["expected_remaining_fraction"] is None
    assert "estimated" not in text_of(known) + written(known)


def test_an_arm_without_weight_or_springs_is_refused() -> None:
    """Without masses 0.023 mm were corrected where masses give 0.162 mm: nothing said so."""
    whole = arm()
    bare = replace(whole, robot=replace(whole.robot, mass=np.zeros(7)))
    found = convert(TEXT, bare, force=NO_FORCE)
    assert [d.severity for d in found.diagnostics if d.code == "KIN010"] == ["error"] and not found.outputs
    for rigid, force in ((whole.with_effects(), NO_FORCE), (whole.with_effects(JointOffset()), (10.0, 0.0, 0.0))):
        found = convert(TEXT, rigid, force=force)
        assert [d.severity for d in found.diagnostics if d.code == "MOD006"] == ["error"] and not found.outputs
    stiff = convert(TEXT, whole.with_effects(JointCompliance()), force=NO_FORCE)
    assert stiff.outputs and "MOD006" not in codes(stiff)
    offset = convert(TEXT, whole.with_effects(JointOffset(offset_rad=[0, 1e-4, 0, 0, 0, 0])), force=NO_FORCE)
    assert [d.severity for d in offset.diagnostics if d.code == "MOD006"] == ["warning"] and offset.outputs


def standing(base: Pose) -> Station:
    """An arm whose base stands there in the world."""
    T = pose_matrix(base.trans, base.rot)
    return Station(Cell(arms={"robot": CellArm("robot", "", None, T, T[:3, :3].T @ np.array([0.0, 0.0, -GRAVITY]))}))


def test_the_base_frame_takes_the_program_from_the_world_to_the_arm() -> None:
    """One cell stated twice: in a world at the base, and in one 3.7 m away and turned by 90 deg."""
    turn = (0.6, 0.0, 0.0, 0.8)
    base = Pose((3700.0, -200.0, 500.0), turn)
    frame = pose_mult(base, Pose((1000.0, -300.0, 500.0)))
    body = (
        f"MoveJ {target(350, -200, 200)},v200,fine,tT\\WObj:=wT;\nMoveL {target(350, 200, 200)},v50,fine,tT\\WObj:=wT;"
    )
    here = module("", body)
    there = here.replace("[[1000,-300,500],[1,0,0,0]]", f"[{list(frame.trans)},{list(frame.rot)}]")
    assert here != there
    near, far = convert(here), convert(there, replace(arm(), station=standing(base)))
    np.testing.assert_allclose(places(written(far)), places(written(near)), atol=0.002)
    assert far.report["max_error_before_mm"] == pytest.approx(near.report["max_error_before_mm"], abs=1e-4)
    tilted = convert(there, replace(arm(), station=standing(replace(base, rot=(0.8, 0.6, 0.0, 0.0)))))
    assert "CMP014" in [d.code for d in tilted.diagnostics if d.severity == "error"] and not tilted.outputs


def test_the_weight_of_the_tool_bends_the_arm() -> None:
    """Ten kilograms more at the tool's centre: the correction grows by J C J^T times the weight, to first order."""
    light, heavy = TEXT, TEXT.replace("[5,[0,0,120]", "[15,[0,0,120]")
    assert heavy != light
    more = shifts(convert(heavy, force=NO_FORCE)) - shifts(convert(light, force=NO_FORCE))
    found = convert(light, force=NO_FORCE)
    assert found.plan is not None and arm().robot.joint_compliance is not None
    move = found.plan.motion.moves[0]
    center = move.T_mount_tcp.copy()
    center[:3, 3] = 0, 0, 0.12
    J, J_center = (jacobian(arm().robot, move.q[None], T)[0] for T in (move.T_mount_tcp, center))
    weight = np.array([0, 0, -10 * GRAVITY, 0, 0, 0])
    sag = J @ (np.array(arm().robot.joint_compliance) * (J_center.T @ weight))
    assert more[0] == pytest.approx(-1e3 * sag[:3], rel=0.01, abs=2e-3)


def test_the_correction_is_opposite_to_the_deflection_of_the_force() -> None:
    """Twice the force, twice the correction (to first order); the other way round, the other way round."""
    none, once, twice, back = (
        shifts(convert(TEXT, force=f)) for f in (NO_FORCE, (0, 0, -150.0), (0, 0, -300.0), (0, 0, 150.0))
    )
    assert (once - none)[:, 2].min() > 0.1
    assert np.abs((twice - none) - 2 * (once - none)).max() < 0.01
    assert np.abs((back - none) + (once - none)).max() < 0.01


def test_a_moment_turns_the_tool() -> None:
    none, turned = (convert(TEXT, force=NO_FORCE, moment=m) for m in ((0.0, 0.0, 0.0), (0.0, 60.0, 0.0)))
    assert np.abs(shifts(turned) - shifts(none)).max() > 0.02
    assert turned.report["max_error_after_mm"] <= 0.01


def test_a_correction_of_the_orientation_alone_is_a_correction() -> None:
    """Axis 6 stands 0.2 deg off and the torch lies on its axis: the TCP stays where it is, the torch turns."""
    text = 'robot = "irb4600_60_205"\n[effects.joint_offset]\noffset_rad = [0, 0, 0, 0, 0, 0.0035]\n'
    found = convert(TEXT, model(text), force=NO_FORCE)
    assert np.abs(shifts(found)).max() < 1e-3
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    rotations = [np.array(e.target.rot) for e in events(written(found)) if isinstance(e.target, RobTarget)]
    before = np.array(events(TEXT)[0].target.rot)  # type: ignore[union-attr]
    assert 2 * np.arccos(min(1.0, abs(rotations[0] @ before))) == pytest.approx(0.0035, rel=1e-2)


def test_torque_limits_hold_the_weight_as_the_arm_hangs() -> None:
    """On a wall axis 1 has the weight of the whole arm to hold."""
    weak = replace(arm().robot, torque=np.array([300.0, 8000.0, 5000.0, 900.0, 900.0, 900.0]))
    wall = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    floor = convert(TEXT, replace(arm(), robot=weak), force=NO_FORCE)
    assert floor.exit_code == 0
    held = convert(TEXT, replace(arm(), robot=weak, R_world_base=wall), force=NO_FORCE)
    assert "MOT010" in codes(held)


WARM = (
    SPRINGS.format("3e-7")
    + "[effects.thermal_joint_drift]\nreference_C = 20\ndrift_rad_per_K = [0, 2e-5, 0, 0, 0, 0]\n"
)


def test_what_reads_a_channel_that_no_program_tells_is_left_out_and_said() -> None:
    told, warm = model(SPRINGS.format("3e-7")), model(WARM + FITTED.format("1e-14"))
    found = convert(TEXT, warm, force=NO_FORCE)
    (said,) = (d for d in found.diagnostics if d.code == "CMP016")
    assert said.severity == "warning" and "`temperature`" in said.message
    assert "--channel temperature=NUMBER" in said.help
    assert "thermal_joint_drift" not in written(found)
    assert found.report["expected_accuracy"] is None
    np.testing.assert_array_equal(shifts(found), shifts(convert(TEXT, told, force=NO_FORCE)))


def test_a_stated_channel_acts_along_the_whole_program() -> None:
    """30 K above the reference joint 2 stands 0.6 mrad ahead: the corrected program puts it that much back."""
    warm, cold = (
        convert(TEXT, model(WARM), force=NO_FORCE, channels=(("temperature", degrees),)) for degrees in (50.0, 20.0)
    )
    assert "thermal_joint_drift" in written(warm) and "CMP016" not in codes(warm)
    assert warm.report["max_error_after_mm"] < 0.01
    q = [found.plan.exact.q_goal for found in (warm, cold) if found.plan is not None]
    np.testing.assert_allclose(q[0] - q[1], np.tile([0, -6e-4, 0, 0, 0, 0], (len(q[0]), 1)), atol=2e-6)


@pytest.mark.parametrize("name", ["temprature", "payload"])
def test_a_channel_that_no_effect_waits_for_is_an_error(name: str) -> None:
    found = convert(TEXT, model(WARM), force=NO_FORCE, channels=(("temperature", 30.0), (name, 3.0)))
    assert [d.code for d in found.diagnostics if d.severity == "error"] == ["CMP016"] and not found.outputs
