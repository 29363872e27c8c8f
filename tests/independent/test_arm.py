"""The independent arm against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tests.independent import arm as A
from tests.independent import inverse as I

RNG = np.random.default_rng(5)


def poses(arm: A.Arm, n: int) -> np.ndarray:
    q = RNG.uniform(-1, 1, (n, 6)) * np.radians([90, 40, 50, 160, 90, 160]) + np.radians([0, 20, 0, 0, 0, 0])
    return np.clip(q, arm.lower, arm.upper)


def test_zero_pose_is_the_makers() -> None:
    f = A.irb4600().forward(np.zeros((1, 6)), np.eye(4))
    assert f.tcp[0, :3, 3] == pytest.approx([1.270, 0, 1.570], abs=1e-12)
    assert f.tcp[0, :3, 2] == pytest.approx([1, 0, 0], abs=1e-12)
    assert f.tcp[0, :3, 0] == pytest.approx([0, 0, -1], abs=1e-12)


def test_joint_directions() -> None:
    """A positive axis 2 leans the arm forward, axis 3 lowers the forearm, axis 5 lowers the hand."""
    arm = A.irb4600()
    for j, way in ((0, [0, 1]), (1, [0, -1]), (2, [2, -1]), (4, [2, -1])):
        q = np.zeros((1, 6))
        q[0, j] = 0.01
        move = arm.forward(q, np.eye(4)).tcp[0, :3, 3] - [1.270, 0, 1.570]
        axis = {0: 1, 1: 0, 2: 2, 4: 2}[j]
        expected = {0: 1, 1: 1, 2: -1, 4: -1}[j]
        assert np.sign(move[axis]) == expected, way


def test_reach_and_seed_lengths() -> None:
    q = np.zeros((1, 6))
    q[0, 1] = np.pi / 2
    q[0, 2] = -np.arctan2(0.960, 0.175)
    f = A.irb4600().forward(q, np.eye(4))
    assert f.body[5][0, :3, 3] == pytest.approx([0.175 + 0.9 + np.hypot(0.96, 0.175), 0, 0.495], abs=1e-9)
    seed = A.ARMS["irb4600_60_205_seed"]().forward(np.zeros((1, 6)), np.eye(4))
    assert seed.tcp[0, 2, 3] == pytest.approx(1.745, abs=1e-12)


@pytest.mark.parametrize("name", ["irb4600_60_205", "irb4600_60_205_seed", "irb4600_20_250"])
def test_inverse_returns_every_branch_to_the_pose(name: str) -> None:
    arm = A.ARMS[name]()
    q = poses(arm, 200)
    flange = arm.forward(q, np.eye(4)).flange
    back = I.inverse(arm, flange)
    hit = np.abs(I.wrap(back - q[:, None])).max(axis=2)
    hit = np.nanmin(hit, axis=1)
    assert hit.max() < 1e-9
    for b in range(8):
        ok = np.isfinite(back[:, b]).all(axis=1)
        again = arm.forward(back[ok, b], np.eye(4)).flange
        assert np.abs(again - flange[ok]).max() < 1e-9
    for k in range(40):
        found = I.solve_target(arm, flange[k], tuple(I.confdata(arm, q[k])[0]))
        assert found is not None
        assert np.abs(found - q[k]).max() < 1e-9


def test_confdata_of_known_probes() -> None:
    arm = A.irb4600()
    q = np.radians([[90.0, 0, 0, 0, 10, 0], [-150, 0, 0, -185, -10, 350], [0, 0, -85, 0, 10, 0], [0, -40, 0, 0, 10, 0]])
    assert I.confdata(arm, q).tolist() == [[1, 0, 0, 0], [-2, -3, 3, 1], [0, 0, 0, 2], [0, 0, 0, 0]]


def test_one_soft_joint_under_a_vertical_force() -> None:
    """Axis 2 alone soft, no masses: the moment is F times the horizontal lever of the deflected arm."""
    arm = A.irb4600()
    light = A.Arm(arm.name, arm.link, arm.axis, np.zeros(7), arm.center, arm.lower, arm.upper, arm.lengths)
    c = np.zeros(6)
    c[1] = 1e-6
    q = np.zeros((1, 6))
    e = A.equilibrium(light, q, np.eye(4), A.Load(force=np.array([0, 0, -1000.0])), A.joint_springs(c))
    lever = e.frames.tcp[0, 0, 3] - 0.175
    assert e.dq[0, 1] == pytest.approx(1e-6 * 1000.0 * lever, rel=1e-12)
    assert lever == pytest.approx(1.095 * np.cos(e.dq[0, 1]) + 1.075 * np.sin(e.dq[0, 1]), rel=1e-12)


def test_weights_by_hand_at_zero() -> None:
    """Joint 2 carries every centre's forward offset from axis 2; joints 1 and 4 carry nothing but the side offsets."""
    arm = A.irb4600()
    f = arm.forward(np.zeros((1, 6)), np.eye(4))
    tau, wrench = A.spring_loads(f, A.dead_loads(arm, f, A.Load(mass=20.0, center=np.array([0, 0, 0.1]))))
    x = np.array([0.185, 0.26, 0.78, 1.14, 1.24, 1.37]) - 0.175
    m = np.array([72, 86, 22, 11, 3, 20])
    assert tau[0, 1] == pytest.approx(9.81 * (m * x).sum(), rel=1e-12)
    assert tau[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert tau[0, 3] == pytest.approx(0.0, abs=1e-9)
    assert wrench[0, 0, 2] == pytest.approx(-9.81 * (128 + m.sum()), rel=1e-12)


def test_cantilever_tip() -> None:
    """A forearm beam EI under a tip force: w = F L^3 / 3 EI and slope F L^2 / 2 EI at the wrist."""
    arm = A.irb4600()
    light = A.Arm(arm.name, arm.link, arm.axis, np.zeros(7), arm.center, arm.lower, arm.upper, arm.lengths)
    length, ei = 0.960, 1.3e6
    c = np.zeros((6, 6))
    c[2, 2], c[4, 4] = length**3 / (3 * ei), length / ei
    c[2, 4] = c[4, 2] = -(length**2) / (2 * ei)
    # Force at the wrist centre itself: tool0 shifted back by the flange length.
    back = A.shift(0, 0, -0.135)
    e = A.equilibrium(
        light, np.zeros((1, 6)), back, A.Load(force=np.array([0, 0, -100.0])), A.body_springs(np.zeros(6), {4: c})
    )
    assert e.frames.tcp[0, 2, 3] - 1.570 == pytest.approx(-100 * length**3 / (3 * ei), rel=1e-6)
    assert e.xi[0, 4, 4] == pytest.approx(100 * length**2 / (2 * ei), rel=1e-6)


def test_equilibrium_is_satisfied() -> None:
    arm = A.irb4600()
    load = A.Load(mass=12.0, center=np.array([0.03, 0.02, 0.12]), force=np.array([200.0, -200, -200]))
    tool = A.shift(0.02, -0.01, 0.35)
    e = A.equilibrium(arm, poses(arm, 100), tool, load, A.joint_springs(A.TABLE_2))
    tau, _ = A.spring_loads(e.frames, A.dead_loads(arm, e.frames, load))
    assert np.abs(tau * A.TABLE_2 - e.dq).max() < 1e-12
    assert 1e-4 < np.abs(e.dq).max() < 1e-2


def test_work_of_the_springs_is_work_of_the_force() -> None:
    """Maxwell-Betti: with small forces, the displacement at B by a force A equals that at A by B."""
    arm = A.irb4600()
    light = A.Arm(arm.name, arm.link, arm.axis, np.zeros(7), arm.center, arm.lower, arm.upper, arm.lengths)
    q, tool = poses(arm, 20), A.shift(0.02, -0.01, 0.35)
    beam = np.diag([1e-9, 2e-7, 2e-7, 1e-6, 7e-7, 7e-7])
    springs = A.body_springs(A.TABLE_2, {0: beam, 2: beam, 4: beam})
    rest = light.forward(q, tool).tcp[:, :3, 3]
    u = {}
    for k in range(3):
        e = A.equilibrium(light, q, tool, A.Load(force=0.01 * np.eye(3)[k]), springs)
        u[k] = (e.frames.tcp[:, :3, 3] - rest) / 0.01
    for i in range(3):
        for k in range(3):
            assert np.abs(u[i][:, k] - u[k][:, i]).max() < 2e-5 * np.abs(u[i]).max()


def test_ur10_stretched_out() -> None:
    f = A.ur10().forward(np.zeros((1, 6)), np.eye(4))
    assert f.flange[0, :3, 3] == pytest.approx([-1.1843, -0.256141, 0.0116], abs=1e-6)


def test_inertia_is_the_time_derivative_of_momentum() -> None:
    """Swinging: the D'Alembert torque on axis 1 is minus the rate of the whole angular momentum about the base's z axis."""
    arm = A.irb4600()
    q, v, a = poses(arm, 10), RNG.normal(size=(10, 6)), RNG.normal(size=(10, 6))
    load = A.Load(mass=20.0, center=np.array([0.03, 0.02, 0.1]))

    def momentum(t: float) -> np.ndarray:
        """Angular momentum about z by central differences of the places."""
        h = 1e-5
        at = [arm.forward(q + v * s + a * s * s / 2, np.eye(4)) for s in (t - h, t, t + h)]
        total = np.zeros(10)
        for b in range(1, 8):
            frames = [x.flange if b == 7 else x.body[b] for x in at]
            center = load.center if b == 7 else arm.center[b]
            mass = 20.0 if b == 7 else arm.mass[b]
            c = [x[:, :3, 3] + x[:, :3, :3] @ center for x in frames]
            total += mass * np.cross(c[1], (c[2] - c[0]) / (2 * h))[:, 2]
            if b < 7:
                turn = (frames[2][:, :3, :3] - frames[0][:, :3, :3]) / (2 * h) @ np.swapaxes(frames[1][:, :3, :3], 1, 2)
                total += mass * arm.gyration[b] ** 2 * turn[:, 1, 0]
        return total

    f = arm.forward(q, np.eye(4))
    tau, _ = A.spring_loads(f, A.inertial_loads(arm, f, v, a, load))
    rate = (momentum(1e-3) - momentum(-1e-3)) / 2e-3
    assert np.abs(tau[:, 0] + rate).max() < 1e-3 * np.abs(rate).max()
