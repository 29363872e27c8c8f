"""Sustained acceleration, inertial torques, transitions."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.motion.path.samples import sample_path
from postproc.motion.smoothing import GENTLE, SHARE, transition
from postproc.motion.timing.inertia import inertial_torque, point_velocity
from postproc.motion.timing.sustained import sustained
from postproc.motion.timing.trajectory import retime
from postproc.robot.kinematics import body_poses, jacobian
from tests.motion.build import ROBOT, TORCH, chain, joint, line, pose, tcp


def kept(a: np.ndarray, period: float, dt: float = 0.001) -> np.ndarray:
    t = np.arange(len(a)) * dt

    def acceleration(x: np.ndarray) -> np.ndarray:
        return np.repeat(np.interp(x, t, a)[:, None], 6, axis=1)

    return sustained(acceleration, float(t[-1]), t, np.full(len(a), period))[:, 0]


def test_a_burst_vanishes_and_what_lasts_stays_in_full() -> None:
    t = np.arange(0, 2, 0.001)
    burst = np.where((t > 0.5) & (t < 0.55), 8.0, 0.0)
    assert np.abs(kept(burst, 0.1)).max() == 0.0
    lasting = np.where((t > 0.5) & (t < 1.5), -3.0, 0.0)
    away = (np.abs(t - 0.5) > 0.0126) & (np.abs(t - 1.5) > 0.0126)  # one step of an eighth of the period
    assert kept(lasting, 0.1)[away] == pytest.approx(lasting[away])


def test_long_motions_in_pieces_equal_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(0, 20, 0.01)
    a = np.sin(np.pi * t / t[-1]) + np.where((t % 3) < 0.03, 2.0, 0.0)
    # Pieces start at other instants, so bursts are cut at other steps; what lasts is the same.
    whole = kept(a, 0.2, 0.01)
    monkeypatch.setattr("postproc.arrays.BLOCK", 64)
    assert np.abs(kept(a, 0.2, 0.01) - whole).max() < 0.06


def test_a_period_that_differs_in_the_sixth_digit_changes_nothing() -> None:
    """A stiffness fitted anew must not move what an hour-long program keeps of its ramps."""
    a = np.where((np.arange(40_000) % 1300) < 450, np.arange(40_000) % 450 / 100, 0.0)
    assert np.array_equal(kept(a, 0.1, 0.02), kept(a, 0.1 * (1 + 1e-6), 0.02))
    assert kept(a, 0.1, 0.02).max() > 3.0


def test_a_slow_weld_is_free_of_inertia_and_a_long_swing_is_not() -> None:
    moves = chain(
        joint(pose(1.1, -0.3, 0.5)),
        line(pose(1.1, 0.3, 0.5), speed=0.01, fine=True),
        joint(pose(1.1, -0.5, 0.8), speed=5.0, fine=True),
    )
    path, _ = sample_path(ROBOT, moves)
    trajectory = retime(ROBOT, path)
    weld, swing = path.move == 1, path.move == 2
    assert np.abs(trajectory.a_sustained[weld]).max() < 1e-2
    assert np.abs(trajectory.a[weld]).max() > np.abs(trajectory.a_sustained[weld]).max()
    assert np.abs(trajectory.a_sustained[swing]).max() > 1.0
    # Only bursts longer than the first period count.
    stiff = retime(ROBOT, path, np.full(len(path.q), 0.02))
    assert np.abs(stiff.a_sustained).sum() > np.abs(trajectory.a_sustained).sum()
    rigid = retime(ROBOT, path, np.zeros(len(path.q)))
    assert rigid.a_sustained == pytest.approx(stiff.a_sustained)


def kinetic_energy(q: np.ndarray, v: np.ndarray, mass: float, center: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Half the mass times squared speed of every body and the payload, speeds from differences of poses."""
    T0, T1 = body_poses(ROBOT, q - h * v), body_poses(ROBOT, q + h * v)
    total = np.zeros(len(q))
    for b in range(1, 7):
        points = [T[:, b, :3, :3] @ ROBOT.center[b] + T[:, b, :3, 3] for T in (T0, T1)]
        total += 0.5 * ROBOT.mass[b] * np.sum(((points[1] - points[0]) / (2 * h)) ** 2, axis=1)
        W = T1[:, b, :3, :3] @ np.swapaxes(T0[:, b, :3, :3], 1, 2)
        spin = np.stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]], axis=1) / (4 * h)
        local = np.einsum("nji,nj->ni", T0[:, b, :3, :3], spin)
        total += 0.5 * np.einsum("ni,ij,nj->n", local, ROBOT.inertia[b], local)
    ends = [(T[:, 6] @ ROBOT.link[6])[:, :3] @ np.append(center, 1.0) for T in (T0, T1)]
    return total + 0.5 * mass * np.sum(((ends[1] - ends[0]) / (2 * h)) ** 2, axis=1)


