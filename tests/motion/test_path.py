r"""Paths against closed forms: lines, arcs, joint moves, corners, ``SingArea\Wrist``, and what is wrong with them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import ARC_FAULTS, build_curves, circle_through, pose_at
from postproc.motion.path.samples import Samples, sample_path
from postproc.motion.values import Move
from tests.independent.arm import irb4600
from tests.motion.build import DOWN, HOME, ROBOT, TORCH, arc, chain, joint, line, pose, sampled, tcp

A, B, C = pose(1.1, -0.3, 0.5), pose(1.1, 0.3, 0.5, (20.0, 175.0, 5.0)), pose(1.2, 0.3, 0.7)
HALF_TURNS = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2 * np.pi])


def codes(moves: list[Move]) -> list[str]:
    return [d.code for d in sample_path(ROBOT, moves)[1]]


def turned(T: np.ndarray) -> np.ndarray:
    """Angles (n,) [rad] of orientations from that of A."""
    return np.asarray(Rotation.from_matrix(A[:3, :3].T @ T[:, :3, :3]).magnitude())


def test_a_line_is_straight_and_turns_evenly() -> None:
    path = sampled(joint(A), line(B, fine=True))
    u, p = np.append(0.0, path.u[1:]), path.T_work_tcp[:, :3, 3]
    assert np.abs(p - (A[:3, 3] + u[:, None] * (B - A)[:3, 3])).max() < 1e-12
    assert turned(path.T_work_tcp) == pytest.approx(u * turned(B[None])[0], abs=1e-9)
    assert np.linalg.norm(np.diff(p, axis=0), axis=1).max() <= 0.010 + 1e-12
    assert path.way()[-1] == pytest.approx(np.linalg.norm((B - A)[:3, 3]))
    assert path.goal.tolist() == [0, len(path.q) - 1] and path.stop.tolist() == [True, True]


def test_joint_angles_belong_to_the_poses() -> None:
    path = sampled(joint(A, zone=0.02), line(B, zone=0.05, zone_rotation=0.08), line(C, zone=0.01), joint(A, fine=True))
    assert np.abs(tcp(path.q) - path.T_work_tcp).max() < 1e-9
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.2


def test_a_joint_move_is_straight_in_joint_space() -> None:
    path = sampled(joint(A), joint(C, fine=True))
    u = np.append(0.0, path.u[1:])[:, None]
    assert np.abs(path.q - (path.q[0] + u * (path.q[-1] - path.q[0]))).max() < 1e-12


@pytest.mark.parametrize("sweep", [60.0, 150.0, 235.0])
def test_an_arc_lies_on_its_circle(sweep: float) -> None:
    center, radius, end = np.array([1.15, 0.0, 0.6]), 0.15, np.radians(sweep)
    tilt = Rotation.from_euler("xy", [20, 15], degrees=True)

    def at(angle: float) -> np.ndarray:
        T = pose(0, 0, 0)
        T[:3, 3] = center + tilt.apply(radius * np.array([np.cos(angle), np.sin(angle), 0]))
        return T

    path = sampled(joint(at(0)), arc(at(0.4 * end), at(end), fine=True))
    x, y, z = tilt.inv().apply(path.T_work_tcp[:, :3, 3] - center).T
    assert np.abs(np.hypot(x, y) - radius).max() < 1e-12 and np.abs(z).max() < 1e-12
    assert path.way()[-1] == pytest.approx(radius * end, rel=1e-3)
    assert np.unwrap(np.arctan2(y, x)) == pytest.approx(np.append(0.0, path.u[1:]) * end, abs=1e-9)


@pytest.mark.parametrize(("via", "degrees"), [(50, 80.0), (-130, 280.0)])
def test_the_circle_point_decides_which_way_the_tool_turns(via: float, degrees: float) -> None:
    """Seen from the path, which itself turns by 180 degrees about the same axis."""
    start, middle, end = pose(1.1, -0.1, 0.5), pose(1.0, 0.0, 0.5, (via, 180, 0)), pose(1.1, 0.1, 0.5, (100, 180, 0))
    curves = build_curves(ROBOT, tuple(chain(joint(start), arc(middle, end, fine=True))))
    assert np.degrees(np.linalg.norm(curves.turn[1])) == pytest.approx(degrees)


@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_a_tool_keeps_its_attitude_to_the_arc(tilt: float) -> None:
    """With CirPathMode at its default a torch that starts and ends alike, seen from the path, stays so all along."""
    torch = Rotation.from_euler("xy", [180.0 + tilt, tilt], degrees=True)

    def at(angle: float) -> np.ndarray:
        turn = Rotation.from_rotvec([0, 0, angle])
        T = np.eye(4)
        T[:3, 3] = np.array([1.15, 0.0, 0.6]) + turn.apply([0.1, 0, 0])
        T[:3, :3] = (turn * torch).as_matrix()
        return T

    sweep, u = np.radians(100.0), np.linspace(0.0, 1.0, 11)
    curves = build_curves(ROBOT, tuple(chain(joint(at(0)), arc(at(0.5 * sweep), at(sweep), fine=True))))
    expected = np.array([at(float(x) * sweep) for x in u])
    assert pose_at(ROBOT, curves, np.ones(11, dtype=int), u) == pytest.approx(expected, abs=1e-12)


def test_arcs_that_are_none() -> None:
    via = np.array([[0.1, 0.1, 0], [1e-5, 0, 0], [0.1, 0, 0], [0.01, 0.1, 0], [0.1, 0.1, 0]])
    end = np.array([[1e-5, 0, 0], [0.2, 0, 0], [0.2, 1e-4, 0], [0.01, -0.01, 0], [0.2, 0, 0]])
    fault = circle_through(np.zeros((5, 3)), via, end)[5]
    assert [ARC_FAULTS[i] for i in fault] == [ARC_FAULTS[i] for i in (1, 2, 3, 4, 0)]
    moves = chain(joint(A), arc(pose(1.1, 0.0, 0.5), B, fine=True))
    other = replace(moves[1], q=moves[1].q + HALF_TURNS)  # how an arc that is none arrives says nothing
    assert codes(moves) == codes([moves[0], other]) == ["MOT001"]


def corner(zone: float, ahead: float = 0.2, angles: tuple[float, float, float] = DOWN, **more: Any) -> Samples:
    """A way along y and then along x, past (1.1, 0, 0.5)."""
    middle = line(pose(1.1, 0.0, 0.5), zone=zone, **{"zone_rotation": zone, **more})
    return sampled(joint(pose(1.1, -0.2, 0.5)), middle, line(pose(1.1 + ahead, 0.0, 0.5, angles), fine=True))


def from_corner(path: Samples) -> np.ndarray:
    return path.T_work_tcp[:, :3, 3] - np.array([1.1, 0.0, 0.5])


def test_a_corner_stays_in_its_zone_and_keeps_the_direction_at_its_border() -> None:
    path, radius = corner(0.05), 0.05 + 0.25 * 0.05 / 2  # the way of half the smoothing at 0.25 m/s on either side
    p = from_corner(path)
    inside = np.linalg.norm(p, axis=1) < radius - 1e-9
    assert np.minimum(np.abs(p[:, 0]), np.abs(p[:, 1]))[~inside].max() < 1e-12
    assert path.blend[inside].all() and not path.stop[1]
    # Symmetric, and past the middle at 3/16 of the radius from each line.
    assert p[path.goal[1]] == pytest.approx([radius * 3 / 16, -radius * 3 / 16, 0.0], abs=1e-12)
    x, y, _ = np.diff(p, axis=0).T
    assert (np.diff(np.unwrap(np.arctan2(y, x))) < 1e-9).all()


@pytest.mark.parametrize(("ahead", "radius"), [(0.2, 0.1), (0.04, 0.02), (0.5, 0.1)])
def test_a_zone_reaches_half_way_to_the_neighbour_at_most(ahead: float, radius: float) -> None:
    p = from_corner(corner(0.5, ahead))
    off_lines = np.minimum(np.abs(p[:, 0]), np.abs(p[:, 1])) > 1e-9
    assert 0.6 * radius < np.linalg.norm(p[off_lines], axis=1).max() < radius + 1e-9


def test_orientation_starts_to_turn_earlier_than_the_path() -> None:
    path = corner(0.01, angles=(30.0, 180.0, 0.0), zone_rotation=0.06)
    y, away = from_corner(path)[:, 1], turned(path.T_work_tcp)
    assert away[y < -0.067] == pytest.approx(0.0, abs=1e-9)
    assert away[y < -0.017].max() > 1e-4


def test_a_corner_between_joint_moves_is_smooth_in_joint_space() -> None:
    path = sampled(joint(A), joint(C, zone=0.1), joint(B, fine=True))
    assert path.blend.any()
    assert np.abs(tcp(path.q) - path.T_work_tcp).max() < 1e-12
    step = np.diff(path.q, axis=0)
    turn = np.diff(step / np.linalg.norm(step, axis=1)[:, None], axis=0)
    assert np.linalg.norm(turn, axis=1).max() < 0.7


def test_a_change_of_tool_does_not_move_the_arm() -> None:
    other, middle = pose(0.0, 0.1, 0.25), pose(1.1, 0.0, 0.5)
    ahead = middle @ np.linalg.inv(TORCH) @ other
    ahead[:3, 3] += [0.1, 0.0, 0.1]
    path = sampled(joint(A), line(middle, zone=0.05), line(ahead, T_mount_tcp=other, fine=True))
    steps = np.linalg.norm(np.diff(tcp(path.q, np.eye(4))[:, :3, 3], axis=0), axis=1)
    assert steps.max() < 0.015
    assert path.way()[-1] == pytest.approx(np.sum(steps), rel=0.05)


def test_chains_do_not_touch() -> None:
    path = sampled(joint(A), line(B, fine=True), joint(C, starts_chain=True), line(A, fine=True))
    assert path.stop.tolist() == [True, True, True, True]
    assert (path.move == 2).sum() == 1
    i = int(path.goal[2])
    assert path.way()[i] == path.way()[i - 1]


def test_samples_follow_the_size_of_the_task() -> None:
    short = [line(pose(1.1, 0.001 * k, 0.5), zone=0.0003) for k in range(1, 50)]
    assert len(sampled(joint(A)).q) == 1
    assert len(sampled(joint(pose(1.1, 0.0, 0.5)), *short).q) <= 4 * 50
    assert len(sampled(joint(A), line(pose(1.1, 0.3, 0.5), fine=True)).q) == 61


@pytest.mark.parametrize(("beyond", "expected"), [(-1.0, []), (0.09, []), (0.15, ["MOT002"]), (20.0, ["MOT002"])])
def test_a_limit_on_the_way(beyond: float, expected: list[str]) -> None:
    """A way along a limit may be recorded at it, a tenth of a degree beyond."""
    high = HOME.copy()
    high[4] = ROBOT.upper[4] + np.radians(beyond)
    _, findings = sample_path(ROBOT, chain({"kind": "absjoint", "q": HOME}, {"kind": "absjoint", "q": high}))
    assert [d.code for d in findings] == expected
    assert all("joint 5" in d.message for d in findings)


def test_a_goal_in_another_configuration_and_the_advice_for_the_kind_of_motion() -> None:
    """A joint move may turn joints by any angle: behind a line that arrives otherwise, that line's target is named."""
    moves = chain(joint(A), line(B, zone=0.02), {"kind": "absjoint", "q": HOME})
    moves[1] = replace(moves[1], q=moves[1].q + HALF_TURNS)
    assert codes([moves[0], replace(moves[1], fine=True)]) == ["MOT004"]
    (arrives,), (at_joint_move,) = ([d for d in sample_path(ROBOT, moves)[1] if d.span == (k, k + 1)] for k in (1, 2))
    assert arrives.code == "MOT004" and at_joint_move.code == "MOT002"
    assert not ("joint move" in at_joint_move.help or "configuration," in at_joint_move.help)


