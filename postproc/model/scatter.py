"""What an estimated stiffness means: how much of the deflection is left once it is corrected by the estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.deflection import Deflection
from postproc.model.loads import loaded_state
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian

DRAWS = 4096
QUANTILES = (0.025, 0.975)
NORMAL_95 = 1.959964  # standard deviations of a normal distribution that hold 95 %
STIFFNESS_FACTOR = np.array([4, 3, 2.5, 2.5, 3.5, 2.5])
"""Factors that hold 95 % of arms about the rule of the library, where an arm's file states none (docs/robot.md)."""
PUBLISHED_FACTOR, UNKNOWN_FACTOR = 1.5, 10.0
"""The same about a stiffness that was measured on one arm of the type, and about an ordinary size of any arm."""


def stiffness_factors(robot: Robot) -> Array:
    """Return (6,) factors within which 95 % of arms of a type lie about the joint compliance of its file."""
    if robot.stiffness_factor is not None:
        return robot.stiffness_factor
    if robot.joint_compliance is None:
        return np.full(6, UNKNOWN_FACTOR)
    return np.full(6, PUBLISHED_FACTOR) if robot.stiffness_source == "measured" else STIFFNESS_FACTOR


@dataclass(frozen=True, slots=True)
class Scatter:
    """What a correction with the stiffness of the type leaves on an arm of the type: intervals that hold 95 % of arms.

    Args:
        remaining: share of the arm's own deflection. of_estimate: the same as a share of the estimated deflection.
        after_gauge: ``remaining`` once readings of a dial gauge have told the stiffness; None before that is asked.
    """

    remaining: tuple[float, float]
    of_estimate: tuple[float, float]
    after_gauge: tuple[float, float] | None = None


def remaining_fraction(model: Model, state: State) -> tuple[float, float]:
    """Return the share of the deflection that remains after a correction with the stiffness of the type: `scatter_of`.

    Args:
        state: n states with all loads, where the correction is made.
    """
    return scatter_of(model, state).remaining


def scatter_of(model: Model, state: State, known: Array | None = None) -> Scatter:
    """Return 95 % intervals of what remains of the deflection after a correction with the stiffness of the type.

    The deflection of the TCP is d = sum_js x_js, the share of joint j under source s (bodies 1 to 6; all that is
    stated: payload, force, effects), x_js = J_j c_j tau_js. An arm has a_js = f_j g_s times as much of each: f_j its
    compliance over the estimate, log-normal with 95 % within the arm's factor; g_s its mass over the estimate,
    log-normal with one standard deviation at the body's factor, 1 for what is stated. Over all states, with the Gram
    matrix G of the shares, what remains of that arm's deflection is rho = sqrt((a - 1)^T G (a - 1) / a^T G a), and of
    the estimated one sqrt((a - 1)^T G (a - 1) / 1^T G 1): soft arms bend more. Quantiles of 2.5 % and 97.5 % are taken
    over a scrambled Sobol sequence (Owen 1998), the same every time. Above 1 the correction is worse than none.

    Args:
        state: n states with all loads, where the correction is made.
        known: (6, 6) covariance of the logarithms of f, where measurements have told something of them.
    """
    from scipy.stats import norm, qmc

    parts = _shares(model, state)
    gram = parts @ parts.T
    if not gram.any():
        return Scatter((0.0, 0.0), (0.0, 0.0))
    robot = model.robot
    masses = np.ones(7) if robot.mass_factor is None else robot.mass_factor
    spread = np.diag(np.log(stiffness_factors(robot)) / NORMAL_95) if known is None else np.linalg.cholesky(known).T
    drawn = norm.ppf(qmc.Sobol(12, rng=np.random.default_rng(0)).random(DRAWS))
    sources = np.column_stack([np.exp(drawn[:, 6:] * np.log(masses[1:])), np.ones(DRAWS)])
    a = (np.exp(drawn[:, :6] @ spread)[:, :, None] * sources[:, None, :]).reshape(DRAWS, -1)
    remaining, full = (np.einsum("kp,pq,kq->k", x, gram, x, optimize=True) for x in (a - 1.0, a))
    shares = np.sqrt(np.maximum(remaining, 0.0) / [full, np.full(DRAWS, gram.sum())])
    (low, high), (least, most) = np.quantile(shares, QUANTILES, axis=1).T.tolist()
    return Scatter((low, high), (least, most))


def _shares(model: Model, state: State) -> Array:
    """Return the shares (42, 3 n) of the TCP's deflection [m] by joint and source of its torque.

    Rows run over the six joints, for each of them over the weights of bodies 1 to 6 and then all stated loads. They are
    zero without joint springs.
    """
    spring = model.in_role(Role.JOINT_SPRINGS)
    if spring is None:
        return np.zeros((42, 3 * len(state)))
    state = model.with_arm(state)
    full = _torques(model, state)
    bare = state.with_(payload_mass=None, wrench=None)
    single = [_torques(_only(model, body), bare) for body in range(1, 7)]
    torques = np.stack([*single, full - np.sum(single, axis=0)])  # (7, n, 6)
    columns = jacobian(model.robot, state.q, state.T_flange_tcp)[:, :3] * spring.vector()  # (n, 3, 6)
    return np.einsum("nij,snj->jsni", columns, torques).reshape(42, -1)


def _torques(model: Model, state: State) -> Array:
    """Return the joint torques (n, 6) [N m] of the undeflected arm."""
    loads = loaded_state(model, state, Deflection(np.zeros((len(state), 6)), {}, None, None), ()).joint_load
    assert loads is not None
    return loads


def _only(model: Model, body: int) -> Model:
    """Return the arm with the mass and inertia of one body only, and no effects."""
    alone = np.arange(7) == body
    robot = replace(model.robot, mass=model.robot.mass * alone, inertia=model.robot.inertia * alone[:, None, None])
    return Model(robot, (), model.R_world_base, model.T_flange_tcp)
