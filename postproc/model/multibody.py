"""Weight and inertia of the links on the coordinates of the arm: joints and virtual springs (seed paper, Sec. 3.1).

The recursions of Featherstone, Rigid Body Dynamics Algorithms (2008), Ch. 5 and 6, for all poses at once.
"""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.model.chain import Chain, Directions, generalised_forces
from postproc.model.derivatives.places import BODY
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_motions, cross, skew


class Multibody:
    """Weight and inertia of the links on every coordinate of the deflected arm.

    The virtual spring at the far end of body b is three sliding joints along the body's axes, then turns about x, y, z:
    coordinates with one number each, so that loads are their exact conjugates and the stiffness matrix is symmetric.

    Args:
        gravity: (3,) base axes [m/s^2]; None for a base that moves, whose gravity and motion `rnea` is given.
        bodies: bodies with a virtual spring.

    Attributes:
        joint: (6,) column of each arm joint; spring: (bodies, 6) columns of each virtual spring; both in chain order.
        columns: the latter by the number of the body; place: (size,) column of each as of `places.displacement_parts`.
        size: number of coordinates, six joints and six for each body with a virtual spring.
    """

    def __init__(self, robot: Robot, gravity: Array | None, bodies: tuple[int, ...]) -> None:
        self.robot, self.bodies = robot, bodies
        self.gravity = np.zeros(3) if gravity is None else np.asarray(gravity, dtype=float)
        self.size = 6 + 6 * len(bodies)
        # The spring of body b comes before joint b + 1.
        before = np.cumsum([6 * (b in bodies) for b in range(7)])
        self.joint = np.arange(6) + before[:6]
        self.columns = {b: b + before[b] - 6 + np.arange(6) for b in bodies}
        self.spring = np.array([*self.columns.values()], dtype=int).reshape(len(bodies), 6)
        self.place = np.empty(self.size, dtype=int)
        self.place[self.joint] = np.arange(6)
        for b, block in self.columns.items():
            self.place[block] = BODY + 6 * b + np.arange(6)

    def coordinates(self, chain: Chain) -> Array:
        """Return the coordinates (n, size) of the deflected arm: joints [rad], displacements of springs [m, rad]."""
        if not self.bodies:
            return chain.q
        result = np.zeros((len(chain.q), self.size))
        result[:, self.joint] = chain.q
        for b, xi in chain.body.items():
            result[:, self.columns[b]] = xi
        return result

    def rnea(
        self,
        chain: Chain,
        along: Directions,
        v: Array | None = None,
        a: Array | None = None,
        base: tuple[Array, ...] | None = None,
    ) -> Array:
        """Return the generalised forces M a + C v + g, (n, size), of a motion (recursive Newton-Euler).

        Args:
            chain: the deflected arm, whose springs are at rest; along: directions of its coordinates.
            v, a: (n, 6) speeds and accelerations of the arm joints [rad/s], [rad/s^2]; None for rest.
            base: only of an arm whose base moves, (n, 3) each: gravity less the acceleration of its origin, angular
                velocity, and angular acceleration.
        """
        robot, n = self.robot, len(chain.q)
        # Components and bodies 1 to 6 run along the first axes, poses along the last.
        T = chain.T_base_body[:, 1:].transpose(2, 3, 1, 0)
        R, center = T[:3, :3], robot.center[1:].T[..., None]
        lever = R[:, 0] * center[0] + R[:, 1] * center[1] + R[:, 2] * center[2]
        pull = self.gravity[:, None, None] if base is None else base[0].T[:, None]
        acceleration, torque = np.broadcast_to(-pull, lever.shape), np.zeros(lever.shape)
        if v is not None or a is not None or base is not None:
            still = np.zeros((n, 6))
            rates = still if v is None else v, still if a is None else a
            turning = (None, None) if base is None else (base[1], base[2])
            moving = body_motions(robot, chain.T_base_body, *rates, turning)[1:]
            origin, spin, rate = (np.stack([part.T for part in parts], axis=1) for parts in zip(*moving, strict=True))
            acceleration = acceleration + origin + cross(rate, lever) + cross(spin, cross(spin, lever))
            # Euler's equation in the axes of each body.
            spin, rate = (R[0] * x[0] + R[1] * x[1] + R[2] * x[2] for x in (spin, rate))
            momentum, change = (np.einsum("bij,jbn->ibn", robot.inertia[1:], x) for x in (spin, rate))
            turn = change + cross(spin, momentum)
            torque = R[:, 0] * turn[0] + R[:, 1] * turn[1] + R[:, 2] * turn[2]
        force = robot.mass[1:, None] * acceleration
        wrenches = np.zeros((n, 8, 6))
        wrenches[:, 1:7, :3] = force.transpose(2, 1, 0)
        wrenches[:, 1:7, 3:] = (cross(T[:3, 3] + lever, force) + torque).transpose(2, 1, 0)
        return generalised_forces(along, wrenches)

    def weight_stiffness(self, chain: Chain, along: Directions) -> Array:
        """Return the derivative (n, m, m) of the links' weight by coordinates: gravity's part of K_E (Eq. 21).

        K_ik = sum_b m_b g . (spin_i x J_k(c_b)) over the bodies b that the later coordinate k carries, i before k.

        Args:
            chain: the deflected arm; along: directions of its coordinates.
        """
        mass = _carried(np.broadcast_to(self.robot.mass, (len(chain.q), 7)), along)
        moment = _carried(self.robot.mass[:, None] * self._centers(chain), along)
        # The sum of m_b J_k(c_b).
        swept = mass[..., None] * (along.slide - np.cross(along.spin, along.origin)) + np.cross(along.spin, moment)
        return _mirrored(np.cross(self.gravity, along.spin) @ np.swapaxes(swept, 1, 2))

    def inertia(self, chain: Chain, along: Directions) -> Array:
        """Return the inertia (n, m, m) of the links, by the composite rigid body algorithm.

        Args:
            chain: the deflected arm; along: directions of its coordinates.
        """
        R = chain.T_base_body[..., :3, :3]
        offset, mass = skew(self._centers(chain)), self.robot.mass[:, None, None]
        spatial = np.zeros((len(R), 7, 6, 6))
        spatial[..., :3, :3] = mass * np.eye(3)
        spatial[..., :3, 3:] = -mass * offset
        spatial[..., 3:, :3] = mass * offset
        spatial[..., 3:, 3:] = R @ self.robot.inertia @ np.swapaxes(R, 2, 3) - mass * offset @ offset
        momentum = _carried(spatial, along) @ along.line[..., None]
        return _mirrored(along.line @ np.swapaxes(momentum[..., 0], 1, 2))

    def _centers(self, chain: Chain) -> Array:
        """Return the centres of mass (n, 7, 3) of the bodies in base axes [m]."""
        T = chain.T_base_body
        return np.asarray((T[..., :3, :3] @ self.robot.center[:, :, None])[..., 0] + T[..., :3, 3])


def _carried(values: Array, along: Directions) -> Array:
    """Return the sums (n, m, ..) of values (n, 7, ..) of bodies 0 to 6 over those that each coordinate carries."""
    sums = np.zeros((len(values), 8, *values.shape[2:]))
    sums[:, :7] = np.cumsum(values[:, ::-1], axis=1)[:, ::-1]
    return sums[:, list(along.carried)]


def _mirrored(matrix: Array) -> Array:
    """Return symmetric matrices (n, m, m) with the upper triangles of these."""
    upper = np.triu(matrix)
    return upper + np.swapaxes(np.triu(matrix, 1), 1, 2)