def test_power_of_the_inertial_torque_is_the_change_of_energy() -> None:
    rng = np.random.default_rng(2)
    q, v, a = rng.uniform(-1, 1, (20, 6)), rng.uniform(-2, 2, (20, 6)), rng.uniform(-5, 5, (20, 6))
    mass, center = 12.0, np.array([0.1, -0.05, 0.3])
    torque = inertial_torque(ROBOT, (q, v, a), (np.full(20, mass), np.tile(center, (20, 1))))
    h = 1e-5
    energy = [kinetic_energy(q + x * v + x * x * a / 2, v + x * a, mass, center) for x in (-h, h)]
    rate = (energy[1] - energy[0]) / (2 * h)
    assert np.sum(torque * v, axis=1) == pytest.approx(rate, rel=2e-4, abs=0.05)


def test_weight_is_the_change_of_height() -> None:
    rng = np.random.default_rng(4)
    q = rng.uniform(-1, 1, (10, 6))
    still, center = np.zeros((10, 6)), np.tile([0.1, 0.0, 0.2], (10, 1))
    gravity = np.array([0.0, 0.0, -9.81])
    torque = inertial_torque(ROBOT, (q, still, still), (np.full(10, 7.0), center), gravity)

    def potential(q: np.ndarray) -> np.ndarray:
        T = body_poses(ROBOT, q)
        height = sum(ROBOT.mass[b] * (T[:, b, :3, :3] @ ROBOT.center[b] + T[:, b, :3, 3])[:, 2] for b in range(1, 7))
        payload = ((T[:, 6] @ ROBOT.link[6])[:, :3] @ np.array([0.1, 0.0, 0.2, 1.0]))[:, 2]
        return np.asarray(9.81 * (height + 7.0 * payload))

    h = 1e-6
    for j in range(6):
        step = h * np.eye(6)[j]
        assert (potential(q + step) - potential(q - step)) / (2 * h) == pytest.approx(torque[:, j], abs=1e-4)


def test_velocity_of_a_point() -> None:
    rng = np.random.default_rng(5)
    q, v = rng.uniform(-1, 1, (10, 6)), rng.uniform(-1, 1, (10, 6))
    found = point_velocity(ROBOT, body_poses(ROBOT, q), v, tcp(q)[:, :3, 3])
    assert found == pytest.approx(np.einsum("nij,nj->ni", jacobian(ROBOT, q, TORCH)[:, :3], v), abs=1e-12)


JUMP = np.array([1.2e-3, -0.4e-3, 0.8e-3, 1e-4, -2e-4, 0.0])
Q = np.radians([[0.0, 20.0, 10.0, 0.0, 60.0, 0.0], [5.0, 22.0, 12.0, 5.0, 60.0, 0.0]])


@pytest.mark.parametrize(("size", "available"), [(1.0, 3.0), (1.0, 0.22), (40.0, 3.0)])
def test_a_transition_keeps_its_share_of_the_joint_limits(size: float, available: float) -> None:
    turns = np.linalg.pinv(jacobian(ROBOT, Q, TORCH))
    ramp = transition(ROBOT, size * JUMP, turns, available)
    assert ramp.duration <= available
    t = np.linspace(0.0, ramp.duration, 20_001)
    correction = ramp.at(t)
    assert correction[0] == pytest.approx(np.zeros(6), abs=1e-12)
    assert correction[-1] == pytest.approx(size * JUMP)
    joints = np.einsum("kij,tj->kti", turns, correction)
    h = t[1]
    speed = np.diff(joints, axis=1) / h
    acceleration = np.diff(speed, axis=1) / h
    jerk = np.diff(acceleration, axis=1) / h
    assert (np.abs(speed).max(axis=(0, 1)) <= SHARE * ROBOT.speed * 1.001).all()
    assert (np.abs(acceleration).max(axis=(0, 1)) <= SHARE * ROBOT.acceleration * 1.001).all()
    assert (np.abs(jerk).max(axis=(0, 1)) <= SHARE * ROBOT.jerk * 1.05).all()
    assert np.abs(speed[:, [0, -1]]).max() < 1e-3 * np.abs(speed).max()


def test_a_small_jump_is_passed_gently_where_there_is_time() -> None:
    turns = np.linalg.pinv(jacobian(ROBOT, Q, TORCH))
    assert transition(ROBOT, 1e-2 * JUMP, turns, 5.0).duration == pytest.approx(GENTLE)
    assert transition(ROBOT, 1e-2 * JUMP, turns, 0.12).duration == pytest.approx(0.12)


def test_without_time_the_limits_give_way() -> None:
    turns = np.linalg.pinv(jacobian(ROBOT, Q, TORCH))
    ramp = transition(ROBOT, 40 * JUMP, turns, 0.05)
    assert ramp.duration == 0.05
    assert ramp.at(np.array([-1.0, 0.0, 0.05, 1.0])) == pytest.approx(np.outer([0, 0, 1, 1], 40 * JUMP))
    at_once = transition(ROBOT, JUMP, turns, 0.0)
    assert at_once.at(np.array([-1e-9, 0.0])) == pytest.approx(np.outer([0, 1], JUMP))
