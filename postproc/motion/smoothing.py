"""Jumps of a correction become jerk-limited transitions in time (ruckig, state to state).

A correction jumps where the load jumps: the wrench is switched on at the arc start, a tool or a workpiece is taken. The
transition belongs to the move where accuracy counts less: finished before the arc, begun after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.robot.arm import Robot

GENTLE = 0.2  # [s] a transition takes this long where there is time: two periods of an arm's usual first frequency
TRANSITION_SHARE = 0.1  # of every joint limit is given to transitions; the rest is the motion's


@dataclass(frozen=True, slots=True)
class Ramp:
    """A transition from no correction to the whole jump.

    Args:
        jump: (6,) translation [m] and rotation vector [rad].
        duration: of the transition [s].
        curve: Ruckig trajectory from 0 to 1, whose own duration is scaled to that.
    """

    jump: Array
    duration: float
    curve: Any

    def at(self, time: Array) -> Array:
        """Correction (k, 6) at times (k,) since the transition began [s]: zero before, the whole jump after its end."""
        if self.duration <= 0.0:
            return np.where(time[:, None] < 0.0, 0.0, self.jump)
        inside = np.clip(time / self.duration, 0.0, 1.0) * self.curve.duration
        progress = np.array([self.curve.at_time(x)[0][0] for x in inside])
        return np.clip(progress, 0.0, 1.0)[:, None] * self.jump


def transition(robot: Robot, jump: Array, joints_by_shift: Array, available: float) -> Ramp:
    """The jerk-limited transition over a jump (6,) of the correction; it takes 0.2 s, or less if there is less time.

    The joints turn by w = J^-1 jump in proportion to one progress g from 0 to 1, so joint j asks for |w_j| g' <=
    speed_j, |w_j| g'' <= acceleration_j, |w_j| g''' <= jerk_j, each 10 % of the joint's limit. It takes longer than 0.2
    s where these limits demand it, but never longer than the available time: then the limits are exceeded.

    Args:
        jump: translation [m] and rotation vector [rad].
        joints_by_shift: (k, 6, 6) at k poses of the move, from ``Mounts.joints_by_shift``.
        available: time there is [s].
    """
    w = np.maximum(np.abs(joints_by_shift @ jump).max(axis=0), 1e-12)
    speed, acceleration, jerk = (
        float((TRANSITION_SHARE * x / w).min()) for x in (robot.speed, robot.acceleration, robot.jerk)
    )
    curve = fast = _between_stops(speed, acceleration, jerk)
    wanted = min(GENTLE, available)
    if fast.duration < wanted:
        # With the jerk alone as limit, a way of 1 from rest to rest takes (32 / jerk)^(1/3).
        gentle = _between_stops(speed, acceleration, 32.0 / wanted**3)
        curve = gentle if gentle.duration <= available * (1 + 1e-9) else fast
    return Ramp(jump, float(min(curve.duration, max(available, 0.0))), curve)


def _between_stops(speed: float, acceleration: float, jerk: float) -> Any:
    """Ruckig trajectory of one coordinate from 0 to 1, from rest to rest under the three limits, without way-points.

    Ruckig would calculate way-points through a cloud service.
    """
    from ruckig import InputParameter, Ruckig, Trajectory

    wanted = InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [1.0]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [speed], [acceleration], [jerk]
    curve = Trajectory(1)
    Ruckig(1).calculate(wanted, curve)
    return curve
