"""Channels by name, against plain numpy over the recorded numbers."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.channels.expression import channel, in_order
from postproc.channels.sight import Site, moved_by_reading
from postproc.channels.state import State
from postproc.channels.tool import leaning
from postproc.channels.units import recorded, shown, within
from postproc.robot.catalogue import load_robot
from tests.channels.build import SITE, full_state, seen_points, tool_points, turned
from tests.independent.arm import ARMS

STATE = full_state(v=None, a=None)
MOVING = full_state()
AXES, POINTS = tool_points(STATE)
SEEN = seen_points(POINTS)
LEVEL = np.hypot(SEEN[:, 0], SEEN[:, 1])
DISTANCE = np.sqrt((SEEN**2).sum(axis=1))
LEAN = np.array(
    [m + np.cross([0, 0, 0.5], f) for f, m in zip(*np.split(STATE.body_load[:, 0], 2, axis=1), strict=True)]
)
BEAM = np.array([axes.T @ turned(-1, seen) / d for axes, seen, d in zip(AXES, SEEN, DISTANCE, strict=True)])


def along_tool(vectors):
    return np.array([axes.T @ v for axes, v in zip(AXES, np.broadcast_to(vectors, AXES.shape[:2]), strict=True)])


GRAVITY = along_tool(STATE.gravity)
FORCE = along_tool(STATE.wrench[:, :3])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("q2", STATE.q[:, 1]),
        ("v6", MOVING.v[:, 5]),
        ("a1", MOVING.a[:, 0]),
        ("dir4", STATE.approach[:, 3]),
        ("load3", STATE.joint_load[:, 2]),
        ("temperature", STATE.temperature),
        ("time", STATE.time),
        ("payload", STATE.payload_mass),
        ("session", STATE.session),
        ("fy", STATE.wrench[:, 1]),
        ("rail_m", STATE.channels["rail_m"]),
        ('"oil level"', STATE.channels["oil level"]),
        ("2.5", np.full(len(STATE), 2.5)),
        ("abs(q2)", np.sqrt(STATE.q[:, 1] ** 2)),
        ("q1 + q2 - q3", STATE.q @ [1, 1, -1, 0, 0, 0]),
        ("abs(q1 - load2)", np.abs(STATE.q[:, 0] - STATE.joint_load[:, 1])),
        ("1 - rail_m", 1 - STATE.channels["rail_m"]),
        ("x", POINTS[:, 0]),
        ("y", POINTS[:, 1]),
        ("z", POINTS[:, 2]),
        ("radius", np.sqrt(POINTS[:, 0] ** 2 + POINTS[:, 1] ** 2)),
        ("seen_elevation", np.arcsin(SEEN[:, 2] / DISTANCE)),
        ("seen_distance", DISTANCE),
        ("beam_to_x", np.arccos(BEAM[:, 0])),
        ("beam_to_z", np.arccos(BEAM[:, 2])),
        ("beam_around_x", np.angle(BEAM[:, 1] + 1j * BEAM[:, 2])),
        ("beam_around_y", np.angle(BEAM[:, 2] + 1j * BEAM[:, 0])),
        ("gravity_y", GRAVITY[:, 1]),
        ("weight_z", STATE.payload_mass * GRAVITY[:, 2]),
        ("force_x", FORCE[:, 0]),
        ("lean(0 rad)", LEAN[:, 0]),
        ("lean(90 deg)", LEAN[:, 1]),
        ("lean(30 deg)", LEAN[:, 0] * np.sqrt(3) / 2 + LEAN[:, 1] / 2),
        ("leaning", np.sqrt(LEAN[:, 0] ** 2 + LEAN[:, 1] ** 2)),
    ],
)
def test_a_channel_has_the_values_that_its_name_says(name, values):
    state = MOVING if name in ("v6", "a1") else STATE
    assert_allclose(channel(name).values(state, SITE), values, atol=1e-9)
    assert channel(name).name == name


@pytest.mark.parametrize(("name", "points"), [("azimuth", POINTS), ("seen_azimuth", SEEN)])
@pytest.mark.parametrize("middle", [0.0, 2.0, -170.0])
def test_an_azimuth_lies_within_half_a_turn_of_its_middle(name, points, middle):
    """The same direction, and no jump but opposite to the middle."""
    degrees = middle < -3
    values = channel(f"{name}({middle:g} {'deg' if degrees else 'rad'})").values(STATE, SITE)
    assert_allclose(
        np.stack([np.cos(values), np.sin(values)], axis=1) * np.hypot(*points.T[:2])[:, None], points[:, :2]
    )
    assert np.abs(values - (np.radians(middle) if degrees else middle)).max() <= np.pi


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        ("q2 + v1", {"v": None}),
        ("load3", {"joint_load": None}),
        ("temperature", {"temperature": None}),
        ("lag(pressure, 60 s)", {}),
        ("x", {"T_base_body": None}),
        ("gravity_x", {"T_base_body": None}),
        ("force_x", {"wrench": None}),
        ("fx", {"wrench": None}),
        ("weight_y", {"payload_mass": None}),
        ("acceleration_y", {}),
        ("lean(0 rad)", {"body_load": None}),
        ("leaning", {"robot": None}),
    ],
)
def test_a_channel_that_was_not_recorded_has_no_values(name, missing):
    assert channel(name).values(STATE.with_(**missing), SITE) is None


@pytest.mark.parametrize(
    ("name", "reads"),
    [
        ("q2", ("q",)),
        ("dir5", ("approach",)),
        ("load3", ("load",)),
        ("q7", ("q7",)),  # a column of that name
        ("fz", ("wrench",)),
        ("abs(load3)", ("load",)),
        ("q2 + temperature", ("q", "temperature")),
        ("1 - rail_m", ("rail_m",)),
        ("lag(temperature, 60 s)", ("temperature", "time")),
        ("creep(load3, 60 s)", ("load", "time")),
        ("play(load2, 5 N m)", ("load",)),
        ("before(payload)", ("payload", "q")),
        ("rise(temperature)", ("temperature", "q")),
        ("azimuth(0 rad)", ("pose", "robot")),
        ("beam_to_x", ("pose", "robot")),
        ("lean(0 rad)", ("load", "pose", "robot")),
        ("acceleration_x", ("pose", "robot", "v", "a")),
        ("weight_x", ("pose", "robot", "payload")),
    ],
)
def test_an_effect_declares_what_its_channel_reads(name, reads):
    assert channel(name).reads == reads


def late(x, time, constant, settled):
    """T dz/dt = x - z in steps of a second, x linear between its times."""
    fine = np.arange(time[0], time[-1] + 1.0, 1.0)
    signal, z = np.interp(fine, time, x), [x[0] if settled else 0.0]
    for before, now in itertools.pairwise(signal):
        z.append(z[-1] + (0.5 * (before + now) - z[-1]) / constant)
    return np.interp(time, fine, z)


@pytest.mark.parametrize(("head", "settled"), [("lag", True), ("creep", False)])
def test_what_follows_late_is_the_solution_of_its_equation(head, settled):
    """Rows in any order of time; a minute is 60 s."""
    shuffled = STATE.rows(np.random.default_rng(1).permutation(len(STATE)))
    name = f"{head}(temperature, 20 min)"
    expected = late(STATE.temperature, STATE.time, 1200.0, settled)
    for state in (STATE, shuffled):
        found = in_order([channel(name)], state).channels[name]
        assert_allclose(found[np.argsort(state.time)], expected, atol=2e-2)
    assert np.ptp(expected) > 1.0


def test_creep_follows_a_load_that_jumps_by_its_exponential():
    time = np.array([0.0, 1e-3, 100.0, 300.0, 1000.0])
    state = State(q=np.zeros((5, 6)), time=time, joint_load=np.outer([0.0, 50.0, 50.0, 50.0, 50.0], np.ones(6)))
    found = in_order([channel("creep(load2, 200 s)")], state).channels["creep(load2, 200 s)"]
    assert_allclose(found, 50 * (1 - np.exp(-time / 200)), atol=1e-3)


@pytest.mark.parametrize(
    ("name", "reach", "x"),
    [("play(q2, 40 mrad)", 0.04, STATE.q[:, 1]), ("play(load2, 90 N m)", 90.0, STATE.joint_load[:, 1])],
)
def test_play_is_where_in_its_gap_a_dragged_slide_lies(name, reach, x):
    """A slide with so much room to either side stays where it is until an end takes it along."""
    x = 0.1 * x
    place, expected = x[0], []
    for at in x:
        place = min(max(place, at - reach), at + reach)
        expected.append((at - place) / reach)
    state = STATE.with_(q=0.1 * STATE.q, joint_load=0.1 * STATE.joint_load)
    found = in_order([channel(name)], state).channels[name]
    assert_allclose(found, expected, atol=1e-9)
    assert set(np.sign(found)) == {-1.0, 0.0, 1.0} and (np.abs(found) < 1).sum() > 2


def test_the_row_before_is_that_of_the_last_row_in_which_a_joint_moved():
    """Rows 1 and 2, and rows 4 and 5, stand still; row 3 begins a session."""
    q = np.zeros((6, 6))
    q[:, 1] = [0.1, 0.2, 0.2, 0.5, 0.9, 0.9]
    state = State(q=q, payload_mass=np.arange(6.0), session=np.array([0, 0, 0, 1, 1, 1]))
    names = ["before(q2)", "rise(q2)", "before(payload)", "rise(payload)", "abs(rise(q2))"]
    seen = in_order(map(channel, names), state)
    assert_allclose(seen.channels["before(q2)"], [0.1, 0.1, 0.1, 0.5, 0.5, 0.5])
    assert_allclose(seen.channels["rise(q2)"], [0.0, 0.1, 0.1, 0.0, 0.4, 0.4])
    assert_allclose(seen.channels["before(payload)"], [0, 0, 0, 3, 3, 3])
    assert_allclose(seen.channels["rise(payload)"], [0, 1, 1, 0, 1, 1])
    assert channel("abs(rise(q2))").values(seen) == pytest.approx([0.0, 0.1, 0.1, 0.0, 0.4, 0.4])


def test_channels_of_the_order_are_filled_in_from_the_inside_once():
    inner, outer = "lag(temperature, 600 s)", "play(lag(temperature, 600 s), 0.5 K)"
    assert channel(outer).ordered == (inner, outer) and channel("abs(q2)").ordered == ()
    found = in_order([channel(outer)], STATE)
    x = found.channels[inner]
    alone = in_order([channel("play(warm, 0.5 K)")], STATE.with_(channels={"warm": x})).channels["play(warm, 0.5 K)"]
    assert_allclose(found.channels[outer], alone)
    known = found.with_(temperature=None)
    assert_allclose(channel(outer).values(known), alone)
    assert in_order([channel(outer)], known).channels[inner] is x


@pytest.mark.parametrize(
    ("name", "at_rest"),
    [
        ("lag(temperature, 9 s)", STATE.temperature),
        ("before(q2)", STATE.q[:, 1]),
        ("play(q2, 1 mrad)", 0.0),
        ("rise(q2)", 0.0),
    ],
)
def test_without_an_order_a_state_is_at_rest(name, at_rest):
    assert_allclose(channel(name).values(STATE), np.broadcast_to(at_rest, len(STATE)))


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("", "there is no name"),
        ("q1 + ", "a channel is expected behind `q1 +`"),
        ("q1 q2", "`q2` is left over"),
        ("log(q1)", "`log` is no function: abs, lag, creep, play, before, rise, azimuth, seen_azimuth, lean"),
        ("lag(temperature)", "`lag` needs a number behind a comma, as in `lag(temperature, 2640 s)`"),
        ("lag(temperature, soon)", "`lag` needs a number with its unit: rad, mrad, deg"),
        ("lag(temperature, 5 days)", "`lag` needs a number with its unit"),
        ("lag(temperature, 0 s)", "`lag` needs a number above zero"),
        ("play(q2, -1 mrad)", "`play` needs a number above zero"),
        ("azimuth(3 s)", "`azimuth` needs an angle"),
        ("abs(q1", "`)` is missing behind `abs(q1`"),
        ("abs()", "a channel is expected behind `abs(`"),
    ],
)
def test_a_name_that_cannot_be_read_says_why(name, why):
    with pytest.raises(ValueError) as caught:
        channel(name)
    assert str(caught.value).startswith(why)


def test_the_tool_feels_gravity_less_its_own_acceleration():
    """Finite differences of an arm written apart from the product; the point is 0.2 m off the tool's origin."""
    g, h = np.random.default_rng(4), 1e-4
    q, v, a = (g.uniform(-size, size, (6, 6)) for size in (1.0, 2.0, 8.0))
    tool, point, mass = np.eye(4), np.array([0.2, 0.0, 0.0]), np.arange(1.0, 7.0)
    tool[:3, 3] = [0.1, 0.0, 0.4]
    arm = ARMS["irb4600_60_205"]()
    now, before, after = (arm.forward(q + t * v + 0.5 * t**2 * a, tool) for t in (0.0, -h, h))
    places = [f.tcp[:, :3, 3] + f.tcp[:, :3, :3] @ point for f in (before, now, after)]
    acceleration = (places[0] - 2 * places[1] + places[2]) / h**2
    state = State(
        q=q, T_base_body=np.stack(now.body, axis=1), gravity=np.array([0.0, 0.0, -9.81]), v=v, a=a,
        robot=replace(load_robot(arm.name), link=arm.link), payload_mass=mass, T_flange_tcp=tool,
    )  # fmt: skip
    site = Site(tuple(point))
    weight = mass[:, None] * (state.gravity - acceleration)
    for kind, vectors in (("acceleration", acceleration), ("weight", weight)):
        felt = np.stack([channel(f"{kind}_{axis}").values(state, site) for axis in "xyz"], axis=1)
        assert_allclose(felt, np.einsum("nji,nj->ni", now.tcp[:, :3, :3], vectors), atol=0.02)


