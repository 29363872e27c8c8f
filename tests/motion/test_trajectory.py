"""Time: limits kept everywhere, programmed speeds held, rest at stops; against plain numerical differentiation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.motion.path.samples import sample_path
from postproc.motion.timing.fastest import Grid, fastest
from postproc.motion.timing.inertia import inertial_torque
from postproc.motion.timing.jerk_limited import Profile, joint_motion
from postproc.motion.timing.limits import check_limits
from postproc.motion.timing.spline import Runs
from postproc.motion.timing.trajectory import Trajectory, retime
from postproc.motion.values import Move
from postproc.robot.arm import Robot
from tests.build import refused
from tests.cost import operations
from tests.motion.build import ROBOT, arc, chain, joint, line, pose, tcp


def timed(moves: list[Move], **more: object) -> Trajectory:
    path, findings = sample_path(ROBOT, moves)
    assert findings == []
    return retime(ROBOT, path, **more)  # type: ignore[arg-type]


def weld() -> list[Move]:
    return chain(
        joint(pose(1.0, -0.5, 0.9)),
        line(pose(1.1, -0.4, 0.6), speed=1.0, rotation_speed=5.0, zone=0.05, zone_rotation=0.075),
        line(pose(1.2, -0.3, 0.5), speed=0.25, zone=0.001, zone_rotation=0.0015),
        line(pose(1.2, 0.2, 0.5), speed=0.01, welding=True, zone=0.001, zone_rotation=0.001),
        arc(pose(1.2 - 0.1 * (1 - np.sqrt(0.5)), 0.2 + 0.1 * np.sqrt(0.5), 0.5), pose(1.1, 0.3, 0.5), speed=0.01,
            welding=True, fine=True),
        line(pose(1.1, 0.3, 0.8), speed=2.0, fine=True),
        joint(pose(1.0, -0.5, 0.9), speed=5.0, fine=True),
    )  # fmt: skip


def positions(trajectory: Trajectory, t: np.ndarray) -> np.ndarray:
    """Joint angles (k, 6) at any times, from nothing but the curve and the time law's distance."""
    from postproc.motion.timing.timelaw import evaluate

    profile: Profile = trajectory.profile
    run, inner = profile.at(t)
    s = evaluate(profile.law, run, inner)[0]
    first = np.flatnonzero(np.diff(profile.runs.run, prepend=-1))
    last = np.append(first[1:], len(profile.runs.s)) - 1
    place = np.minimum(profile.runs.s[first][run] + s, np.nextafter(profile.runs.s[last][run], -1.0))
    return np.asarray(profile.runs.curve(place))


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return timed(weld())


def assert_limits_hold(trajectory: Trajectory) -> None:
    profile: Profile = trajectory.profile
    t = np.linspace(0.0, trajectory.t[-1], 400_001)
    m = joint_motion(profile.runs, profile.law, *profile.at(t), profile.runs.curve)
    assert (np.abs(m.v) / ROBOT.speed).max() < 1.002
    assert (np.abs(m.a) / ROBOT.acceleration).max() < 1.01
    assert (np.abs(m.jerk_bend + m.jerk_slope) / ROBOT.jerk).max() < 1.05
    # The arm is used: some limit is nearly reached on the fast moves.
    assert (np.abs(m.a) / ROBOT.acceleration).max() > 0.5


def test_speed_acceleration_and_jerk_limits_hold_everywhere(trajectory: Trajectory) -> None:
    assert_limits_hold(trajectory)