SINGULAR = tcp(np.radians([[5.0, 10.0, 10.0, 80.0, 0.3, -80.0]]))[0]
ASIDE = np.array([[0.0, 0, 0, 0], [0, 0, 0, 0.2], [0, 0, 0, 0], [0, 0, 0, 0]])


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        (SINGULAR - ASIDE, SINGULAR + ASIDE, {"MOT003", "MOT005"}),
        (pose(0.2, -1.6, 0.8), pose(0.2, 1.6, 0.8), {"KIN004", "MOT003"}),
    ],
    ids=["through the singular wrist", "out of reach half way"],
)
def test_a_way_that_the_arm_cannot_follow(start: np.ndarray, end: np.ndarray, expected: set[str]) -> None:
    assert set(codes(chain(joint(start), line(end, fine=True)))) & expected


def wrist(moves: list[Move]) -> list[Move]:
    for move in moves:
        move.event.options["wrist_in_joints"] = True  # type: ignore[index]
    return moves


def test_a_wrist_that_flips_leaves_the_tcp_on_its_lines_and_its_corner() -> None:
    q = np.radians([5.0, 20.0, 10.0, -80.0, 4.0, 80.0])
    start, flip = tcp(q)[0], np.array([0.0, 0.0, 0.0, np.pi, 0.0, -np.pi])
    ahead, aside = (start.copy() for _ in range(2))
    ahead[1, 3] += 0.1
    aside[:2, 3] += 0.1
    moves = chain(joint(start), line(ahead, zone=0.01, zone_rotation=0.02), line(aside, fine=True))
    # The goals of the lines with the other sign of axis 5.
    moves = [replace(moves[0], q=q), *(replace(m, q=m.q * (1, 1, 1, 1, -1, 1) + flip) for m in moves[1:])]
    assert "MOT004" in codes(moves)
    path, findings = sample_path(ROBOT, wrist(moves))
    assert findings == []
    assert np.abs(np.asarray(irb4600().forward(path.q, TORCH).tcp) - path.T_work_tcp).max() < 1e-9
    assert np.abs(np.diff(path.q, axis=0)).max() < np.radians(10.0)
    p, free = path.T_work_tcp[:, :3, 3] - start[:3, 3], ~path.blend
    assert np.abs(p[free & (path.move == 1)][:, [0, 2]]).max() < 1e-9
    assert np.abs(p[free & (path.move == 2)][:, 1:] - (0.1, 0.0)).max() < 1e-9
    assert np.linalg.norm(p[path.blend] - (0.0, 0.1, 0.0), axis=1).max() < 0.010 + 0.25 * 0.05 / 2 + 1e-9
    rows = (path.move == 1) & (path.u < 0.5)
    even = moves[0].q + path.u[rows][:, None] * (moves[1].q - moves[0].q)
    assert path.q[rows][:, 3:] == pytest.approx(even[:, 3:], abs=1e-12)
    assert path.q[-1] == pytest.approx(moves[2].q, abs=1e-9)


