"""The arm of a task as its controller computes it, for the program that asks (CalcRobT, CalcJointT).

T_frame_object T_displacement T_target = T_base_frame^-1 T_base_flange(q) T_flange_tcp
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from postproc.arrays import Array, invert
from postproc.diagnostics import PostprocError
from postproc.motion.path.places import idle_axes
from postproc.rapid.data.arm import Situation
from postproc.rapid.data.records import NO_AXIS, Ax6, JointTarget, RobTarget
from postproc.rapid.motions.units import matrix_pose, object_matrix, pose_matrix, tool_matrix
from postproc.rapid.unknown import Kind, Unknown
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station
from postproc.robot.configuration import confdata
from postproc.robot.inverse import joint_solution
from postproc.robot.kinematics import forward


@dataclass(frozen=True, slots=True)
class NominalArm:
    """The arm of a task in its cell; it implements the protocol ``rapid.data.arm.Arm``."""

    robot: Robot
    station: Station = field(default_factory=Station)

    def target(self, joints: JointTarget, situation: Situation) -> RobTarget:
        """The robtarget of joint angles, as CalcRobT computes it.

        Args:
            situation: tool, work object, displacement, offset of the external axes and active units in force.

        Raises:
            Unknown: an axis has no position, the configuration cannot be computed, or the work has no known place.
        """
        if max(map(abs, joints.robax)) >= NO_AXIS or self.robot.parallelogram:
            raise Unknown(Kind.UNDEFINED, "CalcRobT")
        q = np.radians([joints.robax])
        T_frame_tcp = self._to_frame(joints.extax, situation) @ forward(self.robot, q)[0] @ tool_matrix(situation.tool)
        pose = matrix_pose(invert(object_matrix(situation.wobj, situation.displacement)) @ T_frame_tcp)
        try:
            a, b, c, d = confdata(self.robot, q)[0].tolist()
        except PostprocError:
            raise Unknown(Kind.UNDEFINED, "CalcRobT") from None
        extax = _shifted(joints.extax, situation.axis_offset, -1.0)
        return RobTarget(pose.trans, pose.rot, (a, b, c, d), extax)

    def joints(self, target: RobTarget, situation: Situation) -> JointTarget:
        """The jointtarget of a robtarget in its configuration, as CalcJointT computes it.

        Args:
            situation: tool, work object, displacement, offset of the external axes and active units in force.

        Raises:
            Unknown: the target cannot be reached in its configuration, or the work has no known place.
        """
        extax = _shifted(target.extax, situation.axis_offset, 1.0)
        T_frame_tcp = object_matrix(situation.wobj, situation.displacement) @ pose_matrix(target.trans, target.rot)
        T_flange = invert(self._to_frame(extax, situation)) @ T_frame_tcp @ invert(tool_matrix(situation.tool))
        try:
            solution = joint_solution(self.robot, T_flange[None], np.array([target.robconf]))
        except PostprocError:
            raise Unknown(Kind.UNDEFINED, "CalcJointT") from None
        if solution.failures:
            raise Unknown(Kind.UNDEFINED, "CalcJointT")
        a, b, c, d, e, f = np.degrees(solution.q[0]).tolist()
        return JointTarget((a, b, c, d, e, f), extax)

    def _to_frame(self, extax: Ax6, situation: Situation) -> Array:
        """T_frame_base (4, 4): the base in the frame that the work stands in, the world or a mechanical unit's end.

        Args:
            extax: [mm], [deg] of the external axes, 9E9 where none is stated.

        Raises:
            Unknown: the unit is not in the cell, or an axis of it has no position.
        """
        idle = idle_axes(situation.units, self.station)
        stated = [NO_AXIS if letter in idle else axis for letter, axis in zip(LETTERS, extax, strict=True)]
        positions = self.station.positions(np.array([stated]))
        unit = None if situation.wobj.ufprog else situation.wobj.ufmec
        if unit is not None and unit.lower() not in self.station.cell.units:
            raise Unknown(Kind.MOVED_OBJECT, situation.wobj.name, unit)
        T_base_frame = self.station.frame(unit, positions)[0]
        if not np.isfinite(T_base_frame).all():
            raise Unknown(Kind.BASE_NOWHERE, self.station.arm, "an axis of the chain has no position here")
        return invert(T_base_frame)


def _shifted(extax: Ax6, offset: Ax6, sign: float) -> Ax6:
    """External axes plus ``sign`` times the offset; an axis at 9E9 stays 9E9."""
    a, b, c, d, e, f = (x if x >= NO_AXIS else x + sign * by for x, by in zip(extax, offset, strict=True))
    return a, b, c, d, e, f