@pytest.mark.parametrize("reading", ["azimuth", "elevation", "distance", "scale"])
def test_an_error_of_a_reading_moves_the_point_as_spherical_coordinates_do(reading):
    read = [np.arctan2(SEEN[:, 1], SEEN[:, 0]), np.arctan2(SEEN[:, 2], LEVEL), DISTANCE]
    number, size = {"azimuth": (0, 1.0), "elevation": (1, 1.0), "distance": (2, 1.0), "scale": (2, DISTANCE)}[reading]

    def cartesian(step):
        turn, up, far = (x + step * (k == number) * size for k, x in enumerate(read))
        return np.stack([far * np.cos(up) * np.cos(turn), far * np.cos(up) * np.sin(turn), far * np.sin(up)], axis=1)

    assert_allclose(moved_by_reading(SEEN, reading), (cartesian(1e-6) - cartesian(-1e-6)) / 2e-6, atol=1e-8)


def test_a_base_leans_about_a_point_below_it_as_the_moment_turns_it():
    """A turn about the pivot moves a point as the same turn and a shift of the base do."""
    below = np.array([0.0, 0.0, 0.4])
    tip = LEAN * [1.0, 1.0, 0.0] / np.linalg.norm(LEAN[:, :2], axis=1, keepdims=True)
    turn, shift = np.moveaxis(leaning(LEAN), 2, 0)
    assert_allclose(np.cross(turn, POINTS) + below[2] * shift, np.cross(tip, POINTS + below))


