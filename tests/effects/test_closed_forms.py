"""Every effect of the library against a formula written here, in plain numpy or by hand."""

from dataclasses import replace
from math import cos, pi, sin, sqrt, tanh

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import State
from postproc.effects.conformance.example import example_arm
from postproc.effects.geometry import long_bodies, weight
from postproc.effects.registry import effect_library
from postproc.robot.kinematics import body_poses

LIBRARY = effect_library()
ARM = example_arm()
ENDS = ARM.link[:, :3, 3]
SIX = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
Q = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-1.0, 0.8, -0.6, 2.0, -1.5, 3.0]])
SIDE = np.array([[1, -1, 0, 1, 1, -1], [-1, -1, 1, 0, 0, 1.0]])
DOWN = np.array([0, 0, -9.81])
QUARTER = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
WARM = State(q=Q, temperature=np.array([25.0, 12.0]), robot=ARM)


def effect(key, **parameters):
    return LIBRARY[key](**parameters)


def row(shape, **entries):
    """Zeros with some entries: `i2_1=5.0` sets [2, 1]."""
    array = np.zeros(shape)
    for name, value in entries.items():
        array[tuple(map(int, name[1:].split("_")))] = value
    return array


def placed(position, rotation=None):
    T = np.eye(4)
    T[:3, 3] = position
    T[:3, :3] = np.eye(3) if rotation is None else rotation
    return T


def bodies(poses, **channels):
    """One state of the example arm in which some bodies stand somewhere, by number."""
    T = np.tile(np.eye(4), (1, 7, 1, 1))
    for body, pose in poses.items():
        T[0, body] = pose
    return State(q=np.zeros((1, 6)), T_base_body=T, **{"robot": ARM, **channels})


def loaded(body, force, moment, robot=ARM):
    load = np.zeros((1, 7, 6))
    load[0, body] = [*force, *moment]
    return State(q=np.zeros((1, 6)), robot=robot, body_load=load, joint_load=np.zeros((1, 6)))


def given(kind, state, part):
    """What an effect gives: `joint`, `tool`, `instrument`, `body 3`, `torque` or `wrench 3`."""
    word, _, number = part.partition(" ")
    moved, load = displacement_of(kind, state), load_of(kind, state)
    parts = {"joint": moved.joint, "tool": moved.tool, "instrument": moved.instrument, "torque": load.joint}
    by_body = {"body": moved.body, "wrench": load.body}
    return by_body[word][int(number)] if number else parts[word]


def wrench(force, point):
    """Force and moment about the base origin."""
    return [[*force, *np.cross(point, force)]]


def beam(force=(0, 0, 0), moment=(0, 0, 0)):
    return loaded(4, force, moment)


def pull(taut, at):
    along = np.array([-1, 0, 1.2]) / sqrt(1 + 1.44)
    return wrench(taut * 300 * (sqrt(1 + 1.44) - 0.5) * along, at)


def waves(angle):
    """The lines of the transmission error below on joints 3 and 6."""
    third = 1e-4 * sin(3 * angle[2]) + 2e-5 * sin(120.5 * angle[2]) + 3e-5 * cos(120.5 * angle[2])
    return [0, 0, third, 0, 0, 1e-6 * cos(angle[5])]


