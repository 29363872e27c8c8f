"""What is left between corrected ends: a line follows the corrections of its ends, not those on its way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.compensation.correction.inverse import command
from postproc.model.arm import Model
from postproc.robot.kinematics import forward
from postproc.runtime.conditions import Conditions
from postproc.runtime.proof.check import SOLVED_M

LINE_M = 0.5
LINES = 400
FOLLOWED = np.radians(90.0)
"""Travel of a joint on half a line [rad] beyond which the line leads past a singular pose."""


@dataclass(frozen=True)
class ChordError:
    """Error in the middle of lines of length `LINE_M` between two corrected ends [m]; count: number of lines."""

    count: int
    largest_m: float
    rms_m: float

    @property
    def per_square_metre(self) -> float:
        """The largest error over the square of the length [m/m2], as the correction bends evenly along a line."""
        return self.largest_m / LINE_M**2

    def __str__(self) -> str:
        """The result in one line of text, with lengths in mm."""
        return (
            f"in the middle of {self.count} lines of {1e3 * LINE_M:g} mm between corrected ends: largest error "
            f"{1e3 * self.largest_m:.3f} mm, rms {1e3 * self.rms_m:.3f} mm; of 1 m, as it grows with the square of "
            f"the length: {1e3 * self.per_square_metre:.3f} mm"
        )


def chord_error(model: Model, done: Conditions, count: int = LINES, seed: int = 6) -> ChordError:
    """Distance of the exact correction in the middle of lines from the mean of the corrections at their ends.

    The lines have random directions and constant orientation; only those count that the arm can follow entirely.

    Args:
        model: the arm with the effects that are corrected.
        done: the conditions, with the region in which the lines lie.
        count: number of lines drawn.
    """
    rigid, q = model.with_effects(), done.drawn(count, seed)
    way = np.random.default_rng(seed).normal(size=(len(q), 3))
    way *= 0.5 * LINE_M / np.linalg.norm(way, axis=1, keepdims=True)
    middle = forward(model.robot, q) @ done.T_flange_tcp
    moved, follows = [], np.ones(len(q), dtype=bool)
    for side in (-1.0, 0.0, 1.0):
        desired = middle.copy()
        desired[:, :3, 3] += side * way
        nominal = command(rigid, done.states(q), desired)
        exact = command(model, done.states(nominal.q), desired)
        inside = ((nominal.q >= done.lower) & (nominal.q <= done.upper)).all(axis=1)
        follows &= inside & (np.maximum(nominal.residual_m, exact.residual_m) < SOLVED_M)
        follows &= np.abs(nominal.q - q).max(axis=1) < FOLLOWED
        moved.append(exact.T_base_tcp[:, :3, 3] - desired[:, :3, 3])
    before, halfway, after = (one[follows] for one in moved)
    off = np.linalg.norm(halfway - 0.5 * (before + after), axis=1)
    rms = float(np.sqrt(np.mean(off**2))) if len(off) else 0.0
    return ChordError(len(off), float(off.max(initial=0.0)), rms)
