"""Weight and inertia of the links by pinocchio, with virtual springs as extra joints (virtual joint method)."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.model.chain import Chain, Directions
from postproc.model.multibody import Multibody
from postproc.robot.arm import Robot


class PinocchioBodies(Multibody):
    """The same as `Multibody`, computed by pinocchio: recursive Newton-Euler and composite rigid bodies.

    The virtual spring at the far end of a body is three sliding joints along its axes, then turns about x, y, z. A base
    that moves slides and turns by six more joints, whose coordinates stay zero.

    Raises:
        ImportError: pinocchio is not installed: PyPI has no wheel of it for every platform.
    """

    def __init__(self, robot: Robot, gravity: Array | None, bodies: tuple[int, ...]) -> None:
        """Build the pinocchio model of the arm with these virtual springs."""
        import pinocchio

        super().__init__(robot, gravity, bodies)
        self.pin: Any = pinocchio
        pin = self.pin
        model = pin.Model()
        model.gravity = pin.Motion(self.gravity, np.zeros(3))
        kinds = [getattr(pin, f"JointModel{kind}{axis}") for kind in "PR" for axis in "XYZ"]
        parent = 0
        for k, kind in enumerate(kinds if gravity is None else ()):
            parent = model.addJoint(parent, kind(), pin.SE3.Identity(), f"base {k}")
        self.base = parent  # joints of the base, no coordinates of the arm
        for b in range(7):
            distal = pin.SE3(np.eye(3), robot.link[b, :3, 3])
            turn = pin.SE3(robot.link[b, :3, :3], np.zeros(3))
            if b in bodies:
                for k, kind in enumerate(kinds):
                    parent = model.addJoint(parent, kind(), distal if k == 0 else pin.SE3.Identity(), f"spring {b} {k}")
                distal = pin.SE3.Identity()
            if b < 6:
                axis = pin.JointModelRevoluteUnaligned(np.asarray(robot.axis[b], dtype=float))
                parent = model.addJoint(parent, axis, distal * turn, f"joint {b + 1}")
                inertia = pin.Inertia(float(robot.mass[b + 1]), robot.center[b + 1], robot.inertia[b + 1])
                model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.model, self.data = model, model.createData()
        self.pool = pin.ModelPool(model, 1)

    def rnea(
        self,
        chain: Chain,
        along: Directions,
        v: Array | None = None,
        a: Array | None = None,
        base: tuple[Array, ...] | None = None,
    ) -> Array:
        """Return the generalised forces M a + C v + g, (n, size), as `Multibody.rnea`."""
        coordinates = self.coordinates(chain)
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

    def inertia(self, chain: Chain, along: Directions) -> Array:
        """Return the inertia (n, size, size) of the links, as `Multibody.inertia`."""
        result = np.empty((len(chain.q), self.size, self.size))
        for i, q in enumerate(self.coordinates(chain)):
            M = np.triu(self.pin.crba(self.model, self.data, q))
            result[i] = M + np.triu(M, 1).T
        return result
