r"""``SingArea\Wrist``: the TCP on its line or circle, axes 4 to 6 as joints, against an arm in plain numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.motion.path.curves import build_curves, pose_at
from postproc.motion.path.samples import sample_path
from postproc.motion.values import Move
from tests.independent.arm import irb4600
from tests.motion.build import HOME, ROBOT, TORCH, arc, chain, joint, line, pose, tcp

OTHER_WRIST = np.array([0.0, 0.0, 0.0, np.pi, 0.0, -np.pi])
ALMOST_STRAIGHT = np.radians([5.0, 20.0, 10.0, -80.0, 4.0, 80.0])
START = tcp(ALMOST_STRAIGHT)[0]


def own_tcp(q: np.ndarray) -> np.ndarray:
    return np.asarray(irb4600().forward(q, TORCH).tcp)


def flipped(move: Move) -> Move:
    """The same goal with the other sign of axis 5."""
    return replace(move, q=move.q * (1, 1, 1, 1, -1, 1) + OTHER_WRIST)


def wrist(moves: list[Move]) -> list[Move]:
    for move in moves:
        move.event.options["wrist_in_joints"] = True  # type: ignore[index]
    return moves


def over_the_singularity() -> list[Move]:
    ahead, aside = START.copy(), START.copy()
    ahead[1, 3] += 0.1
    aside[:2, 3] += 0.1
    first, middle, last = chain(joint(START), line(ahead, zone=0.01, zone_rotation=0.02), line(aside, fine=True))
    first = replace(first, q=ALMOST_STRAIGHT)
    return [first, flipped(middle), flipped(last)]


def test_a_wrist_that_flips_leaves_the_tcp_on_its_lines_and_its_corner() -> None:
    assert "MOT004" in {d.code for d in sample_path(ROBOT, over_the_singularity())[1]}
    moves = wrist(over_the_singularity())
    path, findings = sample_path(ROBOT, moves)
    assert findings == []
    assert np.abs(own_tcp(path.q) - path.T_work_tcp).max() < 1e-9
    assert np.abs(np.diff(path.q, axis=0)).max() < np.radians(10.0)
    free = ~path.blend
    p = path.T_work_tcp[:, :3, 3] - START[:3, 3]
    assert np.abs(p[free & (path.move == 1)][:, [0, 2]]).max() < 1e-9
    assert np.abs(p[free & (path.move == 2)] @ np.array([[0, 1, 0], [0, 0, 1]]).T - (0.1, 0.0)).max() < 1e-9
    assert np.linalg.norm(p[path.blend] - (0.0, 0.1, 0.0), axis=1).max() < 0.010 + 1e-9
    rows = (path.move == 1) & (path.u < 0.5)
    even = moves[0].q + path.u[rows][:, None] * (moves[1].q - moves[0].q)
    assert path.q[rows][:, 3:] == pytest.approx(even[:, 3:], abs=1e-12)
    assert path.q[-1] == pytest.approx(moves[2].q, abs=1e-9)


def test_on_an_arc_the_tool_passes_the_circle_point_as_it_is_programmed_there() -> None:
    start, via, end = pose(1.1, -0.1, 0.5), pose(1.2, 0.0, 0.5, (10, 170, 5)), pose(1.1, 0.1, 0.5, (20, 185, 0))
    curves = build_curves(ROBOT, tuple(wrist(chain(joint(start), arc(via, end, fine=True)))))
    T = pose_at(ROBOT, curves, np.ones(41, dtype=int), np.linspace(0.0, 1.0, 41))
    assert np.abs(np.linalg.norm(T[:, :3, 3] - (1.1, 0.0, 0.5), axis=1) - 0.1).max() < 1e-9
    assert np.stack([T[0], T[20], T[40]]) == pytest.approx(np.stack([start, via, end]), abs=1e-9)


def test_a_stationary_tool_keeps_its_line_on_the_carried_work() -> None:
    nozzle = tcp(HOME)[0]
    ends = np.radians([[0.0, 20.0, 10.0, 0.0, 60.0, 0.0], [4.0, 22.0, 8.0, 30.0, 55.0, -40.0]])
    steps = [{"kind": "absjoint", "q": ends[0]}, {"kind": "line", "q": ends[1], "fine": True}]
    moves = wrist(chain(*steps, tool=nozzle))
    path, findings = sample_path(ROBOT, [replace(move, stationary=True) for move in moves])
    assert findings == []
    on_work = np.linalg.inv(irb4600().forward(path.q, np.eye(4)).flange) @ nozzle
    chord = on_work[-1, :3, 3] - on_work[0, :3, 3]
    assert on_work[:, :3, 3] == pytest.approx(on_work[0, :3, 3] + np.append(0, path.u[1:])[:, None] * chord, abs=1e-9)


def test_a_line_that_leaves_the_reach_is_said_to() -> None:
    left, right = pose(0.2, -1.6, 0.8), pose(0.2, 1.6, 0.8)
    _, findings = sample_path(ROBOT, wrist(chain(joint(left), line(right, fine=True))))
    assert {"KIN004", "MOT002"} & {d.code for d in findings if d.severity == "error"}
