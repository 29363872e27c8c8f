"""The measuring program, read back as a controller reads it."""

from __future__ import annotations

import re

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.rapid.data.records import JointTarget
from postproc.rapid.execution.walk import walk
from postproc.render.measuring import measuring_module
from postproc.robot.catalogue import load_robot
from tests.rapid.build import program

ROBOT = load_robot("irb4600_60_205")


def visited(text: bytes) -> Array:
    """Joint angles (n, 6) [rad] in the order in which they are visited."""
    read = program(text)
    assert not read.diagnostics
    targets = [event.target for event in walk(read)]
    return np.radians([target.robax for target in targets if isinstance(target, JointTarget)])


def test_every_pose_is_reached_from_its_side_and_loads_are_changed_once() -> None:
    rng = np.random.default_rng(3)
    q = rng.uniform(ROBOT.lower, ROBOT.upper, (8, 6))
    side = rng.choice([-1.0, 0.0, 1.0], (8, 6))
    labels = [f"N{i}" for i in range(8)]
    text = measuring_module(ROBOT, State(q, approach=side, payload_mass=np.array([30.0, 5.0] * 4)), labels, "poses.csv")
    joints, order = visited(text), [1, 3, 5, 7, 0, 2, 4, 6]
    travel = joints[1::2] - joints[0::2]
    np.testing.assert_allclose(joints[1::2], q[order], atol=np.radians(1e-4))
    np.testing.assert_array_equal(np.sign(np.round(travel, 5)), side[order])
    assert (np.abs(travel) < np.radians(2.001)).all()
    assert list(dict.fromkeys(re.findall(r"N\d", text.decode()))) == [labels[i] for i in order]
    assert text.count(b"mount ") == 2


def test_poses_near_a_limit_stay_inside() -> None:
    text = measuring_module(ROBOT, State(ROBOT.upper[None], approach=-np.ones((1, 6))), ["N1"], "poses.csv")
    assert len(visited(text)) == 2 and (visited(text) <= ROBOT.upper + 1e-9).all() and b"mount" not in text
