"""The jerk-limited time law of a path: the fastest speed, averaged in time, checked against every limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array, blocks, distinct, largest_of_rows
from postproc.diagnostics import Diagnostic, Matter, PostprocError
from postproc.motion.findings import at_move
from postproc.motion.inertia import DRIVEN, drive_shares, inertial_torque
from postproc.motion.timing.effort import Effort, effort_of
from postproc.motion.timing.fastest import FASTEST, Grid, fastest, lay_grid, programmed_ease, programmed_speed
from postproc.motion.timing.spline import Cubics, Knots, Runs, fit_spline
from postproc.motion.timing.timelaw import TimeLaw, evaluate, time_law, times_at
from postproc.motion.values import Flags, Index
from postproc.robot.arm import Robot

RAMP = 0.1  # [s] in which an acceleration is taken up: of the IRB 6640, whose ramps are logged (docs/motion.md)
_ROUNDS = 6
_KEPT = 1.001  # ratio to a limit that counts as kept
_PATCH = 40  # grid points on either side of a place that is slowed
_CREEP = 1e-3  # [m/s] slower than this only near a stop, where a lower speed would not help
_TO_EITHER_SIDE = 1e-7  # [s]
_SLIGHT = 0.1  # share of an acceleration limit below which the torque of the drives is not computed
_MARGIN = 0.95  # what is too fast is slowed a little more than asked for: fewer rounds


@dataclass(frozen=True, slots=True)
class Profile:
    """The time law along the runs (stretches from standstill to standstill) of a path.

    Args:
        runs: the knots of the path.
        law: the time law.
        start: (r + 1,) time [s] at which each run begins, and the last one ends.
        payload: masses (k,) [kg] at the knots, and their centers (k, 3) in tool0 [m].
    """

    runs: Knots
    law: TimeLaw
    start: Array
    payload: tuple[Array, Array]

    def at(self, t: Array) -> tuple[Index, Array]:
        """Run (k,) at each time t (k,) [s] from the start of the program, and the time since it began (k,) [s].

        A run is a stretch from standstill to standstill. Times before the start or after the end belong to the first or
        last.
        """
        run = np.clip(np.searchsorted(self.start, t, side="right") - 1, 0, max(self.runs.count - 1, 0))
        return run, t - self.start[run]

    def bare(self) -> Profile:
        """A copy of the profile without path and curve, so that long programs need less memory."""
        knots = Knots(self.runs.sample, self.runs.run, self.runs.count, self.runs.s)
        return Profile(knots, self.law, self.start, self.payload)


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Motion of the c columns of a curve, the six joints and external axes behind them, at k instants.

    Args:
        place: (k,) path parameter [m]; path_speed: (k,) [m/s].
        path_acceleration: (k,) [m/s^2].
        v, a: (k, c) [rad/s], [rad/s^2]; of linear axes [m/s], [m/s^2].
        a_slope: (k, c) the part of a that changes the speed along the path.
        jerk_bend, jerk_slope: (k, c) [rad/s^3], from the shape of the path and from the change of path acceleration.
    """

    place: Array
    path_speed: Array
    path_acceleration: Array
    v: Array
    a: Array
    a_slope: Array
    jerk_bend: Array
    jerk_slope: Array


def joint_motion(runs: Knots, law: TimeLaw, run: Index, t: Array, curve: Cubics) -> JointMotion:
    """Motion of the joints at times ``t`` (k,) [s] since their runs ``run`` (k,) from standstill to standstill began.

    The joints follow the curve over the path parameter:
    qd = q' sd;  qdd = q'' sd^2 + q' sdd;  qddd = q''' sd^3 + 3 q'' sd sdd (bend) + q' sddd (slope).

    Args:
        law: time law of the runs.
        curve: joint angles, and external axes behind them, as a function of the path parameter [m].
    """
    s, sd, sdd, sddd = (x[:, None] for x in evaluate(law, run, t))
    place = _place(runs, run, s[:, 0])
    q1, q2, q3 = curve.derivatives(place)
    bend = q3 * sd**3 + 3 * q2 * sd * sdd
    slope = q1 * sdd
    return JointMotion(place, sd[:, 0], sdd[:, 0], q1 * sd, q2 * sd**2 + slope, slope, bend, q1 * sddd)


