"""Every effect of the library against a formula written here, in plain numpy or by hand."""

from dataclasses import replace
from math import cos, pi, sin, sqrt, tanh

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import State
from postproc.effects.example import example_arm
from postproc.effects.geometry import long_bodies, point_acceleration
from postproc.effects.library.frames.frame_drift import FrameDrift
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.outlier import Outlier
from postproc.effects.library.frames.session import Session
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.servo_lag import ServoLag
from postproc.effects.library.joints.thermal_joint_drift import ThermalJointDrift
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.joints.wrist_coupling import WristCoupling
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.loads.payload_error import PayloadError
from postproc.effects.library.structure.base_compliance import BaseCompliance
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.library.structure.thermal_growth import ThermalGrowth
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import body_motions, body_poses

SIX = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
Q = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-1.0, 0.8, -0.6, 2.0, -1.5, 3.0]])


def states(**channels):
    return State(q=Q, **channels)


def placed(position, rotation=None):
    T = np.eye(4)
    T[:3, 3] = position
    T[:3, :3] = np.eye(3) if rotation is None else rotation
    return T


def turn_z(angle):
    return np.array([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])


def bodies(**poses):
    """One state in which the named bodies stand somewhere, such as b3=T."""
    T = np.tile(np.eye(4), (1, 7, 1, 1))
    for name, pose in poses.items():
        T[0, int(name[1])] = pose
    return State(q=np.zeros((1, 6)), T_base_body=T)


def wrench_on(effect, state, body):
    return load_of(effect, state).body[body][0]


def test_instrument_frame():
    given = displacement_of(InstrumentFrame(shift_m=[1, 2, 3], turn_rad=[4, 5, 6]), states())
    assert_allclose(given.instrument, [1, 2, 3, 4, 5, 6])


def test_tool_frame():
    given = displacement_of(ToolFrame(shift_m=[1, 2, 3], turn_rad=[4, 5, 6]), states())
    assert_allclose(given.tool, [1, 2, 3, 4, 5, 6])


def test_joint_offset():
    assert_allclose(displacement_of(JointOffset(offset_rad=SIX), states()).joint, [SIX, SIX])


def test_link_geometry():
    shift, turn = np.zeros((7, 3)), np.zeros((7, 3))
    shift[2, 1], turn[2, 0] = 1e-3, 2e-3
    given = displacement_of(LinkGeometry(shift_m=shift, turn_rad=turn), states()).body
    assert list(given) == [2]
    assert_allclose(given[2], [[0, 1e-3, 0, 2e-3, 0, 0]] * 2)


def test_joint_compliance():
    state = states(joint_load=np.array([SIX * 100, -SIX]))
    given = displacement_of(JointCompliance(compliance_rad_per_Nm=np.full(6, 2e-6)), state).joint
    assert_allclose(given, [SIX * 2e-4, -SIX * 2e-6])


@pytest.mark.parametrize(
    ("law", "at_50", "at_minus_400"),
    [
        ("tanh", 1e-6 * 100 * tanh(0.5), -1e-6 * 100 * tanh(4.0)),
        ("piecewise", 1e-6 * 50, -1e-6 * 100),
        ("catalogue", 1e-6 * 50, -1e-6 * (100 + 0.25 * 200)),
        ("cubic", 1e-6 * 100 * 0.125, -1e-6 * 100 * 64),
    ],
)
def test_nonlinear_compliance(law, at_50, at_minus_400):
    load = np.zeros((2, 6))
    load[:, 1] = 50, -400
    effect = NonlinearCompliance(law=law, windup_rad=np.full(6, 1e-6 * 100), knee_Nm=np.full(6, 100.0))
    dq = displacement_of(effect, states(joint_load=load)).joint
    assert_allclose(dq[:, 1], [at_50, at_minus_400])
    assert not dq[:, [0, 2, 3, 4, 5]].any()


