"""Worlds in which a person has taught the targets anew: what that changes, relative to what stands in the text."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import rapid as R
from tests.worlds.taught.programs import ARM, Task, Taught, joints
from tests.worlds.values import singles
from tests.worlds.world import World

CHANGES = ("posture", "tilt", "axes", "turn", "all")
TILT, SHIFT_MM = np.radians(6.0), 4.0


@dataclass(frozen=True)
class Anew:
    """One target taught anew: moved by ``shift`` [mm] and ``turn`` (3, 3), in axes of the work object; with its own confdata
    and external axes. A corrected target stands beside the original by its correction, and so it does when it is taught."""

    shift: list[float]
    turn: np.ndarray
    conf: list[float]
    axes: list[float]

    def of(self, value: Any) -> Any:
        place = [a + b for a, b in zip(value[0], self.shift, strict=True)]
        rot = R.matrix_quaternion(self.turn @ R.quaternion_matrix(value[1]))
        return [singles(place), [float(v) for v in rot], self.conf, self.axes]


def world(task: Task, change: str, seed: int) -> World | None:
    """A world in which all targets of a program are taught anew in one way; None where the arm cannot."""
    draw = np.random.default_rng(seed)
    signs = [-np.sign(sum(t.q[k] for t in task.targets.values())) or 1.0 for k in range(6)]
    anew: dict[str, Anew] = {}
    for name, target in task.targets.items():
        made = _taught(task, target, change, draw, signs)
        if made is None:
            return None
        other, q = made
        turn = other.T[:3, :3] @ target.T[:3, :3].T
        shift = 1000 * (other.T[:3, 3] - target.T[:3, 3])
        conf = [float(c) for c in I.confdata(ARM, q)[0]]
        anew[name] = Anew([round(float(v), 2) for v in shift], turn, conf, [float(a) for a in other.axes])
    return World(seed, anew=anew)


def _taught(
    task: Task, target: Taught, change: str, draw: np.random.Generator, signs: list[float]
) -> tuple[Taught, np.ndarray] | None:
    T, axes, q = target.T.copy(), target.axes.copy(), target.q
    if change in ("tilt", "all"):
        about = draw.normal(size=3)
        T[:3, :3] = A.rotation_vector(TILT * draw.uniform(0.3, 1) * about / np.linalg.norm(about)) @ T[:3, :3]
        T[:3, 3] += draw.uniform(-SHIFT_MM, SHIFT_MM, 3) / 1000
    if change in ("axes", "all"):
        if task.cell.axis is None:
            return None
        axes[task.cell.axis] = round(axes[task.cell.axis] + draw.uniform(0.5, 1.5) * task.cell.reach, 2)
    near = joints(task.cell, T, axes, q)
    if near is None:
        return None
    if change in ("posture", "all"):  # the wrist the other way round
        near = near + np.array([0, 0, 0, signs[3] * np.pi, -2 * near[4], signs[5] * np.pi])
    if change == "turn":  # the last axis once more around, to where that can be
        whole = next((k for k in (5, 3) if abs(near[k] + signs[k] * 2 * np.pi) < ARM.upper[k]), None)
        if whole is None:
            return None
        near = near.copy()
        near[whole] += signs[whole] * 2 * np.pi
    if (near < ARM.lower).any() or (near > ARM.upper).any():
        return None
    return replace(target, T=T, axes=axes), near
