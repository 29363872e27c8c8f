"""What the rows and the priors together say about every parameter: the posterior of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import GRAVITY, Array
from postproc.channels.state import State
from postproc.effects.asking import of_parameters
from postproc.estimation.linear import solve_positive
from postproc.estimation.priors import UNDETERMINED_SHARE, Prior, lognormal_deviation, prior_at, prior_of
from postproc.estimation.solution import Solution
from postproc.estimation.solving.step import Name
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import derivatives
from postproc.robot.kinematics import skew

POSES_IN_RANGE = 100
"""Poses anywhere between joint limits at which a model is asked for what measured rows do not show."""
NOTHING, SAME = 1e-7, 0.01
"""Move [m] by a standard deviation that is none, and the share of a parameter's moves below which the others make
up for it everywhere: such a parameter only says the same in other axes (joint 1 and the base)."""
FORCE = 0.5
"""Share of the weight of the rated payload that pulls in any direction where a model is asked for what rows lack."""
SOFTEST_ARM = 3.0
"""Deviations of the logarithm of a compliance beyond which no arm is asked where it would stand."""
STEPS, SETTLED = 60, 1e-10
SMALLEST = 1e-3
"""Share of the prior's median from which a positive parameter begins that the rows alone make smaller or negative."""


@dataclass(frozen=True)
class Posterior:
    """The normal distribution of the parameters that follows from a fit and the priors.

    The rows determine the first k parameters, but not the h others: the k scatter by their covariance, and all k + h
    together along the directions in which the h may be off without any effect on the rows.

    Args:
        names: (effect key, index in its vector) of the k determined parameters, in the order of ``covariance``.
        mean: (k + h,) the likeliest values of all.
        covariance: (k, k) of the determined ones for known values of the others.
        unidentifiable: names of the h others.
        directions: (h, k + h) one standard deviation each.
        prior: (k + h,) standard deviation of each before any row was read; inf where nothing was known.
        sources: (k + h) where each prior comes from.
        base: names of others that only move the base as a whole (joint 1, where no instrument stands): work that
            counts from the arm does not see them.
    """

    names: tuple[Name, ...]
    mean: Array
    covariance: Array
    unidentifiable: tuple[Name, ...]
    directions: Array
    prior: Array
    sources: tuple[str, ...]
    base: tuple[Name, ...] = ()

    @property
    def deviations(self) -> Array:
        """(k + h,) standard deviation of each parameter."""
        variance = np.concatenate([np.diag(self.covariance), np.zeros(len(self.unidentifiable))])
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) + np.sum(self.directions**2, axis=0)))

    @property
    def undetermined(self) -> tuple[int, ...]:
        """Indices of the parameters of which the rows have said less than half: they stand at their priors."""
        silent = self.deviations > UNDETERMINED_SHARE * self.prior
        return tuple(int(i) for i in np.flatnonzero(silent))


def posterior_of(fit: Solution, scatter: float) -> Posterior:
    """Return the posterior of a fit.

    With r the whitened residual at x_0, A its columns, s^2 the scatter, x the parameters, m their priors' medians and S
    their deviations, the sum |r - A (x - x_0)|^2 / s^2 + |(x - m) / S|^2 is least; positive parameters count with
    their logarithms, and values far from m with less than their square (`Prior.cost`). The covariance is the inverse
    of half the second derivative there (Laplace). Parameters that the rows do not determine together with the others
    (`Solution.unknown`) come last: if these are off by x_h, the determined ones are off by
    -(A^T A / s^2 + S^-2)^-1 A^T A_h x_h / s^2. Those that no pose under any
    load shows are omitted: they describe the motion of others in other axes.

    Args:
        scatter: s^2, the factor between (A^T A + penalty^2)^-1 and the covariance of the fitted parameters.
    """
    determined = (*fit.parameters, *(p for p in fit.at_bound if p not in fit.unknown))
    names, count = (*determined, *(p for p in fit.unknown if p not in determined)), len(determined)
    objective = objective_of(fit, names, count, scatter)
    shown, of_base = _visible(fit, names, count, objective)
    base = tuple(names[k] for k in of_base)
    names, objective = tuple(names[k] for k in shown), objective.subset(shown)
    mean, prior = objective.minimum(), objective.prior
    covariance, directions = _laplace(objective, mean, count)
    deviation = np.where(np.isinf(prior.spread), np.inf, prior.deviation(mean))
    return Posterior(determined, mean, covariance, names[count:], directions, deviation, prior.source, base)


