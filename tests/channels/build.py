"""States of an arm with all that a table or a program may record, drawn once; frames are random."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.channels.sight import Site
from postproc.channels.state import State

ROWS = 40
POINT, PLACE = (0.03, -0.02, 0.05), (1.2, -0.4, 0.3, 0.02, -0.05, 0.3)
SITE = Site(POINT, PLACE)


def frames(seed: int, count: int) -> np.ndarray:
    """(ROWS, count, 4, 4) poses of frames about a metre from the origin."""
    T = np.tile(np.eye(4), (ROWS, count, 1, 1))
    T[..., :3, :3] = Rotation.random(ROWS * count, random_state=seed).as_matrix().reshape(ROWS, count, 3, 3)
    T[..., :3, 3] = np.random.default_rng(seed).normal(0, 0.8, (ROWS, count, 3))
    return T


def full_state(**changes) -> State:
    """A state with every channel; the base end of its link 0 is half a metre above the origin."""
    g = np.random.default_rng(7)
    link = np.tile(np.eye(4), (7, 1, 1))
    link[0, 2, 3] = 0.5
    fields = {
        "q": g.uniform(-1.5, 1.5, (ROWS, 6)),
        "v": g.normal(0, 1, (ROWS, 6)),
        "a": g.normal(0, 5, (ROWS, 6)),
        "approach": g.choice([-1.0, 1.0], (ROWS, 6)),
        "payload_mass": g.choice([5.0, 30.0], ROWS),
        "wrench": g.normal(0, 300, (ROWS, 6)),
        "temperature": 22 + 3 * g.normal(size=ROWS),
        "time": np.sort(g.uniform(0, 9000, ROWS)),
        "session": np.repeat([0, 1], ROWS // 2),
        "channels": {"rail_m": g.uniform(0, 4, ROWS), "oil level": g.uniform(1, 2, ROWS), "row": np.arange(ROWS) + 1.0},
        "joint_load": g.normal(0, 400, (ROWS, 6)),
        "body_load": g.normal(0, 500, (ROWS, 7, 6)),
        "T_base_body": frames(3, 7),
        "T_flange_tcp": frames(4, 1)[0, 0],
        "robot": SimpleNamespace(link=link),
    }
    return State(**{**fields, **changes})


def tool_points(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Axes (n, 3, 3) of the tool and places (n, 3) of the measured point in base axes."""
    T = np.array([body[6] @ state.T_flange_tcp for body in state.T_base_body])
    return T[:, :3, :3], np.array([pose[:3] @ [*POINT, 1.0] for pose in T])


def turned(way: int, vector: np.ndarray) -> np.ndarray:
    """A vector (3,) of base axes in those of the instrument, or back (way -1)."""
    return Rotation.from_rotvec(way * np.array(PLACE[3:])).apply(vector)


def seen_points(points: np.ndarray) -> np.ndarray:
    """(n, 3) points of the base as the instrument sees them."""
    return np.array([turned(1, p) + PLACE[:3] for p in points])
