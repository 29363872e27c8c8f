"""The arm that runs a program, as far as RAPID asks: places from joint angles (CalcRobT) and back (CalcJointT)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from postproc.rapid.data.records import Ax6, JointTarget, Pose, RobTarget, ToolData, WobjData
from postproc.rapid.data.values import Data, as_pose, rounded, to_jointtarget, to_robtarget, to_tool, to_wobj
from postproc.rapid.unknown import Kind, Unknown


@dataclass(frozen=True, slots=True)
class Situation:
    """What a place and the joint angles there depend on, beside the arm.

    Args:
        displacement: that of the program (PDispSet); axis_offset: of the external axes (EOffsSet) [mm or deg].
        units: mechanical units that the program has switched, with whether they are active now.
    """

    tool: ToolData
    wobj: WobjData
    displacement: Pose
    axis_offset: Ax6
    units: tuple[tuple[str, bool], ...]


class ControllerArm(Protocol):
    """An arm as its controller computes it."""

    def target(self, joints: JointTarget, situation: Situation) -> RobTarget:
        """Pose of the TCP in the object frame, configuration and external axes at these joint angles.

        Raises:
            Unknown: the place of the robot base or of the work is not known, or the arm has no configuration data.
        """

    def joints(self, target: RobTarget, situation: Situation) -> JointTarget:
        """Joint angles [deg] and external axes at which the TCP stands on the target, in the target's configuration.

        Raises:
            Unknown: the place of the robot base or of the work is not known, the arm has no configuration data, or it
                does not reach the target.
        """


BY_ARM = frozenset({"calcrobt", "calcjointt"})
"""Functions that an arm is needed for, by lower-case name."""


def call_by_arm(
    arm: ControllerArm | None,
    name: str,
    arguments: Iterable[Data],
    options: Mapping[str, Data],
    state: Callable[[str], Data],
) -> tuple[str, Data]:
    """Evaluate CalcRobT or CalcJointT and return the result's type name and its value in single precision.

    Args:
        name: ``calcrobt`` or ``calcjointt``, in upper or lower case.
        arguments: values of the two positional arguments: target or joint angles, then tool.
        options: values of the optional arguments; only ``wobj`` is known.
        state: gives the present value of ``@pdisp``, ``@eoffs`` and ``@units``, which instructions have set.

    Raises:
        Unknown: there is no arm, other arguments are given, or the tool is not held by the robot or the work is.
    """
    values = tuple(arguments)
    if arm is None or len(values) != 2 or not options.keys() <= {"wobj"}:
        raise Unknown(Kind.CONTROLLER_FUNCTION, name)
    tool = to_tool("", values[1])
    wobj = to_wobj("", options["wobj"]) if "wobj" in options else WobjData()
    if not tool.robhold or wobj.robhold:
        raise Unknown(Kind.CONTROLLER_FUNCTION, name)
    situation = Situation(tool, wobj, state("@pdisp"), state("@eoffs"), state("@units"))
    if name.lower() == "calcrobt":
        place = arm.target(to_jointtarget(values[0]), situation)
        conf = tuple(map(float, place.robconf))
        return "robtarget", rounded((*as_pose(Pose(place.trans, place.rot)), conf, place.extax))
    joints = arm.joints(to_robtarget(values[0]), situation)
    return "jointtarget", rounded((joints.robax, joints.extax))
