"""The rigid bodies of an arm in pinocchio, each virtual spring as six joints: three that slide and three that turn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

KINDS = [getattr(pin, f"JointModel{kind}{axis}") for kind in "PR" for axis in "XYZ"]


class RigidBody:
    """Weight, inertia and their derivatives by pinocchio, one pose after the other.

    Args:
        gravity: (3,); None for a base that moves: it slides and turns by six more joints, whose coordinates stay zero.
        bodies: numbers 0 to 6 of the bodies with a spring at their far end.
    """

    def __init__(self, robot: Any, gravity: np.ndarray | None = None, bodies: tuple[int, ...] = ()) -> None:
        self.model = model = pin.Model()
        model.gravity = pin.Motion(np.zeros(3) if gravity is None else gravity, np.zeros(3))
        parent, self.joint = 0, []
        for k, kind in enumerate(KINDS if gravity is None else ()):
            parent = model.addJoint(parent, kind(), pin.SE3.Identity(), f"base {k}")
        self.base = parent
        for b in range(7):
            distal = pin.SE3(np.eye(3), robot.link[b, :3, 3])
            if b in bodies:
                for k, kind in enumerate(KINDS):
                    parent = model.addJoint(parent, kind(), distal if k == 0 else pin.SE3.Identity(), f"spring {b} {k}")
                distal = pin.SE3.Identity()
            if b < 6:
                axis = pin.JointModelRevoluteUnaligned(robot.axis[b])
                parent = model.addJoint(parent, axis, distal * pin.SE3(robot.link[b, :3, :3], np.zeros(3)), f"{b + 1}")
                self.joint.append(parent - 1 - self.base)
                inertia = pin.Inertia(float(robot.mass[b + 1]), robot.center[b + 1], robot.inertia[b + 1])
                model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.data = model.createData()

    def torques(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, base: tuple[np.ndarray, ...] | None) -> np.ndarray:
        """(n, m) generalised forces; q (n, m); v, a (n, 6) of the joints; base: pull, spin and its rate, (n, 3) each."""
        result = np.empty_like(q)
        for i in range(len(q)):
            rates = np.zeros((3, self.model.nv))
            rates[0, self.base :] = q[i]
            rates[1:, self.base + np.array(self.joint)] = v[i], a[i]
            if base is not None:
                x, y, z = base[1][i]
                rates[1, 3:6] = x, y, z
                # Turns one after the other, about x, y and z, bring an acceleration of their own.
                rates[2, :6] = [*-base[0][i], *(base[2][i] - [y * z, -x * z, x * y])]
            result[i] = pin.rnea(self.model, self.data, *rates)[self.base :]
        return result

    def weight_stiffness(self, q: np.ndarray) -> np.ndarray:
        """(n, m, m) derivative of the weight by the coordinates q (n, m)."""
        none = pin.StdVec_Force()
        none.extend([pin.Force.Zero()] * self.model.njoints)
        return np.array([-pin.computeStaticTorqueDerivatives(self.model, self.data, each, none) for each in q])

    def inertia(self, q: np.ndarray) -> np.ndarray:
        """(n, m, m) inertia at the coordinates q (n, m)."""
        upper = [np.triu(pin.crba(self.model, self.data, each)) for each in q]
        return np.array([M + np.triu(M, 1).T for M in upper])
