"""The fastest speed along a path under the limits of the arm and of the program: toppra, for many runs at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.arrays import Array
from postproc.motion.timing.grid import Grid
from postproc.motion.timing.inertia import inertial_torque
from postproc.motion.timing.spline import Runs
from postproc.robot.arm import Robot

UNIT = 0.01  # toppra's absolute tolerances suit numbers near one: path parameter in cm
_MOST = 2000  # grid points
_STOP = 1e-6  # squared speed that stands for a stop: with zero, rounding turns toppra's intervals inside out
_LOOSE = 1e-6  # the same for a speed that is given
_NEGLIGIBLE = 1e-6  # share of a joint's acceleration limit
_SHARES = (1.0, 0.999, 0.99, 0.97)  # of the acceleration limits: another try where rounding stopped the first


def fastest(robot: Robot, runs: Runs, grid: Grid, gravity: Array) -> tuple[Array, int | None]:
    """Fastest path speeds (g,) [m/s] at the grid points.

    Stops are grid points with speed zero, so one call of toppra serves several runs of about 2000 points together, and
    its memory does not grow with the program.

    Args:
        gravity: (3,) base axes [m/s^2]; counts where the robot has torque limits.

    Returns:
        The speeds, and the index of the grid point where toppra finds no way on (all speeds are then zero), else None.
    """
    speed = np.zeros(len(grid.s))
    for rows in _parts(grid):
        speed[rows], blocked = _of_part(robot, runs, grid.only(rows), gravity)
        if blocked is not None:
            return np.zeros(len(speed)), rows.start + blocked
    return speed, None


def _parts(grid: Grid) -> Iterator[slice]:
    """Slices of the grid that hold whole runs (from standstill to standstill), 2000 points or more but for the last."""
    begin = 0
    for end in (*(np.flatnonzero(np.diff(grid.run)) + 1).tolist(), len(grid.s)):
        if end - begin >= _MOST or end == len(grid.s):
            yield slice(begin, end)
            begin = end


def _of_part(robot: Robot, runs: Runs, grid: Grid, gravity: Array) -> tuple[Array, int | None]:
    """Fastest path speeds (g,) [m/s] of one part of the grid, and the index of the point where there is no way on.

    It is one call of toppra, repeated with smaller acceleration limits (down to 97 %) if rounding stops it.
    """
    from postproc.motion.timing.constraints import TOPPRA, GridPath, JointLimits, JointVelocityConstraint, SpeedBounds

    # Derivatives from inside the run, also at its last point, where the curve passes over into the gap.
    last = np.append(np.diff(grid.run) > 0, True)
    inner = np.where(last, np.nextafter(grid.s, -np.inf), grid.s)
    values: list[Array] = [runs.curve(inner), runs.curve(inner, 1) * UNIT, runs.curve(inner, 2) * UNIT**2]
    # Next to nothing is nothing: toppra's linear programs fail on lines that are all but parallel.
    values[2][np.abs(values[2]) * (grid.cap[:, None] / UNIT) ** 2 < _NEGLIGIBLE * runs.limits.acceleration] = 0.0
    low, high = (grid.floor / UNIT) ** 2 * (1 - _LOOSE), (grid.cap / UNIT) ** 2 * (1 + _LOOSE)

    dof = values[0].shape[1]
    bounds = SpeedBounds(low, np.maximum(high, _STOP), dof)
    whole = GridPath(values, np.array([grid.s[0], grid.s[-1]]) / UNIT)
    ease = grid.ease[:, None]
    eased = values[1] / ease, values[2] / ease, np.zeros_like(values[1])
    ends = np.minimum(grid.cap, grid.floor)[[0, -1]] / UNIT
    fixed, may_rest = [JointVelocityConstraint(runs.limits.speed), bounds], grid.floor <= 0
    if robot.torque is not None:
        # M q' u + (M q'' + C(q') q') x + g
        terms = _torque_terms(robot, runs, grid, values, gravity)
        fixed.append(JointLimits(terms, robot.torque, dof))
        may_rest = may_rest & (np.abs(terms[2]) <= robot.torque).all(axis=1)
    blocked = 0
    for share in _SHARES:
        limits = [*fixed, JointLimits(eased, share * runs.limits.acceleration, dof)]
        solver = TOPPRA(may_rest, limits, whole, gridpoints=grid.s / UNIT, solver_wrapper="seidel",
                        parametrizer="ParametrizeConstAccel")  # fmt: skip
        _, speed, _, controllable = solver.compute_parameterization(*ends, return_data=True)
        if speed is not None and not np.isnan(speed).any():
            return np.where(grid.cap > 0, speed * UNIT, 0.0), None
        unknown = np.isnan(controllable if speed is None else speed[:, None]).any(axis=1)
        blocked = int(np.flatnonzero(unknown)[-1]) if unknown.any() else 0
    return np.zeros(len(grid.s)), blocked


def _torque_terms(
    robot: Robot, runs: Runs, grid: Grid, values: list[Array], gravity: Array
) -> tuple[Array, Array, Array]:
    """Joint torques (g, 6) [N m] per path acceleration, per squared path speed, and at rest, in toppra's path unit.

    Args:
        values: path coordinates and their first two derivatives, (g, c) each; the first six are the joint angles.
    """
    held = runs.moves_at(grid.s)
    payload = np.array([m.payload_mass for m in held]), np.array([m.payload_center for m in held])
    q, q1, q2 = (column[:, :6] for column in values)
    still = np.zeros_like(q)
    rest = inertial_torque(robot, (q, still, still), payload, gravity)
    return inertial_torque(robot, (q, still, q1), payload), inertial_torque(robot, (q, q1, q2), payload), rest