def test_on_an_arc_the_tool_passes_the_circle_point_as_it_is_programmed_there() -> None:
    start, via, end = pose(1.1, -0.1, 0.5), pose(1.2, 0.0, 0.5, (10, 170, 5)), pose(1.1, 0.1, 0.5, (20, 185, 0))
    curves = build_curves(ROBOT, tuple(wrist(chain(joint(start), arc(via, end, fine=True)))))
    T = pose_at(ROBOT, curves, np.ones(41, dtype=int), np.linspace(0.0, 1.0, 41))
    assert np.abs(np.linalg.norm(T[:, :3, 3] - (1.1, 0.0, 0.5), axis=1) - 0.1).max() < 1e-9
    assert T[[0, 20, 40]] == pytest.approx(np.stack([start, via, end]), abs=1e-9)


def test_a_stationary_tool_keeps_its_line_on_the_carried_work() -> None:
    nozzle = tcp(HOME)[0]
    ends = np.radians([[0.0, 20.0, 10.0, 0.0, 60.0, 0.0], [4.0, 22.0, 8.0, 30.0, 55.0, -40.0]])
    steps = [{"kind": "absjoint", "q": ends[0]}, {"kind": "line", "q": ends[1], "fine": True}]
    moves = wrist(chain(*({**step, "stationary": True} for step in steps), tool=nozzle))
    path, findings = sample_path(ROBOT, moves)
    assert findings == []
    on_work = (np.linalg.inv(irb4600().forward(path.q, np.eye(4)).flange) @ nozzle)[:, :3, 3]
    u = np.append(0, path.u[1:])[:, None]
    assert on_work == pytest.approx(on_work[0] + u * (on_work[-1] - on_work[0]), abs=1e-9)


