"""Nominal inverse kinematics: the solution that a confdata means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, blocks, full_turns
from postproc.diagnostics import Diagnostic, Source, Span
from postproc.robot.arm import Robot
from postproc.robot.closed_form import inverse
from postproc.robot.configuration import (
    QUARTER,
    TURNING,
    branch,
    closed_form,
    confdata,
    quadrant_excess,
)

TAUGHT_WRIST = 2e-6  # |sin q5| below which q4 of a taught target means nothing: text carries 6 digits of a quaternion
BOUNDARY = 1e-3  # so far outside its quadrant [rad] a taught target stands by its text alone: 2 decimals of a mm
RECORDED = np.radians(0.1)
"""So far beyond a limit [rad] a posture still stands at it: positions are recorded and written in rounded numbers, and
axes are calibrated anew."""
COMPLIANT = QUARTER
"""So far outside its quadrants [rad] a solution still has the configuration: cf1, cf4 and cf6 within one of what is
stated, cfx equal (RobotStudio API reference, `ConfigurationMode.Compliant`). Tools are calibrated anew and work objects
moved: home positions of public production programs stand up to 0.4 degrees outside."""


NONE_INSIDE = (
    "check in what the target stands: tool, displacement, and work object (without `\\WObj` it is `wobj0`); as it is "
    "read no configuration reaches it"
)
"""Help where every solution of a pose is beyond a limit."""


@dataclass(frozen=True, slots=True)
class UnreachedPose:
    """Why a pose has no joint angles.

    Args:
        index: which pose.
        reason: ``unreachable``, ``configuration`` (no solution has it) or ``limit``.
        message: one sentence; help: one action.
    """

    index: int
    reason: Literal["unreachable", "configuration", "limit"]
    message: str
    help: str

    def diagnostic(self, source: Source | None = None, span: Span | None = None) -> Diagnostic:
        """Return the error KIN001 (unreachable), KIN002 (configuration) or KIN003 (limit) at a place of a file."""
        code = {"unreachable": "KIN001", "configuration": "KIN002", "limit": "KIN003"}[self.reason]
        return Diagnostic(code, "error", self.message, source, span, self.help)


@dataclass(frozen=True, slots=True)
class JointSolution:
    """Joint angles (n, 6) [rad], NaN where a failure says why."""

    q: Array
    failures: tuple[UnreachedPose, ...]


def joint_solution(robot: Robot, T_base_flange: Array, conf: NDArray[np.int64] | Array) -> JointSolution:
    """Compute the joint angles that a controller takes for poses with confdata, whole turns included.

    A pose without one has NaN and a failure.

    Args:
        T_base_flange: (n, 4, 4). conf: (n, 4) [cf1, cf4, cf6, cfx].

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    poses = np.asarray(T_base_flange, dtype=float).reshape(-1, 4, 4)
    wanted = np.asarray(conf, dtype=np.int64).reshape(-1, 4)
    q, failures = np.empty((len(poses), 6)), []
    for rows in blocks(len(poses)):
        q[rows], solved = _solve(robot, poses[rows], wanted[rows])
        failures += [replace(f, index=rows.start + f.index) for f in solved]
    return JointSolution(q, tuple(failures))


def selects(robot: Robot, conf: NDArray[np.int64], q: Array) -> NDArray[np.bool_]:
    """Return (n,) whether confdata (n, 4) means joint angles (n, 6) [rad] and no other solution of their pose.

    cf1, cf4 and cf6 are within one quadrant, less the rounding of text, and cfx is equal. At a nearly straight wrist
    cfx hardly tells the two wrists apart, between which axis 4 makes half a turn: there they must be within half a
    quadrant, and inside at an exactly straight one, where axes 4 and 6 are divided anew.

    Raises:
        PostprocError: KIN005, the arm does not stand as ABB arms do at zero.
    """
    bend = np.abs(np.sin(q[..., 4]))
    most = np.where(bend < 2 * BOUNDARY, COMPLIANT / 2, COMPLIANT) - BOUNDARY / 2
    most = np.where(bend < 2 * TAUGHT_WRIST, BOUNDARY / 2, most)
    other = branch(closed_form(robot), q) ^ conf[..., 3]
    same = (other == 0) | ((other == 1) & (bend < BOUNDARY / 2))
    return np.asarray(same & (quadrant_excess(q, conf) <= most))


