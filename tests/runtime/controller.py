"""A controller for modules that correct targets: the interpreter of the worlds, and kinematics of the independent arm.

Nothing here is of the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.independent import arm as A
from tests.worlds.arm_functions import ArmFunctions
from tests.worlds.interpreter import Interpreter
from tests.worlds.parser import parse
from tests.worlds.values import matrix_pose, pose_matrix
from tests.worlds.world import World

NO_AXES = [9e9] * 6

CALLER = """
MODULE caller
    VAR robtarget pIn;
    VAR robtarget pTo;
    VAR robtarget pOut;
    PERS tooldata tUsed:=[TRUE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
    PERS wobjdata wUsed:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
    PERS loaddata lUsed:=[1,[0,0,0],[1,0,0,0],0,0,0];
    PROC plain()
        pOut:=ppCorrected(pIn,tUsed);
    ENDPROC
    PROC object()
        pOut:=ppCorrected(pIn,tUsed\\WObj:=wUsed);
    ENDPROC
    PROC weld()
        pOut:=ppCorrected(pIn,tUsed\\WObj:=wUsed\\Weld);
    ENDPROC
    PROC loaded()
        pOut:=ppCorrected(pIn,tUsed\\WObj:=wUsed\\TLoad:=lUsed);
    ENDPROC
    PROC circle()
        pOut:=ppCorrectedCirc(pIn,pTo,tUsed\\WObj:=wUsed);
    ENDPROC
ENDMODULE
"""


def metres(target: list[Any]) -> np.ndarray:
    """The pose (4, 4) [m] of a robtarget."""
    T = pose_matrix(target)
    T[:3, 3] *= 1e-3
    return T


@dataclass
class Controller:
    """A task that holds the module and can be asked for one target after another."""

    module: str
    arm: A.Arm

    def __post_init__(self) -> None:
        self.kinematics = ArmFunctions(self.arm)
        modules = [*parse(self.module), *parse(CALLER)]
        self.task = Interpreter(modules, World(0), functions=self.kinematics.functions)

    def set(self, name: str, value: Any) -> None:
        self._ref(name).set(value, self.task.records)

    def get(self, name: str) -> Any:
        return self._ref(name).get()

    def _ref(self, name: str) -> Any:
        for names in (self.task.shared, *self.task.own.values()):
            if name.lower() in names:
                return names[name.lower()]
        raise KeyError(name)

    def ask(self, target: list[Any], routine: str = "object") -> list[Any]:
        """What the function gives for a robtarget."""
        self.set("pIn", target)
        self.run(routine)
        return list(self.get("pOut"))

    def run(self, routine: str) -> None:
        """Run a procedure."""
        self.task.steps = 0
        self.task.run_routine(self.task.routines[routine.lower()], ())

    def target(self, q: np.ndarray, tool: np.ndarray, frame: np.ndarray | None = None) -> list[Any]:
        """The robtarget in single precision at joint angles (6,) [rad], with TCP (4, 4) [m] in a frame (4, 4) [m]."""
        tcp = self.arm.forward(q, tool).tcp[0]
        place = (np.eye(4) if frame is None else np.linalg.inv(frame)) @ tcp
        mm = place.copy()
        mm[:3, 3] *= 1e3
        return [*matrix_pose(mm), self.kinematics.conf(q), list(NO_AXES)]
