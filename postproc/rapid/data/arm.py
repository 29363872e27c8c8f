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
        """Where joint angles put the TCP on the work.

        Raises:
            Unknown: nothing tells where base or work stand, or the arm has no configuration data.
        """

    def joints(self, target: RobTarget, situation: Situation) -> JointTarget:
        """The joint angles of a target.

        Raises:
            Unknown: as above, or the arm does not reach it.
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
    """Result type and value, in single precision, of one of ``BY_ARM``, in any case.

    Args:
        state: what instructions have set, by ``@`` key.

    Raises:
        Unknown: it has no value for these arguments, or the arm is not known.
    """
    given = tuple(arguments)
    if arm is None or len(given) != 2 or not options.keys() <= {"wobj"}:
        raise Unknown(Kind.CONTROLLER_FUNCTION, name)
    tool = to_tool("", given[1])
    wobj = to_wobj("", options["wobj"]) if "wobj" in options else WobjData()
    if not tool.robhold or wobj.robhold:
        raise Unknown(Kind.CONTROLLER_FUNCTION, name)
    situation = Situation(tool, wobj, state("@pdisp"), state("@eoffs"), state("@units"))
    if name.lower() == "calcrobt":
        place = arm.target(to_jointtarget(given[0]), situation)
        conf = tuple(map(float, place.robconf))
        return "robtarget", rounded((*as_pose(Pose(place.trans, place.rot)), conf, place.extax))
    found = arm.joints(to_robtarget(given[0]), situation)
    return "jointtarget", rounded((found.robax, found.extax))
