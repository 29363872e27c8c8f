"""Paths: lines, arcs, joint moves, corners, and what is wrong with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.motion.path.curves import ARC_FAULTS, build_curves, circle_through, pose_at
from postproc.motion.path.samples import Samples, sample_path
from postproc.motion.values import Move
from tests.motion.build import HOME, ROBOT, arc, chain, joint, line, pose, tcp

A, B, C = pose(1.1, -0.3, 0.5), pose(1.1, 0.3, 0.5, (20.0, 175.0, 5.0)), pose(1.2, 0.3, 0.7)


def sampled(moves: list[Move]) -> Samples:
    path, findings = sample_path(ROBOT, moves)
    assert findings == []
    return path


def codes(moves: list[Move]) -> list[str]:
    return [d.code for d in sample_path(ROBOT, moves)[1]]


def test_a_line_is_straight_and_turns_evenly() -> None:
    path = sampled(chain(joint(A), line(B, fine=True)))
    rows = np.append(0, np.flatnonzero(path.move == 1))
    u = np.append(0.0, path.u[rows[1:]])
    p = path.T_work_tcp[rows, :3, 3]
    assert np.abs(p - (A[:3, 3] + u[:, None] * (B - A)[:3, 3])).max() < 1e-12
    whole = Rotation.from_matrix(A[:3, :3].T @ B[:3, :3]).magnitude()
    turned = Rotation.from_matrix(A[:3, :3].T @ path.T_work_tcp[rows, :3, :3]).magnitude()
    assert turned == pytest.approx(u * whole, abs=1e-9)
    step = np.linalg.norm(np.diff(p, axis=0), axis=1)
    assert step.max() <= 0.010 + 1e-12
    assert path.way()[-1] == pytest.approx(np.linalg.norm((B - A)[:3, 3]))
    assert path.goal.tolist() == [0, len(path.q) - 1]
    assert path.stop.tolist() == [True, True]


def test_joint_angles_belong_to_the_poses() -> None:
    moves = chain(joint(A, zone=0.02), line(B, zone=0.05, zone_rotation=0.08), line(C, zone=0.01), joint(A, fine=True))
    path = sampled(moves)
    assert np.abs(tcp(path.q) - path.T_work_tcp).max() < 1e-9
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.2


def test_a_joint_move_is_straight_in_joint_space() -> None:
    moves = chain(joint(A), joint(C, fine=True))
    path = sampled(moves)
    u = np.append(0.0, path.u[1:])[:, None]
    assert np.abs(path.q - (moves[0].q + u * (moves[1].q - moves[0].q))).max() < 1e-12


@pytest.mark.parametrize("sweep", [60.0, 150.0, 235.0])
def test_an_arc_lies_on_its_circle(sweep: float) -> None:
    center, radius = np.array([1.15, 0.0, 0.6]), 0.15
    tilt = Rotation.from_euler("xy", [20, 15], degrees=True)

    def at(angle: float) -> np.ndarray:
        T = pose(0, 0, 0)
        T[:3, 3] = center + tilt.apply(radius * np.array([np.cos(angle), np.sin(angle), 0]))
        return T

    end = np.radians(sweep)
    path = sampled(chain(joint(at(0)), arc(at(0.4 * end), at(end), fine=True)))
    d = path.T_work_tcp[:, :3, 3] - center
    assert np.abs(np.linalg.norm(d, axis=1) - radius).max() < 1e-12
    assert np.abs(d @ tilt.apply([0, 0, 1])).max() < 1e-12
    assert path.way()[-1] == pytest.approx(radius * end, rel=1e-3)
    local = tilt.inv().apply(d)
    angle = np.unwrap(np.arctan2(local[:, 1], local[:, 0]))
    assert angle == pytest.approx(np.append(0.0, path.u[1:]) * end, abs=1e-9)


def test_the_circle_point_decides_which_way_the_tool_turns() -> None:
    start, end = pose(1.1, -0.1, 0.5, (0, 180, 0)), pose(1.1, 0.1, 0.5, (100, 180, 0))
    short = pose(1.0, 0.0, 0.5, (50, 180, 0))
    long_way = pose(1.0, 0.0, 0.5, (-130, 180, 0))
    turn = []
    for via in (short, long_way):
        moves = chain(joint(start), arc(via, end, fine=True))
        turn.append(float(np.linalg.norm(build_curves(ROBOT, tuple(moves)).turn[1])))
    # Seen from the path, which itself turns by 180 degrees about the same axis.
    assert np.degrees(turn) == pytest.approx([80.0, 280.0])


@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_a_tool_keeps_its_attitude_to_the_arc(tilt: float) -> None:
    """With CirPathMode at its default a torch that starts and ends alike, seen from the path, stays so all along."""
    center, radius, sweep = np.array([1.15, 0.0, 0.6]), 0.1, np.radians(100.0)

    def at(angle: float) -> np.ndarray:
        T = pose(0, 0, 0)
        turned = Rotation.from_rotvec([0, 0, angle])
        T[:3, 3] = center + turned.apply([radius, 0, 0])
        T[:3, :3] = (turned * Rotation.from_euler("xy", [180.0 + tilt, tilt], degrees=True)).as_matrix()
        return T

    curves = build_curves(ROBOT, tuple(chain(joint(at(0)), arc(at(0.5 * sweep), at(sweep), fine=True))))
    u = np.linspace(0.0, 1.0, 11)
    expected = np.array([at(float(x) * sweep) for x in u])
    assert pose_at(ROBOT, curves, np.ones(11, dtype=int), u) == pytest.approx(expected, abs=1e-12)


def test_arcs_that_are_none() -> None:
    a = np.zeros((5, 3))
    via = np.array([[0.1, 0.1, 0], [1e-5, 0, 0], [0.1, 0, 0], [0.01, 0.1, 0], [0.1, 0.1, 0]])
    end = np.array([[1e-5, 0, 0], [0.2, 0, 0], [0.2, 1e-4, 0], [0.01, -0.01, 0], [0.2, 0, 0]])
    fault = circle_through(a, via, end)[5]
    assert [ARC_FAULTS[i] for i in fault] == [ARC_FAULTS[i] for i in (1, 2, 3, 4, 0)]
    moves = chain(joint(A), arc(pose(1.1, 0.0, 0.5), B, fine=True))
    assert codes(moves) == ["MOT001"]
    turned = moves[1].q + np.array([0, 0, 0, 0, 0, 2 * np.pi])
    assert codes([moves[0], replace(moves[1], q=turned)]) == ["MOT001"]  # how an arc that is none arrives says nothing


def corner(zone: float, ahead: float = 0.2) -> Samples:
    steps = [
        joint(pose(1.1, -0.2, 0.5)),
        line(pose(1.1, 0.0, 0.5), zone=zone, zone_rotation=zone),
        line(pose(1.1 + ahead, 0.0, 0.5), fine=True),
    ]
    return sampled(chain(*steps))


def test_a_corner_stays_in_its_zone_and_keeps_the_direction_at_its_border() -> None:
    path = corner(0.05)
    p = path.T_work_tcp[:, :3, 3] - np.array([1.1, 0.0, 0.5])
    off_lines = np.minimum(np.abs(p[:, 0]), np.abs(p[:, 1]))
    inside = np.linalg.norm(p, axis=1) < 0.05 - 1e-9
    assert off_lines[~inside].max() < 1e-12
    assert (path.blend == inside).all() or (path.blend[inside]).all()
    # Symmetric, and past the middle at 3/16 of the radius from each line.
    assert p[path.goal[1]] == pytest.approx([0.05 * 3 / 16, -0.05 * 3 / 16, 0.0], abs=1e-12)
    d = np.diff(p, axis=0)
    angle = np.unwrap(np.arctan2(d[:, 1], d[:, 0]))
    assert (np.diff(angle) < 1e-9).all()
    assert not path.stop[1]


@pytest.mark.parametrize(("ahead", "radius"), [(0.2, 0.1), (0.04, 0.02), (0.5, 0.1)])
def test_a_zone_reaches_half_way_to_the_neighbour_at_most(ahead: float, radius: float) -> None:
    path = corner(0.5, ahead)
    p = path.T_work_tcp[:, :3, 3] - np.array([1.1, 0.0, 0.5])
    off_lines = np.minimum(np.abs(p[:, 0]), np.abs(p[:, 1])) > 1e-9
    assert np.linalg.norm(p[off_lines], axis=1).max() < radius + 1e-9
    assert np.linalg.norm(p[off_lines], axis=1).max() > 0.6 * radius


def test_orientation_starts_to_turn_earlier_than_the_path() -> None:
    turned = (30.0, 180.0, 0.0)
    steps = [
        joint(pose(1.1, -0.2, 0.5)),
        line(pose(1.1, 0.0, 0.5), zone=0.01, zone_rotation=0.06),
        line(pose(1.3, 0.0, 0.5, turned), fine=True),
    ]
    path = sampled(chain(*steps))
    p = path.T_work_tcp[:, :3, 3]
    away = Rotation.from_matrix(A[:3, :3].T @ path.T_work_tcp[:, :3, :3]).magnitude()
    before = (path.move == 1) & (p[:, 1] < -0.011)
    assert away[before & (p[:, 1] < -0.061)] == pytest.approx(0.0, abs=1e-9)
    assert away[before].max() > 1e-4


def test_a_corner_between_joint_moves_is_smooth_in_joint_space() -> None:
    moves = chain(joint(A), joint(C, zone=0.1), joint(B, fine=True))
    path = sampled(moves)
    assert path.blend.any()
    assert np.abs(tcp(path.q) - path.T_work_tcp).max() < 1e-12
    turn = np.diff(np.diff(path.q, axis=0) / np.linalg.norm(np.diff(path.q, axis=0), axis=1)[:, None], axis=0)
    assert np.linalg.norm(turn, axis=1).max() < 0.7


def test_a_change_of_tool_does_not_move_the_arm() -> None:
    other = pose(0.0, 0.1, 0.25)
    moves = chain(joint(A), line(pose(1.1, 0.0, 0.5), zone=0.05))
    flange = tcp(moves[1].q[None], np.eye(4))[0]
    ahead = flange @ other
    ahead[:3, 3] += [0.1, 0.0, 0.1]
    last = chain(joint(ahead, first=False), tool=other)[0]
    more = [replace(last, kind="line", fine=True, row=2)]
    path = sampled(moves + more)
    flanges = tcp(path.q, np.eye(4))[:, :3, 3]
    steps = np.linalg.norm(np.diff(flanges, axis=0), axis=1)
    assert steps.max() < 0.015
    assert path.way()[-1] == pytest.approx(np.sum(steps), rel=0.05)


def test_chains_do_not_touch() -> None:
    moves = chain(joint(A), line(B, fine=True)) + chain(joint(C), line(A, fine=True))
    path = sampled(moves)
    assert path.stop.tolist() == [True, True, True, True]
    assert (path.move == 2).sum() == 1
    i = int(path.goal[2])
    assert path.way()[i] == path.way()[i - 1]


def test_samples_follow_the_size_of_the_task() -> None:
    short = [line(pose(1.1, 0.001 * k, 0.5), zone=0.0003) for k in range(1, 50)]
    path = sampled(chain(joint(pose(1.1, 0.0, 0.5)), *short))
    assert len(path.q) <= 4 * 50
    long = sampled(chain(joint(A), line(pose(1.1, 0.3, 0.5), fine=True)))
    assert len(long.q) == 61


def test_a_limit_on_the_way() -> None:
    q = HOME.copy()
    high = q.copy()
    high[4] = np.radians(119.0)
    narrow = replace(ROBOT, upper=np.where(np.arange(6) == 4, np.radians(100.0), ROBOT.upper))
    moves = chain({"kind": "absjoint", "q": q}, {"kind": "absjoint", "q": high, "fine": True})
    _, findings = sample_path(narrow, moves)
    assert [d.code for d in findings] == ["MOT002"]
    assert "joint 5" in findings[0].message


@pytest.mark.parametrize(("beyond", "codes"), [(0.09, []), (0.15, ["MOT002"])])
def test_a_way_along_a_limit_may_be_recorded_at_it(beyond: float, codes: list[str]) -> None:
    high = HOME.copy()
    high[4] = ROBOT.upper[4] + np.radians(beyond)
    _, findings = sample_path(ROBOT, chain({"kind": "absjoint", "q": HOME}, {"kind": "absjoint", "q": high}))
    assert [d.code for d in findings] == codes
    assert all("120.2 deg" in d.message or "120.1 deg" in d.message for d in findings)


def test_a_goal_in_another_configuration() -> None:
    moves = chain(joint(A), line(B, fine=True))
    turned = moves[1].q + np.array([0, 0, 0, 0, 0, 2 * np.pi])
    assert codes([moves[0], replace(moves[1], q=turned)]) == ["MOT004"]


def test_the_advice_is_for_the_kind_of_motion() -> None:
    """A joint move passes no singularity: behind a line that arrives otherwise, that line's target is to be mended."""
    moves = chain(joint(A), line(B, zone=0.02), {"kind": "absjoint", "q": HOME})
    moves[1] = replace(moves[1], q=moves[1].q + np.array([0, 0, 0, 0, 0, 2 * np.pi]))
    at_joint_move = [d for d in sample_path(ROBOT, moves)[1] if d.span == (2, 3)]
    assert {d.code for d in at_joint_move} == {"MOT002", "MOT003"}
    assert not any("joint move" in d.help or "configuration," in d.help for d in at_joint_move)
    assert any("correct the target before this one" in d.help for d in at_joint_move)


def test_through_the_singular_wrist() -> None:
    middle = tcp(np.radians([[5.0, 10.0, 10.0, 80.0, 0.3, -80.0]]))[0]
    start, end = middle.copy(), middle.copy()
    start[1, 3] -= 0.2
    end[1, 3] += 0.2
    found = codes(chain(joint(start), line(end, fine=True)))
    assert set(found) & {"MOT003", "MOT005"}


def test_out_of_reach_half_way() -> None:
    left, right = pose(0.2, -1.6, 0.8), pose(0.2, 1.6, 0.8)
    moves = chain(joint(left), line(right, fine=True))
    found = codes(moves)
    assert "KIN004" in found or "MOT003" in found


def test_one_move_is_one_sample() -> None:
    assert len(sampled(chain(joint(A))).q) == 1
