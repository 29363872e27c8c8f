"""Sustained acceleration, inertial torques and transitions against energy, height and differences."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.motion.inertia import inertial_torque, point_velocity
from postproc.motion.path.samples import sample_path
from postproc.motion.smoothing import GENTLE, TRANSITION_SHARE, transition
from postproc.motion.timing.jerk_limited import check_limits
from postproc.motion.timing.sustained import sustained
from postproc.motion.timing.timelaw import evaluate
from postproc.motion.timing.trajectory import Trajectory, retime
from postproc.robot.arm import Robot
from postproc.robot.kinematics import body_poses, jacobian
from tests.motion.build import DRIVEN, ROBOT, TORCH, chain, joint, line, pose, sampled, tcp

RNG = np.random.default_rng(2)
Q, V, ACC = RNG.uniform(-1, 1, (20, 6)), RNG.uniform(-2, 2, (20, 6)), RNG.uniform(-5, 5, (20, 6))
MASS, CENTER = 12.0, np.array([0.1, -0.05, 0.3])
PAYLOAD = np.full(20, MASS), np.tile(CENTER, (20, 1))


def kept(a: np.ndarray, period: float, dt: float = 0.001) -> np.ndarray:
    """What lasts of an acceleration (n,) at equal steps of time."""
    t = np.arange(len(a)) * dt
    six = lambda x: np.repeat(np.interp(x, t, a)[:, None], 6, axis=1)  # noqa: E731
    return sustained(six, float(t[-1]), t, np.full(len(a), period))[:, 0]


def test_a_burst_vanishes_and_what_lasts_stays_in_full() -> None:
    t = np.arange(0, 2, 0.001)
    assert np.abs(kept(np.where((t > 0.5) & (t < 0.55), 8.0, 0.0), 0.1)).max() == 0.0
    lasting = np.where((t > 0.5) & (t < 1.5), -3.0, 0.0)
    away = (np.abs(t - 0.5) > 0.0126) & (np.abs(t - 1.5) > 0.0126)  # one step of an eighth of the period
    assert kept(lasting, 0.1)[away] == pytest.approx(lasting[away])


def test_long_motions_in_pieces_equal_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces start at other instants, so bursts are cut at other steps; what lasts is the same."""
    t = np.arange(0, 20, 0.01)
    a = np.sin(np.pi * t / t[-1]) + np.where((t % 3) < 0.03, 2.0, 0.0)
    in_one = kept(a, 0.2, 0.01)
    monkeypatch.setattr("postproc.arrays.BLOCK", 64)
    assert np.abs(kept(a, 0.2, 0.01) - in_one).max() < 0.06


def test_a_period_that_differs_in_the_sixth_digit_changes_nothing() -> None:
    """A stiffness fitted anew must not move what an hour-long program keeps of its ramps."""
    a = np.where((np.arange(40_000) % 1300) < 450, np.arange(40_000) % 450 / 100, 0.0)
    assert np.array_equal(kept(a, 0.1, 0.02), kept(a, 0.1 * (1 + 1e-6), 0.02))
    assert kept(a, 0.1, 0.02).max() > 3.0


def test_a_slow_weld_is_free_of_inertia_and_a_long_swing_is_not() -> None:
    """Only bursts longer than the first period count; a rigid arm has the shortest one."""
    path = sampled(
        joint(pose(1.1, -0.3, 0.5)),
        line(pose(1.1, 0.3, 0.5), speed=0.01, fine=True),
        joint(pose(1.1, -0.5, 0.8), speed=5.0, fine=True),
    )
    usual, stiff, rigid = (retime(ROBOT, path, np.full(len(path.q), period)) for period in (0.1, 0.02, 0.0))
    weld, swing = path.move == 1, path.move == 2
    assert np.abs(usual.a_sustained[weld]).max() < min(1e-2, np.abs(usual.a[weld]).max())
    assert np.abs(usual.a_sustained[swing]).max() > 1.0
    assert np.abs(stiff.a_sustained).sum() > np.abs(usual.a_sustained).sum()
    assert rigid.a_sustained == pytest.approx(stiff.a_sustained)
    assert retime(ROBOT, path).a_sustained == pytest.approx(usual.a_sustained)


