"""What the tool and the footing feel, against finite differences of an arm written apart from the product."""

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.identification.curves.signal import Signal
from postproc.identification.curves.derived import felt_by_tool, leaning, overturning
from postproc.robot.catalogue import load_robot
from tests.independent.arm import irb4600

G = np.array([0.0, 0.0, -9.81])


def overturned(state, others=()):
    blocks, wide = overturning(state, others)
    return [*(p for some in blocks for p in some), *wide]


def test_the_weight_that_a_moving_tool_feels_is_that_of_gravity_less_its_acceleration():
    g = np.random.default_rng(4)
    q, v, a = (g.uniform(-size, size, (6, 6)) for size in (1.0, 2.0, 8.0))
    arm, tool, h = irb4600(), np.eye(4), 1e-4
    tool[:3, 3] = [0.1, 0.0, 0.4]
    now, before, after = (arm.forward(q + t * v + 0.5 * t**2 * a, tool) for t in (0.0, -h, h))
    acceleration = (after.tcp - 2 * now.tcp + before.tcp)[:, :3, 3] / h**2
    mass = np.arange(1.0, 7.0)
    state = State(
        q=q, T_base_body=np.stack(now.body, axis=1), gravity=G, v=v, a=a, robot=load_robot("irb4600_60_205"),
        payload_mass=mass, T_flange_tcp=tool,
    )  # fmt: skip
    felt = {what: along for what, _, along, _ in felt_by_tool(state, now.tcp[:, :3, 3])}
    wanted = mass[:, None] * (G - acceleration)
    turn = now.tcp[:, :3, :3]
    assert felt["payload's weight"] == pytest.approx(np.einsum("nji,nj->ni", turn, wanted), abs=0.01)


def test_the_footing_feels_the_moment_about_its_own_place():
    push = np.array([300.0, -200.0, 500.0, -40.0, 120.0, 90.0])
    load = np.zeros((6, 1, 6))
    load[:, 0, 0] = push
    robot = SimpleNamespace(link=np.eye(4)[None].copy())
    robot.link[0, 2, 3] = 0.5
    found = {p.text: p for p in overturned(SimpleNamespace(body_load=load, robot=robot))}
    curved = found["growing with the square of the overturning moment about y, to its side"]
    assert curved.values == pytest.approx(push * np.abs(push) / 500.0**2)
    assert curved.where == "base"


def test_a_footing_may_soften_with_a_column_of_words():
    push, wet = np.array([[300.0, -200.0], [-50.0, 500.0], [120.0, 90.0]]), np.array([0.0, 1.0, 1.0])
    load = np.zeros((3, 1, 6))
    load[:, 0, :2] = push
    robot = SimpleNamespace(link=np.eye(4)[None].copy())
    robot.link[0, 2, 3] = 0.5
    ground = Signal(("ground",), wet, "wet", "", "wet")
    found = {p.text: p for p in overturned(SimpleNamespace(body_load=load, robot=robot), [ground])}
    tilted = found["the overturning moment about x and about y times ground wet"]
    moment = 0.5 * np.stack([-push[:, 1], push[:, 0]], axis=1) * wet[:, None]
    assert tilted.values == pytest.approx(moment / np.abs(moment).max())
    assert tilted.where == "base" and tilted.channels[0] == "ground"


def test_a_base_leans_about_a_point_below_it_as_the_moment_turns_it():
    """A turn about the pivot moves a point as the same turn and a shift of the base do."""
    g = np.random.default_rng(5)
    lean, points, below = g.normal(0, 800.0, (7, 3)), g.uniform(-1, 1, (7, 3)), np.array([0.0, 0.0, 0.4])
    tip = lean * [1.0, 1.0, 0.0] / np.linalg.norm(lean[:, :2], axis=1, keepdims=True)
    turn, shift = np.moveaxis(leaning(lean), 2, 0)
    wanted = np.cross(tip, points + below)
    assert np.cross(turn, points) + below[2] * shift == pytest.approx(wanted)


def test_a_footing_on_air_softens_as_its_pressure_falls():
    load, pressure = np.random.default_rng(6).normal(0, 500.0, (40, 1, 6)), np.linspace(2.0, 6.0, 40)
    robot = SimpleNamespace(link=np.eye(4)[None].copy())
    air = Signal(("cushion_bar",), pressure, "air", "", "cushion_bar")
    found = {p.text: p for p in overturned(SimpleNamespace(body_load=load, robot=robot), [air])}
    soft = found["the overturning moment times one over cushion_bar"]
    wanted = np.hypot(load[:, 0, 3], load[:, 0, 4]) / pressure
    assert soft.values == pytest.approx(wanted / wanted.max()) and soft.where == "base, as it leans"
