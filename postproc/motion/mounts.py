"""Who holds what: the tool on the flange and the work in a frame, or the work on the flange and the tool in a frame.

A program states the way of the TCP on the work, so curves are laid in the work frame: a frame beside the arm, or the
flange where the robot carries the work piece to a stationary tool.

    T_work_tcp = T_base_frame^-1 T_base_flange T_flange_tcp,    or for a stationary tool
    T_work_tcp = T_base_flange^-1 T_base_frame T_frame_tcp

with the frame in which the work, or the stationary tool, stands: the base, the world that a track carries the base
through, or the end of a positioner. It moves in the base with the external axes.

Source: ABB RAPID reference manual, tooldata and wobjdata (robhold, ufprog, ufmec).
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
    """How tool and work are held at n places, on the flange or in a frame.

    Args:
        T_mount_tcp: (n, 4, 4) constant pose T_flange_tcp, or T_frame_tcp of a stationary tool.
        stationary: (n,) whether the tool is stationary.
        T_base_frame: (n, 4, 4) the frame of work or stationary tool; None where it is the base.
        frame: (n,) number of that frame; None where it is the base.
    """

    T_mount_tcp: Array
    stationary: NDArray[np.bool_]
    T_base_frame: Array | None = None
    frame: NDArray[np.int64] | None = None

    def __getitem__(self, rows: Any) -> Mounts:
        """The mounts of the chosen rows (indices, a slice or a mask)."""
        placed = (x if x is None else x[rows] for x in (self.T_base_frame, self.frame))
        return Mounts(self.T_mount_tcp[rows], self.stationary[rows], *placed)

    def same(self, other: Mounts) -> NDArray[np.bool_]:
        """(n,) bool: tool matrix, kind of tool and number of the frame are equal; the frame may stand elsewhere."""
        tool: NDArray[np.bool_] = (self.T_mount_tcp == other.T_mount_tcp).all(axis=(1, 2))
        tool &= self.stationary == other.stationary
        if self.frame is not None and other.frame is not None:
            tool &= self.frame == other.frame
        return tool

    def _in_base(self, T_frame: Array) -> Array:
        """T_base_x (n, 4, 4) of poses T_frame_x (n, 4, 4) stated in the frame of the work or of the stationary tool."""
        return T_frame if self.T_base_frame is None else self.T_base_frame @ T_frame

    def _in_frame(self, T_base: Array) -> Array:
        """T_frame_x (n, 4, 4) of poses T_base_x (n, 4, 4), in the frame of the work or of the stationary tool."""
        return T_base if self.T_base_frame is None else invert(self.T_base_frame) @ T_base

    def work(self, T_base_flange: Array) -> Array:
        """T_work_tcp (n, 4, 4): the TCP in the work frame for flange poses T_base_flange (n, 4, 4)."""
        if not self.stationary.any():
            return self._in_frame(T_base_flange @ self.T_mount_tcp)
        other_way = invert(T_base_flange) @ self._in_base(self.T_mount_tcp)
        return self._chosen(self._in_frame(T_base_flange @ self.T_mount_tcp), other_way)

    def flange(self, T_work_tcp: Array) -> Array:
        """T_base_flange (n, 4, 4): flange poses that bring the TCP to T_work_tcp (n, 4, 4); the inverse of `work`."""
        if not self.stationary.any():
            return self._in_base(T_work_tcp @ invert(self.T_mount_tcp))
        other_way = self._in_base(self.T_mount_tcp) @ invert(T_work_tcp)
        return self._chosen(self._in_base(T_work_tcp @ invert(self.T_mount_tcp)), other_way)

    def base_tcp(self, T_work_tcp: Array) -> Array:
        """T_base_tcp (n, 4, 4): the TCP in the base for T_work_tcp (n, 4, 4); for a stationary tool its fixed place."""
        return self._in_base(self._chosen(T_work_tcp, self.T_mount_tcp))

    def flange_tcp(self, T_work_tcp: Array) -> Array:
        """T_flange_tcp (n, 4, 4): the TCP in the flange for T_work_tcp (n, 4, 4).

        A tool on the flange has a constant one; a stationary tool moves over the work piece, which the flange carries.
        """
        return self._chosen(self.T_mount_tcp, T_work_tcp)

    def seen(self, T_base_tcp: Array, T_work_tcp: Array) -> Array:
        """T_work_tcp (n, 4, 4) of a deflected arm, whose flange brings its nominal TCP point to T_base_tcp (n, 4, 4).

        A tool on the flange is then at T_base_tcp. A stationary tool stays in place and the work on the flange is
        displaced: T_flange_tcp T_base_tcp^-1 T_base_frame T_mount_tcp, with T_flange_tcp equal to the nominal
        T_work_tcp passed.
        """
        if not self.stationary.any():
            return self._in_frame(T_base_tcp)
        other_way = T_work_tcp @ invert(T_base_tcp) @ self._in_base(self.T_mount_tcp)
        return self._chosen(self._in_frame(T_base_tcp), other_way)

    def joints_by_shift(self, robot: Robot, q: Array, T_work_tcp: Array) -> Array:
        """Change of joint angles [rad] per small shift of the TCP on the work, (n, 6, 6): the inverse Jacobian.

        It is a pseudo-inverse in work axes: directions with a singular value below 0.1 % of the largest are left out,
        as the arm cannot move that way. To shift a stationary tool on the work, the work moves the opposite way.
        """
        J = jacobian(robot, q, self.flange_tcp(T_work_tcp))
        inverse = np.asarray(np.linalg.pinv(J, rcond=_SINGULAR), dtype=float)
        on_flange = inverse if self.T_base_frame is None else inverse @ _turning(self.T_base_frame)
        if not self.stationary.any():
            return on_flange
        return self._chosen(on_flange, inverse @ -_turning(forward(robot, q)))

    def _chosen(self, on_flange: Array, stationary: Array) -> Array:
        """Matrices (n, 4, 4) or (n, 6, 6) of ``stationary`` where the tool is stationary, else of ``on_flange``."""
        if not self.stationary.any():
            return on_flange
        return np.where(self.stationary[:, None, None], stationary, on_flange)


def _turning(T: Array) -> Array:
    """(n, 6, 6) block-diagonal matrices that turn shifts and rotation vectors by the rotations of poses (n, 4, 4)."""
    turns = np.zeros((len(T), 6, 6))
    turns[:, :3, :3] = turns[:, 3:, 3:] = T[:, :3, :3]
    return turns