def test_hardening_spring_solves_its_equation():
    load = np.linspace(-3000.0, 3000.0, 60).reshape(10, 6)
    e, t0 = 4e-7, 250.0
    effect = NonlinearCompliance(law="hardening", windup_rad=np.full(6, e * t0), knee_Nm=np.full(6, t0))
    dq = displacement_of(effect, State(q=np.zeros((10, 6)), joint_load=load)).joint
    assert_allclose(dq / e + dq**3 / (e**3 * t0**2), load, rtol=1e-10, atol=1e-9)


def test_backlash_stops_short_on_the_side_it_came_from():
    side = np.array([[1, -1, 0, 1, 1, -1], [-1, -1, 1, 0, 0, 1.0]])
    given = displacement_of(Backlash(half_gap_rad=np.full(6, 1e-4)), states(approach=side)).joint
    assert_allclose(given, -1e-4 * side)


@pytest.mark.parametrize(("order", "nearest"), [(1.0, [1.02]), (1.04, [1.0, 1.02, 1.06]), (3.0, [2.5, 2.98, 3.02])])
def test_orders_beside_a_line_come_again_in_every_turn(order, nearest):
    """A wave that does not is a slope in the range of any joint, which no wheel makes."""
    orders = [v.effect.order[-1] for v in TransmissionError(joint=(5,), order=(order,)).nearby()]
    assert set(nearest) <= set(orders) and min([*orders, order]) >= 1.0


def test_orders_are_tried_as_high_as_the_angles_tell_them_from_lower_ones():
    """On a grid of 40 degrees, order 5 is order 4 turned back; readings of one place scatter."""
    grid = np.radians(np.repeat([-80.0, -40.0, 0.0, 40.0, 80.0], 8))
    five, four = (np.column_stack([np.cos(n * grid), np.sin(n * grid)]) for n in (5, 4))
    assert_allclose(five, four * [1, -1], atol=1e-12)
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (40, 6))
    q[:, 1] = grid + np.random.default_rng(4).normal(0.0, 2e-4, 40)
    q[:, 4] = 0.5
    every = [(*v.effect.joint, *v.effect.order) for v in TransmissionError.variants(State(q=q))]
    assert [n for j, n in every if j == 2] == [1.0, 2.0, 3.0, 4.0]
    assert max(n for j, n in every if j == 1) == 320 and not any(j == 5 for j, _ in every)


def test_orders_beside_several_lines_are_those_of_the_new_ones():
    lines = TransmissionError(joint=(3, 2, 3), order=(5.0, 2.0, 2.5))
    found = [tuple(zip(v.effect.joint, v.effect.order, strict=True)) for v in lines.nearby(2)]
    assert all(terms[0] == (3, 5.0) for terms in found)
    assert {terms[1] for terms in found if terms[2] == (3, 2.5)} >= {(2, 1.5), (2, 2.5), (2, 2.02)}
    assert {terms[2] for terms in found if terms[1] == (2, 2.0)} >= {(3, 2.0), (3, 3.0)}
    assert lines.nearby(2)[0].label == "joint 2, order 1.98; joint 3, order 2.5"
    # One line is not told twice.
    twins = TransmissionError(joint=(3, 3), order=(2.0, 2.5)).nearby(2)
    assert twins and all(len(set(v.effect.order)) == 2 for v in twins)


def test_transmission_error_with_two_lines_on_one_joint():
    effect = TransmissionError(
        joint=(3, 3, 6), order=(3, 120.5, 1), sine_rad=[1e-4, 2e-5, 0], cosine_rad=[0, 3e-5, 1e-6]
    )
    dq = displacement_of(effect, states()).joint
    for row, q in zip(dq, Q, strict=True):
        assert row[2] == pytest.approx(1e-4 * sin(3 * q[2]) + 2e-5 * sin(120.5 * q[2]) + 3e-5 * cos(120.5 * q[2]))
        assert row[5] == pytest.approx(1e-6 * cos(q[5]))
        assert not row[[0, 1, 3, 4]].any()