EI, GJ, EA, L = 1.3e6, 0.6e6, 2e8, 0.7
BEAM = effect("link_compliance", body=(4,), bending_per_Nm2=[1 / EI], torsion_per_Nm2=[1 / GJ], stretch_per_N=[1 / EA])
TERMS = {"joint": (3, 3, 6), "order": (3, 120.5, 1)}
PART = {"mass_kg": [20], "moment_kgm": [[20 * 0.5, 0, 0]]}
CASTINGS = {"body": (2, 4), "growth_per_K": 1e-5, "extra_per_K": [0, 3e-6]}
# The strains stand for growth that begins at 22.5 deg C.
LATE = CASTINGS | {"strain": -2.5e-5, "extra_strain": [0, -7.5e-6]}
HOSE = effect("dress_pack", from_m=[0, 0, 0.3], to_m=[0, 0, 0.1], stiffness_N_per_m=300.0, slack_m=0.5)
HUNG = bodies({3: placed((0, 0, 2)), 6: placed((1, 0, 1))})
FEET = {"tilt_rad_per_Nm": [1e-7, 2e-7]}
LEVER = loaded(0, (1000, 0, -5000), (200, 2500, 700))
# tool0's z looks along base x: 0.1 m along it from the flange at (1.05, 0, 1).
WRIST = replace(
    ARM, link=np.concatenate([ARM.link[:6], placed((0.05, 0, 0), [[0, 0, 1], [0, 1, 0], [-1, 0, 0]])[None]])
)
FLANGE = bodies({6: placed((1, 0, 1))}, robot=WRIST)
STATED = replace(FLANGE, payload_mass=np.array([50.0]), payload_center=np.array([[0, 0, 0.1]]))
# The link turns by 90 degrees about x, so that the joint's z is the body's -y.
TURNED = replace(
    ARM,
    link=np.concatenate([ARM.link[:1], placed(ENDS[1], [[1, 0, 0], [0, 0, -1], [0, 1, 0]])[None], ARM.link[2:]]),
    axis=np.concatenate([ARM.axis[:1], [[0, 0, 1]], ARM.axis[2:]]),
)


