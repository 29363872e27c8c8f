"""Steps in a correction become jerk-limited transitions (ruckig, state to state) that spare the side where accuracy counts.

A correction jumps where the load jumps: the wrench is switched on at the arc start, a tool or a workpiece is taken. Between
steps it is left as it is, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from postproc.arrays import Array
from postproc.motion.path import starts_chain
from postproc.motion.values import Flags, Path, Trajectory
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian

GENTLE = (
    0.2  # [s] a transition takes at least this long where there is room: two periods of the first natural frequency
)
SMALLEST = 1e-8  # jumps below this [m] or [rad] are no steps
_SHARE = 0.05  # of every joint limit is kept for the correction, however much the motion itself uses
_HORIZON = 0.5  # [s] around a step in which the motion's own use of the limits counts


@dataclass(frozen=True, slots=True)
class Step:
    """A jump of the correction between two samples.

    Args:
        index: the jump is from sample ``index`` to ``index + 1``.
        side: where the transition belongs: ``before`` the step if accuracy counts after it, ``after`` otherwise.
        room: time on that side [s].
        speed, acceleration, jerk: limits of the progress of the transition from 0 to 1 [1/s], [1/s^2], [1/s^3].
    """

    index: int
    side: Literal["before", "after"]
    room: float
    speed: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, slots=True)
class Transition:
    """How a step was smoothed.

    Args:
        step: the step; jump: (6,) its size [m], [rad].
        begin, end: times between which the correction passes over [s].
        bound: what is left of the jump at the step, on the side where accuracy counts: 0 where there was room, else the
            largest remaining error [m] of the position, over ``overrun`` seconds.
    """

    step: Step
    jump: Array
    begin: float
    end: float
    bound: float
    overrun: float


def find_steps(path: Path, wrench_on_arc: bool) -> list[int]:
    """Samples after which the load or the tool is another: payload, tool, and the arc where the wrench comes with it."""
    moves = path.moves
    differs = [False] * len(moves)
    for k in range(1, len(moves)):
        a, b = moves[k - 1], moves[k]
        same_load = a.payload_mass == b.payload_mass and np.array_equal(a.payload_center, b.payload_center)
        same_tool = np.array_equal(a.T_flange_tcp, b.T_flange_tcp)
        differs[k] = not (same_load and same_tool) or (wrench_on_arc and a.welding != b.welding)
    begins = np.append(False, np.diff(path.move) != 0) & ~starts_chain(path.moves, path.move)
    return [int(i) - 1 for i in np.flatnonzero(begins) if differs[path.move[i]]]


def plan_steps(robot: Robot, trajectory: Trajectory, correction: Array, indices: Sequence[int]) -> list[Step]:
    """Side, room and limits of every step.

    The jump in joint angles is w = J^-1 jump; the progress g of the transition may use what the motion leaves of each
    joint's limits: |w_j| g' <= limit_j - |v_j|, and likewise for acceleration and half of the jerk.

    Args:
        correction: (n, 6) translation [m] and rotation vector [rad] of the TCP, base axes.
        indices: from ``find_steps``.
    """
    path, t = trajectory.path, trajectory.t
    moves = path.moves
    weld = np.array([m.welding for m in moves])[path.move]
    chain = np.cumsum(starts_chain(moves, path.move))
    sides: list[Literal["before", "after"]] = []
    for i in indices:
        sides.append("after" if weld[i] and not weld[i + 1] else "before")
    steps = []
    for k, i in enumerate(indices):
        jump = jump_at(t, correction, i)
        J = jacobian(robot, path.q[i : i + 1], moves[path.move[i]].T_flange_tcp)[0]
        w = np.maximum(np.abs(np.linalg.lstsq(J, jump, rcond=1e-6)[0]), 1e-12)
        near = np.abs(t - t[i]) <= _HORIZON
        left_v = np.maximum(robot.speed - np.abs(trajectory.v[near]).max(axis=0), _SHARE * robot.speed)
        left_a = np.maximum(robot.acceleration - np.abs(trajectory.a[near]).max(axis=0), _SHARE * robot.acceleration)
        room = _room(t, chain, weld, indices, sides, k)
        limits = (float((x / w).min()) for x in (left_v, left_a, 0.5 * robot.jerk))
        steps.append(Step(i, sides[k], room, *limits))
    return steps


def _room(
    t: Array, chain: Array, weld: Flags, indices: Sequence[int], sides: Sequence[Literal["before", "after"]], k: int
) -> float:
    """Time to the end of the chain, to the next weld or to the next step; shared with a transition from the other side."""
    i = indices[k]
    same = np.flatnonzero(chain == chain[i])
    if sides[k] == "before":
        welded = np.flatnonzero(weld[:i])
        edge = max(t[same[0]], t[welded[-1]] if len(welded) and not weld[i] else -np.inf)
        if k > 0:
            meet = sides[k - 1] == "after"
            edge = max(edge, t[indices[k - 1]] + (0.5 * (t[i] - t[indices[k - 1]]) if meet else 0.0))
        return float(max(t[i] - edge, 0.0))
    welded = np.flatnonzero(weld[i + 1 :]) + i + 1
    edge = min(t[same[-1]], t[welded[0] - 1] if len(welded) else np.inf)
    if k + 1 < len(indices):
        meet = sides[k + 1] == "before"
        edge = min(edge, t[indices[k + 1]] - (0.5 * (t[indices[k + 1]] - t[i]) if meet else 0.0))
    return float(max(edge - t[i], 0.0))


def jump_at(t: Array, correction: Array, i: int) -> Array:
    """Size (6,) of the step between samples i and i + 1, what comes after it carried back to the time of the step."""
    later = correction[i + 1]
    if t[i + 1] > t[i] and i + 2 < len(t) and t[i + 2] > t[i + 1]:
        slope = (correction[i + 2] - correction[i + 1]) / (t[i + 2] - t[i + 1])
        later = later - slope * (t[i + 1] - t[i])
    result: Array = later - correction[i]
    return result


def smooth_correction(t: Array, correction: Array, steps: Sequence[Step]) -> tuple[Array, list[Transition]]:
    """Replace every step by a transition o(t) from 0 to the jump, from rest to rest.

    Before the step c + o, after it c - (jump - o). Where the room is too short for the limits, the transition starts at
    the far end of the room and ends (or begins) on the side where accuracy counts; the bound says how much is left there.

    Args:
        t: (n,) [s]; correction: (n, 6). steps: from ``plan_steps``, ascending.

    Returns:
        The smoothed correction (the same array where there is no step), and what was done.
    """
    if not steps:
        return correction, []
    result = correction.copy()
    transitions = []
    for step in steps:
        i = step.index
        jump = jump_at(t, correction, i)
        if np.abs(jump).max() < SMALLEST:
            continue
        progress, duration = _progress(step)
        # Finished at the step, or begun at it; where the room is short, shifted over to the side that counts.
        over = max(duration - step.room, 0.0)
        begin = t[i] - duration + over if step.side == "before" else t[i] - over
        rows = np.flatnonzero((t > begin) & (t < begin + duration))
        first, last = (int(rows[0]), int(rows[-1])) if len(rows) else (i + 1, i)
        rows = np.arange(min(first, i + 1), max(last, i) + 1)
        g = np.array([progress(x - begin) for x in t[rows]])
        late = rows > i
        result[rows] += np.where(late, g - 1.0, g)[:, None] * jump
        at_step = progress(t[i] - begin)
        left = (1.0 - at_step if step.side == "before" else at_step) if over > 0 else 0.0
        bound = float(left * np.linalg.norm(jump[:3]))
        transitions.append(Transition(step, jump, float(begin), float(begin + duration), bound, over))
    return result, transitions


def _progress(step: Step) -> tuple[Callable[[float], float], float]:
    """Jerk-limited progress from 0 to 1 as a function of time, and how long it takes [s].

    As fast as the limits permit, or, where there is room, as slow as ``GENTLE``: with the jerk alone as limit, going
    from rest to rest takes T = (32 / jerk)^(1/3).
    """
    fast = _rest_to_rest(step.speed, step.acceleration, step.jerk)
    wanted = min(GENTLE, step.room)
    if fast.duration < wanted:
        gentle = _rest_to_rest(step.speed, step.acceleration, 32.0 / wanted**3)
        fast = gentle if gentle.duration <= max(step.room, wanted) * (1 + 1e-9) else fast

    def progress(x: float) -> float:
        if x <= 0.0 or x >= fast.duration:
            return 0.0 if x <= 0.0 else 1.0
        return float(fast.at_time(x)[0][0])

    return progress, float(fast.duration)


def _rest_to_rest(speed: float, acceleration: float, jerk: float) -> Any:
    """Ruckig's trajectory from 0 to 1, state to state (its way-points would ask a cloud service)."""
    from ruckig import InputParameter, Ruckig
    from ruckig import Trajectory as Ramp

    wanted = InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [1.0]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [speed], [acceleration], [jerk]
    ramp = Ramp(1)
    Ruckig(1).calculate(wanted, ramp)
    return ramp