def test_a_line_that_leaves_the_reach_is_said_to() -> None:
    moves = wrist(chain(joint(pose(0.2, -1.6, 0.8)), line(pose(0.2, 1.6, 0.8), fine=True)))
    assert {"KIN004", "MOT002"} & {d.code for d in sample_path(ROBOT, moves)[1] if d.severity == "error"}


@pytest.mark.parametrize("axis", range(6))
def test_turning_the_joints_as_the_inverse_jacobian_says_shifts_the_tcp_on_the_work(axis: int) -> None:
    """To first order, with a tool on the flange and with one that stands still."""
    mounts = Mounts(np.array([TORCH, pose(1.3, -0.1, 0.9, (20.0, 150.0, 35.0))]), np.array([False, True]))
    q, size = np.array([HOME, HOME + 0.2]), 1e-6
    T = mounts.work(tcp(q, np.eye(4)))
    after = mounts.work(tcp(q + size * mounts.joints_by_shift(ROBOT, q, T)[:, :, axis], np.eye(4)))
    turn = Rotation.from_matrix(after[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    shift = np.concatenate([after[:, :3, 3] - T[:, :3, 3], turn], axis=1) / size
    assert shift == pytest.approx(np.tile(np.eye(6)[axis], (2, 1)), abs=1e-4)
    assert mounts.same(mounts).all() and not Mounts(mounts.T_mount_tcp[:1], np.array([True])).same(mounts[:1]).any()