@dataclass(frozen=True)
class Objective:
    """The sum (x - x_0)^T G (x - x_0) - 2 b^T (x - x_0) + `Prior.cost`, least at the likeliest parameters x.

    Args:
        gram: (p, p) G. pull: (p,) b. start: (p,) x_0. prior: m, S and which parameters are positive.
        columns: (N, p) whitened derivatives of the prediction by the parameters; none where nobody asks for them.
    """

    gram: Array
    pull: Array
    start: Array
    prior: Prior
    columns: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def subset(self, index: NDArray[np.int_]) -> Objective:
        """Return the objective of some of the parameters, by their indices."""
        gram, prior = self.gram[np.ix_(index, index)], self.prior.some(index)
        return Objective(gram, self.pull[index], self.start[index], prior, self.columns[:, index])

    def curvature(self, unit: Array, weight: Array) -> Array:
        """Return (p, p) half the second derivative by parameters in some units (p,), for the weights (p,) of priors."""
        return np.asarray(self.gram * np.outer(unit, unit) + np.diag(weight))

    def minimum(self) -> Array:
        """Return x (p,) at which the sum is least: Gauss and Newton, each step halved until the sum falls.

        A step changes a positive parameter by a factor e at most.
        """
        log = self.prior.log
        x = np.where(log, np.maximum(self.start, SMALLEST * self.prior.value), self.start)
        for _ in range(STEPS):
            unit, weight = np.where(log, x, 1.0), self.prior.weight(x)
            slope = unit * (self.gram @ (x - self.start) - self.pull) + weight * self.prior.off(x)
            step = -solve_positive(self.curvature(unit, weight), slope)
            step /= max(1.0, float(np.max(np.abs(step), initial=0.0, where=log)))
            now, share = self._cost(x), 1.0
            while share > 1e-3:
                trial = np.where(log, x * np.exp(share * step), x + share * step)
                if self._cost(trial) <= now:
                    break
                share /= 2
            else:
                break
            x = trial
            if now - self._cost(x) < SETTLED * (1.0 + abs(now)):
                break
        return np.asarray(x)

    def _cost(self, x: Array) -> float:
        """Return the sum at x (p,)."""
        by = x - self.start
        return float(by @ (self.gram @ by) - 2 * self.pull @ by) + self.prior.cost(x)


def objective_of(fit: Solution, names: Sequence[Name], count: int, scatter: float) -> Objective:
    """Return what the rows of a fit and the priors say of some parameters together.

    Args:
        names: (effect key, index) of the parameters; count: of those among them that are determined, which come first.
        scatter: as in `posterior_of`.
    """
    penalty, prior = penalty_and_prior(fit, names, count)
    start = of_parameters(fit.model.effects, names)
    columns = _columns(fit, names)
    gram = (columns.T @ columns + np.diag(penalty**2)) / scatter
    pull = (columns.T @ fit.problem.residual - penalty**2 * start) / scatter
    return Objective(gram, pull, start, prior, columns)


def penalty_and_prior(fit: Solution, names: Sequence[Name], count: int) -> tuple[Array, Prior]:
    """Return the weights (p,) of the smoothness penalty and the prior of some parameters, as in `objective_of`."""
    penalty = np.zeros(len(names))
    penalty[: len(fit.parameters)] = fit.penalty
    prior = prior_at(fit.model, fit.model.effects, names)
    # A frame may be anywhere, and the penalty of a free function is its prior.
    free = np.array([k < count and key in fit.problem.anywhere for k, (key, _) in enumerate(names)], dtype=bool)
    return penalty, replace(prior, spread=np.where(free | (penalty > 0), np.inf, prior.spread))


