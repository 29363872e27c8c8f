"""What an instrument reads of the measured point: azimuth, elevation and distance, and the beam in tool axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.channels.tool import point_of, tool_poses

READINGS = ("azimuth", "elevation", "distance", "scale")
"""Readings that may be off; scale is an error in proportion to the distance.

Sources: ASME B89.4.19-2006; Hughes, Forbes, Lewis, Sun, Veal and Nasr (2011), Meas. Sci. Technol. 22, 045103.
"""


@dataclass(frozen=True)
class Site:
    """Where the measured point sits on the tool, and where the instrument sees the base.

    Args:
        point: (3,) [m] of the measured point in the axes of the nominal tool.
        instrument: (6,) displacement [m], [rad] of the base as the instrument sees it.
    """

    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    instrument: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def _T_instrument_base(site: Site) -> Array:
    """Return the pose (4, 4) of the base as the instrument sees it."""
    from postproc.robot.pose import displace  # loads scipy, which a library of effects does not need

    return displace(np.array(site.instrument))


def measured_point(state: State, site: Site) -> Array:
    """Return (n, 3) [m] the measured point in base axes, of the arm with the poses that a model has filled in."""
    return point_of(state, np.array(site.point))


def seen_point(state: State, site: Site) -> Array:
    """Return (n, 3) [m] the measured point in the axes of the instrument."""
    T, point = _T_instrument_base(site), measured_point(state, site)
    if state.T_reference_base is not None:
        reference = state.T_reference_base
        point = np.einsum("nij,nj->ni", reference[:, :3, :3], point) + reference[:, :3, 3]
    return np.asarray(point @ T[:3, :3].T + T[:3, 3])


def beam(state: State, site: Site) -> Array:
    """Return (n, 3) unit direction from the instrument to the point in the axes of the tool."""
    T, seen = _T_instrument_base(site), seen_point(state, site)
    turn = tool_poses(state)[:, :3, :3]
    if state.T_reference_base is not None:
        turn = state.T_reference_base[:, :3, :3] @ turn
    along = np.einsum("nji,nj->ni", turn, seen @ T[:3, :3])
    return np.asarray(along / np.maximum(np.linalg.norm(seen, axis=1), 1e-9)[:, None])


def moved_by_reading(seen: Array, reading: str) -> Array:
    """Return (n, 3) displacement of a point by a unit error of a reading, instrument axes.

    Azimuth and elevation in m/rad, distance in m/m, scale in m.

    Args:
        seen: (n, 3) the point in the axes of the instrument [m].
    """
    x, y, z = seen.T
    if reading == "azimuth":
        return np.stack([-y, x, 0 * x], axis=1)
    if reading == "elevation":
        level = np.maximum(np.hypot(x, y), 1e-9)
        return np.stack([-x * z / level, -y * z / level, level], axis=1)
    if reading == "distance":
        return np.asarray(seen / np.maximum(np.linalg.norm(seen, axis=1), 1e-9)[:, None])
    return seen


def azimuth(point: Array, middle: float) -> Array:
    """Return the azimuth (n,) [rad] of points (n, 3) [m], within half a turn of a middle one [rad]."""
    back = middle - np.pi
    return np.asarray(np.mod(np.arctan2(point[:, 1], point[:, 0]) - back, 2 * np.pi) + back)