def test_joint_error_map_is_a_line_and_a_fourier_series_within_its_range_and_flat_beyond():
    low, high = (-10.0, -0.5, *(-10.0,) * 2, -100.0, -10.0), (10.0, 0.5, *(10.0,) * 2, 100.0, 10.0)
    sine, cosine = np.array([[1.0, 2, 3], [4, 5, 6]]) * 1e-5, np.array([[-1.0, 0, 1], [2, -2, 1]]) * 1e-5
    slope = {"slope_rad": [2e-5, 3e-5], "low_rad": low, "high_rad": high}
    effect = JointErrorMap(joint=(2, 5), order=3, sine_rad=sine, cosine_rad=cosine, **slope)
    dq = displacement_of(effect, states()).joint

    def series(row, q):
        return sum(sine[row, k - 1] * sin(k * q) + cosine[row, k - 1] * cos(k * q) for k in (1, 2, 3))

    assert_allclose(dq[:, 1], [series(0, 0.2) + 2e-5 * 0.2 / pi, series(0, 0.5) + 2e-5 * 0.5 / pi])
    # A full turn comes again.
    assert_allclose(dq[:, 4], [series(1, 0.5), series(1, -1.5)])
    assert_allclose(displacement_of(effect.unlimited(), states()).joint[1, 1], series(0, Q[1, 1]) + 2e-5 * Q[1, 1] / pi)
    assert_allclose(effect.outside(Q)[:, 1], [0.0, 0.3])
    assert not effect.outside(Q)[:, [0, 2, 3, 4, 5]].any()


def test_roughness_of_the_map_is_half_a_derivative():
    rng = np.random.default_rng(3)
    effect = JointErrorMap(joint=(4,), order=5, sine_rad=rng.normal(size=(1, 5)), cosine_rad=rng.normal(size=(1, 5)))
    q = np.zeros((64, 6))
    q[:, 3] = np.linspace(0, 2 * pi, 64, endpoint=False)
    wave = np.fft.fft(displacement_of(effect, State(q=q)).joint[:, 3]) / 64
    energy = 2 * np.sum(np.abs(np.fft.fftfreq(64, 1 / 64)) * np.abs(wave) ** 2)
    assert np.sum((effect.roughness() * effect.vector()) ** 2) == pytest.approx(energy)


def test_arm_load_at_rest():
    # Body 3 stands at (1, 0, 2), turned by 90 degrees about z; the part sits 0.2 m along its own x: at (1, 0.2, 2).
    state = bodies(b3=placed((1, 0, 2), turn_z(pi / 2)))
    given = wrench_on(ArmLoad(body=(3,), mass_kg=[22], moment_kgm=[[22 * 0.2, 0, 0]]), state, 3)
    force = np.array([0, 0, -9.81 * 22])
    assert_allclose(given, [*force, *np.cross([1, 0.2, 2], force)], atol=1e-12)


def test_arm_load_on_an_arm_that_hangs_from_a_wall():
    state = replace(bodies(b2=placed((0, 0.5, 1))), gravity=np.array([9.81, 0, 0]))
    given = wrench_on(ArmLoad(body=(2,), mass_kg=[10], moment_kgm=[[0, 0, 0]]), state, 2)
    assert_allclose(given, [98.1, 0, 0, 0, 98.1, -0.5 * 98.1])


def test_two_loads_on_one_body_add():
    state = bodies(b3=placed((1, 0, 2)))
    twice = wrench_on(ArmLoad(body=(3, 3), mass_kg=[10, 12], moment_kgm=np.zeros((2, 3))), state, 3)
    assert_allclose(twice, wrench_on(ArmLoad(body=(3,), mass_kg=[22], moment_kgm=[[0, 0, 0]]), state, 3))


def test_arm_load_swung_about_joint_1():
    """On a turntable with speed w and acceleration e a mass at radius r pulls outwards by m w^2 r and back by m e r."""
    arm, w, e = example_arm(), 1.5, 4.0
    v, a = np.zeros((1, 6)), np.zeros((1, 6))
    v[0, 0], a[0, 0] = w, e
    state = replace(bodies(b1=placed((0, 0, 0.3))), robot=arm, v=v, a=a)
    given = wrench_on(ArmLoad(body=(1,), mass_kg=[20], moment_kgm=[[20 * 0.5, 0, 0]]), state, 1)
    assert_allclose(given[:3], [20 * w**2 * 0.5, -20 * e * 0.5, -9.81 * 20])


