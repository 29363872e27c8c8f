"""The pinocchio model of the arm, with virtual springs as extra joints (virtual joint method; seed paper, Sec. 3.1)."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.model.derivatives.places import BODY
from postproc.robot.arm import Robot


class Multibody:
    """Weight and inertia of the links on every coordinate of the deflected arm.

    The virtual spring at the far end of body b is three sliding joints along the body's axes, then turns about x, y, z:
    coordinates with one number each, so that loads are their exact conjugates and the stiffness matrix is symmetric.

    Args:
        gravity: (3,) base axes [m/s^2]; None for a base that moves: it slides and turns by six more joints, whose
            speeds and accelerations `rnea` is given, and whose coordinates stay zero.
        bodies: bodies with a virtual spring.

    Attributes:
        joint: (6,) column of each arm joint; spring: (bodies, 6) columns of each virtual spring; both in chain order.
        columns: the latter by the number of the body; place: (size,) column of each as of `places.placed`.
    """

    def __init__(self, robot: Robot, gravity: Array | None, bodies: tuple[int, ...]) -> None:
        """Build the pinocchio model of the arm with these virtual springs."""
        import pinocchio

        self.pin: Any = pinocchio
        pin = self.pin
        model = pin.Model()
        model.gravity = pin.Motion(np.zeros(3) if gravity is None else np.asarray(gravity, dtype=float), np.zeros(3))
        kinds = [getattr(pin, f"JointModel{kind}{axis}") for kind in "PR" for axis in "XYZ"]
        parent, joint, spring = 0, [], []
        for k, kind in enumerate(kinds if gravity is None else ()):
            parent = model.addJoint(parent, kind(), pin.SE3.Identity(), f"base {k}")
        self.base = parent  # joints of the base, no coordinates of the arm
        for b in range(7):
            distal = pin.SE3(np.eye(3), robot.link[b, :3, 3])
            turn = pin.SE3(robot.link[b, :3, :3], np.zeros(3))
            if b in bodies:
                columns = []
                for k, kind in enumerate(kinds):
                    parent = model.addJoint(parent, kind(), distal if k == 0 else pin.SE3.Identity(), f"spring {b} {k}")
                    columns.append(parent - 1 - self.base)
                spring.append(columns)
                distal = pin.SE3.Identity()
            if b < 6:
                axis = pin.JointModelRevoluteUnaligned(np.asarray(robot.axis[b], dtype=float))
                parent = model.addJoint(parent, axis, distal * turn, f"joint {b + 1}")
                joint.append(parent - 1 - self.base)
                inertia = pin.Inertia(float(robot.mass[b + 1]), robot.center[b + 1], robot.inertia[b + 1])
                model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.model, self.data = model, model.createData()
        self.pool = pin.ModelPool(model, 1)
        self.bodies = bodies
        self.joint = np.array(joint)
        self.spring = np.array(spring, dtype=int).reshape(len(bodies), 6)
        self.columns = dict(zip(bodies, self.spring, strict=True))
        self.place = np.empty(self.size, dtype=int)
        self.place[self.joint] = np.arange(6)
        for b, block in self.columns.items():
            self.place[block] = BODY + 6 * b + np.arange(6)

    @property
    def size(self) -> int:
        """Number of coordinates: six joints and six for each body with a virtual spring."""
        return int(self.model.nv) - self.base

    def rnea(
        self, coordinates: Array, v: Array | None = None, a: Array | None = None, base: tuple[Array, ...] | None = None
    ) -> Array:
        """Return the generalised forces M a + C v + g, (n, size), of a motion (recursive Newton-Euler).

        Args:
            coordinates: (n, size) joint angles [rad] and displacements of the springs [m, rad], which are at rest.
            v, a: (n, 6) speeds and accelerations of the arm joints [rad/s], [rad/s^2]; None for rest.
            base: only of an arm whose base moves, (n, 3) each: gravity less the acceleration of its origin, angular
                velocity, and angular acceleration.
        """
        n = len(coordinates)
        q = np.zeros((self.base + self.size, n), order="F")
        q[self.base :] = coordinates.T
        rates = [np.zeros_like(q, order="F") for _ in range(2)]
        for rate, motion in zip(rates, (v, a), strict=True):
            if motion is not None:
                rate[self.base + self.joint] = motion.T
        if base is not None:
            pull, (x, y, z), turn = base[0].T, base[1].T, base[2].T
            rates[0][3:6] = x, y, z
            # Turns one after the other, about x, y and z, bring an acceleration of their own.
            rates[1][:6] = [*-pull, *(turn - [y * z, -x * z, x * y])]
        # For one state pinocchio answers with a vector.
        return np.asarray(self.pin.rneaInParallel(1, self.pool, q, *rates)).reshape(len(q), n)[self.base :].T

    def weight_stiffness(self, coordinates: Array) -> Array:
        """Return the derivative (n, m, m) of the links' weight by coordinates: gravity's part of K_E (Eq. 21)."""
        none = self.pin.StdVec_Force()
        none.extend([self.pin.Force.Zero()] * self.model.njoints)
        # One call a pose: 10 microseconds with the 48 coordinates, there is no batched form.
        return np.array([-self.pin.computeStaticTorqueDerivatives(self.model, self.data, q, none) for q in coordinates])

    def inertia(self, coordinates: Array) -> Array:
        """Return the inertia (n, m, m) of the links at coordinates (n, m), by the composite rigid body algorithm."""
        result = np.empty((len(coordinates), self.size, self.size))
        for i, q in enumerate(coordinates):
            M = np.triu(self.pin.crba(self.model, self.data, q))
            result[i] = M + np.triu(M, 1).T
        return result