def test_a_run_that_is_not_slowed_enough_in_time_takes_longer_as_a_whole(
    trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("postproc.motion.timing.jerk_limited._ROUNDS", 0)
    stretched = timed(weld())
    assert_limits_hold(stretched)
    assert stretched.t[-1] == pytest.approx(trajectory.t[-1], rel=0.01)
    assert abs(stretched.t[-1] - trajectory.t[-1]) > 1e-3  # it is another law


def test_a_stretch_too_short_to_slow_down_in_is_solved_with_all_of_the_path(
    trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole: list[bool] = []

    def no_part(robot: Robot, runs: Runs, grid: Grid, gravity: np.ndarray) -> tuple[np.ndarray, int | None]:
        whole.append(not grid.floor.any())
        return fastest(robot, runs, grid, gravity) if whole[-1] else (np.zeros(len(grid.s)), 0)

    monkeypatch.setattr("postproc.motion.timing.jerk_limited.fastest", no_part)
    again = timed(weld())
    assert whole[:3] == [True, False, True]  # as it is, the part that was too fast, everything instead
    assert_limits_hold(again)
    assert again.t[-1] == pytest.approx(trajectory.t[-1], rel=0.01)


def test_derivatives_are_those_of_the_motion(trajectory: Trajectory) -> None:
    """Speeds and accelerations against central differences of the joint angles."""
    profile: Profile = trajectory.profile
    rng = np.random.default_rng(1)
    t = rng.uniform(0.0, trajectory.t[-1], 3000)
    h = 1e-5
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
    middle = (path.move == 3) & (path.u > 0.1) & (path.u < 0.9)
    assert trajectory.tcp_speed[middle] == pytest.approx(0.01, rel=2e-4)
    assert np.abs(trajectory.a[middle]).max() < 1e-3
    on_arc = (path.move == 4) & (path.u > 0.1) & (path.u < 0.9)
    assert trajectory.tcp_speed[on_arc] == pytest.approx(0.01, rel=2e-3)


def test_rest_at_every_stop(trajectory: Trajectory) -> None:
    path = trajectory.path
    rest = path.goal[path.stop]
    assert len(rest) == 4
    assert np.abs(trajectory.v[rest]).max() < 1e-9
    assert np.abs(trajectory.a[rest]).max() < 1e-9
    assert (trajectory.tcp_speed[path.goal[~path.stop]] > 1e-3).all()


def test_time_runs_and_fits_the_distance(trajectory: Trajectory) -> None:
    path, t = trajectory.path, trajectory.t
    assert (np.diff(t) > 0).all()
    q = positions(trajectory, t[1:-1])
    inside = ~np.isin(np.arange(1, len(t) - 1), path.goal[path.stop])
    assert np.abs(q - path.q[1:-1])[inside].max() < 1e-8


def test_a_start_at_full_speed_would_take_longer_without_the_grid_points_of_ramps() -> None:
    """A slow weld between stops takes its length over its speed, the window, and next to nothing more."""
    moves = chain(joint(pose(1.1, -0.2, 0.5)), line(pose(1.1, 0.2, 0.5), speed=0.008, fine=True))
    trajectory = timed(moves)
    assert trajectory.t[-1] == pytest.approx(0.4 / 0.008 + trajectory.profile.law.window[0], abs=0.02)


def test_a_duration_is_met() -> None:
    moves = chain(joint(pose(1.1, -0.3, 0.5)), line(pose(1.1, 0.3, 0.5), speed=1.0, duration=7.5, fine=True))
    assert timed(moves).t[-1] == pytest.approx(7.5, rel=0.03)


def test_accset_lowers_accelerations_while_it_is_in_force() -> None:
    """The same way at 50 %, at 100 %, and through a zone from one to the other; numerical second derivatives."""
    way = [pose(1.0, -0.3, 0.7), pose(1.2, 0.3, 0.6)]
    there, back = line(way[1], speed=5.0, rotation_speed=20.0), line(way[0], speed=5.0, rotation_speed=20.0)
    trajectory = timed(
        chain(joint(way[0], fine=True), {**there, "ease": 0.5, "fine": True}, {**back, "fine": True},
              {**there, "ease": 0.5, "zone": 0.05, "zone_rotation": 0.05}, {**back, "fine": True})
    )  # fmt: skip
    goals = trajectory.t[trajectory.path.goal]
    step = 1e-4

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


def test_reorientation_speed_is_kept() -> None:
    turned = pose(1.1, 0.0, 0.5, (60.0, 180.0, 0.0))
    moves = chain(joint(pose(1.1, 0.0, 0.5)), line(turned, speed=1.0, rotation_speed=np.radians(20.0), fine=True))
    trajectory = timed(moves)
    assert trajectory.t[-1] == pytest.approx(3.0 + trajectory.profile.law.window[0], abs=0.15)


def torque(trajectory: Trajectory) -> np.ndarray:
    """Joint torques (n, 6) [N m] of the bare arm, without its weight."""
    none = np.zeros(len(trajectory.t))
    motion = trajectory.path.q, trajectory.v, trajectory.a_sustained
    return inertial_torque(ROBOT, motion, (none, np.zeros((len(none), 3))))


def test_torque_limits() -> None:
    moves = chain(joint(pose(1.1, -0.4, 0.9)), joint(pose(1.1, 0.4, 0.4), speed=5.0, fine=True))
    path, _ = sample_path(ROBOT, moves)
    free = retime(ROBOT, path)
    weak = replace(ROBOT, torque=np.array([200.0, 4000.0, 2000.0, 300.0, 200.0, 100.0]))
    held = retime(weak, path)
    assert held.t[-1] > free.t[-1]
    assert np.abs(torque(free)[:, 0]).max() > 200.0
    assert np.abs(torque(held)[:, 0]).max() < 200.0 * 1.05
    none = replace(ROBOT, torque=np.array([200.0, 10.0, 2000.0, 300.0, 200.0, 100.0]))
    error = refused(lambda: retime(none, path))
    assert error[0].code == "MOT010"
    assert "joint 2" in error[0].message


def test_the_same_motion_keeps_the_limits_and_a_wild_correction_does_not(trajectory: Trajectory) -> None:
    path = trajectory.path
    report = check_limits(ROBOT, trajectory.profile, path.q)
    assert report.slower < 1.02 * report.cycle_time
    assert report.cycle_time == trajectory.t[-1]
    gentle = path.q + 1e-3 * np.sin(path.way())[:, None]
    assert check_limits(ROBOT, trajectory.profile, gentle).slower < 1.05 * report.cycle_time
    wild = path.q + 2e-3 * (np.arange(len(path.q)) % 2)[:, None]
    assert check_limits(ROBOT, trajectory.profile, wild).slower > 1.2 * report.cycle_time


def test_no_motion_no_time() -> None:
    trajectory = timed(chain(joint(pose(1.1, 0.0, 0.5))))
    assert trajectory.t.tolist() == [0.0]
    assert check_limits(ROBOT, trajectory.profile, trajectory.path.q).slower == 0.0


def test_a_target_given_twice_is_a_stop() -> None:
    there = pose(1.1, 0.1, 0.5)
    moves = chain(
        joint(pose(1.1, -0.1, 0.5)), line(there, zone=0.01), line(there, zone=0.01), line(pose(1.1, 0.3, 0.5))
    )
    trajectory = timed(moves)
    assert np.isfinite(trajectory.t).all()
    assert trajectory.path.stop.tolist() == [True, True, True, True]


def test_cost_grows_with_the_program_and_no_faster() -> None:
    def cost(n: int) -> int:
        points = [line(pose(1.1 + 0.02 * (k % 2), -0.4 + 0.8 * k / n, 0.5), zone=0.001, speed=0.1) for k in range(n)]
        moves = chain(joint(pose(1.0, -0.4, 0.6)), *points, line(pose(1.1, 0.4, 0.5), fine=True))
        path, _ = sample_path(ROBOT, moves)
        return operations(lambda: retime(ROBOT, path))

    cost(10)
    assert cost(800) < 8 * 1.2 * cost(100)


def test_speeds_are_those_of_toppra_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the programs that are left out where the arm may rest nor runs solved apart change the speeds."""
    from toppra.algorithm import TOPPRA as plain

    from postproc.motion.timing import constraints
    from postproc.motion.timing import fastest as module
    from postproc.motion.timing.fastest import lay_grid, programmed_ease, programmed_speed
    from postproc.motion.timing.spline import cut_runs

    path, _ = sample_path(ROBOT, weld())
    for robot in (ROBOT, replace(ROBOT, torque=np.array([4000.0, 5000, 3000, 400, 400, 200]))):
        runs = cut_runs(robot, path)
        grid = lay_grid(runs, programmed_speed(runs), programmed_ease(runs), np.full(runs.count, 0.05))
        gravity = np.array([0.0, 0.0, -9.81])
        monkeypatch.setattr(module, "_MOST", 10)
        apart, blocked = fastest(robot, runs, grid, gravity)
        assert blocked is None and runs.count > 1 and (np.diff(grid.run) > 0).any()
        with monkeypatch.context() as whole:
            whole.setattr(module, "_MOST", 10**6)
            whole.setattr(constraints, "TOPPRA", lambda may_stop, *words, **named: plain(*words, **named))
            assert np.allclose(fastest(robot, runs, grid, gravity)[0], apart, rtol=2e-5, atol=2e-5)