def test_arm_load_on_an_arm_of_which_the_speed_alone_was_recorded():
    """It is pulled outwards, by m w^2 r: a steady speed."""
    v = np.zeros((1, 6))
    v[0, 0] = 1.5
    state = replace(bodies(b1=placed((0, 0, 0.3))), robot=example_arm(), v=v)
    given = wrench_on(ArmLoad(body=(1,), mass_kg=[20], moment_kgm=[[20 * 0.5, 0, 0]]), state, 1)
    assert_allclose(given[:3], [20 * 1.5**2 * 0.5, 0, -9.81 * 20])


def test_acceleration_of_a_point_against_differences_of_its_path():
    arm, rng, h = example_arm(), np.random.default_rng(5), 1e-4
    q, v, a = rng.normal(size=(3, 8, 6))
    at = np.array([0.1, -0.2, 0.3])

    def path(t):
        T = body_poses(arm, q + v * t + a * t**2 / 2)
        return T, (T[:, 5] @ np.append(at, 1.0))[:, :3]

    T, now = path(0.0)
    differences = (path(h)[1] - 2 * now + path(-h)[1]) / h**2
    assert_allclose(point_acceleration(body_motions(arm, T, v, a)[5], T[:, 5], now), differences, rtol=1e-5, atol=1e-5)


def test_gravity_compensator_is_a_spring_on_joint_2():
    k, q0 = 1800.0, 0.3
    effect = GravityCompensator(sine_Nm=[-k * cos(q0)], cosine_Nm=[-k * sin(q0)])
    torque = load_of(effect, states()).joint
    assert_allclose(torque[:, 1], -k * np.sin(Q[:, 1] + q0))
    assert not torque[:, [0, 2, 3, 4, 5]].any()