def beyond_limits(robot: Robot, q: Array) -> list[UnreachedPose]:
    """Return a failure for each posture (n, 6) [rad] outside the limits, about its joint farthest out.

    Up to 0.1 degrees (``RECORDED``) outside counts as inside. NaN rows have none.
    """
    excess = excess_of(robot, q)
    help_ = "move or turn the target, or give it another configuration"
    beyond = []
    for i in np.flatnonzero(excess.max(axis=1, initial=0.0) > 0.0):
        j = int(np.argmax(excess[i]))
        limit = np.degrees(robot.lower[j] if q[i, j] < robot.lower[j] else robot.upper[j])
        text = f"joint {j + 1} reaches {np.degrees(q[i, j]):.1f} deg, limit {round(limit, 1):g} deg"
        beyond.append(UnreachedPose(int(i), "limit", text, help_))
    return beyond


def excess_of(robot: Robot, q: Array) -> Array:
    """Return (n, 6) how far joint angles [rad] are beyond their limits less 0.1 degrees; positive is outside."""
    return np.asarray(np.maximum(robot.lower - q, q - robot.upper) - RECORDED)


def nearest_solution(robot: Robot, T_base_flange: Array, q: Array) -> Array:
    """Return joint angles (6,) [rad] within limits that reach a pose with least travel from a posture; else NaN.

    Args:
        T_base_flange: (4, 4). q: (6,) the posture [rad]; travel is the sum over the joints.
    """
    solutions = inverse(robot, T_base_flange[None])[0]
    turned = q + (solutions - q + np.pi) % (2 * np.pi) - np.pi
    inside = (excess_of(robot, turned) <= 0.0).all(axis=-1)  # False where there is no solution
    travel = np.where(inside, np.abs(turned - q).sum(axis=-1), np.inf)
    best = int(np.argmin(travel))
    return turned[best] if np.isfinite(travel[best]) else np.full(6, np.nan)


def _solve(robot: Robot, poses: Array, wanted: NDArray[np.int64]) -> tuple[Array, list[UnreachedPose]]:
    """Compute the joint angles (n, 6) of poses (n, 4, 4) with confdata ``wanted`` (n, 4); NaN rows have a failure."""
    opw = closed_form(robot)
    solutions = inverse(robot, poses)
    q, gap = _turned(solutions, wanted[:, None, :3])
    bits = branch(opw, solutions)
    # At a straight wrist both signs of axis 5 are the same arm.
    mirrored = (np.abs(np.sin(solutions[..., 4])) < BOUNDARY) & (bits ^ 1 == wanted[:, None, 3])
    same = (bits == wanted[:, None, 3]) | mirrored
    exists = np.asarray(np.isfinite(solutions).all(axis=-1))
    # Among branches that fit, one inside its quadrants and inside the limits wins.
    excess = np.where(excess_of(robot, q) > 0.0, 1.0, 0.0).sum(axis=-1)
    cost = np.where(exists & same & (gap <= COMPLIANT), gap + excess + 2 * TAUGHT_WRIST * mirrored, np.inf)
    best = np.argmin(cost, axis=1)
    rows = np.arange(len(q))
    solved = np.isfinite(cost[rows, best])
    result = np.where(solved[:, None], q[rows, best], np.nan)
    failures = [
        _missing(robot, int(i), solutions[i], wanted[i])
        if exists[i].any()
        else UnreachedPose(
            int(i), "unreachable", _out_of_reach(robot, poses[i]), "move the target into the working range"
        )
        for i in np.flatnonzero(~solved)
    ]
    for failure in beyond_limits(robot, result):
        others = solutions[failure.index]
        others = others[np.isfinite(others).all(axis=-1)]
        none = bool((excess_of(robot, others) > 0.0).any(axis=-1).all())
        failures.append(replace(failure, help=NONE_INSIDE) if none else failure)
    result[[f.index for f in failures]] = np.nan
    return result, sorted(failures, key=lambda f: f.index)


def _turned(q: Array, cf: NDArray[np.int64]) -> tuple[Array, Array]:
    """Move axes 1, 4 and 6 of solutions by whole turns into their quadrants, or as near as possible.

    At a straight wrist axes 4 and 6 are divided anew where that helps.

    Args:
        q: (n, 8, 6) [rad]; cf: (n, 1, 3) quadrants cf1, cf4, cf6.

    Returns:
        The moved angles, and the largest distance (n, 8) [rad] of an axis from its quadrant.
    """
    moved, gap = _near_quadrants(q, cf)
    on_boundary = (np.abs(np.sin(q[..., 4])) < TAUGHT_WRIST) & (gap > BOUNDARY)
    if on_boundary.any():
        divided, remainder = _near_quadrants(_divided_wrist(q, cf), cf)
        moved = np.where(on_boundary[..., None], divided, moved)
        gap = np.where(on_boundary, remainder + TAUGHT_WRIST, gap)
    return moved, gap


