"""Tools on the flange and tools that stand still, against products of matrices written out here."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.motion.mounts import Mounts
from tests.motion.build import HOME, ROBOT, TORCH, pose, tcp

STAND = pose(1.3, -0.1, 0.9, (20.0, 150.0, 35.0))
MOUNTS = Mounts(np.array([TORCH, STAND]), np.array([False, True]))
Q = np.array([HOME, HOME + 0.2])
FLANGE = tcp(Q, np.eye(4))


@pytest.mark.parametrize("axis", range(6))
def test_joint_angles_of_a_small_shift(axis: int) -> None:
    """Turning the joints as the inverse Jacobian says shifts the TCP on the work by the shift, to first order."""
    T = MOUNTS.work(FLANGE)
    size = 1e-6
    step = MOUNTS.joints_by_shift(ROBOT, Q, T)[:, :, axis] * size
    after = MOUNTS.work(tcp(Q + step, np.eye(4)))
    turn = Rotation.from_matrix(after[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    found = np.concatenate([after[:, :3, 3] - T[:, :3, 3], turn], axis=1) / size
    assert found == pytest.approx(np.tile(np.eye(6)[axis], (2, 1)), abs=1e-4)


def test_the_same_matrix_is_another_mount_where_the_tool_stands_still() -> None:
    held, standing = (Mounts(np.array([TORCH]), np.array([flag])) for flag in (False, True))
    assert held.same(held).all() and standing.same(standing).all()
    assert not held.same(standing).any()
