"""What a base that moves does to the arm: loads against masses followed in space, and the time that its axes take."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.model.chain import deflected_chain, directions
from postproc.model.equilibrium import predict
from postproc.model.file import default_model
from postproc.robot.cells.cell import Cell, CellArm, Joint, Unit
from postproc.robot.cells.station import Station
from tests.cells.test_paths import ARM, axis, converted, track
from tests.independent import arm as A

TICK = 1e-4  # [s]


def standing(t: float, spin: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(1, 3, 3) how a base that starts to turn stands after a short time, to second order."""
    w, a = (np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]]) for x in (spin, rate))
    return (np.eye(3) + w * t + (a + w @ w) * t**2 / 2)[None]


def torques(
    q: np.ndarray, v: np.ndarray, a: np.ndarray, shift: np.ndarray, spin: np.ndarray, rate: np.ndarray
) -> np.ndarray:
    """(6,) joint torques that weight and inertia of point masses ask of the joints, each followed in space."""

    def places(t: float) -> list[np.ndarray]:
        f = ARM.forward((q + v * t + a * t**2 / 2)[None], np.eye(4))
        c = [f.body[b][0, :3, 3] + f.body[b][0, :3, :3] @ ARM.center[b] for b in range(1, 7)]
        return [standing(t, spin, rate)[0] @ p + shift * t**2 / 2 for p in c]

    before, now, later = places(-TICK), places(0.0), places(TICK)
    f = ARM.forward(q[None], np.eye(4))
    parts = []
    for b in range(1, 7):
        acceleration = (later[b - 1] - 2 * now[b - 1] + before[b - 1]) / TICK**2
        parts.append(A.point_load(b, now[b - 1][None], ARM.mass[b] * (A.G - acceleration)))
    return A.spring_loads(f, A.Wrenches(parts))[0][0]


@pytest.mark.parametrize("seed", range(4))
def test_the_load_of_a_base_that_moves_is_that_of_its_masses_in_space(seed: int) -> None:
    g = np.random.default_rng(seed)
    q, v, a = g.uniform(-1, 1, 6), g.uniform(-1, 1, 6), g.uniform(-2, 2, 6)
    shift, spin, rate = g.uniform(-3, 3, 3), g.uniform(-2, 2, 3), g.uniform(-4, 4, 3)
    model = default_model("irb4600_60_205")
    bare = replace(model, robot=replace(model.robot, inertia=np.zeros((7, 3, 3))))
    base = ((A.G - shift)[None], spin[None], rate[None])
    chain = deflected_chain(bare.robot, q[None], {}, False)
    along, arm = directions(bare.robot, chain, ()), bare.multibody((), True)
    found = -arm.rnea(chain, along, v[None], a[None], base)[0]
    assert found == pytest.approx(torques(q, v, a, shift, spin, rate), rel=1e-4, abs=0.05)
    without = -arm.rnea(chain, along, v[None], a[None], (base[0], 0 * base[1], 0 * base[2]))[0]
    assert np.abs(without - found).max() > 1.0  # the spin of the base is felt


def test_a_payload_feels_the_base_as_the_links_do() -> None:
    """A base that speeds up sideways is one that leans: the deflection is that under gravity less its acceleration."""
    model = default_model("irb4600_60_205")
    q, push = np.array([[0.2, 0.3, -0.2, 0.4, 0.9, -0.3]]), np.array([[3.0, -1.0, 0.0]])
    state = model.state(q, payload_mass=np.array([20.0]), payload_center=np.array([[0.0, 0, 0.2]]))
    moving = predict(model, state.with_(gravity=A.G - push))[0, :3, 3]
    still = np.zeros((1, 3))
    spinning = state.with_(gravity=A.G - push, base_spin=still, base_spin_rate=still)
    load = A.Load(20.0, np.array([0, 0, 0.2]), gravity=A.G - push)
    real = A.equilibrium(ARM, q, np.eye(4), load, A.joint_springs(A.TABLE_2)).frames.tcp[0, :3, 3]
    assert moving == pytest.approx(real, abs=1e-8)
    assert predict(model, spinning)[0, :3, 3] == pytest.approx(moving, abs=1e-12)


def test_how_a_base_on_a_turning_column_moves() -> None:
    """Two metres out on a column that turns: centripetal and tangential acceleration, in the axes of the base."""
    column = Unit("COLUMN", (Joint("r", "a", "rotary"),))
    out = np.eye(4)
    out[0, 3] = 2.0
    station = Station(Cell({"column": column}, {"robot": CellArm("robot", "", "COLUMN", out)}), "robot", ("COLUMN",))
    e, v, a = np.zeros((1, 6)), np.zeros((1, 6)), np.zeros((1, 6))
    e[0, 0], v[0, 0], a[0, 0] = 0.7, 0.5, 0.3
    acceleration, spin, rate = station.base_motion(e, v, a)
    assert acceleration[0] == pytest.approx([-2.0 * 0.25, 2.0 * 0.3, 0.0], abs=1e-5)
    assert spin[0] == pytest.approx([0, 0, 0.5], abs=1e-6) and rate[0] == pytest.approx([0, 0, 0.3], abs=1e-5)


@pytest.mark.parametrize(("speed", "least"), [(5.0, 240.0), (1000.0, 150.0)])
def test_a_slow_track_takes_its_time(speed: float, least: float) -> None:
    """1200 mm of track while the torch goes 1500 mm at 10 mm/s: the slower of the two rules."""
    result = converted(replace(track(0.0, 1200.0, 1200.0), axes=axis("a", "linear", "robot", speed=speed)))
    assert least < result.report["cycle_time_s"] < least + 40.0
