"""A robot from a URDF file, read by pinocchio."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.robot.arm import Robot
from postproc.robot.catalogue import ACCELERATION
from postproc.robot.opw import derive

ENDLESS = 2 * np.pi
"""A joint without limits turns so far to either side: poses are drawn inside limits."""


def read_urdf(path: Path) -> Robot:
    """The six-axis arm of a URDF file; its flange is the frame ``tool0``, else ``flange``, else the last one.

    Raises:
        PostprocError: KIN007, not a URDF or not a serial arm with six turning joints.
    """
    import pinocchio

    pin: Any = pinocchio
    try:
        model = pin.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError) as error:
        raise _wrong(path, f"not a URDF of a robot: {error}") from error
    serial = all(model.parents[i] == i - 1 for i in range(1, model.njoints))
    if model.nv != 6 or model.njoints != 7 or not serial:
        raise _wrong(
            path,
            f"{model.njoints - 1} moving joints in a {'chain' if serial else 'tree'}; six in a chain are needed",
        )
    data = model.createData()
    q = pin.neutral(model)
    pin.computeJointJacobians(model, data, q)
    motion = np.array([pin.getJointJacobian(model, data, i, pin.ReferenceFrame.LOCAL)[:, i - 1] for i in range(1, 7)])
    if np.abs(motion[:, :3]).max() > 1e-12:
        raise _wrong(path, "the arm has sliding joints; six turning joints are needed")
    named = {f.name: f for f in model.frames if f.parentJoint == 6}
    flange = named.get("tool0") or named.get("flange") or list(named.values())[-1]
    link = np.array([model.jointPlacements[i].homogeneous for i in range(1, 7)] + [flange.placement.homogeneous])
    endless = np.array([model.joints[i].nq == 2 for i in range(1, 7)])
    first = np.array([model.joints[i].idx_q for i in range(1, 7)])
    lower = np.where(endless, -ENDLESS, np.array(model.lowerPositionLimit)[first])
    upper = np.where(endless, ENDLESS, np.array(model.upperPositionLimit)[first])
    if not (lower < upper).all():
        raise _wrong(path, "a lower limit is not below its upper limit")
    speed = np.array(model.velocityLimit)
    effort = np.array(model.effortLimit)
    return Robot(
        name=str(model.name),
        link=link,
        axis=motion[:, 3:],
        lower=lower,
        upper=upper,
        speed=np.where((speed > 0) & np.isfinite(speed), speed, np.pi),
        acceleration=np.array(ACCELERATION),
        jerk=10 * np.array(ACCELERATION),
        mass=np.array([0.0] + [i.mass for i in list(model.inertias)[1:]]),
        center=np.array([np.zeros(3)] + [i.lever for i in list(model.inertias)[1:]]),
        inertia=np.array([np.zeros((3, 3))] + [i.inertia for i in list(model.inertias)[1:]]),
        torque=effort if np.isfinite(effort).all() and (effort > 0).all() else None,
        opw=derive(link, motion[:, 3:]),
        sources={"robot": f"URDF {path.name}; accelerations and jerks are estimates"},
    )


def _wrong(path: Path, message: str) -> PostprocError:
    return PostprocError.of("KIN007", f"`{path}`: {message}", help="give the URDF of one six-axis arm")
