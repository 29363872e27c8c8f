"""Millimetres to metres and back, against scipy rotations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from postproc.arrays import invert
from postproc.rapid.motions import units
from tests.rapid.build import events

W = 'PERS wobjdata w:=[FALSE,TRUE,"",[[1000,200,-30],[0.5,0.5,-0.5,0.5]],[[10,20,30],[0,0.6,0,0.8]]];'
T = "PERS tooldata t:=[TRUE,[[10,-20,350],[0.8,0,0.6,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"
POINT = "[[400,-50,80],[0.1,0.7,-0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def T_of(trans: list[float], q: list[float]) -> np.ndarray:
    result = np.eye(4)
    w, x, y, z = q
    result[:3, :3], result[:3, 3] = Rotation.from_quat([x, y, z, w]).as_matrix(), np.array(trans) / 1000
    return result


U, O_, D = (
    T_of([1000, 200, -30], [0.5, 0.5, -0.5, 0.5]),
    T_of([10, 20, 30], [0, 0.6, 0, 0.8]),
    T_of([1, 2, 3], [0.8, 0, 0, 0.6]),
)
X = T_of([400, -50, 80], [0.1, 0.7, -0.5, 0.5])
TOOL = T_of([10, -20, 350], [0.8, 0, 0.6, 0])
EVENT = events(f"PDispSet [[1,2,3],[0.8,0,0,0.6]]; MoveL {POINT},v5,z0,t\\WObj:=w;", W + T)[0]


def test_target_is_uframe_oframe_displacement_target() -> None:
    np.testing.assert_allclose(units.target_matrix(EVENT), U @ O_ @ D @ X, atol=1e-12)
    np.testing.assert_allclose(units.tool_matrix(EVENT.tool), TOOL, atol=1e-12)
    np.testing.assert_allclose(units.flange_matrix(EVENT), U @ O_ @ D @ X @ np.linalg.inv(TOOL), atol=1e-12)


def test_many_at_once() -> None:
    found = units.target_matrices([EVENT, EVENT])
    np.testing.assert_allclose(found, [units.target_matrix(EVENT)] * 2, atol=1e-15)
    assert units.target_matrices([]).shape == (0, 4, 4)


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_poses_are_written_back_in_the_object_frame(numbers: list[float]) -> None:
    goal = np.eye(4)
    goal[:3, :3], goal[:3, 3] = Rotation.from_rotvec(np.array(numbers[:3]) * 3).as_matrix(), numbers[3:]
    (pose,) = units.target_poses([EVENT], goal[None])
    np.testing.assert_allclose(U @ O_ @ D @ units.pose_matrix(pose.trans, pose.rot), goal, atol=1e-9)
    assert EVENT.target is not None and np.dot(pose.rot, EVENT.target.rot) >= 0  # type: ignore[union-attr]


def test_stationary_tool_holds_still_and_the_robot_carries_the_object() -> None:
    data = (T + W).replace("[TRUE,[[10", "[FALSE,[[10").replace("[FALSE,TRUE", "[TRUE,TRUE")
    event = events(f"MoveL {POINT},v5,z0,t\\WObj:=w;", data)[0]
    flange = units.flange_matrix(event)
    np.testing.assert_allclose(flange @ U @ O_ @ X, TOOL, atol=1e-12)


def test_inverse_of_many() -> None:
    both = np.stack([U, X])
    np.testing.assert_allclose(invert(both) @ both, [np.eye(4)] * 2, atol=1e-12)


def test_events_without_robtarget_are_refused() -> None:
    event = events("MoveAbsJ [[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v5,z0,tool0;")[0]
    with pytest.raises(ValueError, match="robtarget"):
        units.target_matrix(event)
