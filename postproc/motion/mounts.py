"""Who holds what: the tool on the flange and the work in the base, or the work on the flange and the tool in the base.

A program states the way of the TCP on the work, so curves are laid in the work frame: the base, or the flange where the
robot carries the work piece to a stationary tool. The other of the two frames is the mount that the TCP is fixed to:

    T_work_tcp = T_work_mount T_mount_tcp,    T_work_mount = T_base_flange, or its inverse for a stationary tool.

Source: ABB RAPID reference manual, tooldata and wobjdata (robhold).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, invert
from postproc.robot.arm import Robot
from postproc.robot.kinematics import forward, jacobian

_SINGULAR = 1e-3  # of the largest singular value: directions that the arm has all but lost


@dataclass(frozen=True, slots=True)
class Mounts:
    """Mounts at n places.

    Args:
        T_mount_tcp: (n, 4, 4), fixed: T_flange_tcp, or T_base_tcp of a stationary tool; stationary: (n,) which it is.
    """

    T_mount_tcp: Array
    stationary: NDArray[np.bool_]

    def __getitem__(self, rows: Any) -> Mounts:
        return Mounts(self.T_mount_tcp[rows], self.stationary[rows])

    def same(self, other: Mounts) -> NDArray[np.bool_]:
        """(n,) whether two mounts are the same."""
        tool: NDArray[np.bool_] = (self.T_mount_tcp == other.T_mount_tcp).all(axis=(1, 2))
        tool &= self.stationary == other.stationary
        return tool

    def work(self, T_base_flange: Array) -> Array:
        """T_work_tcp (n, 4, 4) of flange poses."""
        return self._turned(T_base_flange) @ self.T_mount_tcp

    def flange(self, T_work_tcp: Array) -> Array:
        """T_base_flange (n, 4, 4) of poses on the work: T_work_tcp T_mount_tcp^-1, inverted for a stationary tool."""
        return self._turned(T_work_tcp @ invert(self.T_mount_tcp))

    def base_tcp(self, T_work_tcp: Array) -> Array:
        """T_base_tcp (n, 4, 4): where the process is in the base."""
        return self._chosen(T_work_tcp, self.T_mount_tcp)

    def flange_tcp(self, T_work_tcp: Array) -> Array:
        """T_flange_tcp (n, 4, 4): where the process is on the flange; it wanders over a work piece that is carried."""
        return self._chosen(self.T_mount_tcp, T_work_tcp)

    def seen(self, T_base_tcp: Array, T_work_tcp: Array) -> Array:
        """T_work_tcp (n, 4, 4) of an arm whose flange has what belongs at the TCP at T_base_tcp instead.

        A held tool stands there. A stationary tool stands where it always does, on work that is displaced:
        T_flange_tcp T_base_tcp^-1 T_mount_tcp.
        """
        if not self.stationary.any():
            return T_base_tcp
        return self._chosen(T_base_tcp, T_work_tcp @ invert(T_base_tcp) @ self.T_mount_tcp)

    def joints_by_shift(self, robot: Robot, q: Array, T_work_tcp: Array) -> Array:
        """Joint angles (n, 6, 6) by a small shift of the TCP on the work, in work axes: the inverse of the Jacobian.

        Directions that the arm has all but lost are left out.

        To shift a stationary tool on the work, the work has to go the other way.
        """
        J = jacobian(robot, q, self.flange_tcp(T_work_tcp))
        inverse = np.asarray(np.linalg.pinv(J, rcond=_SINGULAR), dtype=float)
        if not self.stationary.any():
            return inverse
        other_way = np.zeros((len(inverse), 6, 6))
        other_way[:, :3, :3] = other_way[:, 3:, 3:] = -forward(robot, q)[:, :3, :3]
        return self._chosen(inverse, inverse @ other_way)

    def _turned(self, T: Array) -> Array:
        return self._chosen(T, invert(T)) if self.stationary.any() else T

    def _chosen(self, held: Array, stationary: Array) -> Array:
        if not self.stationary.any():
            return held
        return np.where(self.stationary[:, None, None], stationary, held)
