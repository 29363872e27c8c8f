"""CalcJointT and CalcRobT of a controller, by kinematics of the independent arm; singles come back.

CalcJointT solves for the configuration of the target and raises ERR_ROBLIMIT or ERR_OUTSIDE_REACH (RAPID reference
manual, functions).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.worlds.interpreter import Interpreter
from tests.worlds.values import RapidError, matrix_pose, pose_matrix, singles

ERR_ROBLIMIT, ERR_OUTSIDE_REACH = 1135.0, 1136.0
QUARTER_MARGIN = np.radians(5.0)


@dataclass
class ArmFunctions:
    """The functions for one arm.

    Args:
        arm: kinematics. near: (6,) joint angles [rad] near which an arm without closed form is solved.
        raised: numbers of the errors so far.
    """

    arm: A.Arm
    near: np.ndarray | None = None
    raised: list[float] = field(default_factory=list)

    @property
    def functions(self) -> dict[str, Any]:
        return {"calcjointt": self._calc_joint_t, "calcrobt": self._calc_rob_t}

    def conf(self, q: np.ndarray) -> list[float]:
        if not self.arm.lengths:
            return [0.0] * 4
        return [float(x) for x in I.confdata(self.arm, q)[0]]

    def _arguments(self, task: Interpreter, arguments: Any, kind: str) -> tuple[Any, np.ndarray, np.ndarray]:
        given = [a.value for a in arguments if a.kind == "pos"]
        value, tool = task.evaluate(given[0], kind), task.evaluate(given[1], "tooldata")
        wobj = next((task.evaluate(a.value) for a in arguments if a.name == "wobj"), task.builtin["wobj0"].get())
        return value, pose_matrix(tool[1]), task.motion.frame(task, wobj)

    def _calc_rob_t(self, task: Interpreter, arguments: Any) -> Any:
        joints, tool, frame = self._arguments(task, arguments, "jointtarget")
        q = np.radians(np.array(joints[0]))
        flange = self.arm.forward(q, np.eye(4)).tcp[0].copy()
        flange[:3, 3] *= 1e3
        return [*matrix_pose(np.linalg.inv(frame) @ flange @ tool), self.conf(q), list(joints[1])]

    def _calc_joint_t(self, task: Interpreter, arguments: Any) -> Any:
        target, tool, frame = self._arguments(task, arguments, "robtarget")
        if (
            not np.isfinite(np.array(target[0] + target[1] + target[2])).all()
            or abs(np.linalg.norm(target[1]) - 1) > 0.01
        ):
            raise self._error(ERR_OUTSIDE_REACH)
        flange = frame @ pose_matrix(target) @ np.linalg.inv(tool)
        flange[:3, 3] *= 1e-3
        q = self.solved(flange, target[2])
        return [singles(np.degrees(q)), list(target[3])]

    def solved(self, flange: np.ndarray, conf: list[float]) -> np.ndarray:
        if not self.arm.lengths:
            return self._newton(flange)
        every = I.inverse(self.arm, flange[None])[0]
        every = every[np.isfinite(every).all(axis=1)]
        if not len(every):
            raise self._error(ERR_OUTSIDE_REACH)
        best, far = None, np.inf
        for q in every:
            turned = q.copy()
            for j, quarter in zip((0, 3, 5), conf[:3], strict=True):
                middle = (quarter + 0.5) * np.pi / 2
                turned[j] = middle + (q[j] - middle + np.pi) % (2 * np.pi) - np.pi
            outside = max(
                abs(turned[j] - (c + 0.5) * np.pi / 2) - np.pi / 4 for j, c in zip((0, 3, 5), conf, strict=False)
            )
            same = I.confdata(self.arm, turned)[0][3] == conf[3]
            if same and outside < far:
                best, far = turned, outside
        if best is None or far > QUARTER_MARGIN:
            raise self._error(ERR_ROBLIMIT)
        if ((best < self.arm.lower) | (best > self.arm.upper)).any():
            raise self._error(ERR_ROBLIMIT)
        return best

    def _newton(self, flange: np.ndarray) -> np.ndarray:
        assert self.near is not None
        q = self.near.copy()
        for _ in range(20):
            f = self.arm.forward(q, np.eye(4))
            here = f.tcp[0]
            turn = flange[:3, :3] @ here[:3, :3].T
            axial = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
            error = np.concatenate([flange[:3, 3] - here[:3, 3], axial])
            J = np.array([[*np.cross(f.axis[j][0], here[:3, 3] - f.pivot[j][0]), *f.axis[j][0]] for j in range(6)]).T
            q = q + np.linalg.lstsq(J, error, rcond=1e-9)[0]
        return q

    def _error(self, number: float) -> RapidError:
        self.raised.append(number)
        return RapidError(number)
