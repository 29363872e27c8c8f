"""In which configuration an arm follows a seam: the one that stays farthest from joint limits and a straight wrist."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, whole_turns
from postproc.diagnostics import PostprocError
from postproc.robot.arm import Robot
from postproc.robot.configuration import TURNING, confdata
from postproc.robot.inverse import inverse
from postproc.robot.track import track


def seam_configuration(robot: Robot, T_base_flange: Array) -> NDArray[np.int64] | None:
    """Confdata (n, 4) of poses (n, 4, 4) passed one after the other, None where no configuration holds them all.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    best, most = None, 0.0
    for start in inverse(robot, T_base_flange[:1])[0]:
        if np.isnan(start).any():
            continue
        try:
            q = _in_range(robot, track(robot, T_base_flange, start))
        except PostprocError:  # this branch ends on the way
            continue
        room = _room(robot, q)
        if room > most:
            best, most = q, room
    return None if best is None else confdata(robot, best)


def unreachable(robot: Robot, T_base_flange: Array) -> NDArray[np.int64]:
    """Indices of poses that the arm cannot take within its limits in any configuration."""
    q = inverse(robot, T_base_flange)
    turned = q.copy()
    turned[..., TURNING] += whole_turns(q, near=_middle(robot))[..., TURNING]
    inside = np.all((turned >= robot.lower) & (turned <= robot.upper), axis=-1)
    return np.flatnonzero(~np.any(inside, axis=1))


def _middle(robot: Robot) -> Array:
    """The middle of each joint's range, (6,)."""
    return (robot.lower + robot.upper) / 2


def _in_range(robot: Robot, q: Array) -> Array:
    """The same way (n, 6) moved by whole turns of axes 1, 4 and 6 towards the middle of their ranges."""
    way = (q.min(axis=0) + q.max(axis=0)) / 2
    moved = q.copy()
    moved[:, TURNING] += whole_turns(way, near=_middle(robot))[TURNING]
    return moved


def _room(robot: Robot, q: Array) -> float:
    """Smallest distance from a joint limit or from a straight wrist along the way [rad]; negative beyond a limit."""
    limits = np.minimum(q - robot.lower, robot.upper - q).min()
    return float(min(limits, np.abs(np.sin(q[:, 4])).min()))
