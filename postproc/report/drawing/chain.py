"""The chain of an arm as plain numbers, from which a page draws it."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.report.drawing.columns import exact
from postproc.robot.arm import Robot


def chain_of(robot: Robot, T_flange_tcp: Array) -> dict[str, Any]:
    """The chain T_base_flange = link[0] Rot(axis[0], q1) .. link[6], and which tool each row has, (m, 4, 4)."""
    tools, tool = np.unique(T_flange_tcp[:, :3, 3], axis=0, return_inverse=True)
    return {
        "name": robot.name,
        "link": robot.link.tolist(),
        "axis": robot.axis.tolist(),
        "tools": tools.tolist(),
        "tool": exact(tool.reshape(-1)),
    }
