"""The model that a controller's own configuration gives: the joint compliances of Absolute Accuracy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from postproc.robot.controller import Calibration

FAR_FACTOR = 10.0
"""A compliance farther from what is usual for the joint than by this factor is in another unit, or of another joint."""
SOFTEST = 1e-3  # [rad/(N m)], where nobody says what is usual
STIFFNESS = "joints.stiffness_Nm_per_rad"
UNREAD = "absolute_accuracy.unread"


def controller_model(robot_name: str, calibration: Calibration | None) -> Model:
    """Return the arm with the joint compliances of its Absolute Accuracy calibration; other joints take the library's.

    ``robot.sources`` says where each number comes from and which entries are not used.

    Raises:
        PostprocError: KIN018, there is no calibration, or a value in it is no compliance; those of `load_robot`.
    """
    robot = load_robot(robot_name)
    if calibration is None:
        text = "the controller's configuration has no joint compliances (`Compl` of JOINT_CALIB)"
        help_ = "only a backup of an arm with Absolute Accuracy has them: name a program in it, or `--cell BACKUP`"
        raise PostprocError.of("KIN018", text, help=help_, exit_code=1)
    usual = robot.joint_compliance
    compliance = np.zeros(6) if usual is None else usual.copy()
    for joint, value in calibration.compliance.items():
        least, most = (0.0, SOFTEST) if usual is None else (usual[joint] / FAR_FACTOR, usual[joint] * FAR_FACTOR)
        if not least < value < most:
            text = f"`Compl {value:g}` of `{calibration.entries[joint]}` in JOINT_CALIB is no compliance in rad/(N m)"
            help_ = f"it would have to be between {least:.1g} and {most:.1g}: give a fitted model with -m"
            raise PostprocError.of("KIN018", text, help=help_, exit_code=1)
        compliance[joint] = value
    sources = {**robot.sources, STIFFNESS: _source(calibration, usual is not None)}
    sources[UNREAD] = ", ".join(calibration.unread)
    kind = "controller"
    robot = replace(robot, joint_compliance=compliance, stiffness_source=kind, stiffness_factor=None, sources=sources)
    springs = effect_in_role(Role.JOINT_SPRINGS).null().with_vector(compliance)
    return Model(robot, (springs,), robot_name=robot_name, stiffness_source=kind)


def _source(calibration: Calibration, library: bool) -> str:
    """Say in one sentence where the compliance of each joint comes from.

    Args:
        library: the library knows compliances for the joints without an entry; else these are rigid.
    """
    read = ", ".join(f"joint {j + 1} (`{entry}`)" for j, entry in sorted(calibration.entries.items()))
    rest = " and ".join(str(j + 1) for j in range(6) if j not in calibration.entries)
    told = "as the library has it" if library else "rigid, for nobody says"
    return f"JOINT_CALIB in the controller's MOC.cfg: {read}" + (f"; joint {rest}: {told}" if rest else "")
