"""What the rows and the priors together say about every parameter: the posterior of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import GRAVITY, Array
from postproc.channels.state import State
from postproc.estimation.priors import UNDETERMINED_SHARE, is_placed, lognormal_deviation, prior_of
from postproc.estimation.solution import Solution
from postproc.estimation.solving.step import Name
from postproc.model.uncertainty import derivatives

POSES_IN_RANGE = 100
"""Poses anywhere between joint limits at which a model is asked for what measured rows do not show."""
NOTHING, SAME = 1e-7, 0.01
"""Move [m] by a standard deviation that is none, and the share of a parameter's own moves below which the others make
up for it everywhere: such a parameter only says the same in other axes (joint 1 and the base)."""
FORCE = 0.5
"""Share of the weight of the rated payload that pulls in any direction where a model is asked for what rows lack."""
TAIL = 2.0
"""Deviations of a logarithm beyond which a prior pulls no harder: an arm may be unlike all others of its type."""
STEPS, SETTLED = 60, 1e-10
SMALLEST = 1e-3
"""Share of the prior's median from which a positive parameter begins that the rows alone make smaller or negative."""


@dataclass(frozen=True)
class Posterior:
    """The normal distribution of the parameters that follows from a fit and the priors.

    The rows determine the first k parameters beside the others, and leave the h others open: the k are off by their
    own covariance, and all are off together along the directions in which the h may be off unseen.

    Args:
        names: (effect key, index in its vector) of the k determined parameters, in the order of ``covariance``.
        mean: (k + h,) the likeliest values of all.
        covariance: (k, k) of the determined ones beside given values of the open ones.
        left_open: names of the h open ones.
        directions: (h, k + h) one standard deviation each.
        prior: (k + h,) standard deviation of each before any row was read; inf where nothing was known.
        sources: (k + h) where each prior comes from.
    """

    names: tuple[Name, ...]
    mean: Array
    covariance: Array
    left_open: tuple[Name, ...]
    directions: Array
    prior: Array
    sources: tuple[str, ...]

    @property
    def deviations(self) -> Array:
        """(k + h,) standard deviation of each parameter."""
        own = np.concatenate([np.diag(self.covariance), np.zeros(len(self.left_open))])
        return np.asarray(np.sqrt(np.maximum(own, 0.0) + np.sum(self.directions**2, axis=0)))

    @property
    def undetermined(self) -> tuple[int, ...]:
        """Indices of the parameters of which the rows have said less than half: they stand at their priors."""
        silent = self.deviations > UNDETERMINED_SHARE * self.prior
        return tuple(int(i) for i in np.flatnonzero(silent))


def posterior_of(fit: Solution, scatter: float) -> Posterior:
    """Return the posterior of a fit.

    With r the whitened residual at x_0, A its columns, s^2 the scatter, x the parameters, m their priors' medians and S
    their deviations, the sum |r - A (x - x_0)|^2 / s^2 + |(x - m) / S|^2 is least; positive parameters count with
    their logarithms. The covariance is the inverse of half the second derivative there (Laplace). Open is a parameter
    that the rows do not determine beside the others (`Solution.unknown`). If it is off by x_h, the determined ones are
    off by -(A^T A / s^2 + S^-2)^-1 A^T A_h x_h / s^2. Open ones that no pose under any load shows are left out: they
    describe the motion of others in other axes.

    Args:
        scatter: s^2, the factor between (A^T A + penalty^2)^-1 and the covariance of the fitted parameters.
    """
    determined = (*fit.parameters, *(p for p in fit.at_bound if p not in fit.unknown))
    names, count = (*determined, *(p for p in fit.unknown if p not in determined)), len(determined)
    effects = {e.key: e for e in fit.model.effects}
    priors = {key: prior_of(effect, fit.model) for key, effect in effects.items()}
    penalty = np.zeros(len(names))
    penalty[: len(fit.parameters)] = fit.penalty
    value = np.array([priors[key].value[i] for key, i in names])
    log = np.array([priors[key].log[i] for key, i in names], dtype=bool)
    spread = np.array([priors[key].spread[i] for key, i in names])
    # A frame may be anywhere, and the penalty of a free function is its prior.
    free = np.array([k < count and is_placed(effects[key]) for k, (key, _) in enumerate(names)], dtype=bool)
    spread = np.where(free | (penalty > 0), np.inf, spread)

    columns = _columns(fit, names)
    start = np.array([effects[key].vector()[i] for key, i in names])
    gram = (columns.T @ columns + np.diag(penalty**2)) / scatter
    pull = (columns.T @ fit.problem.residual - penalty**2 * start) / scatter

    def taken(unit: Array, weight: Array) -> tuple[Array, Array]:
        """Return the covariance (k, k) of the determined ones in these units, and what they take up of the others."""
        curvature = gram * np.outer(unit, unit) + np.diag(weight)
        known = _inverse(curvature[:count, :count])
        return known, known @ curvature[:count, count:]

    unit = np.where(log, value, 1.0)
    moves, own = _moves(fit, names, unit, taken(unit, spread**-2.0)[1])
    shown = moves * spread[count:] > np.maximum(NOTHING, SAME * own * spread[count:])
    kept = np.concatenate([np.arange(count), count + np.flatnonzero(shown)])
    names = tuple(names[k] for k in kept)
    gram, pull, start, value, spread, log = (
        gram[np.ix_(kept, kept)], pull[kept], start[kept], value[kept], spread[kept], log[kept]
    )  # fmt: skip

    mean = _likeliest(gram, pull, start, value, spread, log)
    unit, weight = np.where(log, mean, 1.0), yielding(_log_ratio(mean, value), spread, log)
    known, off = taken(unit, weight)
    curvature = (gram * np.outer(unit, unit) + np.diag(weight))[count:]
    lower = _factor(_inverse(curvature[:, count:] - curvature[:, :count] @ off))
    directions = np.vstack([-off @ lower, lower]).T
    # A log-normal number lies farther from its median than the deviation of its logarithm says.
    total = np.sqrt(np.concatenate([np.diag(known), np.zeros(len(lower))]) + np.sum(directions**2, axis=0))
    wide = unit * np.where(log & (total > 0), lognormal_deviation(total) / np.maximum(total, 1e-300), 1.0)
    deviation = np.array([priors[key].deviation()[i] for key, i in names])
    return Posterior(
        determined,
        mean,
        known * np.outer(wide[:count], wide[:count]),
        names[count:],
        directions * wide,
        np.where(np.isinf(spread), np.inf, deviation),
        tuple(priors[key].source[i] for key, i in names),
    )


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


