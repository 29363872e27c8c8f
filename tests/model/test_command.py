"""The inverse of the model: the real arm reaches what was asked for."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.correction.inverse import command
from postproc.effects.base import Effect
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.library.joints.servo_lag import ServoLag
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium, predict
from postproc.model.file import default_model
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.independent import arm as A

RNG = np.random.default_rng(23)
TOOL = np.array([[0.0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
LOW, HIGH = [-2, -0.4, -0.8, -5, 0.3, -5], [2, 0.9, 0.4, 5, 1.6, 5]
OTHERS: tuple[Effect, ...] = (
    LinkCompliance(body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6]),
    Backlash(half_gap_rad=[0, 1e-4, 9e-5, 5e-5, 0, 1e-4]),
    JointOffset(offset_rad=[1e-4, -2e-4, 3e-4, 1e-4, -3e-4, 2e-4]),
    LinkGeometry(shift_m=np.full((7, 3), 2e-4), turn_rad=np.full((7, 3), 3e-4)),
    ToolFrame(shift_m=[5e-4, -5e-4, 2e-4]),
    ServoLag(lag_s=[1e-3] * 6),
    TransmissionError().with_vector(TransmissionError().vector() + 1e-4),
)


def states(model: Model, n: int):  # type: ignore[no-untyped-def]
    q = RNG.uniform(LOW, HIGH, (n, 6))
    return model.state(
        q,
        T_flange_tcp=TOOL,
        v=RNG.normal(size=(n, 6)) * 0.3,
        a=RNG.normal(size=(n, 6)),
        approach=np.sign(RNG.normal(size=(n, 6))),
        payload_mass=np.full(n, 30.0),
        payload_center=np.tile([0.02, 0.05, 0.15], (n, 1)),
        wrench=np.tile([200.0, -200, -200, 0, 0, 0], (n, 1)),
    )


@pytest.mark.parametrize(
    "effect",
    [
        TransmissionError(order=(20.0,) * 6, sine_rad=[3e-4] * 6),
        JointErrorMap(sine_rad=np.full((6, 8), 1e-4)),
        GravityCompensator(sine_Nm=[-3000.0]),
    ],
    ids=lambda e: e.key,
)
def test_what_follows_the_command_is_reached_in_more_than_one_sweep(effect: Effect) -> None:
    model = default_model()
    model = model.with_effects(*model.effects, effect)
    state = states(model, 100)
    desired = forward(model.robot, state.q) @ TOOL
    result = command(model, state, desired)
    real = predict(model, state.with_(q=result.q))
    assert np.abs(real - desired)[:, :3, 3].max() <= 1e-9


def test_a_pose_out_of_reach_is_given_up_where_a_constant_moves_the_joints() -> None:
    model = default_model()
    model = model.with_effects(*model.effects, JointOffset(offset_rad=[1e-4] * 6))
    far = forward(model.robot, np.zeros((1, 6)))
    far[:, 0, 3] += 3.0
    assert command(model, model.state(np.zeros((1, 6))), far).residual_m[0] > 0.1


@pytest.mark.parametrize("extra", [(), OTHERS[:1], OTHERS[1:], OTHERS])
def test_the_real_arm_reaches_the_desired_pose(extra: tuple[Effect, ...]) -> None:
    model = default_model()
    model = model.with_effects(*model.effects, *extra)
    state = states(model, 300)
    desired = forward(model.robot, state.q) @ TOOL
    result = command(model, state, desired)
    assert result.residual_m.max() <= 1e-9
    real = equilibrium(model, state.with_(q=result.q)).T_base_tcp
    assert np.abs(real - desired)[:, :3].max() < 2e-9
    assert np.abs(forward(model.robot, result.q) @ TOOL - result.T_base_tcp).max() < 1e-12
    before = equilibrium(model, state).T_base_tcp
    assert np.linalg.norm((before - desired)[:, :3, 3], axis=1).max() > 1e-3


def test_an_independent_arm_reaches_the_desired_pose() -> None:
    model, other = default_model(), A.irb4600()
    q = RNG.uniform(LOW, HIGH, (200, 6))
    load = A.Load(mass=12.0, center=np.array([0.0, 0.02, 0.1]), force=np.array([200.0, -200, -200]))
    state = model.state(
        q,
        T_flange_tcp=TOOL,
        payload_mass=np.full(200, 12.0),
        payload_center=np.tile(load.center, (200, 1)),
        wrench=np.tile([200.0, -200, -200, 0, 0, 0], (200, 1)),
    )
    desired = other.forward(q, TOOL).tcp
    result = command(model, state, desired)
    real = A.equilibrium(other, result.q, TOOL, load, A.joint_springs(A.TABLE_2)).frames.tcp
    assert np.abs(real - desired)[:, :3, 3].max() < 1e-9
    assert np.abs(real - desired).max() < 1e-9


def test_start_angles_only_choose_branch_and_turn() -> None:
    model = default_model()
    state = states(model, 100)
    desired = forward(model.robot, state.q) @ TOOL
    exact = command(model, state, desired).q
    near = command(model, state.with_(q=state.q + RNG.normal(size=(100, 6)) * 0.01), desired).q
    assert np.abs(near - exact).max() < 1e-8


def test_a_straight_wrist_and_an_arm_without_closed_form_are_solved() -> None:
    model = default_model()
    model = model.with_effects(*model.effects, OTHERS[0])
    q = RNG.uniform(LOW, HIGH, (50, 6))
    q[:, 4] = RNG.normal(size=50) * 1e-3
    q[0, 4] = 0.0
    desired = forward(model.robot, q) @ TOOL
    result = command(model, model.state(q, T_flange_tcp=TOOL, payload_mass=np.full(50, 10.0)), desired)
    assert np.quantile(result.residual_m, 0.9) <= 1e-9
    assert result.residual_m.max() < 1e-6
    ur = Model(load_robot("ur10"), (JointCompliance(compliance_rad_per_Nm=[1e-5] * 6),))
    q = RNG.uniform(0.3, 1.2, (50, 6))
    desired = forward(ur.robot, q)
    result = command(ur, ur.state(q), desired)
    assert np.abs(equilibrium(ur, ur.state(result.q)).T_base_tcp - desired).max() < 1e-9


def test_steps_near_a_straight_wrist_are_damped() -> None:
    """Without damping (Wampler 1986) a step of a micrometre there turns axes 4 and 6 by whole turns."""
    model = default_model()
    model = model.with_effects(*model.effects, OTHERS[0])
    q = np.tile([0.3, 0.2, 0.1, 0.4, 0.0, 0.5], (4, 1))
    q[:, 4] = [1.0, 3e-3, 1e-3, 0.0]
    result = command(model, model.state(q), predict(model, model.state(q)))
    assert result.residual_m.max() <= 1e-6
    assert np.abs(result.q - q).max() < 0.2


def test_a_pose_out_of_reach_keeps_an_honest_residual() -> None:
    model = default_model()
    model = model.with_effects(*model.effects, OTHERS[0])
    q = np.zeros((2, 6))
    desired = forward(model.robot, q)
    desired[1, 0, 3] += 3.0
    result = command(model, model.state(q), desired)
    assert result.residual_m[0] <= 1e-6
    assert result.residual_m[1] > 0.5
    assert np.isfinite(result.q).all()


def test_nothing_to_do() -> None:
    model = default_model()
    assert command(model, model.state(np.zeros((0, 6))), np.zeros((0, 4, 4))).q.shape == (0, 6)
    rigid = model.with_effects()
    q = RNG.uniform(LOW, HIGH, (5, 6))
    assert np.abs(command(rigid, rigid.state(q), forward(model.robot, q)).q - q).max() < 1e-9