def test_payload_error_in_tool0_and_as_a_share_of_the_stated_payload():
    arm = example_arm()
    tool0 = placed((0.05, 0, 0), [[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    arm = replace(arm, link=np.concatenate([arm.link[:6], tool0[None]]))
    state = replace(bodies(b6=placed((1, 0, 1))), robot=arm)
    # tool0's z looks along base x here: 0.1 m along it from the flange at (1.05, 0, 1).
    given = wrench_on(PayloadError(mass_kg=5, moment_kgm=[0, 0, 0.5]), state, 6)
    force = np.array([0, 0, -5 * 9.81])
    assert_allclose(given, [*force, *np.cross([1.15, 0, 1], force)], atol=1e-12)
    stated = replace(state, payload_mass=np.array([50.0]), payload_center=np.array([[0, 0, 0.1]]))
    assert_allclose(wrench_on(PayloadError(fraction=0.1), stated, 6), given, atol=1e-12)
    # 50 kg that hang 20 mm farther along tool0's z: a pure moment.
    off = wrench_on(PayloadError(centre_m=[0, 0, 0.02]), stated, 6)
    assert_allclose(off, [0, 0, 0, *np.cross([0.02, 0, 0], [0, 0, -50 * 9.81])], atol=1e-12)


def test_dress_pack_pulls_when_taut_and_hangs_when_slack():
    state = replace(bodies(b3=placed((0, 0, 2)), b6=placed((1, 0, 1))), robot=example_arm())
    # From (0, 0, 2.3) to (1, 0, 1.1).
    ends = {"from_m": [0, 0, 0.3], "to_m": [0, 0, 0.1], "stiffness_N_per_m": 300.0}
    taut = load_of(DressPack(slack_m=0.5, **ends), state).body
    along = np.array([-1, 0, 1.2]) / sqrt(1 + 1.44)
    pull = 300 * (sqrt(1 + 1.44) - 0.5) * along
    assert_allclose(taut[6][0], [*pull, *np.cross([1, 0, 1.1], pull)])
    assert_allclose(taut[3][0], [*-pull, *np.cross([0, 0, 2.3], -pull)])
    slack = load_of(DressPack(slack_m=1.6, **ends), state).body
    assert not any(x.any() for x in slack.values())


def test_thermal_growth_stretches_every_casting_along_itself():
    state = states(temperature=np.array([25.0, 12.0]), robot=example_arm())
    given = displacement_of(ThermalGrowth(growth_per_K=1.15e-5, strain=1e-5), state).body
    for b, end in enumerate(
        [(0, 0, 0.3), (0.2, 0, 0.2), (0, 0, 0.9), (0.3, 0, 0.15), (0.7, 0, 0), (0.1, 0, 0), (0.05, 0, 0)]
    ):
        assert_allclose(given[b][0], [*(np.array(end) * (1.15e-5 * 5 + 1e-5)), 0, 0, 0])
        assert_allclose(given[b][1], [*(np.array(end) * (1.15e-5 * -8 + 1e-5)), 0, 0, 0])


def test_one_casting_grows_beyond_the_others():
    state = states(temperature=np.array([25.0, 12.0]), robot=example_arm())
    given = displacement_of(ThermalGrowth(body=(2, 4), growth_per_K=1e-5, extra_per_K=[0, 3e-6]), state).body
    assert_allclose(given[2][:, 2], [0.9 * 1e-5 * 5, 0.9 * 1e-5 * -8])
    assert_allclose(given[4][:, 0], [0.7 * 1.3e-5 * 5, 0.7 * 1.3e-5 * -8])


def test_the_strains_stand_for_another_reference_of_what_grows_apart():
    """All grow from 22.5 deg C on, body 4 more than the others; the effect is told for 20."""
    state = states(temperature=np.array([25.0, 12.0]), robot=example_arm())
    effect = ThermalGrowth(
        body=(2, 4), growth_per_K=1e-5, strain=-2.5e-5, extra_per_K=[0, 3e-6], extra_strain=[0, -7.5e-6]
    )
    given = displacement_of(effect, state).body
    assert_allclose(given[2][:, 2], [0.9 * 1e-5 * 2.5, 0.9 * 1e-5 * -10.5])
    assert_allclose(given[4][:, 0], [0.7 * 1.3e-5 * 2.5, 0.7 * 1.3e-5 * -10.5])


def test_thermal_joint_drift():
    effect = ThermalJointDrift(reference_C=22.0, drift_rad_per_K=SIX * 1e-6)
    given = displacement_of(effect, states(temperature=np.array([22.0, 32.0]))).joint
    assert_allclose(given, [np.zeros(6), SIX * 1e-5])


def loaded(body, force, moment):
    body_load = np.zeros((1, 7, 6))
    body_load[0, body] = [*force, *moment]
    return State(q=np.zeros((1, 6)), robot=example_arm(), body_load=body_load, joint_load=np.zeros((1, 6)))


def test_base_compliance_about_the_floor_moves_the_pedestal_too():
    # The pedestal of the example is 0.3 m high; 1000 N along x on it adds 300 N m about y at the floor.
    state = loaded(0, (1000, 0, -5000), (200, 2500, 700))
    tilt = {"tilt_rad_per_Nm": [1e-7, 2e-7]}
    about_floor = displacement_of(BaseCompliance(**tilt), state).body[0][0]
    assert_allclose(about_floor, [2e-7 * 2800 * 0.3, -1e-7 * 200 * 0.3, 0, 1e-7 * 200, 2e-7 * 2800, 0])
    about_joint = displacement_of(BaseCompliance(pivot="joint 1", **tilt), state).body[0][0]
    assert_allclose(about_joint, [0, 0, 0, 1e-7 * 200, 2e-7 * 2500, 0])


def test_base_compliance_of_feet_that_are_softest_between_the_axes():
    # A spring of 4e-7 about the axis at 30 degrees from x and 1e-7 across it, written out in its own axes.
    state = loaded(0, (0, 0, 0), (300, -200, 50))
    soft, firm = np.array([np.cos(np.pi / 6), 0.5]), np.array([-0.5, np.cos(np.pi / 6)])
    c = 4e-7 * np.outer(soft, soft) + 1e-7 * np.outer(firm, firm)
    turned = BaseCompliance(pivot="joint 1", tilt_rad_per_Nm=np.diag(c), cross_tilt_rad_per_Nm=c[0, 1])
    moment = np.array([300.0, -200.0])
    expected = 4e-7 * (soft @ moment) * soft + 1e-7 * (firm @ moment) * firm
    assert_allclose(displacement_of(turned, state).body[0][0], [0, 0, 0, *expected, 0])


def test_bearing_tilt_turns_across_the_axis_alone():
    # Joint 4 of the example turns about x and sits at the end of body 3.
    state = loaded(3, (0, 0, 0), (50, 60, -70))
    given = displacement_of(BearingTilt(tilt_rad_per_Nm=[0, 0, 0, 1e-7, 0, 0]), state).body
    assert list(given) == [3]
    assert_allclose(given[3][0], [0, 0, 0, 0, 6e-6, -7e-6])


def test_bearing_tilt_where_body_and_joint_axes_differ():
    # The link turns by 90 degrees about x, so that the joint's own z is the body's -y.
    arm = example_arm()
    link = arm.link.copy()
    link[1, :3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    axis = arm.axis.copy()
    axis[1] = [0, 0, 1]
    state = replace(loaded(1, (0, 0, 0), (10, 20, 30)), robot=replace(arm, link=link, axis=axis))
    given = displacement_of(BearingTilt(tilt_rad_per_Nm=[0, 1e-6, 0, 0, 0, 0]), state).body[1][0]
    assert_allclose(given, [0, 0, 0, 1e-5, 0, 3e-5])


def test_link_compliance_against_the_textbook_cantilever():
    EI, GJ, EA, L = 1.3e6, 0.6e6, 2e8, 0.7
    effect = LinkCompliance(body=(4,), bending_per_Nm2=[1 / EI], torsion_per_Nm2=[1 / GJ], stretch_per_N=[1 / EA])

    def tip(force, moment):
        return displacement_of(effect, loaded(4, force, moment)).body[4][0]

    # Along x: a force across z sags by F L^3 / 3EI and turns about -y by F L^2 / 2EI.
    assert_allclose(
        tip((0, 0, 100), (0, 0, 0)), [0, 0, 100 * L**3 / (3 * EI), 0, -100 * L**2 / (2 * EI), 0], atol=1e-18
    )
    assert_allclose(tip((0, 100, 0), (0, 0, 0)), [0, 100 * L**3 / (3 * EI), 0, 0, 0, 100 * L**2 / (2 * EI)], atol=1e-18)
    assert_allclose(tip((0, 0, 0), (0, 0, 80)), [0, 80 * L**2 / (2 * EI), 0, 0, 0, 80 * L / EI], atol=1e-18)
    assert_allclose(tip((0, 0, 0), (0, 80, 0)), [0, 0, -80 * L**2 / (2 * EI), 0, 80 * L / EI, 0], atol=1e-18)
    assert_allclose(tip((500, 0, 0), (60, 0, 0)), [500 * L / EA, 0, 0, 60 * L / GJ, 0, 0], atol=1e-18)


def test_beam_against_integration_of_its_curvature():
    """A skew beam: rotation and deflection by integrating moment / EI and moment / GJ along it."""
    EI, GJ = 2e6, 9e5
    span = example_arm().link[3][:3, 3]
    L = np.linalg.norm(span)
    e = span / L
    force, moment = np.array([100.0, -200, 300]), np.array([40.0, 50, -60])
    s = (np.arange(20000) + 0.5) / 20000 * L
    inside = moment + np.cross((L - s)[:, None] * e, force)
    along = (inside @ e)[:, None] * e
    rate = along / GJ + (inside - along) / EI
    turn = rate.sum(axis=0) * L / 20000
    shift = np.cross(rate, (L - s)[:, None] * e).sum(axis=0) * L / 20000
    effect = LinkCompliance(body=(3,), bending_per_Nm2=[1 / EI], torsion_per_Nm2=[1 / GJ], stretch_per_N=[0])
    assert_allclose(
        displacement_of(effect, loaded(3, force, moment)).body[3][0], [*shift, *turn], rtol=1e-6, atol=1e-14
    )


def test_servo_lag():
    v = np.array([SIX, -2 * SIX])
    assert_allclose(displacement_of(ServoLag(lag_s=np.full(6, 1e-3)), states(v=v)).joint, -1e-3 * v)


def test_wrist_coupling():
    given = displacement_of(WristCoupling(k54=1e-3, k64=2e-3, k65=-3e-3), states()).joint
    assert_allclose(given[0], [0, 0, 0, 0, 1e-3 * 0.4, 2e-3 * 0.4 - 3e-3 * 0.5])
    assert_allclose(given[1], [0, 0, 0, 0, 1e-3 * 2.0, 2e-3 * 2.0 - 3e-3 * -1.5])


def test_frame_drift():
    effect = FrameDrift(velocity_m_per_s=[1e-8, 0, -2e-8], turn_rad_per_s=[0, 3e-9, 0])
    given = displacement_of(effect, states(time=np.array([0.0, 1000.0]))).instrument
    assert_allclose(given, [np.zeros(6), [1e-5, 0, -2e-5, 0, 3e-6, 0]])


def test_session():
    state = State(q=np.zeros((4, 6)), session=np.array([0.0, 2, 1, 2]))
    effect = Session(session=("1", "2"), shift_m=[[1e-5, 0, 0], [0, 2e-5, 0]], turn_rad=[[0, 0, 0], [0, 0, 1e-6]])
    step = [0, 2e-5, 0, 0, 0, 1e-6]
    assert_allclose(displacement_of(effect, state).instrument, [np.zeros(6), step, [1e-5, 0, 0, 0, 0, 0], step])


def test_outlier():
    state = State(q=np.zeros((3, 6)), channels={"row": np.arange(3.0)})
    given = displacement_of(Outlier(row=(1,), shift_m=[[0.099, 0, 0]]), state).instrument
    assert_allclose(given, [np.zeros(6), [0.099, 0, 0, 0, 0, 0], np.zeros(6)])


def test_long_bodies_are_upper_arm_and_forearm():
    assert long_bodies(example_arm()) == (2, 4)
    assert long_bodies(example_arm(), 0.3) == (1, 2, 3, 4)


def test_no_link_weighs_less_than_nothing_and_no_joint_is_stiffer_than_rigid():
    arm = example_arm()
    own = float(arm.mass[3])
    for share, possible in ((-1.1, False), (-0.9, True), (3.0, True)):
        assert ArmLoad(body=(3,), mass_kg=[share * own]).impossible(arm, {}).any() != possible
    # c + w / t0 on joint 2: 1e-6 rad/(N m) beside -1e-4 rad over 50 N m, then over 200 N m.
    linear = {"joint_compliance": JointCompliance(compliance_rad_per_Nm=np.full(6, 1e-6))}
    for knee, possible in ((50.0, False), (200.0, True)):
        curve = NonlinearCompliance(windup_rad=[0, -1e-4, 0, 0, 0, 0], knee_Nm=np.full(6, knee))
        assert curve.impossible(arm, linear).any() != possible
        assert not replace(curve, windup_rad=[0, 1e-4, 0, 0, 0, 0]).impossible(arm, linear).any()


def test_how_bodies_accelerate_is_that_of_the_speeds_of_the_state():
    """A second joint that turns as fast gives its body the centripetal acceleration w^2 r; so does a state made anew."""
    robot = load_robot("ur10")
    T = body_poses(robot, np.zeros((1, 6)))
    slow, fast = np.zeros((2, 1, 6))
    slow[:, 0], fast[:, 0] = 1.0, 2.0
    r = float(np.hypot(*(T[0, 6, :2, 3] - T[0, 1, :2, 3])))
    state = State(q=np.zeros((1, 6)), v=slow, robot=robot, T_base_body=T)
    assert state.motions is state.motions and replace(state, v=None).motions is None
    for v in (slow, fast, slow):
        state = state.with_(v=v)
        assert np.linalg.norm(state.motions[6][0]) == pytest.approx(v[0, 0] ** 2 * r)
