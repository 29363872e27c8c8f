"""Real arms of the independent kind, with what the package knows of them as a model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from postproc.effects.base import Effect
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.structure.base_compliance import BaseCompliance
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.robot.catalogue import load_robot
from postproc.runtime.conditions import Conditions
from postproc.runtime.written import RunTimeModule, write_module
from tests.independent import arm as A
from tests.runtime.controller import Controller

FORCE = np.array([200.0, -200.0, -200.0])
TOOL = A.transform(A.rotation(np.array([0.0, 1.0, 0.0]), np.array(0.6)), np.array([0.02, -0.01, 0.35]))
CENTER = np.array([0.03, 0.02, 0.12])
Place = Callable[[np.ndarray, A.Load], np.ndarray]
"""Real TCP (4, 4) at commanded joint angles (6,) with a load."""


@dataclass(frozen=True)
class Real:
    """An arm, the model of it, and where it really goes."""

    arm: A.Arm
    model: Model
    place: Place
    mass: float

    def conditions(self, **changes: object) -> Conditions:
        robot = self.model.robot
        given = Conditions(robot.lower, robot.upper, TOOL, self.mass, CENTER)
        return replace(given, **changes)  # type: ignore[arg-type]

    def written(self, **changes: object) -> RunTimeModule:
        return write_module(self.model, self.conditions(**changes))

    def controller(self, text: bytes) -> Controller:
        task = Controller(text.decode(), self.arm)
        mm = TOOL.copy()
        mm[:3, 3] *= 1e3
        task.set("tUsed", [True, pose(mm), load(self.mass, CENTER)])
        return task


def pose(mm: np.ndarray) -> list[list[float]]:
    from tests.worlds.values import matrix_pose

    return list(matrix_pose(mm))


def load(mass: float, center: Sequence[float] | np.ndarray) -> list[object]:
    return [mass, [1e3 * float(x) for x in center], [1.0, 0, 0, 0], 0.0, 0.0, 0.0]


def springs() -> Real:
    """Joint springs of Table 2."""
    arm = A.irb4600()

    def place(q: np.ndarray, given: A.Load) -> np.ndarray:
        return A.equilibrium(arm, q, TOOL, given, A.joint_springs(A.TABLE_2)).frames.tcp[0]

    return Real(arm, default_model(), place, 30.0)


@cache
def on_the_arc() -> RunTimeModule:
    """The module of the joint springs under a force of the arc alone."""
    return springs().written(force=FORCE, force_on="arc")


def soft_bodies() -> Real:
    """Joint springs, beams, bearings and a floor that give way; joint 1 sits on the floor, as the arm of the tests has it."""
    arm, tilt = A.irb4600(), np.array([2e-8, 5e-8, 5e-8, 1e-7, 1e-7, 0.0])
    floor, bend, twist = np.array([5e-8, 8e-8, 0.0]), 5e-7, 1e-6
    bodies: dict[int, np.ndarray] = {}
    for j in range(6):
        axis = arm.link[j][:3, :3] @ arm.axis[j]
        bodies[j] = np.zeros((6, 6))
        bodies[j][3:, 3:] = tilt[j] * (np.eye(3) - np.outer(axis, axis))
    # The floor turns about the base's origin: so does the end of the pedestal, in steps of moment and force there.
    arm_of = arm.link[0][:3, 3]
    skew = np.array([[0, -arm_of[2], arm_of[1]], [arm_of[2], 0, -arm_of[0]], [-arm_of[1], arm_of[0], 0]])
    moment = np.hstack([skew, np.eye(3)])
    bodies[0] += moment.T @ np.diag(floor) @ moment
    for b in (2, 4):
        span = arm.link[b][:3, 3]
        length = float(np.linalg.norm(span))
        e = span / length
        along, across = np.outer(e, e), np.eye(3) - np.outer(e, e)
        turn = bend * length**2 / 2 * np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
        stiff = bend * length**3 / 3 * across
        bodies[b] += np.block([[stiff, -turn], [turn, twist * length * along + bend * length * across]])

    def place(q: np.ndarray, given: A.Load) -> np.ndarray:
        return A.equilibrium(arm, q, TOOL, given, A.body_springs(A.TABLE_2, bodies)).frames.tcp[0]

    model = default_model()
    more: tuple[Effect, ...] = (
        BaseCompliance(tilt_rad_per_Nm=floor[:2]),
        BearingTilt(pivot="floor", tilt_rad_per_Nm=tilt),
        LinkCompliance(body=(2, 4), bending_per_Nm2=[bend] * 2, torsion_per_Nm2=[twist] * 2, stretch_per_N=[0.0] * 2),
    )
    return Real(arm, model.with_effects(*model.effects, *more), place, 30.0)


def mapped() -> Real:
    """A UR10 with a map of 25 orders in each joint, 0.3 mrad rms, and soft joints."""
    arm, orders = A.ur10(), np.arange(1, 26)
    g = np.random.default_rng(17)
    sine, cosine = (g.normal(0, 2e-4, (6, 25)) / orders**0.75 for _ in range(2))
    soft = np.array([2e-5, 2e-5, 2e-5, 6e-5, 6e-5, 6e-5])

    def place(q: np.ndarray, given: A.Load) -> np.ndarray:
        angle = q[:, None] * orders
        wrong = (sine * np.sin(angle) + cosine * np.cos(angle)).sum(axis=1)
        return A.equilibrium(arm, q + wrong, TOOL, given, A.joint_springs(soft)).frames.tcp[0]

    map_ = JointErrorMap(order=25, low_rad=(-100.0,) * 6, high_rad=(100.0,) * 6, sine_rad=sine, cosine_rad=cosine)
    effects = (JointCompliance(compliance_rad_per_Nm=soft), map_)
    return Real(arm, Model(load_robot("ur10"), effects, robot_name="ur10"), place, 3.0)
