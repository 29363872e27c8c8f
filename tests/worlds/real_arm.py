"""The real arm behind a program: where its TCP comes to for a target that a function of the program has corrected."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.independent import arm as A
from tests.worlds.arm_functions import ArmFunctions
from tests.worlds.product import FORCE
from tests.worlds.task import Event
from tests.worlds.values import RapidError, pose_matrix

REACHED_MM = 0.005


@dataclass
class RealArm:
    """The IRB 4600-60/2.05 with the joint springs of the source paper, under the force of the product's conversion.

    Args:
        through: lines of the original whose targets go through the function.
        distances: of the real TCP from the original's goals [mm], so far; came_back: goals that were not corrected.
        largest_mm: the largest correction so far.
    """

    through: frozenset[int] = frozenset()
    distances: list[float] = field(default_factory=list)
    came_back: int = 0
    largest_mm: float = 0.0
    kinematics: ArmFunctions = field(default_factory=lambda: ArmFunctions(A.irb4600()))

    def compare(self, original: Event, corrected: Event) -> str:
        """What is wrong with a goal that the function gave, in words; empty where the real TCP comes to the original's."""
        goal, given = original.values["goal"], corrected.values["goal"]
        if np.array_equal(goal, given):
            self.came_back += 1
            return ""
        self.largest_mm = max(self.largest_mm, float(np.linalg.norm((given - goal)[:3, 3])))
        tool = pose_matrix(corrected.values["tool"][1])
        load = corrected.values["tool"][2]
        try:
            q = self.kinematics.solved(_metres(given @ np.linalg.inv(tool)), corrected.values["conf"])
        except RapidError:
            return "the function gave a target that the arm cannot reach"
        weight = A.Load(load[0], 1e-3 * np.array(load[1]), np.array(FORCE))
        springs = A.joint_springs(A.TABLE_2)
        tcp = A.equilibrium(self.kinematics.arm, q, _metres(tool), weight, springs).frames.tcp[0]
        self.distances.append(1e3 * float(np.linalg.norm(tcp[:3, 3] - _metres(goal)[:3, 3])))
        far = self.distances[-1]
        return "" if far <= REACHED_MM else f"the real TCP is {far:.4f} mm from the original's goal"


def _metres(pose: np.ndarray) -> np.ndarray:
    made = pose.copy()
    made[:3, 3] *= 1e-3
    return made
