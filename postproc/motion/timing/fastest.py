"""The fastest speed along a path under the limits of the arm and of the program: toppra, for many runs at a time.

A grid says where toppra decides, and how fast the arm may be there at most.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.motion.inertia import inertial_torque
from postproc.motion.timing.effort import Effort
from postproc.motion.timing.spline import Runs
from postproc.motion.values import Flags, Index, payloads
from postproc.robot.arm import Robot

FASTEST = 20.0  # [m/s] stands for no limit
_CLOSE = 1e-6  # [m] toppra loses its footing between grid points that are closer
_SLOW_RAMP = 0.45  # a ramp longer than this share of its interval needs no grid point of its own


@dataclass(frozen=True, slots=True)
class Grid:
    """Points at which toppra decides on the speed: all knots, and the ends of short ramps between them.

    Args:
        s: (g,) path parameter [m].
        run: (g,) index of the run from standstill to standstill.
        cap, floor: (g,) highest and lowest path speed [m/s]: both zero at stops, equal where the speed is prescribed.
        ease: (g,) share of the joints' acceleration limits that may be used.
    """

    s: Array
    run: Index
    cap: Array
    floor: Array
    ease: Array

    def only(self, rows: Flags | slice) -> Grid:
        """The grid of the chosen points, by a mask (g,) or a slice."""
        return Grid(self.s[rows], self.run[rows], self.cap[rows], self.floor[rows], self.ease[rows])


def programmed_speed(runs: Runs) -> Array:
    r"""Highest path speeds (k - 1,) [m/s] that the program permits between neighbouring knots; zero between runs.

    They follow from the speeds of TCP, reorientation and external axes of each move; with ``\T`` the speed is the
    length of the move over its duration.
    """
    moves, index = runs.path.moves, runs.path.move[runs.sample[1:]]
    h = np.diff(runs.s)
    inside = runs.inside
    speed = np.array([m.speed for m in moves])[index]
    rotation = np.array([m.rotation_speed for m in moves])[index]
    with np.errstate(divide="ignore"):
        cap = np.minimum(speed * h / runs.travel, rotation * h / runs.turn)
        for change, kind in zip(runs.slides.T, runs.kinds, strict=True):
            slide = np.array([m.axis_speed[kind] for m in moves])[index]
            cap = np.minimum(cap, slide * h / change)
    duration = np.array([np.nan if m.duration is None else m.duration for m in moves])
    length = np.bincount(index[inside], h[inside], minlength=len(moves))
    cap = np.where(np.isfinite(duration)[index], (length / duration)[index], cap)
    return np.where(inside, np.minimum(cap, FASTEST), 0.0)


def programmed_ease(runs: Runs) -> Array:
    """Share (k - 1,) of the joints' acceleration limits that AccSet leaves in each interval."""
    ease = np.array([m.ease for m in runs.path.moves])
    return np.where(runs.inside, ease[runs.path.move[runs.sample[1:]]], 1.0)


