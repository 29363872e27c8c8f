"""The path of a program whose arm or work is carried is drawn in the frame of the work, with the arm where it stands."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.report.drawing.path import path_data
from tests.cells.test_paths import FORCE, Case, converted, positioner, track
from tests.report.conftest import numbers


@pytest.mark.parametrize("case", [track(0.0, 250.0, 400.0), positioner(0.0, 40.0, 60.0)], ids=["track", "positioner"])
def test_the_tool_of_the_drawn_arm_is_on_the_path(case: Case) -> None:
    """What the page's script does, in plain numbers: link Rot(axis, q) .. tool, then the base in the work's frame."""
    data = path_data(converted(case, force=FORCE))
    places, arm = data["places"], data["arm"]
    q, p, base = numbers(places["q"]), numbers(places["p"]), numbers(data["base"])
    tool = np.array(arm["tools"])[numbers(arm["tool"]).astype(int)[numbers(places["move"]).astype(int)]]
    assert np.ptp(base, axis=0).max() > 0.2  # it moves
    for i in range(0, len(q), 7):
        T = np.eye(4)
        for j in range(6):
            x, y, z = arm["axis"][j]
            S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            turn = np.eye(4)
            turn[:3, :3] += np.sin(q[i, j]) * S + (1 - np.cos(q[i, j])) * S @ S
            T = T @ np.array(arm["link"][j]) @ turn
        tip = T @ np.array(arm["link"][6]) @ [*tool[i], 1.0]
        there = base[i].reshape(3, 4) @ tip
        assert there == pytest.approx(p[i], abs=1e-3)
