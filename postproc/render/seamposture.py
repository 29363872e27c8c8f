"""In which configuration an arm follows a seam.

Axes 1 to 3 stand as far from joint limits and a straight wrist as they can. Of the two wrists that go with them the one
whose axes 4 and 6 turn fewer quarters from zero is taken: the hose is laid out with both at zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, whole_turns
from postproc.diagnostics import PostprocError
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.configuration import QUARTER, TURNING, confdata
from postproc.robot.track import track

SAME_POSTURE = 1e-6  # [rad]


def seam_configuration(robot: Robot, T_base_flange: Array) -> NDArray[np.int64] | None:
    """Confdata (n, 4) for flange poses (n, 4, 4) passed one after the other; None if no configuration suits all.

    Of those that do, axes 1 to 3 are farthest from joint limits and a straight wrist, and axes 4 and 6 turned least.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    postures: list[tuple[float, Array]] = []
    for start in inverse(robot, T_base_flange[:1])[0]:
        if np.isnan(start).any():
            continue
        try:
            q = _in_range(robot, track(robot, T_base_flange, start))
        except PostprocError:  # this branch ends on the way
            continue
        if (room := _room(robot, q)) > 0.0:
            postures.append((room, q))
    if not postures:
        return None
    roomy = max(postures, key=lambda way: way[0])[1]
    wrists = [(room, q) for room, q in postures if np.allclose(q[:, :3], roomy[:, :3], atol=SAME_POSTURE)]
    return confdata(robot, min(wrists, key=lambda way: (_quarters(way[1]), -way[0]))[1])


def unreachable(robot: Robot, T_base_flange: Array) -> NDArray[np.int64]:
    """Indices of flange poses (n, 4, 4) that the arm cannot take within its limits in any configuration."""
    q = inverse(robot, T_base_flange)
    turned = q.copy()
    turned[..., TURNING] += whole_turns(q, near=_middle(robot))[..., TURNING]
    inside = np.all((turned >= robot.lower) & (turned <= robot.upper), axis=-1)
    return np.flatnonzero(~np.any(inside, axis=1))


def _middle(robot: Robot) -> Array:
    """The middle of each joint's range, (6,) [rad]."""
    return (robot.lower + robot.upper) / 2


def _in_range(robot: Robot, q: Array) -> Array:
    """Joint angles (n, 6) of a path, with axes 1, 4 and 6 moved by whole turns so that it lies nearest to mid-range."""
    way = (q.min(axis=0) + q.max(axis=0)) / 2
    moved = q.copy()
    moved[:, TURNING] += whole_turns(way, near=_middle(robot))[TURNING]
    return moved


def _quarters(q: Array) -> int:
    """Largest turn of axis 4 and of axis 6 from zero in q (n, 6) [rad], each in quarter turns rounded up, added."""
    return int(np.ceil(np.abs(q[:, [3, 5]]).max(axis=0) / QUARTER).sum())


def _room(robot: Robot, q: Array) -> float:
    """Smallest distance [rad] of q (n, 6) from a joint limit or a straight wrist; negative beyond a limit."""
    limits = np.minimum(q - robot.lower, robot.upper - q).min()
    return float(min(limits, np.abs(np.sin(q[:, 4])).min()))