def lay_grid(runs: Runs, effort: Effort, cap: Array, ease: Array, window: Array) -> Grid:
    """Grid points at all knots, and where a ramp between two speeds starts or ends inside an interval.

    A lower speed is reached half a window early and kept half a window longer, so that averaging does not exceed it.

    Args:
        effort: shares of the acceleration limits along the path.
        cap: (k - 1,) highest path speed of each interval between knots [m/s].
        ease: (k - 1,) share of the joints' acceleration limits.
        window: (r,) averaging time of each run [s].
    """
    s, inside = runs.s, runs.inside
    slope = runs.curve.c[2]
    with np.errstate(divide="ignore"):
        joint_cap = (runs.limits.speed / np.abs(slope)).min(axis=1)
        ramp = ease / np.abs(effort.at(s[:-1], slope, slope)[0]).max(axis=1)
    cap = np.where(inside, np.minimum(cap, joint_cap), 0.0)
    reach = 0.5 * cap * window[runs.run[:-1]]
    wide = _lower_over(s, s[:-1] - reach, s[1:] + reach, cap, runs.run)
    at_knot = np.minimum(np.append(wide, np.inf), np.append(np.inf, wide))
    at_knot[runs.ends] = 0.0
    # The end of each ramp, from either side, where it is well inside the interval.
    h = np.diff(s)
    extra = [(s, at_knot, runs.run, np.minimum(np.append(ease, 1.0), np.append(1.0, ease)))]
    for side, low, sign in ((s[:-1], at_knot[:-1], 1.0), (s[1:], at_knot[1:], -1.0)):
        length = np.maximum(wide**2 - low**2, 0.0) / (2 * ramp)
        wanted = inside & (length > _CLOSE) & (length < _SLOW_RAMP * h) & (low < 0.98 * wide)
        extra.append(((side + sign * length)[wanted], wide[wanted], runs.run[:-1][wanted], ease[wanted]))
    all_s, all_cap, all_run, all_ease = (np.concatenate(column) for column in zip(*extra, strict=True))
    order = np.argsort(all_s, kind="stable")
    return Grid(all_s[order], all_run[order], all_cap[order], np.zeros(len(order)), all_ease[order])


def _lower_over(s: Array, low: Array, high: Array, cap: Array, run: Index) -> Array:
    """Smallest cap (k - 1,) among all intervals of a run whose reach [low, high] touches the interval.

    Found by a sparse table in reverse: every reach is covered by two blocks of a power of two, whose caps are then
    passed down to their halves.

    Args:
        s: (k,) path parameter of the knots [m].
        low, high: (k - 1,) reach of each interval [m].
        run: (k,) run of each knot.
    """
    m = len(cap)
    first = np.searchsorted(run[:-1], run[:-1], side="left")
    last = np.searchsorted(run[:-1], run[:-1], side="right") - 1
    a = np.clip(np.searchsorted(s, low, side="right") - 1, first, np.arange(m))
    b = np.clip(np.searchsorted(s, high, side="left") - 1, np.arange(m), last)
    level = np.frexp((b - a + 1).astype(float))[1] - 1
    table = np.full((int(level.max(initial=0)) + 1, m), np.inf)
    np.minimum.at(table, (level, a), cap)
    np.minimum.at(table, (level, b - (1 << level) + 1), cap)
    for n in range(len(table) - 1, 0, -1):
        half = 1 << (n - 1)
        table[n - 1] = np.minimum(table[n - 1], table[n])
        table[n - 1, half:] = np.minimum(table[n - 1, half:], table[n, :-half])
    return table[0]


PATH_UNIT = 0.01  # toppra's absolute tolerances suit numbers near one: path parameter in cm,
LIMIT_SCALE = 10.0  # and limits near 10
_MOST_POINTS = 2000  # grid points
_STOP = 1e-6  # squared speed that stands for a stop: with zero, rounding turns toppra's intervals inside out
_SPEED_SLACK = 1e-6  # the same for a speed that is given
_NEGLIGIBLE = 1e-6  # share of an acceleration limit
_SHARES = (1.0, 0.999, 0.99, 0.97)  # of the acceleration limits: another try where rounding stopped the first


def fastest(robot: Robot, runs: Runs, effort: Effort, grid: Grid, gravity: Array) -> tuple[Array, int | None]:
    """Fastest path speeds (g,) [m/s] at the grid points.

    Stops are grid points with speed zero, so one call of toppra serves several runs of about 2000 points together, and
    its memory does not grow with the program.

    Args:
        effort: shares of the acceleration limits along the path.
        gravity: (3,) base axes [m/s^2]; counts where the robot has torque limits.

    Returns:
        The speeds, and the index of the grid point where toppra finds no way on (all speeds are then zero), else None.
    """
    speed = np.zeros(len(grid.s))
    for rows in _parts(grid):
        speed[rows], blocked = _of_part(robot, runs, effort, grid.only(rows), gravity)
        if blocked is not None:
            return np.zeros(len(speed)), rows.start + blocked
    return speed, None


