"""The elastic equilibrium against an independent arm without pinocchio, and against closed forms."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from postproc.effects.base import Displacement, Effect, State, param
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.model.arm import Model
from postproc.model.deflection import Deflection, moved_by, moves
from postproc.model.equilibrium import equilibrium, predict
from postproc.model.file import default_model
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from postproc.robot.pose import rpy
from tests.build import refused
from tests.independent import arm as A
from tests.model.arms import random_arm

RNG = np.random.default_rng(7)
TOOL = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.35], [0, 0, 0, 1]])


class FreeSprings(Effect, reads=("load",)):
    """A full 6 x 6 compliance at the far end of every body, for tests."""

    matrix: np.ndarray = param(unit="mixed", shape=(7, 6, 6), typical=1e-7)

    def displacement(self, state: State) -> Displacement | None:
        if state.body_load is None:
            return None
        return Displacement(body={b: state.body_load[:, b] @ self.matrix[b].T for b in range(7)})


class Rocking(Effect, reads=("load",)):
    """The base turns by a step where the moment on it is above a limit: no number that shows in the step."""

    turn_rad: float = param(unit="rad", low=-0.1, high=0.1, typical=1e-4)

    def displacement(self, state: State) -> Displacement:
        turned = np.zeros((len(state), 6))
        turned[:, 4] = self.turn_rad * (state.body_load[:, 0, 4] > 0)
        return Displacement(body={0: turned})


def channels(n: int) -> dict[str, np.ndarray]:
    return {
        "payload_mass": RNG.uniform(0, 60, n),
        "payload_center": RNG.uniform(-0.2, 0.2, (n, 3)),
        "wrench": RNG.normal(size=(n, 6)) * [200, 200, 200, 50, 50, 50],
    }


def hung(c: dict[str, np.ndarray]) -> A.Load:
    w = c["wrench"]
    return A.Load(mass=c["payload_mass"], center=c["payload_center"], force=w[:, :3], moment=w[:, 3:])


@pytest.mark.parametrize("name", ["irb4600_60_205", "irb4600_60_205_seed"])
def test_shipped_model_agrees_with_an_independent_elastic_arm(name: str) -> None:
    model, other = default_model(name), A.ARMS[name]()
    q, c = RNG.uniform(-1.5, 1.5, (100, 6)), channels(100)
    ours = equilibrium(model, model.state(q, T_flange_tcp=TOOL, **c))
    theirs = A.equilibrium(other, q, TOOL, hung(c), A.joint_springs(A.TABLE_2))
    assert np.abs(ours.T_base_tcp - theirs.frames.tcp).max() < 1e-10
    assert np.abs(ours.state.joint_load - theirs.tau).max() < 1e-5  # type: ignore[operator]
    nominal = forward(model.robot, q) @ TOOL
    assert np.linalg.norm((ours.T_base_tcp - nominal)[:, :3, 3], axis=1).max() > 1e-3


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_springs_at_every_body_agree_with_an_independent_arm(seed: int) -> None:
    robot, other = random_arm(seed)
    q, c = RNG.uniform(-3, 3, (40, 6)), channels(40)
    joints = RNG.uniform(0, 1e-7, 6)
    bodies = RNG.normal(size=(7, 6, 6)) * 2e-9
    model = Model(robot, (JointCompliance(compliance_rad_per_Nm=joints), FreeSprings(matrix=bodies)))
    ours = equilibrium(model, model.state(q, T_flange_tcp=TOOL, **c))
    theirs = A.equilibrium(other, q, TOOL, hung(c), A.body_springs(joints, dict(enumerate(bodies))))
    moved = np.abs(theirs.frames.tcp - other.forward(q, TOOL).tcp).max()
    # Rotations about three axes differ from a rotation vector in second order.
    assert np.abs(ours.T_base_tcp - theirs.frames.tcp).max() < 1e-3 * moved
    rigid = equilibrium(model.with_effects(FreeSprings(matrix=bodies * 1e-6)), model.state(q, T_flange_tcp=TOOL, **c))
    plain = A.equilibrium(other, q, TOOL, hung(c), A.body_springs(joints * 0, dict(enumerate(bodies * 1e-6))))
    assert np.abs(rigid.state.body_load - plain.wrench).max() < 1e-6 * np.abs(plain.wrench).max()  # type: ignore[operator]


def test_inertia_of_links_and_payload_agrees_with_an_independent_arm() -> None:
    robot, other = random_arm(3)
    n = 30
    q, c = RNG.uniform(-3, 3, (n, 6)), channels(n)
    v, a = RNG.normal(size=(n, 6)), RNG.normal(size=(n, 6)) * 3
    springs = np.full(6, 1e-8)
    model = Model(robot, (JointCompliance(compliance_rad_per_Nm=springs),))
    ours = equilibrium(model, model.state(q, T_flange_tcp=TOOL, v=v, a=a, **c))
    load = hung(c)
    theirs = A.equilibrium(
        other, q, TOOL, load, A.joint_springs(springs), extra=lambda f: A.inertial_loads(other, f, v, a, load)
    )
    assert np.abs(ours.state.joint_load - theirs.tau).max() < 1e-6 * np.abs(theirs.tau).max()  # type: ignore[operator]
    assert np.abs(ours.T_base_tcp - theirs.frames.tcp).max() < 1e-11


def test_a_single_spring_droops_as_a_pendulum_does() -> None:
    """One soft joint, horizontal arm, payload at the tool: theta = c m g L cos(theta)."""
    model = default_model()
    soft = np.zeros(6)
    soft[1] = 5e-6
    model = model.with_effects(JointCompliance(compliance_rad_per_Nm=soft))
    q = np.zeros((1, 6))
    loaded = model.state(q, payload_mass=np.array([50.0]), payload_center=np.zeros((1, 3)))
    droop = float(equilibrium(model, loaded).deflection.joint[0, 1])
    x, z = 1.270 - 0.175, 1.570 - 0.495
    arm = A.irb4600()
    weights = [*zip(arm.mass[2:], _centers_about_axis_2(arm), strict=True), (50.0, np.array([x, 0, z]))]
    # The lever of every weight about axis 2 once the arm has turned.
    expected = sum(5e-6 * m * 9.81 * (p[0] * np.cos(droop) + p[2] * np.sin(droop)) for m, p in weights)
    assert droop == pytest.approx(expected, rel=1e-9)
    assert droop > 1e-3


def _centers_about_axis_2(arm: A.Arm) -> list[np.ndarray]:
    f = arm.forward(np.zeros((1, 6)), np.eye(4))
    return [(f.body[b][0, :3, 3] + f.body[b][0, :3, :3] @ arm.center[b]) - [0.175, 0, 0.495] for b in range(2, 7)]


def test_a_cantilever_bends_as_the_textbook_says() -> None:
    """Forearm as a beam, force across its tip: F L^3 / (3 EI) and F L^2 / (2 EI)."""
    robot = load_robot("irb4600_60_205")
    weightless = Model(_without_mass(robot), (LinkCompliance(body=(4,), bending_per_Nm2=[1e-6]),))
    wrist = np.eye(4)
    wrist[:3, 3] = [0, 0, -0.135]
    wrench = np.array([[0, 0, -100.0, 0, 0, 0]])
    state = weightless.state(np.zeros((1, 6)), wrench=wrench, T_flange_tcp=wrist)
    T = predict(weightless, state)[0]
    L = 0.960
    assert T[2, 3] - 1.570 == pytest.approx(-100 * L**3 / 3 * 1e-6, rel=1e-6)
    # A positive turn about y lowers the tip.
    assert np.arctan2(-T[2, 2], T[0, 2]) == pytest.approx(100 * L**2 / 2 * 1e-6, rel=1e-6)


def _without_mass(robot):  # type: ignore[no-untyped-def]
    from dataclasses import replace

    return replace(robot, mass=np.zeros(7), inertia=np.zeros((7, 3, 3)))


def test_gravity_follows_the_mounting() -> None:
    floor = default_model()
    q = np.zeros((1, 6))
    down = predict(floor, floor.state(q))[0, 2, 3] - 1.570
    gantry = Model(floor.robot, floor.effects, R_world_base=rpy(np.array([np.pi, 0, 0])))
    up = predict(gantry, gantry.state(q))[0, 2, 3] - 1.570
    assert down < -1e-4
    assert up == pytest.approx(-down, rel=5e-3)
    assert gantry.gravity == pytest.approx([0, 0, 9.81])
    wall = Model(floor.robot, floor.effects, R_world_base=rpy(np.array([0, np.pi / 2, 0])))
    # The base's x axis points down: axis 1 carries the weight of what stands beside it, the arm sags along +x.
    assert wall.gravity == pytest.approx([9.81, 0, 0])
    side = predict(wall, wall.state(np.radians([[90.0, 0, 0, 0, 0, 0]])))
    assert side[0, 0, 3] > 1e-3


def test_free_fall_carries_nothing() -> None:
    """An arm whose base falls with g feels no load: gravity and the acceleration of a falling body cancel."""
    model = default_model()
    from dataclasses import replace

    weightless = replace(model)
    object.__setattr__(weightless, "R_world_base", np.zeros((3, 3)))
    q = RNG.uniform(-1, 1, (5, 6))
    state = weightless.state(q, payload_mass=np.full(5, 40.0))
    assert np.abs(predict(weightless, state) - forward(model.robot, q)).max() < 1e-14


def test_tool_and_instrument_displacements_stand_where_they_say() -> None:
    robot = load_robot("ur10")
    tool, frame = RNG.normal(size=3) * 1e-3, RNG.normal(size=6)
    model = Model(robot, (ToolFrame(shift_m=tool), InstrumentFrame(shift_m=frame[:3], turn_rad=frame[3:])))
    q = RNG.uniform(-2, 2, (4, 6))
    T = predict(model, model.state(q, T_flange_tcp=TOOL))
    shifted = np.eye(4)
    shifted[:3, 3] = tool
    expected = A.small(frame[None]) @ A.ARMS["ur10"]().forward(q, TOOL).tcp @ shifted
    assert np.abs(T - expected).max() < 1e-12


def test_rows_do_not_depend_on_each_other_and_models_pickle() -> None:
    model = default_model()
    q, c = RNG.uniform(-1.5, 1.5, (20, 6)), channels(20)
    state = model.state(q, T_flange_tcp=TOOL, **c)
    whole = predict(model, state)
    rows = [3, 17]
    # A batch sweeps until its slowest row has settled to 1e-10, so other rows may have settled further than alone.
    assert np.abs(predict(pickle.loads(pickle.dumps(model)), state.rows(rows)) - whole[rows]).max() < 1e-10
    assert predict(model, state.rows(slice(0, 0))).shape == (0, 4, 4)


class Latch(Effect, reads=("load",)):
    """Joint 3 gives way by a step where its load passes a limit."""

    step_rad: np.ndarray = param(unit="rad", shape=(1,), typical=1e-4)

    def displacement(self, state):
        return np.eye(6)[2] * self.step_rad * (state.joint_load[:, 2:3] > 250.0)


@pytest.mark.parametrize("step", [3e-3, -3e-3])
def test_a_joint_that_gives_way_at_a_load_rests_at_that_load(step: float) -> None:
    """Where the step takes off the load that called for it, neither side is an equilibrium: the joint rests between."""
    model, rigid = (default_model().with_effects(Latch(step_rad=np.array([s]))) for s in (step, 0.0))

    def borne(q):
        return equilibrium(rigid, rigid.state(q)).state.joint_load[:, 2]

    q = np.tile([0.1, 0.4, 0.0, 0.3, 0.7, -0.2], (400, 1))
    q[:, 2] = np.linspace(-1.5, 1.5, 400)
    q = np.tile(q[np.argmin(np.abs(borne(q) - 250.0))], (200, 1))
    q[:, 2] += np.linspace(-1e-2, 1e-2, 200)
    moved = equilibrium(model, model.state(q)).chain.q - q
    edge = np.abs(moved[:, 2] - step / 2) < abs(step) / 2 - 1e-7
    load = borne(q + moved)
    np.testing.assert_allclose(load[edge], 250.0, atol=1e-3)
    np.testing.assert_allclose(moved[~edge, 2], step * (load[~edge] > 250.0), atol=1e-7)
    assert (edge.sum() > 10) == (step > 0)


def test_an_arm_of_rubber_is_a_finding() -> None:
    model = default_model().with_effects(JointCompliance(compliance_rad_per_Nm=np.full(6, 0.5e-3)))
    state = model.state(np.zeros((1, 6)), payload_mass=np.array([1e4]))
    assert refused(lambda: equilibrium(model, state))[0].code == "MOD010"
    assert (
        "pose 1"
        in refused(lambda: equilibrium(default_model(), model.state(np.array([[0.0] * 6, [np.nan] * 6]))))[0].message
    )


def test_parts_of_the_way_from_one_deflection_to_another() -> None:
    g = np.random.default_rng(4)
    draw = (g.normal(size=(5, 6)) for _ in range(6))
    old = Deflection(next(draw), {2: next(draw)}, None, None)
    new = Deflection(next(draw), {2: next(draw), 4: next(draw)}, next(draw), None)
    way = moves(new, old)
    half, whole = moved_by(old, new, way / 2), moved_by(old, new, way)
    np.testing.assert_allclose(moves(new, half), way / 2, atol=1e-14)
    np.testing.assert_allclose(moves(new, whole), 0.0, atol=1e-14)
    assert whole.body.keys() == {2, 4} and whole.tool is new.tool


@pytest.mark.parametrize("turn", [0.0, 1e-3])
def test_a_step_at_the_load_of_a_body_gets_its_load(turn: float) -> None:
    """Also at null, where nothing of it shows: it was asked without any load, and failed."""
    robot, g = load_robot("irb4600_60_205"), np.random.default_rng(3)
    q = g.uniform(-0.5, 0.5, (40, 6)) * [6, 1, 1, 1, 1, 1]
    state = State(q=q, payload_mass=np.full(40, 60.0), payload_center=np.zeros((40, 3)))
    rest = equilibrium(Model(robot, (Rocking(turn_rad=turn),)), state)
    turned = predict(Model(robot, (Rocking(turn_rad=turn),)), state)
    plain = predict(Model(robot), state)
    beyond = rest.state.body_load[:, 0, 4] > 0
    assert 0 < beyond.sum() < 40 or turn == 0.0
    moved = np.linalg.norm(turned[:, :3, 3] - plain[:, :3, 3], axis=1) > 1e-6
    np.testing.assert_array_equal(moved, beyond & (turn > 0))
