"""The inverse of the model: the real arm reaches what was asked for."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.correction.inverse import command
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
from postproc.model.equilibrium import predict
from postproc.model.file import default_model
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.independent import arm as A
from tests.model.arms import HIGH, LOW, TOOL, loaded, with_more

ARM = default_model()
LINKS = LinkCompliance(body=(2, 4), bending_per_Nm2=[8e-7, 1e-6], torsion_per_Nm2=[1e-6, 2e-6])
OTHERS = (
    Backlash(half_gap_rad=[0, 1e-4, 9e-5, 5e-5, 0, 1e-4]),
    JointOffset(offset_rad=[1e-4, -2e-4, 3e-4, 1e-4, -3e-4, 2e-4]),
    LinkGeometry(shift_m=np.full((7, 3), 2e-4), turn_rad=np.full((7, 3), 3e-4)),
    ToolFrame(shift_m=[5e-4, -5e-4, 2e-4]),
    ServoLag(lag_s=[1e-3] * 6),
    TransmissionError().with_vector(TransmissionError().vector() + 1e-4),
)
EFFECTS = {
    "springs": (),
    "links": (LINKS,),
    "others": OTHERS,
    "all": (LINKS, *OTHERS),
    "gears": (TransmissionError(order=(20.0,) * 6, sine_rad=[3e-4] * 6),),
    "map": (JointErrorMap(sine_rad=np.full((6, 8), 1e-4)),),
    "balancer": (GravityCompensator(sine_Nm=[-3000.0]),),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_the_real_arm_reaches_the_desired_pose(name):
    model, g = with_more(ARM, *EFFECTS[name]), np.random.default_rng(23)
    moving = {"v": 0.3 * g.normal(size=(200, 6)), "a": g.normal(size=(200, 6))}
    state = loaded(model, 200, g, approach=np.sign(g.normal(size=(200, 6))), **moving)
    desired = forward(model.robot, state.q) @ TOOL
    result = command(model, state, desired)
    assert result.residual_m.max() <= 1e-9
    assert np.abs(predict(model, state.with_(q=result.q)) - desired)[:, :3].max() < 2e-9
    assert np.abs(forward(model.robot, result.q) @ TOOL - result.T_base_tcp).max() < 1e-12
    assert np.linalg.norm((predict(model, state) - desired)[:, :3, 3], axis=1).max() > 1e-3
    # Start angles only choose branch and turn.
    near = command(model, state.with_(q=state.q + 0.01 * g.normal(size=(200, 6))), desired).q
    assert np.abs(near - result.q).max() < 1e-8


def test_an_independent_arm_reaches_the_desired_pose():
    other, n = A.irb4600(), 200
    load = A.Load(mass=12.0, center=np.array([0.0, 0.02, 0.1]), force=np.array([200.0, -200, -200]))
    held = {"payload_mass": np.full(n, 12.0), "payload_center": np.tile(load.center, (n, 1))}
    wrench = np.tile([200.0, -200, -200, 0, 0, 0], (n, 1))
    state = loaded(ARM, n, np.random.default_rng(23), wrench=wrench, **held)
    desired = other.forward(state.q, TOOL).tcp
    real = A.equilibrium(other, command(ARM, state, desired).q, TOOL, load, A.joint_springs(A.TABLE_2)).frames.tcp
    assert np.abs(real - desired).max() < 1e-9


def test_a_straight_wrist_is_solved_and_steps_beside_it_are_damped():
    """Without damping (Wampler 1986) a step of a micrometre there turns axes 4 and 6 by whole turns."""
    model, g = with_more(ARM, LINKS), np.random.default_rng(23)
    q = g.uniform(LOW, HIGH, (50, 6))
    q[:, 4] = np.append(0.0, 1e-3 * g.normal(size=49))
    state = model.state(q, T_flange_tcp=TOOL, payload_mass=np.full(50, 10.0))
    residual = command(model, state, forward(model.robot, q) @ TOOL).residual_m
    assert np.quantile(residual, 0.9) <= 1e-9 and residual.max() < 1e-6
    q = np.tile([0.3, 0.2, 0.1, 0.4, 0.0, 0.5], (4, 1))
    q[:, 4] = [1.0, 3e-3, 1e-3, 0.0]
    result = command(model, model.state(q), predict(model, model.state(q)))
    assert result.residual_m.max() <= 1e-6
    assert np.abs(result.q - q).max() < 0.2


def test_an_arm_without_closed_form_is_solved():
    model = Model(load_robot("ur10"), (JointCompliance(compliance_rad_per_Nm=[1e-5] * 6),))
    q = np.random.default_rng(23).uniform(0.3, 1.2, (50, 6))
    desired = forward(model.robot, q)
    result = command(model, model.state(q), desired)
    assert np.abs(predict(model, model.state(result.q)) - desired).max() < 1e-9


@pytest.mark.parametrize("effect", [LINKS, OTHERS[1]], ids=["load", "constant"])
def test_a_pose_out_of_reach_keeps_an_honest_residual(effect):
    model, q = with_more(ARM, effect), np.zeros((2, 6))
    desired = forward(model.robot, q)
    desired[1, 0, 3] += 3.0
    result = command(model, model.state(q), desired)
    assert result.residual_m[0] <= 1e-6 and result.residual_m[1] > 0.1
    assert np.isfinite(result.q).all()


def test_nothing_to_do():
    assert command(ARM, ARM.state(np.zeros((0, 6))), np.zeros((0, 4, 4))).q.shape == (0, 6)
    rigid, q = ARM.with_effects(), np.random.default_rng(23).uniform(LOW, HIGH, (5, 6))
    assert np.abs(command(rigid, rigid.state(q), forward(ARM.robot, q)).q - q).max() < 1e-9