def _parts(grid: Grid) -> Iterator[slice]:
    """Slices of the grid that hold whole runs (from standstill to standstill), 2000 points or more but for the last."""
    begin = 0
    for end in (*(np.flatnonzero(np.diff(grid.run)) + 1).tolist(), len(grid.s)):
        if end - begin >= _MOST_POINTS or end == len(grid.s):
            yield slice(begin, end)
            begin = end


@cache
def _solver() -> Any:
    """Return what finds the fastest speed: toppra, or where it is not installed the same in numpy (`reachability`)."""
    try:
        from postproc.motion.timing import constraints
    except ImportError:
        from postproc.motion.timing import reachability

        return reachability
    return constraints


def _of_part(robot: Robot, runs: Runs, effort: Effort, grid: Grid, gravity: Array) -> tuple[Array, int | None]:
    """Fastest path speeds (g,) [m/s] of one part of the grid, and the index of the point where there is no way on.

    It is one call of toppra, repeated with smaller acceleration limits (down to 97 %) if rounding stops it.
    """
    solver = _solver()

    # Derivatives from inside the run, also at its last point, where the curve passes over into the gap.
    last = np.append(np.diff(grid.run) > 0, True)
    inner = np.where(last, np.nextafter(grid.s, -np.inf), grid.s)
    values: list[Array] = [runs.curve(inner), runs.curve(inner, 1) * PATH_UNIT, runs.curve(inner, 2) * PATH_UNIT**2]
    slope, bend = effort.at(grid.s, runs.curve(inner, 1), runs.curve(inner, 2))
    # Next to nothing is nothing: toppra's linear programs fail on lines that are all but parallel.
    bend[np.abs(bend) * grid.cap[:, None] ** 2 < _NEGLIGIBLE] = 0.0
    low, high = (grid.floor / PATH_UNIT) ** 2 * (1 - _SPEED_SLACK), (grid.cap / PATH_UNIT) ** 2 * (1 + _SPEED_SLACK)

    dof = values[0].shape[1]
    bounds = solver.SpeedBounds(low, np.maximum(high, _STOP), dof)
    on_grid = solver.GridPath(values, np.array([grid.s[0], grid.s[-1]]) / PATH_UNIT)
    ease = grid.ease[:, None]
    eased = LIMIT_SCALE * PATH_UNIT * slope / ease, LIMIT_SCALE * PATH_UNIT**2 * bend / ease, np.zeros_like(slope)
    ends = np.minimum(grid.cap, grid.floor)[[0, -1]] / PATH_UNIT
    fixed, may_stop = [solver.JointVelocityConstraint(runs.limits.speed), bounds], grid.floor <= 0
    if robot.torque is not None:
        # M q' u + (M q'' + C(q') q') x + g
        terms = _torque_terms(robot, runs, grid, values, gravity)
        fixed.append(solver.JointLimits(terms, robot.torque, dof))
        may_stop = may_stop & (np.abs(terms[2]) <= robot.torque).all(axis=1)
    blocked = 0
    for share in _SHARES:
        limits = [*fixed, solver.JointLimits(eased, np.full(dof, share * LIMIT_SCALE), dof)]
        problem = solver.TOPPRA(may_stop, limits, on_grid, gridpoints=grid.s / PATH_UNIT, solver_wrapper="seidel",
                        parametrizer="ParametrizeConstAccel")  # fmt: skip
        _, speed, _, controllable = problem.compute_parameterization(*ends, return_data=True)
        if speed is not None and not np.isnan(speed).any():
            return np.where(grid.cap > 0, speed * PATH_UNIT, 0.0), None
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
    payload = payloads(runs.moves_at(grid.s))
    q, q1, q2 = (column[:, :6] for column in values)
    still = np.zeros_like(q)
    weight = inertial_torque(robot, (q, still, still), payload, gravity)
    return inertial_torque(robot, (q, still, q1), payload), inertial_torque(robot, (q, q1, q2), payload), weight
