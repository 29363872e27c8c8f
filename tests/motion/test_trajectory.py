"""Time: limits kept everywhere, programmed speeds held, rest at stops; against plain numerical differentiation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from postproc.motion.inertia import inertial_torque
from postproc.motion.path.samples import sample_path
from postproc.motion.timing.effort import Effort, effort_of
from postproc.motion.timing.fastest import Grid, fastest
from postproc.motion.timing.jerk_limited import check_limits, joint_motion
from postproc.motion.timing.spline import Runs, fit_spline
from postproc.motion.timing.timelaw import evaluate, time_law, times_at
from postproc.motion.timing.trajectory import Trajectory, cut_legs, retime
from postproc.robot.arm import Robot
from tests.build import refused
from tests.cost import operations
from tests.motion.build import ROBOT, arc, chain, joint, line, pose, sampled, tcp, timed

WELD: list[dict[str, Any]] = [
    joint(pose(1.0, -0.5, 0.9)),
    line(pose(1.1, -0.4, 0.6), speed=1.0, rotation_speed=5.0, zone=0.05, zone_rotation=0.075),
    line(pose(1.2, -0.3, 0.5), speed=0.25, zone=0.001, zone_rotation=0.0015),
    line(pose(1.2, 0.2, 0.5), speed=0.01, welding=True, zone=0.001, zone_rotation=0.001),
    arc(pose(1.2 - 0.1 * (1 - np.sqrt(0.5)), 0.2 + 0.1 * np.sqrt(0.5), 0.5), pose(1.1, 0.3, 0.5), speed=0.01,
        welding=True, fine=True),
    line(pose(1.1, 0.3, 0.8), speed=2.0, fine=True),
    joint(pose(1.0, -0.5, 0.9), speed=5.0, fine=True),
]  # fmt: skip


def positions(trajectory: Trajectory, t: np.ndarray) -> np.ndarray:
    """Joint angles (k, 6) at any times, from nothing but the curve and the time law's distance."""
    runs = trajectory.profile.runs
    run, inner = trajectory.profile.at(t)
    s = evaluate(trajectory.profile.law, run, inner)[0]
    first = np.flatnonzero(np.diff(runs.run, prepend=-1))
    last = np.append(first[1:], len(runs.s)) - 1
    return np.asarray(runs.curve(np.minimum(runs.s[first][run] + s, np.nextafter(runs.s[last][run], -1.0))))


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return timed(*WELD)


def assert_limits_hold(trajectory: Trajectory) -> None:
    profile = trajectory.profile
    t = np.linspace(0.0, trajectory.t[-1], 400_001)
    m = joint_motion(profile.runs, profile.law, *profile.at(t), profile.runs.curve)
    assert (np.abs(m.v) / ROBOT.speed).max() < 1.002
    # The arm is used: some limit is nearly reached on the fast moves.
    assert 0.5 < (np.abs(m.a) / ROBOT.acceleration).max() < 1.01
    assert (np.abs(m.jerk_bend + m.jerk_slope) / ROBOT.jerk).max() < 1.05


def test_speed_acceleration_and_jerk_limits_hold_everywhere(trajectory: Trajectory) -> None:
    assert_limits_hold(trajectory)


