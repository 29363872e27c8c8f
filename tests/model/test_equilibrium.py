"""The elastic equilibrium against an independent arm without pinocchio, and against closed forms."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.base import Displacement, Effect, State, param
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium, predict
from postproc.model.file import default_model
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from postproc.robot.pose import rpy
from tests.build import refused
from tests.independent import arm as A
from tests.model.arms import TOOL, random_arm

ARM = default_model()


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


class Latch(Effect, reads=("load",)):
    """Joint 3 gives way by a step where its load passes a limit."""

    step_rad: np.ndarray = param(unit="rad", shape=(1,), typical=1e-4)

    def displacement(self, state):
        return np.eye(6)[2] * self.step_rad * (state.joint_load[:, 2:3] > 250.0)


def scene(n: int, reach: float, seed: int) -> tuple[np.ndarray, dict[str, np.ndarray], A.Load]:
    """Joint angles (n, 6), channels with payload and wrench, and the same loads on the independent arm."""
    g = np.random.default_rng(seed)
    mass, center = g.uniform(0, 60, n), g.uniform(-0.2, 0.2, (n, 3))
    w = g.normal(size=(n, 6)) * [200, 200, 200, 50, 50, 50]
    channels = {"payload_mass": mass, "payload_center": center, "wrench": w, "T_flange_tcp": TOOL}
    return g.uniform(-reach, reach, (n, 6)), channels, A.Load(mass=mass, center=center, force=w[:, :3], moment=w[:, 3:])


@pytest.mark.parametrize("name", ["irb4600_60_205", "irb4600_60_205_seed"])
def test_shipped_model_agrees_with_an_independent_elastic_arm(name):
    model, (q, channels, load) = default_model(name), scene(100, 1.5, 7)
    ours = equilibrium(model, model.state(q, **channels))
    theirs = A.equilibrium(A.ARMS[name](), q, TOOL, load, A.joint_springs(A.TABLE_2))
    assert np.abs(ours.T_base_tcp - theirs.frames.tcp).max() < 1e-10
    assert np.abs(ours.state.joint_load - theirs.tau).max() < 1e-5
    nominal = forward(model.robot, q) @ TOOL
    assert np.linalg.norm((ours.T_base_tcp - nominal)[:, :3, 3], axis=1).max() > 1e-3


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_springs_at_every_body_of_a_moving_arm_agree_with_an_independent_one(seed):
    (robot, other), (q, channels, load), g = random_arm(seed), scene(40, 3, seed), np.random.default_rng(seed)
    joints, bodies = g.uniform(0, 1e-7, 6), g.normal(size=(7, 6, 6)) * 2e-9
    v, a = g.normal(size=(40, 6)), 3 * g.normal(size=(40, 6))
    # Rotations about three axes differ from a rotation vector in second order: stiffer springs agree closer.
    for stiff, close in ((1.0, 1e-3), (1e-3, 1e-6)):
        springs = JointCompliance(compliance_rad_per_Nm=stiff * joints), FreeSprings(matrix=stiff * bodies)
        model = Model(robot, springs)
        ours = equilibrium(model, model.state(q, v=v, a=a, **channels))
        theirs = A.equilibrium(
            *(other, q, TOOL, load, A.body_springs(stiff * joints, dict(enumerate(stiff * bodies)))),
            extra=lambda frames: A.inertial_loads(other, frames, v, a, load),
        )
        moved = np.abs(theirs.frames.tcp - other.forward(q, TOOL).tcp).max()
        assert np.abs(ours.T_base_tcp - theirs.frames.tcp).max() < close * moved
        assert np.abs(ours.state.joint_load - theirs.tau).max() < close * np.abs(theirs.tau).max()
        assert np.abs(ours.state.body_load - theirs.wrench).max() < close * np.abs(theirs.wrench).max()


def test_a_single_spring_droops_as_a_pendulum_does():
    """One soft joint, horizontal arm, payload at the tool: theta = c m g L cos(theta)."""
    model = ARM.with_effects(JointCompliance(compliance_rad_per_Nm=[0, 5e-6, 0, 0, 0, 0]))
    loaded = model.state(np.zeros((1, 6)), payload_mass=np.array([50.0]), payload_center=np.zeros((1, 3)))
    droop = float(equilibrium(model, loaded).deflection.joint[0, 1])
    arm = A.irb4600()
    body = arm.forward(np.zeros((1, 6)), np.eye(4)).body
    centers = [body[b][0, :3, 3] + body[b][0, :3, :3] @ arm.center[b] for b in range(2, 7)]
    weights = [*zip(arm.mass[2:], centers, strict=True), (50.0, np.array([1.270, 0, 1.570]))]
    # The lever of every weight about axis 2 once the arm has turned.
    levers = [(p[0] - 0.175) * np.cos(droop) + (p[2] - 0.495) * np.sin(droop) for _, p in weights]
    assert droop == pytest.approx(sum(5e-6 * 9.81 * m * lever for (m, _), lever in zip(weights, levers, strict=True)))
    assert droop > 1e-3


def test_a_cantilever_bends_as_the_textbook_says():
    """Forearm as a beam, force across its tip: F L^3 / (3 EI) and F L^2 / (2 EI)."""
    weightless = replace(ARM.robot, mass=np.zeros(7), inertia=np.zeros((7, 3, 3)))
    model = Model(weightless, (LinkCompliance(body=(4,), bending_per_Nm2=[1e-6]),))
    wrist, L = A.shift(0, 0, -0.135), 0.960
    T = predict(model, model.state(np.zeros((1, 6)), wrench=np.array([[0, 0, -100.0, 0, 0, 0]]), T_flange_tcp=wrist))[0]
    assert T[2, 3] - 1.570 == pytest.approx(-100 * L**3 / 3 * 1e-6, rel=1e-6)
    # A positive turn about y lowers the tip.
    assert np.arctan2(-T[2, 2], T[0, 2]) == pytest.approx(100 * L**2 / 2 * 1e-6, rel=1e-6)


def test_gravity_follows_the_mounting():
    """A gantry sags upwards in its base, an arm on a wall along the axis of its base that points down."""
    floor, gantry, wall = (replace(ARM, R_world_base=rpy(np.array([0, turn, 0]))) for turn in (0, np.pi, np.pi / 2))
    q = np.zeros((1, 6))
    down, up = (predict(arm, arm.state(q))[0, 2, 3] - 1.570 for arm in (floor, gantry))
    assert down < -1e-4 and up == pytest.approx(-down, rel=5e-3)
    assert gantry.gravity == pytest.approx([0, 0, 9.81]) and wall.gravity == pytest.approx([9.81, 0, 0])
    assert predict(wall, wall.state(np.pi / 2 * np.eye(1, 6)))[0, 0, 3] > 1e-3


def test_free_fall_carries_nothing():
    """An arm whose base falls with g feels no load: gravity and the acceleration of a falling body cancel."""
    q = np.random.default_rng(7).uniform(-1, 1, (5, 6))
    state = ARM.state(q, payload_mass=np.full(5, 40.0), gravity=np.zeros((5, 3)))
    assert np.abs(predict(ARM, state) - forward(ARM.robot, q)).max() < 1e-14


def test_tool_and_instrument_displacements_stand_where_they_say():
    g = np.random.default_rng(7)
    tool, frame, q = g.normal(size=3) * 1e-3, g.normal(size=6), g.uniform(-2, 2, (4, 6))
    effects = ToolFrame(shift_m=tool), InstrumentFrame(shift_m=frame[:3], turn_rad=frame[3:])
    model = Model(load_robot("ur10"), effects)
    expected = A.small(frame[None]) @ A.ARMS["ur10"]().forward(q, TOOL).tcp @ A.shift(*tool)
    assert np.abs(predict(model, model.state(q, T_flange_tcp=TOOL)) - expected).max() < 1e-12


def test_rows_do_not_depend_on_each_other_and_models_pickle():
    q, channels, _ = scene(20, 1.5, 7)
    state, some = ARM.state(q, **channels), [3, 17]
    # A batch sweeps until its slowest row has settled to 1e-10, so other rows may have settled further than alone.
    alone = predict(pickle.loads(pickle.dumps(ARM)), state.rows(some))
    assert np.abs(alone - predict(ARM, state)[some]).max() < 1e-10
    assert predict(ARM, state.rows(slice(0, 0))).shape == (0, 4, 4)


@pytest.mark.parametrize("step", [3e-3, -3e-3])
def test_a_joint_that_gives_way_at_a_load_rests_at_that_load(step):
    """Where the step takes off the load that called for it, neither side is an equilibrium: the joint rests between."""
    model, rigid = (ARM.with_effects(Latch(step_rad=np.array([s]))) for s in (step, 0.0))

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


def test_an_arm_of_rubber_is_a_finding():
    model = ARM.with_effects(JointCompliance(compliance_rad_per_Nm=np.full(6, 0.5e-3)))
    (soft,) = refused(lambda: equilibrium(model, model.state(np.zeros((1, 6)), payload_mass=np.array([1e4]))))
    assert (soft.code, soft.message) == ("MOD010", "the deflection of pose 0 does not settle")
    (unknown,) = refused(lambda: equilibrium(ARM, ARM.state(np.array([[0.0] * 6, [np.nan] * 6]))))
    assert unknown.message == "the deflection of pose 1 does not settle"


@pytest.mark.parametrize("turn", [0.0, 1e-3])
def test_a_step_at_the_load_of_a_body_gets_its_load(turn):
    """Also at null, where nothing of it shows: it was asked without any load, and failed."""
    q = np.random.default_rng(3).uniform(-0.5, 0.5, (40, 6)) * [6, 1, 1, 1, 1, 1]
    state = State(q=q, payload_mass=np.full(40, 60.0), payload_center=np.zeros((40, 3)))
    model = Model(ARM.robot, (Rocking(turn_rad=turn),))
    beyond = equilibrium(model, state).state.body_load[:, 0, 4] > 0
    moved = np.linalg.norm((predict(model, state) - predict(Model(ARM.robot), state))[:, :3, 3], axis=1) > 1e-6
    assert 0 < beyond.sum() < 40 or turn == 0.0
    np.testing.assert_array_equal(moved, beyond & (turn > 0))
