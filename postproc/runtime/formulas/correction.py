"""The correction that a module works out, made from a model and the exact one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, invert
from postproc.compensate.correction.inverse import command
from postproc.diagnostics import PostprocError
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.robot.kinematics import forward
from postproc.robot.pose import displace, pose_error
from postproc.runtime.conditions import WRIST, Conditions, at_run_time
from postproc.runtime.formulas.curves import Curve, tabulated
from postproc.runtime.formulas.fitted import Fitted, fit
from postproc.runtime.formulas.formula import ANGLES, COMMANDED, FORCE, FRAME, LOAD, Formula, Tables, formula
from postproc.runtime.formulas.laws import PROBES, Laws, OfOne, laws_of
from postproc.runtime.formulas.tape import Scalar, worked_out

Flags = NDArray[np.bool_]

PASSES = 3
"""Times that functions of the command are put in: each shrinks what is left by their slope, 0.01 at most."""
FINE = 2e-8
"""What a table may be off [rad, m], and the torque that it may be off in parts of the largest."""
SAMPLES = 4000
MOST_TERMS, ENOUGH_M = 160, 2e-6
LARGEST_TURN = np.radians(1.0)
"""Correction of one joint [rad] beyond which the pose is next to a singular one: the target is returned as it came."""
SOLVED_M = 1e-7
TORQUE_SPAN = 1.5
"""How far beyond the largest torque of the region functions of a torque are tabulated."""


@dataclass(frozen=True)
class RunTimeCorrection:
    """The correction of a model as formulas.

    Args:
        model: the arm with the effects that are corrected. left_out: keys of those that are not.
        laws: what the effects do. tables: their functions. fitted: the rest, None where nothing is left.
        conditions: what it is made for.
    """

    model: Model
    left_out: tuple[str, ...]
    laws: Laws
    tables: Tables
    fitted: Fitted | None
    conditions: Conditions
    formula: Formula

    @property
    def scalars(self) -> tuple[Scalar, ...]:
        """All results that are worked out before the target is solved for the second time."""
        return (self.formula.straight, *self.formula.joints, *(self.formula.moved or ()))


def run_time_correction(model: Model, conditions: Conditions) -> RunTimeCorrection:
    """The correction of a model for the controller.

    Raises:
        PostprocError: RUN006, the region holds nothing but singular poses; MOD010, the loads of the arm do not settle.
    """
    if np.any(conditions.lower > conditions.upper) or len(conditions.drawn(PROBES, 1)) < PROBES:
        text = "the region holds nothing but singular poses, or lies beyond the limits of the arm"
        raise PostprocError.of("RUN006", text, help="give a region in which axis 5 is bent", exit_code=1)
    kept, left_out = at_run_time(model, conditions.channels)
    states = conditions.states(conditions.drawn(PROBES, 1))
    laws = laws_of(kept, states, _largest_loads(kept, conditions))
    tables = _tables(laws, kept, conditions)
    plain = formula(kept, laws, tables, (), conditions.forced)
    found = RunTimeCorrection(kept, left_out, laws, tables, None, conditions, plain)
    if not laws.fitted:
        return found
    q, wanted = _rest(found, conditions.drawn(SAMPLES, 2))
    rest = fit(q, wanted, MOST_TERMS, ENOUGH_M)
    whole = formula(kept, laws, tables, rest.formulas(), conditions.forced)
    return replace(found, fitted=rest, formula=whole)


def corrected(correction: RunTimeCorrection, q: Array) -> tuple[Array, Flags]:
    """Corrected targets T_base_tcp (n, 4, 4) of those with nominal joint angles q (n, 6), as the module has them.

    Returns:
        Targets, and (n,) which of them the module returns corrected, not as they came.
    """
    done = correction.conditions
    values = worked_out(correction.scalars, _inputs(done, q))
    dq, moved = np.radians(np.array(values[1:7], dtype=float).T), values[7:]
    theta = q
    if moved:
        xi = np.array(moved, dtype=float).T * np.array([1e-3] * 3 + [np.pi / 180.0] * 3)
        rigid, states = correction.model.with_effects(), done.states(q)
        theta = command(rigid, states, forward(rigid.robot, q) @ done.T_flange_tcp @ displace(-xi)).q
    start = command_q = theta - dq
    if correction.formula.commanded is not None:
        for _ in range(PASSES):
            angles = dict(zip(COMMANDED, np.degrees(command_q).T, strict=True))
            command_q = start - np.radians(np.array(worked_out(correction.formula.commanded, angles), dtype=float).T)
    robot = correction.model.robot
    target, plain = (forward(robot, angles) @ done.T_flange_tcp for angles in (command_q, q))
    far = np.linalg.norm(target[:, :3, 3] - plain[:, :3, 3], axis=1) > done.bound_m
    turned = np.abs(command_q - q).max(axis=1) > LARGEST_TURN
    straight = np.abs(values[0]) > np.cos(np.arcsin(WRIST))
    beyond = ((command_q < robot.lower) | (command_q > robot.upper)).any(axis=1)
    return target, ~(far | turned | straight | beyond)


def exact(correction: RunTimeCorrection, q: Array) -> tuple[Array, Flags]:
    """Corrected targets (n, 4, 4) by the inverse of the model, and (n,) whether it finds them."""
    done = correction.conditions
    found = command(correction.model, done.states(q), forward(correction.model.robot, q) @ done.T_flange_tcp)
    return found.T_base_tcp, found.residual_m < SOLVED_M


def _inputs(done: Conditions, q: Array) -> dict[str, Array]:
    """Values of the inputs of the formula at joint angles (n, 6) [rad], as the controller has them."""
    n = len(q)
    frame = done.T_flange_tcp
    first = done.mass * done.center
    constant = [
        *zip(LOAD, (done.mass, *first), strict=True),
        *zip(FORCE, (*done.force, *done.moment), strict=True),
        *zip(FRAME, (*(1e3 * frame[:3, 3]), *quaternion(frame[:3, :3])), strict=True),
    ]
    return {
        **dict(zip(ANGLES, np.degrees(q).T, strict=True)),
        **{name: np.full(n, float(value)) for name, value in constant},
    }


def quaternion(R: Array) -> Array:
    """(.., 4) of rotations (.., 3, 3), scalar first and not negative, as RAPID writes it."""
    from scipy.spatial.transform import Rotation

    return np.asarray(np.roll(Rotation.from_matrix(R).as_quat(canonical=True), 1, axis=-1))


def _largest_loads(model: Model, done: Conditions) -> Array:
    """(48,) largest loads on joints and ends of bodies over the region [N m, N]; none is zero."""
    rest = equilibrium(model, done.states(done.drawn(400, 4)), tuple(range(7))).state
    if rest.joint_load is None or rest.body_load is None:
        return np.ones(48)
    loads = np.abs(np.hstack([rest.joint_load, rest.body_load.reshape(-1, 42)])).max(axis=0)
    return np.asarray(TORQUE_SPAN * np.maximum(loads, 1.0))


def _tables(laws: Laws, model: Model, done: Conditions) -> Tables:
    """Functions of one number as tables over the region."""
    loads = _largest_loads(model, done)
    count = 0

    def table(functions: Sequence[OfOne], low: float, high: float, unit: tuple[float, float], fine: float) -> Curve:
        """Of functions of radians or N m, with argument and value in other units."""
        nonlocal count
        count += 1

        def values(x: Array) -> Array:
            return np.asarray(sum(f(x * unit[0]) for f in functions) * unit[1])

        return tabulated(f"ppTable{count}", values, low, high, fine)

    degree = np.pi / 180.0
    low, high = np.degrees(done.lower), np.degrees(done.upper)
    of_angle = {
        (p, j): table(f, low[j], high[j], (degree, 1 / degree if p < 6 else 1.0), FINE / degree if p < 6 else FINE)
        for (p, j), f in laws.of_angle.items()
    }
    of_torque = {
        (p, j): table(f, -loads[j], loads[j], (1.0, 1 / degree if p < 6 else 1.0), FINE / degree if p < 6 else FINE)
        for (p, j), f in laws.of_torque.items()
    }
    torque = {(k, j): table(f, low[j], high[j], (degree, 1.0), 0.01) for (k, j), f in laws.torque.items()}
    return Tables(of_angle, of_torque, torque)


def _rest(plain: RunTimeCorrection, q: Array) -> tuple[Array, Array]:
    """What closed forms lack: angles (n, 6), displacement of the flange in axes of body 6 (n, 6) [m, rad]."""
    (here, good), (there, solved) = corrected(plain, q), exact(plain, q)
    used = good & solved
    tool = invert(plain.conditions.T_flange_tcp)
    here, there = here[used] @ tool, there[used] @ tool
    # The command goes the other way than what displaces the arm; turned into the axes of the last body.
    error = pose_error(there, here)
    R = plain.model.robot.link[6][:3, :3] @ np.swapaxes(here[:, :3, :3], 1, 2)
    parts = [np.einsum("nij,nj->ni", R, part) for part in (error[:, :3], error[:, 3:])]
    return q[used], np.concatenate(parts, axis=1)
