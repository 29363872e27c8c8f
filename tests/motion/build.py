"""Short programs as moves, without a RAPID text, their samples and time; what a RAPID text becomes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.motion.path.samples import Samples, sample_path
from postproc.motion.timing.trajectory import Trajectory, retime
from postproc.motion.values import Move
from postproc.rapid.data.events import MotionEvent
from postproc.robot.catalogue import load_robot
from postproc.robot.inverse import inverse
from postproc.robot.kinematics import forward

DRIVEN = load_robot("irb4600_60_205")
LIMIT = np.array([8.0, 8.0, 8.0, 20.0, 20.0, 25.0])
ROBOT = replace(DRIVEN, acceleration=LIMIT, jerk=10 * LIMIT, drives=None)  # the same limits in every pose
HOME = np.radians([0.0, 20.0, 10.0, 0.0, 60.0, 0.0])
DOWN = (0.0, 180.0, 0.0)


def pose(x: float, y: float, z: float, angles: tuple[float, float, float] = DOWN) -> np.ndarray:
    """(4, 4) from metres and zyx angles [deg]."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("zyx", angles, degrees=True).as_matrix()
    T[:3, 3] = x, y, z
    return T


TORCH = pose(0.05, 0.0, 0.35, (0.0, 30.0, 0.0))


def chain(*steps: dict[str, Any], tool: np.ndarray = TORCH) -> list[Move]:
    """Moves from keyword arguments of ``Move``; joint angles stay as near as possible to those of the move before."""
    moves: list[Move] = []
    q = HOME
    for i, step in enumerate(steps):
        fields = {"starts_chain": i == 0, "T_mount_tcp": tool, **step}
        T = fields.get("T_work_tcp")
        if T is None:
            q = np.asarray(fields.pop("q"))
        else:
            branches = inverse(ROBOT, (T @ np.linalg.inv(fields["T_mount_tcp"]))[None])[0]
            branches = branches[np.isfinite(branches).all(axis=1)]
            turns = branches - 2 * np.pi * np.round((branches - q) / (2 * np.pi))
            q = turns[int(np.argmin(np.abs(turns - q).max(axis=1)))]
        moves.append(Move(row=i, event=_event(i), q=q, **fields))
    return moves


def line(T: np.ndarray, **more: Any) -> dict[str, Any]:
    return {"kind": "line", "T_work_tcp": T, **more}


def joint(T: np.ndarray, **more: Any) -> dict[str, Any]:
    return {"kind": "joint", "T_work_tcp": T, **more}


def arc(via: np.ndarray, T: np.ndarray, **more: Any) -> dict[str, Any]:
    return {"kind": "arc", "T_work_tcp": T, "T_work_via": via, **more}


def _event(row: int) -> MotionEvent:
    """A stand-in with nothing but a place."""
    statement = SimpleNamespace(argument=lambda role: None, source=None, span=(row, row + 1))
    return cast(MotionEvent, SimpleNamespace(statement=statement, options={}, turns=()))


def sampled(*steps: dict[str, Any]) -> Samples:
    """The samples of a chain in which nothing is wrong."""
    path, findings = sample_path(ROBOT, chain(*steps))
    assert findings == []
    return path


def timed(*steps: dict[str, Any]) -> Trajectory:
    return retime(ROBOT, sampled(*steps))


def tcp(q: np.ndarray, tool: np.ndarray = TORCH) -> np.ndarray:
    return forward(ROBOT, q) @ tool