@pytest.mark.parametrize(
    ("kind", "state", "part", "expected"),
    [
        (effect("instrument_frame", shift_m=[1, 2, 3], turn_rad=[4, 5, 6]), State(Q), "instrument", [1, 2, 3, 4, 5, 6]),
        (effect("tool_frame", shift_m=[1, 2, 3], turn_rad=[4, 5, 6]), State(Q), "tool", [1, 2, 3, 4, 5, 6]),
        (effect("joint_offset", offset_rad=SIX), State(Q), "joint", [SIX, SIX]),
        (effect("link_geometry", shift_m=row((7, 3), i2_1=1e-3), turn_rad=row((7, 3), i2_0=2e-3)),
         State(Q), "body 2", [[0, 1e-3, 0, 2e-3, 0, 0]] * 2),
        (effect("joint_compliance", compliance_rad_per_Nm=np.full(6, 2e-6)),
         State(Q, joint_load=np.array([SIX * 100, -SIX])), "joint", [SIX * 2e-4, -SIX * 2e-6]),
        # A joint stops short on the side from which it came, and trails its speed.
        (effect("backlash", half_gap_rad=np.full(6, 1e-4)), State(Q, approach=SIDE), "joint", -1e-4 * SIDE),
        (effect("servo_lag", lag_s=np.full(6, 1e-3)), State(Q, v=SIDE), "joint", -1e-3 * SIDE),
        (effect("wrist_coupling", k54=1e-3, k64=2e-3, k65=-3e-3),
         State(Q), "joint", [[0, 0, 0, 0, 1e-3 * q[3], 2e-3 * q[3] - 3e-3 * q[4]] for q in Q]),
        (effect("transmission_error", **TERMS, sine_rad=[1e-4, 2e-5, 0], cosine_rad=[0, 3e-5, 1e-6]),
         State(Q), "joint", [waves(q) for q in Q]),
        (effect("thermal_joint_drift", reference_C=22.0, drift_rad_per_K=SIX * 1e-6),
         State(Q, temperature=np.array([22.0, 32.0])), "joint", [np.zeros(6), SIX * 1e-5]),
        # A part on body 3 at (1, 0, 2), turned by 90 degrees about z, 0.2 m along its x; an arm on a wall; two parts.
        (effect("arm_load", body=(3,), mass_kg=[22], moment_kgm=[[22 * 0.2, 0, 0]]),
         bodies({3: placed((1, 0, 2), QUARTER)}), "wrench 3", wrench(22 * DOWN, [1, 0.2, 2])),
        (effect("arm_load", body=(2,), mass_kg=[10], moment_kgm=[[0, 0, 0]]),
         bodies({2: placed((0, 0.5, 1))}, gravity=np.array([9.81, 0, 0])),
         "wrench 2", wrench([98.1, 0, 0], [0, 0.5, 1])),
        (effect("arm_load", body=(3, 3), mass_kg=[10, 12], moment_kgm=np.zeros((2, 3))),
         bodies({3: placed((1, 0, 2))}), "wrench 3", wrench(22 * DOWN, [1, 0, 2])),
        # The balancer -k sin(q2 + q0).
        (effect("gravity_compensator", sine_Nm=[-1800 * cos(0.3)], cosine_Nm=[-1800 * sin(0.3)]),
         State(Q), "torque", [[0, -1800 * sin(q[1] + 0.3), 0, 0, 0, 0] for q in Q]),
        (effect("payload_error", mass_kg=5, moment_kgm=[0, 0, 0.5]),
         FLANGE, "wrench 6", wrench(5 * DOWN, [1.15, 0, 1])),
        (effect("payload_error", fraction=0.1), STATED, "wrench 6", wrench(5 * DOWN, [1.15, 0, 1])),
        # 50 kg that hang 20 mm farther along tool0's z: a pure moment.
        (effect("payload_error", centre_m=[0, 0, 0.02]),
         STATED, "wrench 6", [[0, 0, 0, *np.cross([0.02, 0, 0], 50 * DOWN)]]),
        # A hose from (0, 0, 2.3) to (1, 0, 1.1), taut and slack.
        (HOSE, HUNG, "wrench 6", pull(1, [1, 0, 1.1])),
        (HOSE, HUNG, "wrench 3", pull(-1, [0, 0, 2.3])),
        (replace(HOSE, slack_m=1.6), HUNG, "wrench 6", np.zeros((1, 6))),
        *((effect("thermal_growth", growth_per_K=1.15e-5, strain=1e-5),
           WARM, f"body {b}", [[*(end * (1.15e-5 * dt + 1e-5)), 0, 0, 0] for dt in (5, -8)])
          for b, end in enumerate(ENDS)),
        *((effect("thermal_growth", **one),
           WARM, f"body {b}", [[*(ENDS[b] * rate * dt), 0, 0, 0] for dt in (5 - start, -8 - start)])
          for one, start in ((CASTINGS, 0.0), (LATE, 2.5)) for b, rate in ((2, 1e-5), (4, 1.3e-5))),
        # The pedestal is 0.3 m high: 1000 N along x on it add 300 N m about y at the floor.
        (effect("base_compliance", **FEET),
         LEVER, "body 0", [[2e-7 * 2800 * 0.3, -1e-7 * 200 * 0.3, 0, 1e-7 * 200, 2e-7 * 2800, 0]]),
        (effect("base_compliance", pivot="joint 1", **FEET),
         LEVER, "body 0", [[0, 0, 0, 1e-7 * 200, 2e-7 * 2500, 0]]),
        # Joint 4 turns about x and sits at the end of body 3; a bearing tilts across its axis alone.
        (effect("bearing_tilt", tilt_rad_per_Nm=[0, 0, 0, 1e-7, 0, 0]),
         loaded(3, (0, 0, 0), (50, 60, -70)), "body 3", [[0, 0, 0, 0, 6e-6, -7e-6]]),
        (effect("bearing_tilt", tilt_rad_per_Nm=[0, 1e-6, 0, 0, 0, 0]),
         loaded(1, (0, 0, 0), (10, 20, 30), TURNED), "body 1", [[0, 0, 0, 1e-5, 0, 3e-5]]),
        # The cantilever of the textbook, along x.
        (BEAM, beam((0, 0, 100)), "body 4", [[0, 0, 100 * L**3 / (3 * EI), 0, -100 * L**2 / (2 * EI), 0]]),
        (BEAM, beam((0, 100, 0)), "body 4", [[0, 100 * L**3 / (3 * EI), 0, 0, 0, 100 * L**2 / (2 * EI)]]),
        (BEAM, beam(moment=(0, 0, 80)), "body 4", [[0, 80 * L**2 / (2 * EI), 0, 0, 0, 80 * L / EI]]),
        (BEAM, beam(moment=(0, 80, 0)), "body 4", [[0, 0, -80 * L**2 / (2 * EI), 0, 80 * L / EI, 0]]),
        (BEAM, beam((500, 0, 0), (60, 0, 0)), "body 4", [[500 * L / EA, 0, 0, 60 * L / GJ, 0, 0]]),
        (effect("frame_drift", velocity_m_per_s=[1e-8, 0, -2e-8], turn_rad_per_s=[0, 3e-9, 0]),
         State(Q, time=np.array([0, 1e3])), "instrument", [np.zeros(6), [1e-5, 0, -2e-5, 0, 3e-6, 0]]),
        (effect("session", session=("1", "2"), shift_m=[[1e-5, 0, 0], [0, 2e-5, 0]], turn_rad=row((2, 3), i1_2=1e-6)),
         State(np.zeros((3, 6)), session=np.array([0.0, 2, 1])),
         "instrument", [np.zeros(6), [0, 2e-5, 0, 0, 0, 1e-6], [1e-5, 0, 0, 0, 0, 0]]),
        (effect("reflector", first=("a",), reflector=("b", "c"), shift_m=[[0.1, 0, 0], [0, 0.2, 0.3]]),
         State(np.zeros((4, 6)), reflector=np.array([2, 0, 1, 3]), reflector_names=("a", "b", "c", "d")),
         "tool", [[0, 0.2, 0.3, 0, 0, 0], np.zeros(6), [0.1, 0, 0, 0, 0, 0], np.zeros(6)]),
        (effect("outlier", row=(1,), shift_m=[[0.099, 0, 0]]),
         State(np.zeros((3, 6)), channels={"row": np.arange(3.0)}), "instrument", row((3, 6), i1_0=0.099)),
    ],
)  # fmt: skip
def test_an_effect_gives_what_its_formula_says(kind, state, part, expected):
    assert_allclose(given(kind, state, part), expected, rtol=1e-9, atol=1e-12 if "wrench" in part else 1e-18)


