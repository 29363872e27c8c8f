"""Forces along the axes of the tool, and the moment with which the arm leans on its footing, of given states."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State

FORCES = ("gravity", "acceleration", "weight", "force")
"""What a tool feels: gravity, its acceleration [m/s^2], the payload's weight with its inertia, the process force."""


def tool_poses(state: State) -> Array:
    """Return the poses (n, 4, 4) of the nominal tool on the arm's bodies, in base axes."""
    flange = np.asarray(state.T_base_body)[:, 6]
    return np.asarray((flange if state.robot is None else flange @ state.robot.link[6]) @ state.T_flange_tcp)


def point_of(state: State, point: Array) -> Array:
    """Return (n, 3) [m] in base axes of a point (3,) [m] in the axes of the nominal tool."""
    T = tool_poses(state)
    return np.asarray(T[:, :3, :3] @ point + T[:, :3, 3])


def in_tool_axes(state: State, point: Array) -> Array:
    """Return the point (3,) [m] in the axes of the nominal tool nearest to given points (n, 3) [m] in base axes."""
    T = tool_poses(state)
    return np.asarray(np.mean(np.einsum("nji,nj->ni", T[:, :3, :3], point - T[:, :3, 3]), axis=0))


def force_on_tool(state: State, kind: str, point: Array) -> Array | None:
    """Return (n, 3) a force or acceleration (`FORCES`) along the axes of the tool; None where it is not known.

    Gravity is that of the tool's rest frame where the table has payloads and accelerations.

    Args:
        point: (3,) in the axes of the tool [m], of which the acceleration is taken.
    """
    if state.T_base_body is None:
        return None
    turn, n = tool_poses(state)[:, :3, :3], len(state)
    free = np.broadcast_to(state.gravity, (n, 3))
    accelerated = state.a is not None and state.v is not None and state.motions is not None
    if kind == "gravity":
        pull: Array | None = free
    elif kind == "force":
        pull = None if state.wrench is None else np.asarray(state.wrench)[:, :3]
    elif not accelerated and kind == "acceleration":
        pull = None
    else:
        acceleration = np.zeros((n, 3))
        if accelerated and state.motions is not None:
            motion = state.motions[6]
            arm = point_of(state, point) - np.asarray(state.T_base_body)[:, 6, :3, 3]
            acceleration = motion.acceleration + motion.swung(arm)
        if kind == "acceleration":
            pull = acceleration
        else:
            pull = None if state.payload_mass is None else state.payload_mass[:, None] * (free - acceleration)
    return None if pull is None else np.einsum("nji,nj->ni", turn, pull)


def overturning_moment(state: State) -> Array | None:
    """Return the moment (n, 3) on the base about its origin [N m], None where loads are not known."""
    if state.body_load is None or state.robot is None:
        return None
    force, moment = state.body_load[:, 0, :3], state.body_load[:, 0, 3:]
    return np.asarray(moment + np.cross(state.robot.link[0][:3, 3], force))


def leaning(moment: Array) -> Array:
    """Return (n, 3, 2) unit turn axis, then unit shift, of a base that tilts the way a moment (n, 3) pulls it.

    Together they tilt the base about a point at any height.

    Args:
        moment: overturning moment in base axes [N m].
    """
    size = np.hypot(moment[:, 0], moment[:, 1])
    x, y = moment[:, :2].T / np.maximum(size, 1e-9)
    still = np.zeros(len(moment))
    return np.stack([np.stack([x, y, still], axis=1), np.stack([y, -x, still], axis=1)], axis=2)