def slope_acceleration(runs: Runs, law: TimeLaw, run: Index, t: Array) -> Array:
    """Part (k, c) [rad/s^2] of the accelerations that changes the path speed: ``JointMotion.a_slope``.

    Args:
        run, t: (k,) run (stretch from standstill to standstill), and time since it began [s].
    """
    s, _, sdd, _ = evaluate(law, run, t)
    result = np.zeros((len(t), runs.curve.c.shape[2]))
    rows = np.flatnonzero(sdd)
    q1, _, _ = runs.curve.derivatives(_place(runs, run[rows], s[rows]))
    result[rows] = q1 * sdd[rows, None]
    return result


def _place(runs: Knots, run: Index, s: Array) -> Array:
    """Path parameter (k,) of distances s (k,) [m] from the start of runs (k,) from standstill to standstill.

    It is kept just inside each run, as at the end of a run the curve already belongs to the gap behind it.
    """
    edge = np.flatnonzero(np.diff(runs.run, prepend=-1))
    low, high = runs.s[edge], runs.s[np.append(edge[1:], len(runs.s)) - 1]
    return np.minimum(low[run] + s, np.nextafter(high[run], -np.inf))


def limited_law(robot: Robot, runs: Runs, gravity: Array) -> TimeLaw:
    """The jerk-limited time law of all runs.

    Where the averaged motion exceeds a limit, the speed of that stretch is lowered and solved again, up to six times;
    what then still exceeds one makes its whole run slower.

    Args:
        gravity: (3,) in base axes [m/s^2].

    Raises:
        PostprocError: MOT010, no speed keeps the limits of a joint.
    """
    window = np.full(runs.count, max(RAMP, float((runs.limits.acceleration / runs.limits.jerk).max())))
    if runs.count == 0:
        return time_law(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), window)
    stated = programmed_speed(runs), programmed_ease(runs)
    # Where the curvature of the path alone uses half of a joint's jerk limit: |q'''| s_dot^3, constant between knots.
    jerk = (np.abs(6 * runs.curve.c[0]) / runs.limits.jerk).max(axis=1)
    smooth = np.cbrt(0.5 / np.maximum(jerk, 0.5 / FASTEST**3))
    effort = effort_of(robot, runs)
    grid = lay_grid(runs, effort, np.minimum(stated[0], smooth), stated[1], window)

    def solve(part: Grid) -> tuple[Array, int | None]:
        """Fastest speeds (g,) [m/s] on a part of the grid, and the point where there is no way on."""
        return fastest(robot, runs, effort, part, gravity)

    speed, blocked = solve(grid)
    if blocked is not None:
        raise PostprocError(_blocked(robot, runs, grid.s[blocked], gravity), exit_code=1)
    changed = np.ones(len(grid.s), dtype=bool)
    excess = np.zeros(len(stated[0]))
    for attempt in range(_ROUNDS + 1):
        wider = _wide_enough(runs, grid, speed, window, changed)
        changed |= (wider > window)[grid.run]
        window = wider
        law = time_law(grid.run, grid.s, speed, window)
        allowed = _examine((runs, effort), law, stated, np.flatnonzero(changed), excess)
        if not (excess > _KEPT).any():
            return law
        if attempt < _ROUNDS:
            grid, speed, changed = _slowed(runs, (grid, speed), excess, allowed, solve)
    # What is still above a limit is a matter of per cents: the whole run takes that much longer.
    stretch = np.ones(runs.count)
    np.maximum.at(stretch, runs.run[:-1], excess)
    return time_law(grid.run, grid.s, speed / stretch[grid.run], window * stretch)


def _slowed(
    runs: Runs,
    now: tuple[Grid, Array],
    excess: Array,
    allowed: Array,
    solve: Callable[[Grid], tuple[Array, int | None]],
) -> tuple[Grid, Array, Flags]:
    """The grid with lower speed bounds where intervals were passed too fast, and its speeds solved again around them.

    Args:
        now: the grid, and its speeds (g,) [m/s].
        excess: (k - 1,) factor by which each interval is passed too fast.
        allowed: (k - 1,) path speed to allow instead [m/s].
        solve: function that returns the speeds of a grid, and where it is blocked, as ``fastest`` does.

    Returns:
        The grid, its speeds, and which of its points (g,) bool were solved again.
    """
    grid, speed = now
    near = [np.clip(np.searchsorted(runs.s, grid.s, side) - 1, 0, len(allowed) - 1) for side in ("left", "right")]
    over = np.maximum(excess[near[0]], excess[near[1]])
    least = np.minimum(grid.cap, _CREEP)
    lower = np.minimum(np.minimum(allowed[near[0]], allowed[near[1]]), _MARGIN * grid.cap / np.maximum(over, 1.0))
    cap = np.where(over > _KEPT, np.maximum(lower, least), grid.cap)
    if not (cap < grid.cap).any():
        return grid, speed, np.zeros(len(cap), dtype=bool)
    rows = np.zeros(len(cap), dtype=bool)
    around = np.flatnonzero(cap < grid.cap)[:, None] + np.arange(-_PATCH, _PATCH + 1)
    rows[np.clip(around, 0, len(cap) - 1)] = True
    edge = rows & (np.append(False, ~rows[:-1]) | np.append(~rows[1:], False)) & (grid.cap > 0)
    grid = replace(grid, cap=cap)
    part = replace(grid, cap=np.where(edge, speed, cap), floor=np.where(edge, speed, 0.0)).only(rows)
    solved, blocked = solve(part)
    if blocked is not None:
        # The stretch is too short to slow down in: solve everything.
        again, blocked = solve(grid)
        return grid, speed if blocked is not None else again, np.ones_like(rows)
    result = speed.copy()
    result[rows] = solved
    return grid, result, rows


