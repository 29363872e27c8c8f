"""Postures of the arm: what is tight in them, and where a program comes nearest to a joint limit or a singularity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.motion.path.samples import Samples
from postproc.rapid.data.events import MotionStatement
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian

NEAR_LIMIT = np.radians(5.0)
NEAR_SINGULAR = 0.05
LIMIT, WRIST, ARM = "joint limit", "singular wrist", "singular arm"


@dataclass(frozen=True, slots=True)
class Nearest:
    """The place of a program, at a target or between two, that is nearest to a joint limit or to a singularity.

    Args:
        to: joint limit, singular wrist or singular arm.
        amount: for a limit and a wrist an angle [deg], for an arm the smallest singular value over the largest.
        joint: number from 1, for a limit and a wrist.
        angle_deg: angle of that joint at this place.
        statement: the motion statement on whose way the place is.
    """

    to: str
    amount: float
    joint: int | None
    angle_deg: float | None
    statement: MotionStatement


def nearest_to(robot: Robot, path: Samples) -> tuple[Nearest, ...]:
    """The places of a path nearest to a joint limit and, with a spherical wrist, to a wrist and an arm singularity.

    Empty if no sample has known joint angles.
    """
    known = np.flatnonzero(np.isfinite(path.q).all(axis=1))
    if not len(known):
        return ()
    q = path.q[known]

    def at(row: int) -> MotionStatement:
        """The motion statement at a row of the known samples."""
        return path.moves[path.move[known[row]]].event.statement

    margin = np.minimum(q - robot.lower, robot.upper - q)
    row, joint = (int(i) for i in np.unravel_index(int(np.argmin(margin)), margin.shape))
    amount, angle = np.degrees([margin[row, joint], q[row, joint]]).tolist()
    nearest = [Nearest(LIMIT, amount, joint + 1, angle, at(row))]
    if robot.opw is not None:
        bend = np.arcsin(np.abs(np.sin(q[:, 4])))
        row = int(np.argmin(bend))
        amount, angle = np.degrees([bend[row], q[row, 4]]).tolist()
        nearest.append(Nearest(WRIST, amount, 5, angle, at(row)))
        ratio = _singular_values(robot, q)[:, 0]
        row = int(np.argmin(ratio))
        nearest.append(Nearest(ARM, float(ratio[row]), None, None, at(row)))
    return tuple(nearest)


def posture_notes(robot: Robot, q: Array, singular: NDArray[np.bool_]) -> tuple[str, ...]:
    """Warnings in words about postures (n, 6) [rad]: closest joint limit below 5 deg, singular wrist, singular arm.

    Args:
        singular: (n, 2), arm and wrist, from `singular_postures`.
    """
    notes: list[str] = []
    margin = np.minimum(q - robot.lower, robot.upper - q)
    row, joint = np.unravel_index(int(np.argmin(margin)), margin.shape)
    if margin[row, joint] < NEAR_LIMIT:
        notes.append(f"joint {joint + 1} is {np.degrees(margin[row, joint]):.1f} deg from its limit")
    if singular[:, 1].any():
        angle = np.degrees(q[np.argmin(np.abs(np.sin(q[:, 4]))), 4])
        notes.append(f"close to a singular wrist: joint 5 at {angle:.1f} deg")
    if singular[:, 0].any():
        notes.append("close to a singular arm: stretched, or the wrist above axis 1")
    return tuple(notes)


def singular_postures(robot: Robot, q: Array) -> NDArray[np.bool_]:
    """(n, 2) bool: whether the arm and the wrist are close to singular in postures (n, 6) [rad].

    Close means that smallest over largest singular value of the block (see `_singular_values`) is below 5 %. All are
    false for a robot without a spherical wrist.
    """
    if robot.opw is None or not len(q):
        return np.zeros((len(q), 2), dtype=bool)
    return np.asarray(_singular_values(robot, q) < NEAR_SINGULAR)


def _singular_values(robot: Robot, q: Array) -> Array:
    """(n, 2): smallest over largest singular value of the arm and of the wrist for joint angles (n, 6); 0 is singular.

    Axes 4 to 6 do not move the wrist centre, so the Jacobian there falls into a block of the arm and one of the wrist.
    """
    assert robot.opw is not None
    T_flange_wrist = np.eye(4)
    T_flange_wrist[2, 3] = -robot.opw.c4
    J = jacobian(robot, q, T_flange_wrist)
    values = np.linalg.svd(np.stack([J[:, :3, :3], J[:, 3:, 3:]], axis=1), compute_uv=False)
    return np.asarray(values[..., 2] / values[..., 0])