@pytest.mark.parametrize(
    ("law", "at_50", "at_minus_400"),
    [
        ("tanh", tanh(0.5), -tanh(4.0)),
        ("piecewise", 0.5, -1.0),
        ("catalogue", 0.5, -(1 + 0.25 * 2)),
        ("cubic", 0.125, -64.0),
    ],
)
def test_a_nonlinear_spring_follows_its_law(law, at_50, at_minus_400):
    spring = effect("nonlinear_compliance", law=law, windup_rad=np.full(6, 1e-4), knee_Nm=np.full(6, 100.0))
    load = row((2, 6), i0_1=50, i1_1=-400)
    expected = row((2, 6), i0_1=1e-4 * at_50, i1_1=1e-4 * at_minus_400)
    assert_allclose(given(spring, State(Q, joint_load=load), "joint"), expected)


def test_a_hardening_spring_solves_its_equation():
    load, e, t0 = np.linspace(-3000.0, 3000.0, 60).reshape(10, 6), 4e-7, 250.0
    spring = effect("nonlinear_compliance", law="hardening", windup_rad=np.full(6, e * t0), knee_Nm=np.full(6, t0))
    dq = given(spring, State(np.zeros((10, 6)), joint_load=load), "joint")
    assert_allclose(dq / e + dq**3 / (e**3 * t0**2), load, rtol=1e-10, atol=1e-9)


def test_feet_may_be_softest_between_the_axes():
    """A spring of 4e-7 about the axis at 30 degrees from x and 1e-7 across it, written out in its axes."""
    soft, firm, moment = np.array([cos(pi / 6), 0.5]), np.array([-0.5, cos(pi / 6)]), np.array([300.0, -200.0])
    c = 4e-7 * np.outer(soft, soft) + 1e-7 * np.outer(firm, firm)
    feet = effect("base_compliance", pivot="joint 1", tilt_rad_per_Nm=np.diag(c), cross_tilt_rad_per_Nm=c[0, 1])
    expected = 4e-7 * (soft @ moment) * soft + 1e-7 * (firm @ moment) * firm
    assert_allclose(given(feet, loaded(0, (0, 0, 0), (*moment, 50)), "body 0"), [[0, 0, 0, *expected, 0]])