def _likeliest(gram: Array, pull: Array, start: Array, median: Array, spread: Array, log: NDArray[np.bool_]) -> Array:
    """Return x (p,) at which (x - x_0)^T G (x - x_0) - 2 b^T (x - x_0) + sum of rho((x - m) / S) is least.

    rho(z) is z^2; of positive parameters, which count with their logarithms, it goes on along its tangent beyond
    `TAIL`. Gauss and Newton, each step by a factor e at most and halved until the sum falls.

    Args:
        gram: (p, p) G; pull: (p,) b; start: (p,) x_0; median: (p,) m; spread: (p,) S; log: (p,) positive parameters.
    """

    def off(x: Array) -> Array:
        """Return (p,) differences to the medians, of logarithms where parameters are positive."""
        result = x - median
        result[log] = np.log(x[log] / median[log])
        return np.asarray(result)

    def cost(x: Array) -> float:
        """Return the sum that is to be least."""
        by, z = x - start, off(x) / spread
        far = np.where(log, np.maximum(np.abs(z) - TAIL, 0.0), 0.0)
        return float(by @ (gram @ by) - 2 * pull @ by + np.sum(z**2 - far**2))

    x = np.where(log, np.maximum(start, SMALLEST * median), start)
    for _ in range(STEPS):
        unit, weight = np.where(log, x, 1.0), yielding(off(x), spread, log)
        slope = unit * (gram @ (x - start) - pull) + weight * off(x)
        step = -_inverse(gram * np.outer(unit, unit) + np.diag(weight)) @ slope
        step /= max(1.0, float(np.max(np.abs(step), initial=0.0, where=log)))
        now, share = cost(x), 1.0
        while share > 1e-3:
            trial = np.where(log, x * np.exp(share * step), x + share * step)
            if cost(trial) <= now:
                break
            share /= 2
        else:
            break
        x = trial
        if now - cost(x) < SETTLED * (1.0 + abs(now)):
            break
    return np.asarray(x)


def _log_ratio(x: Array, median: Array) -> Array:
    """Return ln(x / m) of numbers (p,) of the same sign, 0 of others."""
    good = x * median > 0
    return np.asarray(np.where(good, np.log(np.where(good, x, 1.0) / np.where(good, median, 1.0)), 0.0))


def yielding(off: Array, spread: Array, log: NDArray[np.bool_]) -> Array:
    """Return the weights (p,) of priors, 1 / S^2, less where a logarithm is more than `TAIL` deviations off.

    Args:
        off: (p,) differences to the medians, of logarithms where ``log``; spread: (p,) S.
        log: (p,) positive parameters.
    """
    share = np.minimum(1.0, TAIL * spread / np.maximum(np.abs(off), 1e-300))
    return np.asarray(np.where(log, share, 1.0) * spread**-2.0)


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a positive semidefinite matrix of numbers of very different sizes."""
    length = np.sqrt(np.diag(matrix))
    scale = np.where(length > 0, length, 1.0)
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))


def _factor(covariance: Array) -> Array:
    """Return L with L L^T a positive definite matrix of numbers of very different sizes."""
    scale = np.sqrt(np.diag(covariance))
    return np.asarray(np.linalg.cholesky(covariance / np.outer(scale, scale)) * scale[:, None])


def _moves(fit: Solution, names: Sequence[Name], unit: Array, taken: Array) -> tuple[Array, Array]:
    """Return (h,) rms moves [m] of the TCP per unit of each open parameter that the rows leave unseen, and all of it.

    Args:
        names: of all p + h parameters; unit: (p + h,) change of each per unit; taken: (p, h) what the determined ones
            take up of the open ones.
    """
    count = len(taken)
    robot = fit.model.robot
    low, high = np.clip([robot.lower, robot.upper], -np.pi, np.pi)
    some = anywhere(fit.data.state, low, high)
    if some.approach is not None:  # all rows may have come from one side
        some = some.with_(approach=some.approach * np.where(np.arange(POSES_IN_RANGE) % 2, -1.0, 1.0)[:, None])
    # Programs press and pull where a table may have gravity alone.
    random = np.random.default_rng(1).normal(size=(POSES_IN_RANGE, 6))
    force = FORCE * GRAVITY * (10.0 if robot.payload is None else robot.payload)
    some = some.with_(wrench=random * np.repeat([force, 0.1 * force], 3))
    D = derivatives(fit.model, some, names)[0] * unit
    moves = D[:, :, count:] - D[:, :, :count] @ taken
    whole, left = (np.sqrt(np.mean(x**2, axis=(0, 1))) for x in (D[:, :, count:], moves))
    return np.asarray(left), np.asarray(whole)