def _wide_enough(runs: Runs, grid: Grid, speed: Array, window: Array, changed: Flags) -> Array:
    """Averaging windows (r,) [s] long enough that no joint exceeds its jerk limit by a change of path acceleration.

    Args:
        speed: (g,) path speed at the grid points [m/s].
        window: (r,) windows to start from [s].
        changed: (g,) grid points to look at.
    """
    rows = np.flatnonzero(changed)
    run = grid.run[rows]
    for _ in range(3):
        law = time_law(grid.run, grid.s, speed, window)
        ratio = np.ones(runs.count)
        for shift in (0.0, 1.0):
            m = joint_motion(runs, law, run, law.t[rows] + shift * window[run] + 1e-9, runs.curve)
            led = np.abs(m.jerk_slope) > np.abs(m.jerk_bend)
            jerk = np.where(led, np.abs(m.jerk_slope + m.jerk_bend), 0.0) / runs.limits.jerk
            np.maximum.at(ratio, run, largest_of_rows(jerk))
        if (ratio <= _KEPT).all():
            break
        window = window * np.where(ratio > 1.0, np.minimum(1.02 * ratio, 2.0), 1.0)
        rows = np.flatnonzero((ratio > 1.0)[grid.run])
        run = grid.run[rows]
    return window


def _examine(
    along: tuple[Runs, Effort], law: TimeLaw, stated: tuple[Array, Array], rows: Index, excess: Array
) -> Array:
    """Write into ``excess`` (k - 1,) the factor by which some intervals are passed too fast, 1 at a limit.

    Args:
        along: the path, and the shares of the acceleration limits along it.
        stated: ``programmed_speed`` and ``programmed_ease`` of the intervals, (k - 1,) each.
        rows: indices of the grid points to look at.

    Returns:
        (k - 1,) path speed [m/s] to allow instead, infinite where no limit is exceeded.
    """
    (runs, effort), (program, ease) = along, stated
    allowed = np.full(len(program), np.inf)
    largest = np.full(len(program), -1.0)
    run = law.run[rows]
    # Where the averaged acceleration bends; either side of every grid point, where speed limits change; between.
    begins = law.t[rows]
    passes = times_at(law, run, law.s[rows])
    between = 0.5 * (passes + np.append(passes[1:], passes[-1:]))
    between = np.where(np.append(np.diff(rows) == 1, False) & (between > passes), between, passes)
    for t in (begins, begins + law.window[run], passes - _TO_EITHER_SIDE, passes + _TO_EITHER_SIDE, between):
        m = joint_motion(runs, law, run, t, runs.curve)
        i = np.clip(np.searchsorted(runs.s, m.place, side="right") - 1, 0, len(program) - 1)
        over = np.maximum.reduce([
            largest_of_rows(np.abs(m.v) / runs.limits.speed),
            m.path_speed / np.where(program[i] > 0, program[i], np.inf),
            np.sqrt(_used(effort, m) / ease[i]),
            np.cbrt(largest_of_rows(np.abs(m.jerk_bend + m.jerk_slope) / runs.limits.jerk)),
        ])  # fmt: skip
        np.maximum.at(largest, i, over)
        slower = _MARGIN * np.maximum(m.path_speed, _CREEP) / np.maximum(over, 1.0)
        np.minimum.at(allowed, i, np.where(over > _KEPT, slower, np.inf))
    excess[largest >= 0.0] = largest[largest >= 0.0]
    return allowed


