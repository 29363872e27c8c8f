"""How fast along the path: toppra under the limits of the arm and the program, then a jerk-limited time law."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.motion.findings import at_move
from postproc.motion.grid import Grid, lay_grid, programmed_speed, smooth_speed
from postproc.motion.spline import Index, Runs
from postproc.motion.timelaw import TimeLaw, evaluate, time_law
from postproc.motion.values import Path
from postproc.rapid.events import MotionEvent
from postproc.robot.arm import Robot

UNIT = 0.01  # toppra's absolute tolerances suit numbers near one: path parameter in cm
_STOP = 1e-6  # squared speed that stands for a stop: with zero, rounding turns toppra's intervals inside out
_ROUNDS = 3
_KEPT = 1.001  # ratio to a limit that counts as kept
_MARGIN = 0.95  # what is too fast is slowed a little more than asked for: fewer rounds


def solve(robot: Robot, runs: Runs, grid: Grid, constraints: Sequence[Any] = ()) -> tuple[Array, int | None]:
    """Fastest path speeds (g,) [m/s] at the grid points, all runs in one pass of toppra.

    Stops are grid points with speed zero, so one call serves the whole program and its cost is linear.

    Returns:
        The speeds, and the grid point where toppra finds no way on, if there is one.
    """
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint, LinearConstraint
    from toppra.interpolator import AbstractGeometricPath

    logging.getLogger("toppra").setLevel(logging.ERROR)
    # Derivatives from inside the run, also at its last point, where the curve passes over into the gap.
    last = np.append(np.diff(grid.run) > 0, True)
    inner = np.where(last, np.nextafter(grid.s, -np.inf), grid.s)
    values = [runs.curve(inner), runs.curve(inner, 1) * UNIT, runs.curve(inner, 2) * UNIT**2]

    class OnGrid(AbstractGeometricPath):  # type: ignore[misc]
        dof = 6
        path_interval = np.array([grid.s[0], grid.s[-1]]) / UNIT
        waypoints = None

        def __call__(self, positions: Array, order: int = 0) -> Array:
            return values[order]

    class SpeedCap(LinearConstraint):  # type: ignore[misc]
        dof = 6

        def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
            bound = np.column_stack([np.zeros(len(grid.cap)), np.maximum((grid.cap / UNIT) ** 2, _STOP)])
            return None, None, None, None, None, None, bound

    limits = [JointVelocityConstraint(robot.speed), JointAccelerationConstraint(robot.acceleration), SpeedCap()]
    solver = TOPPRA([*limits, *constraints], OnGrid(), gridpoints=grid.s / UNIT, solver_wrapper="seidel",
                    parametrizer="ParametrizeConstAccel")  # fmt: skip
    _, speed, _, controllable = solver.compute_parameterization(0.0, 0.0, return_data=True)
    if speed is None or np.isnan(speed).any():
        blocked = np.flatnonzero(np.isnan(controllable).any(axis=1) | (controllable == 0).all(axis=1) & (grid.cap > 0))
        return np.zeros(len(grid.s)), int(blocked[-1]) if len(blocked) else 0
    return np.where(grid.cap > 0, speed * UNIT, 0.0), None


@dataclass(frozen=True, slots=True)
class JointMotion:
    """What the joints do at k instants.

    Args:
        place: (k,) path parameter, path_speed: (k,) [m/s].
        v, a: (k, 6) [rad/s], [rad/s^2]; jerk_bend, jerk_slope: (k, 6) [rad/s^3], from the shape of the path and from
            the change of path acceleration.
    """

    place: Array
    path_speed: Array
    v: Array
    a: Array
    jerk_bend: Array
    jerk_slope: Array


def joint_motion(runs: Runs, law: TimeLaw, run: Index, t: Array) -> JointMotion:
    """Motion at times ``t`` (k,) from the start of each run [s].

    qd = q' sd;  qdd = q'' sd^2 + q' sdd;  qddd = q''' sd^3 + 3 q'' sd sdd (bend) + q' sddd (slope).
    """
    s, sd, sdd, sddd = (x[:, None] for x in evaluate(law, run, t))
    place = _place(runs, run, s[:, 0])
    q1, q2, q3 = (runs.curve(place, order) for order in (1, 2, 3))
    bend = q3 * sd**3 + 3 * q2 * sd * sdd
    return JointMotion(place, sd[:, 0], q1 * sd, q2 * sd**2 + q1 * sdd, bend, q1 * sddd)


def _place(runs: Runs, run: Index, s: Array) -> Array:
    """Path parameter of distances in runs, just inside their ends: beyond, the curve already belongs to the gap."""
    edge = np.flatnonzero(np.diff(runs.run, prepend=-1))
    low, high = runs.s[edge], runs.s[np.append(edge[1:], len(runs.s)) - 1]
    return np.minimum(low[run] + s, np.nextafter(high[run], -np.inf))


def limited_law(robot: Robot, path: Path, runs: Runs, events: Sequence[MotionEvent]) -> TimeLaw:
    """The jerk-limited time law of all runs; runs that pass a limit after averaging are slowed there and solved again.

    Raises:
        PostprocError: MOT010, no speed keeps the limits of a joint.
    """
    window = np.full(runs.count, float((robot.acceleration / robot.jerk).max()))
    if runs.count == 0:
        none = np.zeros(0, dtype=np.int64)
        return TimeLaw(none, none, none, *(np.zeros(0) for _ in range(5)), window)
    program = programmed_speed(path, runs)
    cap = np.minimum(program, smooth_speed(robot, runs))
    todo = np.ones(runs.count, dtype=bool)
    run, s, speed = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
    for _ in range(_ROUNDS):
        grid = lay_grid(robot, runs, cap, window).only(todo)
        solved, blocked = solve(robot, runs, grid)
        if blocked is not None:
            raise PostprocError(_blocked(robot, path, runs, grid, blocked, events), exit_code=1)
        keep = ~todo[run]
        run, s, speed = (np.concatenate(x) for x in ((run[keep], grid.run), (s[keep], grid.s), (speed[keep], solved)))
        order = np.lexsort((s, run))
        run, s, speed = run[order], s[order], speed[order]
        window = _wide_enough(robot, runs, run, s, speed, window)
        law = time_law(run, s, speed, window)
        excess, at_speed = _excess(robot, runs, law, program)
        over = excess > _KEPT
        if not over.any():
            return law
        cap[over] = np.minimum(cap[over], at_speed[over]) / excess[over] * _MARGIN
        todo = np.zeros(runs.count, dtype=bool)
        todo[runs.run[:-1][over]] = True
    # What is still above a limit is a matter of per cents: the whole run takes that much longer.
    stretch = np.ones(runs.count)
    np.maximum.at(stretch, runs.run[:-1], excess)
    return time_law(run, s, speed / stretch[run], window * stretch)


def _wide_enough(robot: Robot, runs: Runs, run: Index, s: Array, speed: Array, window: Array) -> Array:
    """Averaging windows (r,) at which no joint passes its jerk limit where speeding up or slowing down is what counts."""
    for _ in range(3):
        law = time_law(run, s, speed, window)
        ratio = np.ones(runs.count)
        for shift in (0.0, 1.0):
            t = law.t + shift * law.window[run] + 1e-9
            m = joint_motion(runs, law, run, t)
            led = np.abs(m.jerk_slope) > np.abs(m.jerk_bend)
            jerk = np.where(led, np.abs(m.jerk_slope + m.jerk_bend), 0.0) / robot.jerk
            np.maximum.at(ratio, run, jerk.max(axis=1))
        if (ratio <= _KEPT).all():
            break
        window = window * np.where(ratio > 1.0, np.minimum(1.02 * ratio, 2.0), 1.0)
    return window


def _excess(robot: Robot, runs: Runs, law: TimeLaw, program: Array) -> tuple[Array, Array]:
    """By which factor each interval (k - 1,) is passed too fast, and at which path speed [m/s]."""
    excess, at_speed = np.zeros(len(program)), np.full(len(program), np.inf)
    for shift in (0.0, 0.25, 0.5, 0.75, 1.0):
        m = joint_motion(runs, law, law.run, law.t + shift * law.window[law.run])
        i = np.clip(np.searchsorted(runs.s, m.place, side="right") - 1, 0, len(program) - 1)
        over = np.maximum.reduce([
            (np.abs(m.v) / robot.speed).max(axis=1),
            m.path_speed / np.where(program[i] > 0, program[i], np.inf),
            np.sqrt((np.abs(m.a) / robot.acceleration).max(axis=1)),
            np.cbrt((np.abs(m.jerk_bend + m.jerk_slope) / robot.jerk).max(axis=1)),
        ])  # fmt: skip
        np.maximum.at(excess, i, over)
        np.minimum.at(at_speed, i, np.where(over > _KEPT, np.maximum(m.path_speed, 1e-4), np.inf))
    return excess, at_speed


def _blocked(robot: Robot, path: Path, runs: Runs, grid: Grid, point: int, events: Sequence[MotionEvent]) -> Diagnostic:
    knot = min(int(np.searchsorted(runs.s, grid.s[point])), len(runs.s) - 1)
    move = path.moves[path.move[runs.sample[knot]]]
    bend = np.abs(runs.curve(min(grid.s[point], np.nextafter(runs.s[-1], 0.0)), 2)) / robot.acceleration
    return at_move(
        events, move, "MOT010", "error",
        f"there is no speed at which the arm can follow the path to this target: joint {np.argmax(bend) + 1} passes its limits",
        "check the joint limits of the robot file, and the path for a singularity",
    )  # fmt: skip
