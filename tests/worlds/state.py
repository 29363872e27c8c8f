"""Where the robot stands, and the interrupts that are connected."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.worlds.geometry import Array, flange
from tests.worlds.syntax import Arg
from tests.worlds.values import clone, matrix_pose, pose_matrix, predefined, single

if TYPE_CHECKING:
    from tests.worlds.interpreter import Interpreter


@dataclass
class Interrupt:
    """An interrupt: the trap that it runs, the variable that holds its number, what orders it."""

    trap: str
    name: str
    order: str = ""
    single: bool = False
    asleep: bool = False


@dataclass
class MotionState:
    """Where the robot was sent last, and what holds for later motions."""

    pose: Array = field(default_factory=lambda: flange([0, 0, 0, 0, 30, 0]))  # base to tool0
    conf: list[float] = field(default_factory=lambda: [0.0] * 4)
    extax: list[float] = field(default_factory=lambda: [9e9] * 6)
    tool: Any = field(default_factory=lambda: clone(predefined()["tool0"][1]))
    wobj: Any = field(default_factory=lambda: clone(predefined()["wobj0"][1]))
    trigger: dict[str, Any] = field(default_factory=dict)

    def displacement(self, task: Interpreter) -> Array:
        return (
            pose_matrix(task.builtin["c_progdisp"].get()[0])
            if task.builtin["c_progdisp"].get()[0][1] != [0.0] * 4
            else np.eye(4)
        )

    def frame(self, task: Interpreter, wobj: Any) -> Array:
        """Base to the coordinates of programmed targets: user frame, object frame, program displacement."""
        return pose_matrix(wobj[3]) @ pose_matrix(wobj[4]) @ self.displacement(task)

    def target(self, task: Interpreter, tool: Any, wobj: Any) -> list[Any]:
        """CRobT: the present position as a target that would lead here (with the displacement that is on)."""
        tool, wobj = tool or self.tool, wobj or predefined()["wobj0"][1]
        t = np.linalg.inv(self.frame(task, wobj)) @ self.pose @ pose_matrix(tool[1])
        return [*matrix_pose(t), list(self.conf), list(self.extax)]


def with_offsets(task: Interpreter, axes: list[float]) -> list[float]:
    offsets = task.builtin["c_progdisp"].get()[1]
    return [single(a + o) if a < 8e9 and o < 8e9 else a for a, o in zip(axes, offsets, strict=True)]


def target_of_joints(task: Interpreter, joints: Any, tool: Any, wobj: Any) -> list[Any]:
    """CalcRobT: where the joints would put the tool, in the work object and with the displacement that is on."""
    frame = task.motion.frame(task, wobj or predefined()["wobj0"][1])
    t = np.linalg.inv(frame) @ flange(joints[0]) @ pose_matrix(tool[1])
    quarters = [float(np.floor(joints[0][i] / 90)) for i in (0, 3, 5)]
    return [*matrix_pose(t), [*quarters, 0.0], list(joints[1])]


def plain(task: Interpreter, a: Arg) -> Any:
    """What an argument hands over: its value, or a name that is no data (a signal)."""
    if a.value is None:
        return a.name
    if a.value[0] == "ref" and task.find(a.value[1]) is None:
        return a.value[1]
    return [a.name, clone(task.evaluate(a.value))]
