"""What an estimated stiffness means: how much of the deflection is left once it is corrected by the estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.deflection import Deflection
from postproc.model.loads import loaded_state
from postproc.model.uncertainty.prediction import Uncertainty, read_uncertainty
from postproc.model.uncertainty.undetermined import full_covariance
from postproc.robot.arm import Robot
from postproc.robot.kinematics import jacobian

DRAWS, LATTICE = 4093, 1516  # points of a Korobov lattice, and its multiplier
QUANTILES = (0.025, 0.975)
NORMAL_95 = 1.959964  # standard deviations of a normal distribution that hold 95 %
STIFFNESS_FACTOR = np.array([4, 3, 2.5, 2.5, 3.5, 2.5])
"""Factors that hold 95 % of arms about the rule of the library, where an arm's file states none (docs/robot.md)."""
PUBLISHED_FACTOR, UNKNOWN_FACTOR = 2.2, 10.0
"""The same about a stiffness that was measured on one arm of the type, and about an ordinary size of any arm."""
LEAST_SPREAD = 1e-9  # of a logarithm: what is known exactly
STIFFEST = 1e-12  # [rad/(N m)] a joint that hardly gives at all


def stiffness_factors(robot: Robot) -> Array:
    """Return (6,) factors within which 95 % of arms of a type lie about the joint compliance of its file."""
    if robot.stiffness_factor is not None:
        return robot.stiffness_factor
    if robot.joint_compliance is None:
        return np.full(6, UNKNOWN_FACTOR)
    return np.full(6, PUBLISHED_FACTOR) if robot.stiffness_source == "measured" else STIFFNESS_FACTOR


def spring_covariance(model: Model, known: Uncertainty | None = None) -> Array:
    """Return the covariance (6, 6) of the logarithms of the joint compliances over those of the model.

    It is that of a fit, where the model has one: of a parameter with standard deviation s at a compliance c the
    logarithm scatters by sqrt(ln(1 + s^2 / c^2)), with the correlations of the fit. A joint that no fit knows scatters
    as arms of the type do (`stiffness_factors`).

    Args:
        known: what the fit knows of its errors; None for what the model file says.
    """
    spring, known = model.in_role(Role.JOINT_SPRINGS), known or read_uncertainty(model)
    S = np.diag((np.log(stiffness_factors(model.robot)) / NORMAL_95) ** 2)
    if spring is None or known is None:
        return S
    every = known.all_parameters
    joints = [j for j in range(6) if (spring.key, j) in every]
    column = [every.index((spring.key, j)) for j in joints]
    fitted, c = full_covariance(known)[np.ix_(column, column)], np.maximum(spring.vector()[joints], STIFFEST)
    sigma = np.maximum(np.sqrt(np.diag(fitted)), LEAST_SPREAD * c)
    spread = np.sqrt(np.log1p((sigma / c) ** 2))
    S[np.ix_(joints, joints)] = fitted / np.outer(sigma, sigma) * np.outer(spread, spread)
    return S


def scatter_covariance(model: Model, springs: Array | None = None) -> Array:
    """Return the covariance (12, 12) of the logarithms of the six compliances and of the masses of bodies 1 to 6.

    Nobody who knows the springs of a model knows the masses of its links by that: they scatter as those of the type.

    Args:
        springs: (6, 6) of the compliances, where more is known of them; None for `spring_covariance`.
    """
    masses = np.ones(7) if model.robot.mass_factor is None else model.robot.mass_factor
    S = np.diag(np.concatenate([np.zeros(6), np.log(masses[1:]) ** 2]))
    S[:6, :6] = spring_covariance(model) if springs is None else springs
    return S


@dataclass(frozen=True, slots=True)
class Scatter:
    """What a correction with the stiffness of the type leaves on an arm of the type: intervals that hold 95 % of arms.

    Args:
        remaining: share of the arm's own deflection. of_estimate: the same as a share of the estimated deflection.
        after_gauge: ``remaining`` once readings of a dial gauge have told the stiffness; None before that is asked.
        gauge_load: mass that is hung on for these readings [kg].
    """

    remaining: tuple[float, float]
    of_estimate: tuple[float, float]
    after_gauge: tuple[float, float] | None = None
    gauge_load: float | None = None


def scatter_of(model: Model, state: State, known: Array | None = None, weights: bool = True) -> Scatter:
    """Return 95 % intervals of what remains of the deflection after a correction with the stiffness of the type.

    Args:
        state: n states with all loads, where the correction is made.
        known: (12, 12) covariance of the logarithms of f and g (`scatter_by`); None for `scatter_covariance`.
        weights: False counts the deflection by stated loads alone, without that by the weights of the links.
    """
    return scatter_by(deflection_gram(model, state, weights), scatter_covariance(model) if known is None else known)


