"""A module for run time, run and compared with the exact correction of the model, at targets and between them.

A line follows the corrections of its ends, not those on its way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.inverse import command
from postproc.compensation.text.marks import MODULE_MARKER
from postproc.diagnostics import PostprocError, Source
from postproc.model.arm import Model
from postproc.rapid.data.records import LoadData, ToolData
from postproc.rapid.motions.units import matrix_pose
from postproc.robot.kinematics import forward
from postproc.runtime.conditions import Conditions
from postproc.runtime.proof.calls import NOT_HANDLED, Caller, FunctionCall

LINE_M = 0.5
LINES = 400
FOLLOWED = np.radians(90.0)
"""Travel of a joint on half a line [rad] beyond which the line leads past a singular pose."""
TARGETS, AMONG = 24, 12
SOLVED_M = 1e-7
REASONS = {
    1: "not reached", 2: "by tool or load", 3: "outside the region", 4: "next to a singular pose", 5: "too large",
    NOT_HANDLED: "by an error",
}  # fmt: skip


@dataclass(frozen=True)
class Check:
    """How a module corrects targets drawn from the region.

    Args:
        mass: of the load with which it is called [kg].
        corrected: number of targets that it corrects.
        returned: number of those that it returns unchanged, by the value of `ppReason`.
        raised: number of targets at which an error leaves the function.
        largest_m, rms_m: distance from the exact correction [m].
        correction_m: largest correction [m].
        steps: largest number of statements run for a corrected target.
    """

    mass: float
    corrected: int
    returned: dict[int, int]
    raised: int
    largest_m: float
    rms_m: float
    correction_m: float
    steps: int

    def __str__(self) -> str:
        """The result in one line of text: number of targets, largest and rms error, correction, targets returned."""
        returned = ", ".join(f"{times} {REASONS.get(why, 'by an error')}" for why, times in self.returned.items())
        return (
            f"with {self.mass:g} kg, over {self.corrected} targets drawn from the region: largest error "
            f"{1e3 * self.largest_m:.4f} mm, rms {1e3 * self.rms_m:.4f} mm, largest correction "
            f"{1e3 * self.correction_m:.3f} mm; returned as they came: {returned or 'none'}"
        )


def check_module(source: Source, model: Model, every: Sequence[tuple[Conditions, int]]) -> tuple[Check, ...]:
    """Run a module on targets of the region, in single precision, and compare it with the model.

    The process force is the one that the module states (`ppForce`, `ppMoment`), with ``Weld`` given.

    Args:
        source: the module.
        model: the arm with the effects that are corrected (`CorrectedModel`).
        every: conditions (load, region) to check, each with the number of targets; each has one result.

    Raises:
        PostprocError: RUN002 the file is no such module, RUN003 it holds what cannot be calculated; MOD010 the
            deflection does not settle.
    """
    if MODULE_MARKER.encode() not in source.data:
        text, help_ = f"`{source.path}` is no module that corrects targets", "name one of `postproc runtime write`"
        raise PostprocError.of("RUN002", text, source, help=help_)
    caller = Caller(source, model)
    return tuple(_check(caller, model, conditions, _chosen(model, conditions, count)) for conditions, count in every)


def _chosen(model: Model, conditions: Conditions, count: int) -> Array:
    """Joint angles (count, 6) [rad]: half fill the region, half have the largest corrections among 12 times as many."""
    q = conditions.spread(AMONG * count)
    half = count - count // 2
    desired = forward(model.robot, q) @ conditions.T_flange_tcp
    exact = command(model, conditions.states(q), desired)
    moved = np.linalg.norm((exact.T_base_tcp - desired)[:, :3, 3], axis=1)
    moved[:half] = moved[(moved > conditions.bound_m) | (exact.residual_m > SOLVED_M)] = -1.0
    return np.concatenate([q[:half], q[np.argsort(-moved, kind="stable")[: count // 2]]])


def _check(caller: Caller, model: Model, conditions: Conditions, q: Array) -> Check:
    """Call the function at joint angles q (n, 6) [rad] and compare its results with the exact correction.

    The force is the one that the module states.
    """
    conditions = replace(conditions, force=caller.stated("ppForce"), moment=caller.stated("ppMoment"))
    tool = ToolData(
        "", True, matrix_pose(conditions.T_flange_tcp), LoadData(conditions.mass, tuple(1e3 * conditions.center))
    )
    answers = [caller.call(FunctionCall(one, tool, weld=True)) for one in q]
    desired = forward(model.robot, q) @ conditions.T_flange_tcp
    exact = command(model, conditions.states(q), desired)
    good = np.array([answer.reason == 0 for answer in answers], dtype=bool)
    T_answer = np.array([answer.pose for answer in answers]).reshape(-1, 4, 4)
    used = good & (exact.residual_m < SOLVED_M)
    moved = np.linalg.norm((T_answer - desired)[used, :3, 3], axis=1)
    far = np.linalg.norm((T_answer - exact.T_base_tcp)[used, :3, 3], axis=1)
    returned = Counter(answer.reason for answer in answers if answer.reason != 0)
    return Check(
        conditions.mass,
        int(np.count_nonzero(good)),
        dict(sorted(returned.items())),
        returned[NOT_HANDLED],
        float(far.max(initial=0.0)),
        float(np.sqrt(np.mean(far**2))) if len(far) else 0.0,
        float(moved.max(initial=0.0)),
        max((answer.steps for answer in answers if answer.reason == 0), default=0),
    )


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


def chord_error(model: Model, conditions: Conditions, count: int = LINES, seed: int = 6) -> ChordError:
    """Distance of the exact correction in the middle of lines from the mean of the corrections at their ends.

    The lines have random directions and constant orientation; only those count that the arm can follow entirely.

    Args:
        model: the arm with the effects that are corrected.
        conditions: the conditions, with the region in which the lines lie.
        count: number of lines drawn.
    """
    rigid, q = model.with_effects(), conditions.drawn(count, seed)
    way = np.random.default_rng(seed).normal(size=(len(q), 3))
    way *= 0.5 * LINE_M / np.linalg.norm(way, axis=1, keepdims=True)
    middle = forward(model.robot, q) @ conditions.T_flange_tcp
    moved, follows = [], np.ones(len(q), dtype=bool)
    for side in (-1.0, 0.0, 1.0):
        desired = middle.copy()
        desired[:, :3, 3] += side * way
        nominal = command(rigid, conditions.states(q), desired)
        exact = command(model, conditions.states(nominal.q), desired)
        inside = ((nominal.q >= conditions.lower) & (nominal.q <= conditions.upper)).all(axis=1)
        follows &= inside & (np.maximum(nominal.residual_m, exact.residual_m) < SOLVED_M)
        follows &= np.abs(nominal.q - q).max(axis=1) < FOLLOWED
        moved.append(exact.T_base_tcp[:, :3, 3] - desired[:, :3, 3])
    before, halfway, after = (one[follows] for one in moved)
    off = np.linalg.norm(halfway - 0.5 * (before + after), axis=1)
    rms = float(np.sqrt(np.mean(off**2))) if len(off) else 0.0
    return ChordError(len(off), float(off.max(initial=0.0)), rms)
