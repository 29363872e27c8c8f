"""Shares of the acceleration limits that a motion along a path uses, 1 at a limit.

A joint with a constant limit uses ``|q'' sd^2 + q' sdd| / limit``. Axes 1 to 3 of an arm with `Drives` use shares of
the torque that accelerates links, payload and rotors,

    |(M(q) q'' + C(q, q') q' + J q'') sd^2 + (M(q) q' + J q') sdd| / torque,

so that the limit follows from the pose, from the payload, and from what the other joints do. Weight is left out: in the
logged arms it changes the limits by 2 to 13 % (docs/robot.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.motion.inertia import DRIVEN, drive_shares
from postproc.motion.timing.spline import Runs
from postproc.motion.values import payloads
from postproc.robot.arm import Robot

_NO_DRIVES = np.zeros((0, 3))


@dataclass(frozen=True, slots=True)
class Effort:
    """Shares of the limits per path acceleration (``slope``) and per squared path speed (``bend``) along a path.

    Args:
        acceleration: (c,) constant limits of joints and external axes [rad or m per s^2].
        s: (k,) path parameters of the knots [m].
        slope, bend: (k, 3) shares of axes 1 to 3 at the knots [s^2/m], [s^2/m^2]; (0, 3) where their limits are
            constant, too.
    """

    acceleration: Array
    s: Array
    slope: Array
    bend: Array

    def driven(self, s: Array) -> tuple[Array, Array]:
        """Shares (n, 3) of axes 1 to 3 per path acceleration and per squared path speed at parameters s (n,)."""
        i = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        w = ((s - self.s[i]) / (self.s[i + 1] - self.s[i]))[:, None]
        slope, bend = (knots[i] + w * (knots[i + 1] - knots[i]) for knots in (self.slope, self.bend))
        return slope, bend

    def at(self, s: Array, first: Array, second: Array) -> tuple[Array, Array]:
        """Shares (n, c) per path acceleration [s^2/m] and per squared path speed [s^2/m^2] at parameters s (n,).

        Args:
            first, second: (n, c) derivatives of the curve there.
        """
        slope, bend = first / self.acceleration, second / self.acceleration
        if len(self.slope):
            slope[:, DRIVEN], bend[:, DRIVEN] = self.driven(s)
        return slope, bend


def effort_of(robot: Robot, runs: Runs) -> Effort:
    """The shares of a robot's limits along its path, with the payload of each move."""
    if robot.drives is None or not runs.count:
        return Effort(runs.limits.acceleration, runs.s, _NO_DRIVES, _NO_DRIVES)
    # Derivatives from inside the run, also at its last point, where the curve passes over into the gap.
    last = np.append(~runs.inside, True)
    inner = np.where(last, np.nextafter(runs.s, -np.inf), runs.s)
    q, q1, q2 = (runs.curve(inner, order)[:, :6] for order in range(3))
    payload = payloads(runs.moves_at(runs.s))
    slope, bend = (drive_shares(robot, robot.drives, (q, *of), payload) for of in ((np.zeros_like(q), q1), (q1, q2)))
    return Effort(runs.limits.acceleration, runs.s, slope, bend)