def _visible(
    fit: Solution, names: Sequence[Name], count: int, objective: Objective
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return the indices of the determined parameters and of those of the others that some pose shows.

    And the indices of those that move the base as a whole, in all poses alike.

    Args:
        names, count: as in `objective_of`.
    """
    prior = objective.prior
    unit, spread = np.where(prior.log, prior.value, 1.0), prior.spread[count:]
    taken = _eliminated(objective.curvature(unit, prior.spread**-2.0), count)[1]
    moves, total, bent = _moves(fit, names, unit, taken)
    visible = moves * spread > np.maximum(NOTHING, SAME * total * spread)
    of_base = visible & (bent < SAME * moves)
    return np.concatenate([np.arange(count), count + np.flatnonzero(visible)]), count + np.flatnonzero(of_base)


def _eliminated(curvature: Array, count: int) -> tuple[Array, Array]:
    """Return the covariance (k, k) of the k determined parameters, and what they take up (k, h) of the h others.

    Args:
        curvature: (k + h, k + h) half the second derivative; count: k.
    """
    known = solve_positive(curvature[:count, :count], np.eye(count))
    return known, known @ curvature[:count, count:]


def _laplace(objective: Objective, mean: Array, count: int) -> tuple[Array, Array]:
    """Return covariance and directions, as `Posterior` has them, of the normal distribution about the likeliest values.

    Args:
        mean: (k + h,) likeliest values; count: k, the number of determined parameters.
    """
    log = objective.prior.log
    unit = np.where(log, mean, 1.0)
    curvature = objective.curvature(unit, objective.prior.weight(mean))
    known, taken = _eliminated(curvature, count)
    curvature_of_others = curvature[count:, count:] - curvature[count:, :count] @ taken
    others = solve_positive(curvature_of_others, np.eye(len(curvature_of_others)))
    scale = np.sqrt(np.diag(others))  # numbers of very different sizes
    lower = np.linalg.cholesky(others / np.outer(scale, scale)) * scale[:, None]
    directions = np.vstack([-taken @ lower, lower]).T
    # A log-normal number lies farther from its median than the deviation of its logarithm says.
    total = np.sqrt(np.concatenate([np.diag(known), np.zeros(len(lower))]) + np.sum(directions**2, axis=0))
    wide = unit * np.where(log & (total > 0), lognormal_deviation(total) / np.maximum(total, 1e-300), 1.0)
    return known * np.outer(wide[:count], wide[:count]), directions * wide


def anywhere(state: State, low: Array, high: Array) -> State:
    """Return `POSES_IN_RANGE` states with random joint angles; everything else is that of random rows of a state.

    Args:
        state: whose payloads, times, temperatures .. are used.
        low, high: (6,) limits of the angles [rad].
    """
    random = np.random.default_rng(0)
    rows = state.rows(random.integers(len(state), size=POSES_IN_RANGE))
    return rows.with_(q=random.uniform(low, high, (POSES_IN_RANGE, 6)))


def _columns(fit: Solution, names: Sequence[Name]) -> Array:
    """Return (N, p) whitened derivatives of the prediction by parameters, those of the fit first."""
    columns = np.empty((len(fit.problem.residual), len(names)))
    columns[:, : len(fit.parameters)] = fit.columns
    for effect in fit.model.effects:
        wanted = {i: k for k, (key, i) in enumerate(names) if key == effect.key and k >= len(fit.parameters)}
        if wanted:
            mask = np.isin(np.arange(len(effect.vector())), list(wanted))
            columns[:, [wanted[i] for i in np.flatnonzero(mask).tolist()]] = fit.problem.slopes(effect, mask)
    return columns


def _as_stiff_as_arms_are(model: Model) -> Model:
    """Return the model with joint springs no softer than their priors allow: few rows may make them softer than any."""
    effects = []
    for effect in model.effects:
        prior = prior_of(effect, model)
        most = np.where(prior.log, prior.value * np.exp(SOFTEST_ARM * np.where(prior.log, prior.spread, 0.0)), np.inf)
        effects.append(effect.with_vector(np.minimum(effect.vector(), most)) if prior.log.any() else effect)
    return model.with_effects(*effects)


def _moves(fit: Solution, names: Sequence[Name], unit: Array, taken: Array) -> tuple[Array, Array, Array]:
    """Return (h,) rms moves [m] of the TCP per unit of each undetermined parameter.

    Those that no row shows, all, and those that no row shows but for a motion of the base as a whole.

    Args:
        names: of all p + h parameters; unit: (p + h,) change of each per unit; taken: (p, h) what the determined ones
            take up of the others.
    """
    count = len(taken)
    robot = fit.model.robot
    low, high = np.clip([robot.lower, robot.upper], -np.pi, np.pi)
    states = anywhere(fit.data.state, low, high)
    if states.approach is not None:  # all rows may have come from one side
        states = states.with_(approach=states.approach * np.where(np.arange(POSES_IN_RANGE) % 2, -1.0, 1.0)[:, None])
    # Programs press and pull where a table may have gravity alone.
    random = np.random.default_rng(1).normal(size=(POSES_IN_RANGE, 6))
    force = FORCE * GRAVITY * (10.0 if robot.payload is None else robot.payload)
    states = states.with_(wrench=random * np.repeat([force, 0.1 * force], 3))
    model = _as_stiff_as_arms_are(fit.model)
    states = states if fit.data.tool_known else states.with_(T_flange_tcp=model.T_flange_tcp)
    D = derivatives(model, states, names)[0] * unit
    moves = D[:, :, count:] - D[:, :, :count] @ taken
    turn = -skew(predict(model, states)[:, :3, 3])
    base = np.concatenate([np.tile(np.eye(3), (POSES_IN_RANGE, 1, 1)), turn], axis=2).reshape(-1, 6)
    flat = moves.reshape(len(base), -1)
    apart = (flat - base @ np.linalg.lstsq(base, flat, rcond=None)[0]).reshape(moves.shape)
    total, unseen, bent = (np.sqrt(np.mean(x**2, axis=(0, 1))) for x in (D[:, :, count:], moves, apart))
    return np.asarray(unseen), np.asarray(total), np.asarray(bent)