def test_channels_of_a_table_are_those_that_vary():
    state = STATE.with_(channels={**STATE.channels, "still": np.ones(len(STATE)), "lag(q2, 5 s)": STATE.q[:, 1]})
    found = recorded(state.with_(payload_mass=np.full(len(STATE), 4.0), time=np.full(len(STATE), np.nan)), SITE)
    joints = {f"{name}{j}" for name in ("q", "dir", "load") for j in range(1, 7)}
    assert set(found) == joints | {
        "temperature",
        "session",
        "fx",
        "fy",
        "fz",
        "x",
        "y",
        "z",
        "rail_m",
        "oil level",
        "row",
    }
    assert_allclose(found["y"], POINTS[:, 1])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (shown("q2", np.radians(22.0)), "22 deg"),
        (shown("q1 + q2", np.radians(-3.25)), "-3.25 deg"),
        (shown("z", 1.2345), "1234 mm"),
        (shown("rail_m", 2.5), "2.5"),
        (within("q1", np.radians(21.78), np.radians(23.04)), "22.41 ± 0.63 deg"),
        (within("time", -20.0, 45.0), "0 ± 45 s"),
        (within("payload", 29.99, 30.01), "30 kg"),
    ],
)
def test_values_are_shown_in_the_unit_of_the_shop(text, expected):
    assert text == expected