def test_a_run_that_is_not_slowed_enough_in_time_takes_longer_as_a_whole(
    trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("postproc.motion.timing.jerk_limited._ROUNDS", 0)
    stretched = timed(*WELD)
    assert_limits_hold(stretched)
    assert 1.01 * trajectory.t[-1] < stretched.t[-1] < 1.3 * trajectory.t[-1]  # its slow weld, too


def test_a_stretch_too_short_to_slow_down_in_is_solved_with_all_of_the_path(
    trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    every: list[bool] = []

    def no_part(
        robot: Robot, runs: Runs, effort: Effort, grid: Grid, gravity: np.ndarray
    ) -> tuple[np.ndarray, int | None]:
        every.append(not grid.floor.any())
        return fastest(robot, runs, effort, grid, gravity) if every[-1] else (np.zeros(len(grid.s)), 0)

    monkeypatch.setattr("postproc.motion.timing.jerk_limited.fastest", no_part)
    again = timed(*WELD)
    assert every[:3] == [True, False, True]  # as it is, the part that was too fast, everything instead
    assert_limits_hold(again)
    assert again.t[-1] == pytest.approx(trajectory.t[-1], rel=0.01)


def test_derivatives_are_those_of_the_motion(trajectory: Trajectory) -> None:
    """Speeds and accelerations against central differences of the joint angles."""
    profile, h = trajectory.profile, 1e-5
    t = np.random.default_rng(1).uniform(0.0, trajectory.t[-1], 3000)
    q0, q1, q2 = (positions(trajectory, t + x) for x in (-h, 0.0, h))
    m = joint_motion(profile.runs, profile.law, *profile.at(t), profile.runs.curve)
    away = np.abs(t[:, None] - profile.start).min(axis=1) > 2 * h
    assert np.abs((q2 - q0) / (2 * h) - m.v)[away].max() < 1e-4
    kink = np.abs(m.a - (q2 - 2 * q1 + q0) / h**2).max(axis=1)[away]
    # At the few places where the jerk jumps the difference quotient is that coarse.
    assert np.quantile(kink, 0.99) < 2e-2


def test_programmed_speeds_are_kept_and_held(trajectory: Trajectory) -> None:
    t = np.linspace(0.0, trajectory.t[-1], 400_001)
    p = tcp(positions(trajectory, t))[:, :3, 3]
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) / np.diff(t)
    path = trajectory.path
    at = path.move[np.clip(np.searchsorted(trajectory.t, t[1:]), 0, len(path.move) - 1)]
    programmed = np.array([m.speed for m in path.moves])[at]
    in_space = np.array([m.kind != "joint" for m in path.moves])[at]
    # In a zone corner the chords that carry the speed are up to 0.5 % short.
    assert (speed / programmed)[in_space].max() < 1.02
    for move, rel in ((3, 2e-4), (4, 2e-3)):
        middle = (path.move == move) & (path.u > 0.1) & (path.u < 0.9)
        assert trajectory.tcp_speed[middle] == pytest.approx(0.01, rel=rel)
        assert move == 4 or np.abs(trajectory.a[middle]).max() < 1e-3


def test_rest_at_every_stop(trajectory: Trajectory) -> None:
    path = trajectory.path
    stops = path.goal[path.stop]
    assert len(stops) == 4
    assert max(np.abs(of[stops]).max() for of in (trajectory.v, trajectory.a)) < 1e-9
    assert (trajectory.tcp_speed[path.goal[~path.stop]] > 1e-3).all()


def test_time_runs_and_fits_the_distance(trajectory: Trajectory) -> None:
    path, t = trajectory.path, trajectory.t
    assert (np.diff(t) > 0).all()
    inside = np.setdiff1d(np.arange(1, len(t) - 1), path.goal[path.stop])
    assert np.abs(positions(trajectory, t[inside]) - path.q[inside]).max() < 1e-8


TURNED = pose(1.1, 0.0, 0.5, (60.0, 180.0, 0.0))
HALF_METRE = joint(pose(1.1, -0.3, 0.5)), pose(1.1, 0.3, 0.5)
LASTING = {
    # A slow weld between stops takes its length over its speed, the window, and next to nothing more.
    "its length over its speed": (HALF_METRE[0], line(HALF_METRE[1], speed=0.008, fine=True), 0.6 / 0.008, 0.02),
    "a duration": (HALF_METRE[0], line(HALF_METRE[1], speed=1.0, duration=7.5, fine=True), 7.5, 0.22),
    "a speed of reorientation": (
        joint(pose(1.1, 0.0, 0.5)), line(TURNED, speed=1.0, rotation_speed=np.radians(20.0), fine=True), 3.0, 0.15,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("start", "step", "seconds", "within"), LASTING.values(), ids=LASTING)
def test_a_move_lasts_as_long_as_programmed(
    start: dict[str, Any], step: dict[str, Any], seconds: float, within: float
) -> None:
    trajectory = timed(start, step)
    window = 0.0 if "duration" in step else float(trajectory.profile.law.window[0])
    assert trajectory.t[-1] == pytest.approx(seconds + window, abs=within)


def test_accset_lowers_accelerations_while_it_is_in_force() -> None:
    """The same way at 50 %, at 100 %, and through a zone from one to the other; numerical second derivatives."""
    ahead, back = (
        line(p, speed=5.0, rotation_speed=20.0, fine=True) for p in (pose(1.2, 0.3, 0.6), pose(1.0, -0.3, 0.7))
    )
    through = {**ahead, "ease": 0.5, "fine": False, "zone": 0.05, "zone_rotation": 0.05}
    trajectory = timed(joint(pose(1.0, -0.3, 0.7), fine=True), {**ahead, "ease": 0.5}, back, through, back)
    goals, step = trajectory.t[trajectory.path.goal], 1e-4

    def used(begin: float, end: float) -> float:
        t = np.arange(begin + step, end - step, 2e-4)
        q = [positions(trajectory, t + shift) for shift in (-step, 0.0, step)]
        return float(np.max(np.abs(q[0] - 2 * q[1] + q[2]) / step**2 / ROBOT.acceleration))

    assert used(goals[0], goals[1]) == pytest.approx(0.5, abs=0.02)
    assert used(goals[1], goals[2]) == pytest.approx(1.0, abs=0.03)
    in_zone = trajectory.path.blend & (trajectory.path.move == 3)
    assert used(goals[2], trajectory.t[in_zone].min()) < 0.51
    assert 0.9 < used(trajectory.t[trajectory.path.blend].max(), goals[4]) < 1.03
    # From rest to rest without reaching a top speed, time goes with the root of acceleration.
    assert 1.05 < (goals[1] - goals[0]) / (goals[2] - goals[1]) < 2**0.5


def test_torque_limits() -> None:
    path = sampled(joint(pose(1.1, -0.4, 0.9)), joint(pose(1.1, 0.4, 0.4), speed=5.0, fine=True))
    weak = np.array([200.0, 4000.0, 2000.0, 300.0, 200.0, 100.0])
    free, limited = retime(ROBOT, path), retime(replace(ROBOT, torque=weak), path)
    first = []
    for trajectory in (free, limited):
        none = np.zeros(len(trajectory.t))
        motion = trajectory.path.q, trajectory.v, trajectory.a_sustained
        first.append(np.abs(inertial_torque(ROBOT, motion, (none, np.zeros((len(none), 3))))[:, 0]).max())
    assert limited.t[-1] > free.t[-1]
    assert first[0] > 200.0 and first[1] < 200.0 * 1.05
    (error,) = refused(lambda: retime(replace(ROBOT, torque=np.where(np.arange(6) == 1, 10.0, weak)), path))
    assert error.code == "MOT010" and "joint 2" in error.message


def test_the_same_motion_keeps_the_limits_and_a_wild_correction_does_not(trajectory: Trajectory) -> None:
    path, profile = trajectory.path, trajectory.profile
    gentle, wild = 1e-3 * np.sin(path.way()), 2e-3 * (np.arange(len(path.q)) % 2)
    same, slower, much = (check_limits(ROBOT, profile, path.q + by) for by in (0.0, gentle[:, None], wild[:, None]))
    assert same.cycle_time == trajectory.t[-1]
    assert same.slower < 1.02 * same.cycle_time
    assert slower.slower < 1.05 * same.cycle_time and much.slower > 1.2 * same.cycle_time


def test_no_motion_no_time() -> None:
    trajectory = timed(joint(pose(1.1, 0.0, 0.5)))
    assert trajectory.t.tolist() == [0.0]
    assert check_limits(ROBOT, trajectory.profile, trajectory.path.q).slower == 0.0


def test_a_target_that_is_stated_twice_is_a_stop() -> None:
    again = line(pose(1.1, 0.1, 0.5), zone=0.01)
    trajectory = timed(joint(pose(1.1, -0.1, 0.5)), again, again, line(pose(1.1, 0.3, 0.5)))
    assert np.isfinite(trajectory.t).all()
    assert trajectory.path.stop.tolist() == [True, True, True, True]


def test_cost_grows_with_the_program_and_no_faster() -> None:
    def cost(n: int) -> int:
        points = [line(pose(1.1 + 0.02 * (k % 2), -0.4 + 0.8 * k / n, 0.5), zone=0.001, speed=0.1) for k in range(n)]
        path = sampled(joint(pose(1.0, -0.4, 0.6)), *points, line(pose(1.1, 0.4, 0.5), fine=True))
        return operations(lambda: retime(ROBOT, path))

    cost(10)
    assert cost(800) < 8 * 1.2 * cost(100)


def test_speeds_are_those_of_toppra_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the programs left out where the arm may rest, runs solved apart nor the numpy solver change the speeds."""
    from toppra.algorithm import TOPPRA as plain

    from postproc.motion.timing import constraints, reachability
    from postproc.motion.timing import fastest as module
    from postproc.motion.timing.fastest import lay_grid, programmed_ease, programmed_speed
    from postproc.motion.timing.spline import cut_runs

    path = sampled(*WELD)
    for robot in (ROBOT, replace(ROBOT, torque=np.array([4000.0, 5000, 3000, 400, 400, 200]))):
        runs = cut_runs(robot, path)
        effort = effort_of(robot, runs)
        grid = lay_grid(runs, effort, programmed_speed(runs), programmed_ease(runs), np.full(runs.count, 0.05))
        gravity = np.array([0.0, 0.0, -9.81])
        monkeypatch.setattr(module, "_MOST_POINTS", 10)
        apart, blocked = fastest(robot, runs, effort, grid, gravity)
        assert blocked is None and runs.count > 1 and (np.diff(grid.run) > 0).any()
        with monkeypatch.context() as at_once:
            at_once.setattr(module, "_MOST_POINTS", 10**6)
            at_once.setattr(constraints, "TOPPRA", lambda may_stop, *words, **named: plain(*words, **named))
            assert np.allclose(fastest(robot, runs, effort, grid, gravity)[0], apart, rtol=2e-5, atol=2e-5)
        with monkeypatch.context() as without_toppra:
            without_toppra.setattr(module, "_solver", lambda: reachability)
            assert np.allclose(fastest(robot, runs, effort, grid, gravity)[0], apart, rtol=1e-7, atol=1e-7)


def welded_rows() -> list[dict[str, Any]]:
    """Four welded rows of three targets with a stop at either end, and a lone move after them."""
    steps = [joint(pose(1.1, -0.1, 0.5), fine=True)]
    for x in (1.1, 1.11, 1.12, 1.13):
        steps += [line(pose(x, y, 0.5), speed=0.02, zone=0.001, fine=y == 0.1, welding=True) for y in (-0.05, 0.0, 0.1)]
        steps.append(line(pose(x + 0.01, -0.1, 0.5), speed=0.5, fine=True))
    return [*steps, joint(pose(1.2, 0.2, 0.6), starts_chain=True)]


@pytest.mark.parametrize("most", [25, 35, 45])
def test_legs_cover_the_program_and_meet_at_stops(most: int) -> None:
    moves = tuple(chain(*welded_rows()))
    legs = list(cut_legs(moves, np.full(len(moves), 10), most))
    assert len(legs) > 2
    done = 0
    for first, leg in legs:
        goes_on = first < done
        assert leg[0].starts_chain and first == (done - 1 if goes_on else done)
        assert not goes_on or moves[first].fine
        assert [m.row for m in leg] == list(range(first, first + len(leg)))
        done = first + len(leg)
    assert done == len(moves)


def test_legs_are_timed_as_the_full_program_is() -> None:
    moves = tuple(chain(*welded_rows()[:-1]))
    path = sample_path(ROBOT, moves)[0]
    full = retime(ROBOT, path, np.full(len(path.q), 0.1))
    place, begin = path.move + path.u, 0.0
    for first, leg in cut_legs(moves, np.full(len(moves), 10), most=35):
        part, findings = sample_path(ROBOT, leg)
        assert findings == []
        trajectory = retime(ROBOT, part, np.full(len(part.q), 0.1))
        inside = slice(1, None)  # a stop may be left at another time than it is reached
        at = (first + part.move + part.u)[inside]
        assert np.isin(at, place).all()
        k = np.searchsorted(place, at)
        assert np.abs(part.q[inside] - path.q[k]).max() < 1e-9
        assert np.abs(begin + trajectory.t[inside] - full.t[k]).max() < 1e-3 * full.t[-1]
        assert np.abs(trajectory.v[inside] - full.v[k]).max() < 1e-3
        assert np.abs(trajectory.a[inside] - full.a[k]).max() < 0.01 * np.abs(full.a).max()
        begin += trajectory.t[-1]
    assert abs(begin - full.t[-1]) < 1e-3 * full.t[-1]


@pytest.mark.parametrize("seed", range(60))
def test_the_averaged_time_law_is_averaged_by_hand_and_inverted(seed: int) -> None:
    """Two runs from rest to rest; a run of one interval has no speed in its middle."""
    rng = np.random.default_rng(seed)
    run = np.repeat([0, 1], rng.integers(3, 12, 2))
    s, speed = np.cumsum(rng.uniform(0.001, 0.1, len(run))), rng.uniform(0.05, 1.0, len(run))
    speed[(np.diff(run, prepend=-1) > 0) | (np.diff(run, append=2) > 0)] = 0.0
    law = time_law(run, s, speed, rng.uniform(0.02, 0.3, 2))
    for r in (0, 1):
        W, end = law.window[r], law.t[law.last[r]]
        fine = np.linspace(-W, end + W, 20_001)
        sharp = np.zeros_like(fine)
        for i in np.flatnonzero(run == r)[:-1]:
            tau = np.clip(fine - law.t[i], 0.0, law.t[i + 1] - law.t[i])
            sharp += speed[i] * tau + law.acceleration[i] * tau**2 / 2
        area = np.concatenate([[0.0], np.cumsum((sharp[1:] + sharp[:-1]) / 2 * np.diff(fine))])
        t = np.linspace(0.0, end + W, 50)
        at, v, a, _ = evaluate(law, np.full(50, r), t)
        assert at == pytest.approx((np.interp(t, fine, area) - np.interp(t - W, fine, area)) / W, abs=1e-5)
        assert (np.diff(at) >= -1e-12).all()
        assert (v <= speed.max() + 1e-9).all()
        assert (np.abs(a) <= np.abs(law.acceleration).max() + 1e-9).all()
        assert v[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert a[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-6)
    t = times_at(law, run, law.s)
    assert evaluate(law, run, t)[0] == pytest.approx(law.s, abs=1e-9)
    assert t[law.last] == pytest.approx(law.duration)


def test_splines_of_runs_are_those_of_scipy_inside() -> None:
    """One long run: against scipy's spline with parabolic ends, built from its own slopes at the ends."""
    s = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 40))
    q = np.sin(s[:, None] * np.linspace(0.1, 0.4, 6))
    ours = fit_spline(s, q, np.zeros(40, dtype=np.int64))
    ends = ours(np.array([s[0], np.nextafter(s[-1], 0.0)]), 1)
    theirs = CubicSpline(s, q, bc_type=((1, ends[0]), (1, ends[1])))
    x = np.linspace(s[0], s[-1] - 1e-9, 500)
    for order in (0, 1, 2):
        assert np.abs(ours(x, order) - theirs(x, order)).max() < 1e-9
    assert np.abs(ours.c[0][[0, -1]]).max() < 1e-9
    for order, value in enumerate(ours.derivatives(x), start=1):
        assert np.abs(value - theirs(x, order)).max() < 1e-8


def test_runs_do_not_feel_each_other() -> None:
    s, run = np.array([0.0, 1.0, 2.0, 2.1, 3.0, 3.5, 3.6, 4.0]), np.array([0, 0, 0, 1, 1, 1, 2, 2])
    q = np.arange(48.0).reshape(8, 6) ** 1.3
    every = fit_spline(s, q, run)
    for r in range(3):
        rows = np.flatnonzero(run == r)
        alone = fit_spline(s[rows], q[rows], run[rows] - r)
        x = np.linspace(s[rows[0]], s[rows[-1]] - 1e-9, 20)
        assert np.abs(every(x) - alone(x)).max() < 1e-9
    # A run of one interval is a straight line.
    assert np.abs(every(np.array([3.8]), 2)).max() < 1e-9
