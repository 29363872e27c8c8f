"""What somebody who knows the libraries would write first, to set beside the product."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from py_opw_kinematics import KinematicModel, RigidTransform, Robot
from scipy.optimize import least_squares

from postproc.arrays import invert
from postproc.effects.base import Effect
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from tests.independent.rigid_body import RigidBody

GRAVITY = np.array([0.0, 0.0, -9.81])


def pose_loop(model: Model, state: Any, desired: np.ndarray) -> np.ndarray:
    """Commands (n, 6): closed-form inverse kinematics once, then one pinocchio pass for each pose.

    With springs in the joints alone the deflected angles are the nominal ones of the pose, so that the command is
    q - C (J^T w - g), exactly; with springs elsewhere, effects or loads that follow the arm it is not.
    """
    opw = model.robot.opw
    solver = Robot(
        KinematicModel(opw.a1, opw.a2, opw.b, opw.c1, opw.c2, opw.c3, opw.c4, offsets=opw.offsets), degrees=False
    )
    flanges = RigidTransform.from_matrix(desired @ invert(state.T_flange_tcp))
    branches = np.array(solver.reach(flanges, joint_limits=np.tile([10.0, 11.0], (6, 1))).joints)
    far = np.where(np.isnan(branches), np.inf, np.abs(branches - state.q[:, None])).max(axis=2)
    q = branches[np.arange(len(branches)), far.argmin(axis=1)]
    arm = RigidBody(model.robot, model.gravity).model
    flange = pin.SE3(model.robot.link[6][:3, :3], model.robot.link[6][:3, 3])
    tcp = np.broadcast_to(state.T_flange_tcp, (len(q), 4, 4))[0]
    frame = arm.addFrame(pin.Frame("tcp", 6, 0, flange * pin.SE3(tcp[:3, :3], tcp[:3, 3]), pin.FrameType.OP_FRAME))
    data = arm.createData()
    springs = next(e for e in model.effects if isinstance(e, JointCompliance))
    compliance = np.asarray(springs.compliance_rad_per_Nm)
    for i in range(len(q)):
        weight = state.payload_mass[i] * GRAVITY
        gravity = pin.computeGeneralizedGravity(arm, data, q[i])
        J = pin.computeFrameJacobian(arm, data, q[i], frame, pin.LOCAL_WORLD_ALIGNED)
        lever = (data.oMi[6] * flange).act(state.payload_center[i]) - data.oMf[frame].translation
        wrench = state.wrench[i] + np.concatenate([weight, np.cross(lever, weight)])
        q[i] -= compliance * (J.T @ wrench - gravity)
    return q


def fit_by_differences(model: Model, effects: Sequence[Effect], data: Measurements) -> tuple[float, int]:
    """Root mean square residual [m] and number of parameters: scipy's least squares with finite differences.

    Args:
        effects: as the fit may begin; where the instrument stands is known already, which helps.
    """
    ends = np.cumsum([len(effect.vector()) for effect in effects])[:-1]
    scale = np.concatenate([effect.scale() for effect in effects])

    def residual(x: np.ndarray) -> np.ndarray:
        parts = np.split(x * scale, ends)
        real = model.with_effects(*(e.with_vector(part) for e, part in zip(effects, parts, strict=True)))
        return ((predict(real, data.state)[:, :3, 3] - data.position) / 3e-5).ravel()

    start = np.concatenate([effect.vector() for effect in effects]) / scale
    found = least_squares(residual, start, method="lm")
    return 3e-5 * float(np.sqrt(np.mean(found.fun**2))), len(start)
