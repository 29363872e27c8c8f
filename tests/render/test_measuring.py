"""The measuring program, read back as a controller reads it."""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import Source
from postproc.rapid.data.records import JointTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from postproc.render.measuring import measuring_module
from postproc.robot.catalogue import load_robot


def test_every_pose_is_reached_from_its_side_and_loads_are_changed_once() -> None:
    robot = load_robot("irb4600_60_205")
    rng = np.random.default_rng(3)
    q = rng.uniform(robot.lower, robot.upper, (8, 6))
    side = rng.choice([-1.0, 0.0, 1.0], (8, 6))
    payload = np.array([30.0, 5.0] * 4)
    labels = [f"N{i:03d}" for i in range(8)]
    text = measuring_module(robot, q, side, labels, "poses.csv", payload_kg=payload)
    program = read_program(Source("m.mod", text))
    assert program.diagnostics == ()
    visited = [event.target for event in walk(program)]
    assert len(visited) == 16
    joints = np.array([np.radians(target.robax) for target in visited if isinstance(target, JointTarget)])
    order = [1, 3, 5, 7, 0, 2, 4, 6]
    np.testing.assert_allclose(joints[1::2], q[order], atol=np.radians(1e-4))
    travel = joints[1::2] - joints[0::2]
    np.testing.assert_array_equal(np.sign(np.round(travel, 5)), side[order])
    assert (np.abs(travel) < np.radians(2.001)).all()
    assert text.count(b"mount ") == 2
    assert [text.index(label.encode()) for label in ("N001", "N003", "N000")] == sorted(
        text.index(label.encode()) for label in ("N001", "N003", "N000")
    )


def test_poses_near_a_limit_stay_inside() -> None:
    robot = load_robot("irb4600_60_205")
    text = measuring_module(robot, robot.upper[None], -np.ones((1, 6)), ["N001"], "poses.csv")
    first = walk(read_program(Source("m.mod", text)))[0].target
    assert isinstance(first, JointTarget)
    assert (np.radians(first.robax) <= robot.upper + 1e-9).all()
    assert b"mount" not in text