def test_a_skew_beam_bends_as_the_integral_of_its_curvature():
    EI, GJ = 2e6, 9e5
    L = np.linalg.norm(ENDS[3])
    e, force, moment = ENDS[3] / L, np.array([100.0, -200, 300]), np.array([40.0, 50, -60])
    s = (np.arange(20000) + 0.5) / 20000 * L
    inside = moment + np.cross((L - s)[:, None] * e, force)
    along = (inside @ e)[:, None] * e
    rate = along / GJ + (inside - along) / EI
    shift = np.cross(rate, (L - s)[:, None] * e).sum(axis=0) * L / 20000
    skew = effect("link_compliance", body=(3,), bending_per_Nm2=[1 / EI], torsion_per_Nm2=[1 / GJ], stretch_per_N=[0])
    expected = [[*shift, *(rate.sum(axis=0) * L / 20000)]]
    assert_allclose(given(skew, loaded(3, force, moment), "body 3"), expected, rtol=1e-6, atol=1e-14)


def test_an_error_map_is_a_line_and_a_fourier_series_within_its_range_and_flat_beyond():
    low, high = (-10.0, -0.5, -10.0, -10.0, -100.0, -10.0), (10.0, 0.5, 10.0, 10.0, 100.0, 10.0)
    sine, cosine = np.array([[1.0, 2, 3], [4, 5, 6]]) * 1e-5, np.array([[-1.0, 0, 1], [2, -2, 1]]) * 1e-5
    coefficients = {"sine_rad": sine, "cosine_rad": cosine, "slope_rad": [2e-5, 3e-5]}
    error = effect("joint_error_map", joint=(2, 5), order=3, low_rad=low, high_rad=high, **coefficients)

    def series(k, q):
        return sum(sine[k, n - 1] * sin(n * q) + cosine[k, n - 1] * cos(n * q) for n in (1, 2, 3))

    dq = given(error, State(Q), "joint")
    assert_allclose(dq[:, 1], [series(0, q) + 2e-5 * q / pi for q in (0.2, 0.5)])
    assert_allclose(dq[:, 4], [series(1, q) for q in (0.5, -1.5)])  # a full turn comes again
    assert_allclose(given(error.unlimited(), State(Q), "joint")[1, 1], series(0, 0.8) + 2e-5 * 0.8 / pi)
    assert_allclose(error.beyond_range(Q), row((2, 6), i1_1=0.3))


def test_roughness_of_a_map_is_half_a_derivative():
    g, q = np.random.default_rng(3), np.zeros((64, 6))
    error = effect(
        "joint_error_map", joint=(4,), order=5, sine_rad=g.normal(size=(1, 5)), cosine_rad=g.normal(size=(1, 5))
    )
    q[:, 3] = np.linspace(0, 2 * pi, 64, endpoint=False)
    wave = np.fft.fft(given(error, State(q), "joint")[:, 3]) / 64
    energy = 2 * np.sum(np.abs(np.fft.fftfreq(64, 1 / 64)) * np.abs(wave) ** 2)
    assert np.sum((error.roughness() * error.vector()) ** 2) == pytest.approx(energy)


@pytest.mark.parametrize("acceleration", [4.0, None])
def test_a_part_on_a_turntable_is_pulled_outwards_and_back(acceleration):
    """With speed w and acceleration e a mass at radius r pulls outwards by m w^2 r and back by m e r."""
    rates = {"v": row((1, 6), i0_0=1.5)} | ({} if acceleration is None else {"a": row((1, 6), i0_0=acceleration)})
    force = given(effect("arm_load", body=(1,), **PART), bodies({1: placed((0, 0, 0.3))}, **rates), "wrench 1")[0, :3]
    assert_allclose(force, [20 * 1.5**2 * 0.5, -20 * (acceleration or 0.0) * 0.5, -9.81 * 20])


def test_forces_of_a_moving_mass_are_newtons_by_differences_of_its_path():
    """A compact mass has m (g - a) at its place, whatever the arm does."""
    q, v, a = np.random.default_rng(5).normal(size=(3, 8, 6))
    at, mass, h = np.array([0.05, -0.06, 0.1]), 7.0, 1e-4

    def path(t):
        return (body_poses(ARM, q + v * t + a * t**2 / 2)[:, 5] @ np.append(at, 1.0))[:, :3]

    force = mass * (DOWN - (path(h) - 2 * path(0.0) + path(-h)) / h**2)
    moving = State(q, v=v, a=a, robot=ARM, T_base_body=body_poses(ARM, q))
    expected = np.concatenate([force, np.cross(path(0.0), force)], axis=1)
    assert_allclose(weight(moving, 5, [(mass, mass * at)]), expected, rtol=1e-5, atol=1e-4)