def _near_quadrants(q: Array, cf: NDArray[np.int64]) -> tuple[Array, Array]:
    """Move axes 1, 4 and 6 by whole turns to their quadrants; arguments and result are those of `_turned`."""
    middle = (cf + 0.5) * QUARTER
    turning = q[..., TURNING] + full_turns(q[..., TURNING], near=middle)
    gap = np.maximum(np.abs(turning - middle) - QUARTER / 2, 0.0).max(axis=-1)
    result = q.copy()
    result[..., TURNING] = turning
    return result, gap


def _divided_wrist(q: Array, cf: NDArray[np.int64]) -> Array:
    """Divide the turn of axes 4 and 6 at a straight wrist so that both are in or near their quadrants.

    Axis 5 is set to exactly straight. Arguments and result are solutions (n, 8, 6) [rad] and quadrants as in `_turned`.
    """
    forth = np.where(np.cos(q[..., 4]) > 0, 1.0, -1.0)
    # A quadrant does not own its upper edge.
    low, high = cf[..., 1] * QUARTER, (cf[..., 1] + 1) * QUARTER - TAUGHT_WRIST
    total = q[..., 3] + forth * q[..., 5]
    q4 = np.broadcast_to(np.clip(0.0, low, high), total.shape)
    middle = (cf[..., 2] + 0.5) * QUARTER
    q6 = forth * (total - q4)
    q6 = q6 + full_turns(q6, near=middle)
    inside = np.clip(q6, middle - QUARTER / 2, middle + QUARTER / 2 - TAUGHT_WRIST)
    q4 = np.clip(q4 + forth * (q6 - inside), low, high)
    result = q.copy()
    result[..., 3], result[..., 4], result[..., 5] = q4, np.round(q[..., 4] / np.pi) * np.pi, forth * (total - q4)
    return result


def _out_of_reach(robot: Robot, T_base_flange: Array) -> str:
    """Return a sentence that says where the flange would be, and how far its wrist centre is too far or too near."""
    arm = closed_form(robot)
    x, y, z = T_base_flange[:3, 3] - arm.c4 * T_base_flange[:3, 2]
    ahead = np.sqrt(max(x * x + y * y - arm.b**2, 0.0)) - arm.a1
    away, forearm = np.hypot(ahead, z - arm.c1), np.hypot(arm.a2, arm.c3)
    over, under = away - (arm.c2 + forearm), abs(arm.c2 - forearm) - away
    place = " ".join(f"{1e3 * v:.0f}" for v in T_base_flange[:3, 3])
    how = f"its wrist would be {1e3 * over:.0f} mm too far away" if over > 0 else ""
    how = f"its wrist would be {1e3 * under:.0f} mm too near" if under > 0 else how
    return f"`{robot.name}` cannot reach the target, the flange at {place} mm in base axes" + (how and f": {how}")


def _missing(robot: Robot, index: int, solutions: Array, wanted: NDArray[np.int64]) -> UnreachedPose:
    """Return the failure of a pose without a solution in the wanted configuration, listing those that exist.

    Args:
        index: number of the pose.
        solutions: (8, 6) of the pose [rad], NaN rows where there is none; wanted: its confdata (4,).
    """
    solutions = solutions[np.isfinite(solutions).all(axis=-1)]
    turned, _ = _turned(solutions[None], wanted[None, None, :3])
    q = np.concatenate([turned[0], solutions])  # a turn towards what is wanted may lead beyond a limit
    inside = (excess_of(robot, q) <= 0.0).all(axis=-1)
    q = q[inside] if inside.any() else q
    confs = confdata(robot, q)
    # A branch that differs costs more than any turn.
    distance = np.abs(confs[:, :3] - wanted[:3]).sum(axis=1) + 100 * (confs[:, 3] != wanted[3])
    order = np.argsort(distance, kind="stable").tolist()
    listed = {tuple(confs[i].tolist()): np.degrees(q[i]) for i in reversed(order)}
    nearest, *others = (f"{[*conf]} at joints {_rounded(degrees)} deg" for conf, degrees in reversed(listed.items()))
    help_ = f"write one that exists: {nearest} (nearest)" + "".join(f", {other}" for other in others)
    text = f"no joint solution of the target has the configuration {wanted.tolist()}"
    if not inside.any():
        text, help_ = f"{text}, and no other one keeps the limits of the joints", NONE_INSIDE
    return UnreachedPose(index, "configuration", text, help_)


def _rounded(degrees: Array) -> str:
    """Return joint angles [deg] as text with a decimal each."""
    return "(" + ", ".join(f"{round(x, 1) + 0.0:g}" for x in degrees.tolist()) + ")"
