"""What an estimated stiffness means: how much of the deflection is left once it is corrected by the estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import GRAVITY, Array
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
READINGS, READING_SIGMA = 12, 1e-5
"""Of a dial gauge that a shop can take in an hour, and the standard deviation [m] of one of them."""
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


def has_type_stiffness(model: Model) -> bool:
    """Return whether the stiffness is that of the arm's type: estimated, or the numbers of its file.

    Compliances in the controller's configuration are the arm's own; what a user states is taken as known, and what a
    fit has told has its own covariance.
    """
    spring, usual = model.in_role(Role.JOINT_SPRINGS), model.robot.joint_compliance
    if spring is None or model.stiffness_source in ("controller", "user"):
        return False
    if any(name.startswith(f"{spring.key}.") for name in model.fit.get("parameters", ())):
        return False
    return model.stiffness_source == "estimated" or (usual is not None and np.array_equal(spring.vector(), usual))


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


def type_scatter(model: Model, state: State) -> Scatter | None:
    """Return what a correction leaves, for the loads of a program's states; None where the arm's stiffness is known.

    Args:
        state: n states with all loads, where the correction is made.
    """
    if not has_type_stiffness(model):
        return None
    known = _known_after_gauge(model, state)
    after = None if known is None else scatter_of(model, state, known).remaining
    return replace(scatter_of(model, state), after_gauge=after)


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


def _known_after_gauge(model: Model, state: State) -> Array | None:
    """Return the covariance (6, 6) that readings of a dial gauge under a weight leave of the compliances' logarithms.

    At m states spread over the program a gauge along gravity is read with a weight of the rated payload F [N] at the
    TCP and without it. For a unit vector u along gravity the difference of both is h f, h_j = F (u J_j)^2 c_j, with the
    relative compliances f of `scatter_of` and an error of sqrt(2) s, s the deviation of one reading. To first
    order about f = 1 the logarithms of f then have the covariance (diag(1 / p^2) + sum h h^T / 2 s^2)^-1, p their
    spread before. Masses stay as uncertain as they are. None where the rated payload is not known.

    Args:
        state: n states with all loads, where the correction is made.
    """
    spring, robot = model.in_role(Role.JOINT_SPRINGS), model.robot
    if spring is None or robot.payload is None:
        return None
    some = state.rows(np.linspace(0, len(state) - 1, READINGS // 2).round().astype(int))
    columns = jacobian(robot, some.q, some.T_flange_tcp)[:, :3]
    along = np.einsum("i,nij->nj", model.gravity, columns)  # times 9.81
    shown = robot.payload / GRAVITY * along**2 * spring.vector()
    spread = np.maximum(np.log(stiffness_factors(robot)) / NORMAL_95, 1e-9)
    told = np.diag(spread**-2.0) + shown.T @ shown / (2 * READING_SIGMA**2)
    return np.asarray(np.linalg.inv(told))


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