def _used(effort: Effort, m: JointMotion) -> Array:
    """Largest share (k,) of an acceleration limit that a motion uses at k instants, 1 at the limit."""
    share = m.a / effort.acceleration
    if len(effort.slope):
        slope, bend = effort.driven(m.place)
        share[:, DRIVEN] = slope * m.path_acceleration[:, None] + bend * m.path_speed[:, None] ** 2
    return largest_of_rows(np.abs(share))


def _blocked(robot: Robot, runs: Runs, s: float, gravity: Array) -> Diagnostic:
    """MOT010, an error at the move at path parameter s: at no speed does the arm keep its limits there.

    It names the joint or axis that uses most of its torque limit (by its weight), or without torque limits, of its
    acceleration limit.
    """
    (move,) = runs.moves_at(np.array([s]))
    place = np.array([min(s, np.nextafter(runs.s[-1], 0.0))])
    if robot.torque is None:
        share = np.abs(runs.curve(place, 2)[0]) / runs.limits.acceleration
    else:
        still = np.zeros((1, 6))
        payload = np.array([move.payload_mass]), move.payload_center[None]
        weight = inertial_torque(robot, (runs.curve(place)[:, :6], still, still), payload, gravity)
        share = np.abs(weight[0]) / robot.torque
    finding = at_move(
        move, "MOT010", "error",
        f"at no speed can the arm follow the path to this target: {runs.name(int(np.argmax(share)))} passes its limits",
        "check the joint limits of the robot file, and the path for a singularity",
    )  # fmt: skip
    return replace(finding, matter=Matter.UNFOLLOWABLE)


@dataclass(frozen=True, slots=True)
class LimitReport:
    """Use of the joint limits by the corrected motion.

    Args:
        use: (3, 6) largest ratios to the limits of speed, acceleration and jerk, 1 = at the limit.
        cycle_time: [s] as planned.
        slower: [s] if every run were stretched until its worst place keeps the limits.
    """

    use: Array
    cycle_time: float
    slower: float


def check_limits(robot: Robot, profile: Profile, q_corrected: Array) -> LimitReport:
    """Compare the corrected joint motion, on the time law of the programmed one, with the limits of the joints.

    Args:
        profile: of the programmed motion.
        q_corrected: (n, 6) commanded joint angles at the samples of the path [rad].
    """
    worst = np.zeros((3, 6))
    cycle_time = float(profile.start[-1])
    needed = np.ones(max(1, profile.runs.count))
    if profile.runs.count:
        curve = fit_spline(profile.runs.s, q_corrected[profile.runs.sample], profile.runs.run)
        law = profile.law
        begin = profile.start[law.run] + law.t
        moments = distinct(np.concatenate([begin + x * law.window[law.run] for x in (0.0, 0.25, 0.5, 0.75, 1.0)]))
        for part in blocks(len(moments)):
            run, inner = profile.at(moments[part])
            m = joint_motion(profile.runs, law, run, inner, curve)
            jerk = np.abs(m.jerk_bend + m.jerk_slope) / robot.jerk
            share = m.a / robot.acceleration
            if robot.drives is not None:
                rows = np.flatnonzero(largest_of_rows(np.abs(share)) > _SLIGHT)
                place = m.place[rows]
                near = np.minimum(np.searchsorted(profile.runs.s, place), len(profile.runs.s) - 1)
                payload = profile.payload[0][near], profile.payload[1][near]
                motion = curve(place)[:, :6], m.v[rows], m.a[rows]
                share[rows, DRIVEN] = drive_shares(robot, robot.drives, motion, payload)
            ratios = np.abs(m.v) / robot.speed, np.abs(share), jerk  # (k, 6) each, 1 at the limit
            for ratio, power in zip(ratios, (1.0, 0.5, 1.0 / 3.0), strict=True):
                np.maximum.at(needed, run, largest_of_rows(ratio) ** power)
            for kind, ratio in enumerate(ratios):
                worst[kind] = np.maximum(worst[kind], ratio.max(axis=0))
    extra = float(np.sum(profile.law.duration * (needed - 1.0))) if profile.runs.count else 0.0
    return LimitReport(worst, cycle_time, cycle_time + extra)


def join_reports(reports: Sequence[LimitReport]) -> LimitReport:
    """One report for parts of a program that follow each other: largest use, sums of the times."""
    use = np.max([r.use for r in reports], axis=0)
    return LimitReport(use, sum(r.cycle_time for r in reports), sum(r.slower for r in reports))