def kinetic_energy(q: np.ndarray, v: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Half the mass times squared speed of every body and the payload, speeds from differences of poses."""
    T0, T1 = body_poses(ROBOT, q - h * v), body_poses(ROBOT, q + h * v)

    def of_mass(kg: float, points: list[np.ndarray]) -> np.ndarray:
        return np.asarray(0.5 * kg * np.sum(((points[1] - points[0]) / (2 * h)) ** 2, axis=1))

    total = of_mass(MASS, [((T[:, 6] @ ROBOT.link[6])[:, :3] @ np.append(CENTER, 1.0)) for T in (T0, T1)])
    for b in range(1, 7):
        total += of_mass(ROBOT.mass[b], [T[:, b, :3, :3] @ ROBOT.center[b] + T[:, b, :3, 3] for T in (T0, T1)])
        W = T1[:, b, :3, :3] @ np.swapaxes(T0[:, b, :3, :3], 1, 2)
        spin = np.stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]], axis=1) / (4 * h)
        local = np.einsum("nji,nj->ni", T0[:, b, :3, :3], spin)
        total += 0.5 * np.einsum("ni,ij,nj->n", local, ROBOT.inertia[b], local)
    return total


def potential_energy(q: np.ndarray) -> np.ndarray:
    T = body_poses(ROBOT, q)
    links = sum(ROBOT.mass[b] * (T[:, b, :3, :3] @ ROBOT.center[b] + T[:, b, :3, 3])[:, 2] for b in range(1, 7))
    return np.asarray(9.81 * (links + MASS * ((T[:, 6] @ ROBOT.link[6])[:, :3] @ np.append(CENTER, 1.0))[:, 2]))


def test_power_of_the_inertial_torque_is_the_change_of_energy() -> None:
    h = 1e-5
    before, after = (kinetic_energy(Q + x * V + x * x * ACC / 2, V + x * ACC) for x in (-h, h))
    torque = inertial_torque(ROBOT, (Q, V, ACC), PAYLOAD)
    assert np.sum(torque * V, axis=1) == pytest.approx((after - before) / (2 * h), rel=2e-4, abs=0.05)


def test_weight_is_the_change_of_height() -> None:
    torque = inertial_torque(ROBOT, (Q, 0 * V, 0 * ACC), PAYLOAD, np.array([0.0, 0.0, -9.81]))
    for j, step in enumerate(1e-6 * np.eye(6)):
        slope = (potential_energy(Q + step) - potential_energy(Q - step)) / 2e-6
        assert slope == pytest.approx(torque[:, j], abs=1e-4)


def test_velocity_of_a_point() -> None:
    velocity = point_velocity(ROBOT, body_poses(ROBOT, Q), V, tcp(Q)[:, :3, 3])
    assert velocity == pytest.approx(np.einsum("nij,nj->ni", jacobian(ROBOT, Q, TORCH)[:, :3], V), abs=1e-12)


JUMP = np.array([1.2e-3, -0.4e-3, 0.8e-3, 1e-4, -2e-4, 0.0])
TURNS = np.linalg.pinv(jacobian(ROBOT, np.radians([[0.0, 20, 10, 0, 60, 0], [5.0, 22, 12, 5, 60, 0]]), TORCH))


@pytest.mark.parametrize(("size", "available"), [(1.0, 3.0), (1.0, 0.22), (40.0, 3.0)])
def test_a_transition_keeps_its_share_of_the_joint_limits(size: float, available: float) -> None:
    ramp = transition(ROBOT, size * JUMP, TURNS, available)
    assert ramp.duration <= available
    t = np.linspace(0.0, ramp.duration, 20_001)
    correction = ramp.at(t)
    assert correction[[0, -1]] == pytest.approx(np.outer([0, 1], size * JUMP), abs=1e-12)
    rate = np.einsum("kij,tj->kti", TURNS, correction)
    speed = np.diff(rate, axis=1) / t[1]
    assert np.abs(speed[:, [0, -1]]).max() < 1e-3 * np.abs(speed).max()
    for limit, within in ((ROBOT.speed, 1.001), (ROBOT.acceleration, 1.001), (ROBOT.jerk, 1.05)):
        rate = np.diff(rate, axis=1) / t[1]
        assert (np.abs(rate).max(axis=(0, 1)) <= TRANSITION_SHARE * limit * within).all()


@pytest.mark.parametrize(
    ("size", "available", "duration"), [(1e-2, 5.0, GENTLE), (1e-2, 0.12, 0.12), (40, 0.05, 0.05), (1.0, 0.0, 0.0)]
)
def test_a_jump_is_passed_gently_where_there_is_time_and_over_the_limits_where_there_is_none(
    size: float, available: float, duration: float
) -> None:
    ramp = transition(ROBOT, size * JUMP, TURNS, available)
    assert ramp.duration == pytest.approx(duration)
    assert ramp.at(np.array([-1.0, duration, 9.0])) == pytest.approx(np.outer([0, 1, 1], size * JUMP))


def swing(robot: Robot, mass: float, q: np.ndarray, by: float) -> tuple[np.ndarray, Trajectory]:
    """A turn of axis 1 from rest to rest, with a mass at the flange: pushes of axis 1 [N m] from positions, its time."""
    moves = chain({"kind": "absjoint", "q": q}, {
        "kind": "absjoint", "q": q + np.eye(6)[0] * by, "speed": 50.0, "fine": True,
        "payload_mass": mass, "payload_center": CENTER,
    })  # fmt: skip
    trajectory = retime(robot, sample_path(robot, moves)[0])
    t, h = np.linspace(0.0, trajectory.t[-1], 2001)[5:-5], 1e-4
    runs, law = trajectory.profile.runs, trajectory.profile.law
    s = [runs.s[0] + evaluate(law, np.zeros(len(t), dtype=int), t + x)[0] for x in (-h, 0.0, h)]
    angle = [np.interp(x, runs.s, trajectory.path.q[:, 0]) for x in s]
    # All mass that turns with axis 1, by its distance from the axis: the posture stays, so this is all of its inertia.
    T = body_poses(robot, q[None])[0]
    axis = T[1, :3, :3] @ robot.axis[0]
    tip = ((T[6] @ robot.link[6])[:3] @ np.append(CENTER, 1.0), mass, np.zeros((3, 3)))
    parts = [(T[b, :3, :3] @ robot.center[b] + T[b, :3, 3], robot.mass[b],
              T[b, :3, :3] @ robot.inertia[b] @ T[b, :3, :3].T) for b in range(1, 7)]  # fmt: skip
    inertia = sum(m * np.sum(np.cross(axis, p - T[1, :3, 3]) ** 2) + axis @ own @ axis for p, m, own in [*parts, tip])
    drives = robot.drives
    assert drives is not None
    return (inertia + drives.rotor[0]) * (angle[2] - 2 * angle[1] + angle[0]) / h**2, trajectory


def test_drives_accelerate_less_where_more_mass_is_farther_out() -> None:
    """Axis 1 uses its torque and no more, in a folded and in a stretched posture, with and without a payload."""
    assert DRIVEN.drives is not None
    folded, stretched = np.radians([0.0, -40, 60, 0, 0, 0]), np.radians([0.0, 70, -60, 0, 0, 0])
    times = []
    for q, mass in ((folded, 0.0), (stretched, 0.0), (stretched, 60.0)):
        push, trajectory = swing(DRIVEN, mass, q, 0.6)
        assert np.abs(push).max() == pytest.approx(DRIVEN.drives.torque[0], rel=0.03)
        times.append(float(trajectory.t[-1]))
        share = check_limits(DRIVEN, trajectory.profile, trajectory.path.q).use[1]
        assert share[0] == pytest.approx(1.0, abs=0.03) and share[1:].max() < 1.0
    assert 1.15 * times[0] < times[1] and 1.05 * times[1] < times[2]