def test_how_bodies_accelerate_is_that_of_the_speeds_of_the_state():
    """A joint that turns faster gives its body the centripetal acceleration w^2 r; so does a state made anew."""
    T = body_poses(ARM, np.zeros((1, 6)))
    r = float(np.hypot(*(T[0, 6, :2, 3] - T[0, 1, :2, 3])))
    state = State(np.zeros((1, 6)), v=row((1, 6), i0_0=1.0), robot=ARM, T_base_body=T)
    assert state.motions is state.motions and replace(state, v=None).motions is None
    for speed in (1.0, 2.0, 1.0):
        state = state.with_(v=row((1, 6), i0_0=speed))
        assert np.linalg.norm(state.motions[6][0]) == pytest.approx(speed**2 * r)


@pytest.mark.parametrize(("order", "nearest"), [(1.0, [1.02]), (1.04, [1.0, 1.02, 1.06]), (3.0, [2.5, 2.98, 3.02])])
def test_orders_beside_a_line_come_again_in_every_turn(order, nearest):
    """A wave that does not is a slope in the range of any joint, which no wheel makes."""
    orders = [v.effect.order[-1] for v in effect("transmission_error", joint=(5,), order=(order,)).nearby()]
    assert set(nearest) <= set(orders) and min([*orders, order]) >= 1.0


def test_orders_are_tried_as_high_as_the_angles_tell_them_from_lower_ones():
    """On a grid of 40 degrees, order 5 is order 4 turned back; readings of one place scatter."""
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (40, 6))
    q[:, 1] = np.radians(np.repeat([-80.0, -40.0, 0.0, 40.0, 80.0], 8)) + np.random.default_rng(4).normal(0, 2e-4, 40)
    q[:, 4] = 0.5
    tried = [(*v.effect.joint, *v.effect.order) for v in LIBRARY["transmission_error"].variants(State(q))]
    assert [n for j, n in tried if j == 2] == [1.0, 2.0, 3.0, 4.0]
    assert max(n for j, n in tried if j == 1) == 320 and not any(j == 5 for j, _ in tried)


def test_orders_beside_several_lines_are_those_of_the_new_ones():
    near = effect("transmission_error", joint=(3, 2, 3), order=(5.0, 2.0, 2.5)).nearby(2)
    terms = [tuple(zip(v.effect.joint, v.effect.order, strict=True)) for v in near]
    assert all(first == (3, 5.0) for first, _, _ in terms)
    assert {second for _, second, third in terms if third == (3, 2.5)} >= {(2, 1.5), (2, 2.5), (2, 2.02)}
    assert {third for _, second, third in terms if second == (2, 2.0)} >= {(3, 2.0), (3, 3.0)}
    assert near[0].label == "joint 2, order 1.98; joint 3, order 2.5"
    twins = effect("transmission_error", joint=(3, 3), order=(2.0, 2.5)).nearby(2)
    assert twins and all(len(set(v.effect.order)) == 2 for v in twins)  # one line is not told twice


def test_long_bodies_are_upper_arm_and_forearm():
    assert long_bodies(ARM) == (2, 4)
    assert long_bodies(ARM, 0.3) == (1, 2, 3, 4)


@pytest.mark.parametrize(("share", "possible"), [(-1.1, False), (-0.9, True), (3.0, True)])
def test_no_link_weighs_less_than_nothing(share, possible):
    part = effect("arm_load", body=(3,), mass_kg=[share * float(ARM.mass[3])])
    assert part.impossible(ARM, {}).any() != possible


@pytest.mark.parametrize(
    ("windup", "knee", "possible"), [(-1e-4, 50.0, False), (-1e-4, 200.0, True), (1e-4, 50.0, True)]
)
def test_no_joint_is_stiffer_than_rigid(windup, knee, possible):
    """c + w / t0 on joint 2, with c of 1e-6 rad/(N m)."""
    linear = {"joint_compliance": effect("joint_compliance", compliance_rad_per_Nm=np.full(6, 1e-6))}
    curve = effect("nonlinear_compliance", windup_rad=[0, windup, 0, 0, 0, 0], knee_Nm=np.full(6, knee))
    assert curve.impossible(ARM, linear).any() != possible