def deflection_gram(model: Model, state: State, weights: bool = True) -> Array:
    """Return the Gram matrix (42, 42) [m^2] of the deflection's shares (`deflection_shares`), summed over n states."""
    parts = deflection_shares(model, state)
    parts[:, :6] *= weights
    flat = parts.reshape(42, -1)
    return np.asarray(flat @ flat.T)


def scatter_by(gram: Array, covariance: Array) -> Scatter:
    """Return 95 % intervals of what remains of a deflection with uncertain springs and masses.

    The deflection of the TCP is d = sum_js x_js, the share of joint j under source s (bodies 1 to 6; all that is
    stated: payload, force, effects), x_js = J_j c_j tau_js. An arm has a_js = f_j g_s times as much of each: f_j its
    compliance over that of the model, g_s its mass over the estimate, both log-normal, 1 for what is stated. Over all
    states, with the Gram matrix G of the shares, what remains of that arm's deflection is rho = sqrt((a - 1)^T G (a -
    1) / a^T G a), and of the estimated one sqrt((a - 1)^T G (a - 1) / 1^T G 1): soft arms bend more. The intervals are
    the quantiles of 2.5 % and 97.5 % of `normal_draws`. Above 1 the correction is worse than none.

    Args:
        gram: G of `deflection_gram`. covariance: (12, 12) of the logarithms of f and g.
    """
    if not gram.any():
        return Scatter((0.0, 0.0), (0.0, 0.0))
    size, turned = np.linalg.eigh(covariance)
    drawn = np.exp(normal_draws(12) @ (turned * np.sqrt(np.maximum(size, 0.0))) @ turned.T)
    sources = np.column_stack([drawn[:, 6:], np.ones(DRAWS)])
    a = (drawn[:, :6, None] * sources[:, None, :]).reshape(DRAWS, -1)
    remaining, full = (np.sum(x @ gram * x, axis=1) for x in (a - 1.0, a))
    shares = np.sqrt(np.maximum(remaining, 0.0) / [full, np.full(DRAWS, gram.sum())])
    (low, high), (least, most) = np.quantile(shares, QUANTILES, axis=1).T.tolist()
    return Scatter((low, high), (least, most))


@lru_cache(maxsize=2)
def normal_draws(count: int) -> Array:
    """Return `DRAWS` draws (DRAWS, count) of independent standard normal numbers, the same every time.

    The points are those of a Korobov lattice (L'Ecuyer and Lemieux 2000, table 1): column j is normal at
    ((i a^j mod N) + 1/2) / N, i = 0 .. N - 1. Quantiles are as near as those of as many points of a Sobol sequence.
    """
    normal = NormalDist()
    values = np.array([normal.inv_cdf((i + 0.5) / DRAWS) for i in range(DRAWS)])
    powers = np.array([pow(LATTICE, j, DRAWS) for j in range(count)])
    drawn = values[np.arange(DRAWS)[:, None] * powers % DRAWS]
    drawn.setflags(write=False)
    return drawn


def deflection_shares(model: Model, state: State) -> Array:
    """Return the shares (6, 7, n, 3) of the TCP's deflection [m] by joint and source of its torque.

    Sources are the weights of bodies 1 to 6, then all stated loads. The shares are zero without joint springs.
    """
    spring = model.in_role(Role.JOINT_SPRINGS)
    if spring is None:
        return np.zeros((6, 7, len(state), 3))
    state = model.with_arm(state)
    full = _torques(model, state)
    bare = state.with_(payload_mass=None, wrench=None)
    single = [_torques(_only(model, body), bare) for body in range(1, 7)]
    torques = np.stack([*single, full - np.sum(single, axis=0)])  # (7, n, 6)
    columns = jacobian(model.robot, state.q, state.T_flange_tcp)[:, :3] * spring.vector()  # (n, 3, 6)
    return np.einsum("nij,snj->jsni", columns, torques)


def deflection_slopes(shares: Array) -> Array:
    """Return the derivatives (n, 3, 12) of the TCP's deflection [m] by the logarithms of compliances and masses.

    Args:
        shares: (6, 7, n, 3) of `deflection_shares`.
    """
    return np.concatenate([shares.sum(axis=1), shares[:, :6].sum(axis=0)]).transpose(1, 2, 0)


def _torques(model: Model, state: State) -> Array:
    """Return the joint torques (n, 6) [N m] of the undeflected arm."""
    return np.asarray(loaded_state(model, state, Deflection(np.zeros((len(state), 6)), {}, None, None), ()).joint_load)


def _only(model: Model, body: int) -> Model:
    """Return the arm with the mass and inertia of one body only, and no effects."""
    alone = np.arange(7) == body
    robot = replace(model.robot, mass=model.robot.mass * alone, inertia=model.robot.inertia * alone[:, None, None])
    return Model(robot, (), model.R_world_base, model.T_flange_tcp)
