"""A fit moved from where the rows alone would have it to its posterior, which is what programs are corrected with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.effects.asking import of_parameters, with_parameters
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.fitted import Fit
from postproc.estimation.posterior import Posterior, penalty_and_prior
from postproc.estimation.priors import Prior, is_placed, prior_at
from postproc.estimation.problem import Problem
from postproc.estimation.solving.determined import slope
from postproc.model.arm import StatedPrior

LIKELIER = 50.0
"""Twice the logarithm of the odds by which another size must be likelier than the ordinary one, times the number of the
parameters of a kind: few numbers say little of their size."""
SIZE_FACTORS = (0.3, 0.1)
"""Factors of the ordinary sizes that an arm may have: some are calibrated well."""
SETTLE_PASSES, LEAST_SHARE = 8, 1 / 8
"""Steps that are made at most, and the share of a step below which it is none."""
SETTLED_CHANGE = 0.02
"""Standard deviations below which a move of every parameter is none."""


def settled(fit: Fit) -> Fit:
    """Return the fit at the likeliest parameters of its posterior, where what no row shows stands at its prior.

    The posterior is that of the model as it is linear at the fit, and is computed again where it moves by more than
    `SETTLED_CHANGE`. The first step is made whole: from far out in a bent valley of equal fits it leads to where the
    model hardly bends. Each further one is halved until the fit becomes likelier.
    """
    for sweep in range(SETTLE_PASSES):
        after = fit.posterior
        names = (*after.names, *after.unidentifiable)
        before = of_parameters(fit.model.effects, names)
        far = np.any(np.abs(after.mean - before) > SETTLED_CHANGE * after.deviations)
        problem = _nearer(fit, after, before, likelier=bool(far and sweep))
        if problem is None:
            break
        ends = {e.key: np.any(e.vector() == np.stack(e.bounds()), axis=0) for e in problem.model.effects}
        stopped = {(key, i) for key, i in fit.at_bound if ends[key][i]}
        at = slope(problem, fit.free, stopped, fit.strength, fit.parameters)
        fit = replace(fit, problem=problem, at_bound=tuple(sorted(stopped)), **at.shared)
        if not far:
            break
    pull, centre = _pulled(fit)
    return replace(fit, pull=pull, centre=centre)


def _nearer(fit: Fit, after: Posterior, before: Array, likelier: bool) -> Problem | None:
    """Return the problem a step nearer to the mean of its posterior; None where no step will do.

    Args:
        before: (p,) where the parameters stand; likelier: whether the step must make the fit likelier.
    """
    names, scatter = (*after.names, *after.unidentifiable), fit.scatter_of_parameters
    penalty, prior = penalty_and_prior(fit, names, len(after.names))

    def cost(problem: Problem) -> float:
        """Return minus twice the logarithm of the posterior density, but for a constant; inf where no arm balances."""
        x = of_parameters(problem.model.effects, names)
        try:
            return float(np.sum(problem.residual**2) + np.sum((penalty * x) ** 2)) / scatter + prior.cost(x)
        except PostprocError:
            return np.inf

    share, most = 1.0, cost(fit.problem) if likelier else np.finfo(float).max
    while share >= LEAST_SHARE:
        effects = with_parameters(fit.model.effects, names, before + share * (after.mean - before))
        problem = fit.problem.at(effects)
        if cost(problem) <= most:
            return problem
        share /= 2
    return None


def settled_by_size(fit: Fit) -> Fit:
    """Return the fit settled with the ordinary sizes of each parameter times factors, the likeliest one by one.

    Few and noisy rows tell little of each joint's zero, and more of how large the zeros of this arm are together: an
    arm that hardly needs them is not given the noise of the rows for them (empirical Bayes, MacKay 1992). With residual
    r, columns A, prior deviations S and deviations z from the priors in units of S, the logarithm of the marginal
    likelihood is -(|r|^2 / s^2 + |z|^2 + ln det(I + S A^T A S / s^2)) / 2. Priors that the model states stay.
    """
    best = settled(_with_sizes(fit, {}))
    scatter, sizes = best.scatter_of_parameters, dict[str, float]()
    kinds = [(e, part) for e in fit.model.effects if _has_size(e) for part in e.parameters()]
    for name, count in [(f"{e.key}.{part}", np.prod(e.shape(part))) for e, part in kinds]:
        for size in SIZE_FACTORS:
            trial = settled(_with_sizes(fit, {**sizes, name: size}))
            if _log_marginal(trial, scatter) > _log_marginal(best, scatter) + LIKELIER / count:
                best, sizes[name] = trial, size
    return best


def _has_size(effect: Effect) -> bool:
    """Return whether the prior of an effect is its ordinary size."""
    return not is_placed(effect) and effect.roughness() is None and effect.role is not Role.JOINT_SPRINGS


def _with_sizes(fit: Fit, sizes: Mapping[str, float]) -> Fit:
    """Return the fit with ordinary sizes of parameters times factors, by name, as the priors that its model states."""
    model = fit.model
    stated = {
        f"{e.key}.{name}": StatedPrior(0.0, size * float(ordinary), f"ordinary size times {size:g}, chosen by the rows")
        for e in model.effects
        if _has_size(e)
        for name, amplitude, ordinary in zip(e.names(), e.amplitudes(), ordinary_sizes(e, model.robot), strict=True)
        if amplitude and (size := sizes.get(f"{e.key}.{name.partition('[')[0]}", 1.0))
    }
    return replace(fit, problem=replace(fit.problem, model=replace(model, priors={**stated, **model.priors})))


def _log_marginal(fit: Fit, scatter: float) -> float:
    """Return twice the logarithm of the marginal likelihood of `settled_by_size`, but for what all sizes have alike.

    Args:
        scatter: s^2.
    """
    prior, x, log = _priors(fit)
    known = np.array([key not in fit.problem.anywhere for key, _ in fit.parameters], dtype=bool)
    columns = fit.columns * np.where(known, prior.spread * np.where(log, x, 1.0), 1.0)
    off = np.where(known, prior.off(x) / prior.spread, 0.0)
    information = np.linalg.slogdet(np.eye(len(off)) + columns.T @ columns / scatter)[1]
    return -float(np.sum(fit.problem.residual**2) / scatter + off @ off + information)


def _priors(fit: Fit) -> tuple[Prior, Array, NDArray[np.bool_]]:
    """Return the prior of the fitted parameters, their values (p,), and which of them count with their logarithms."""
    prior, x = prior_at(fit.model, fit.model.effects, fit.parameters), of_parameters(fit.model.effects, fit.parameters)
    return prior, x, prior.log & (x > 0)


def _pulled(fit: Fit) -> tuple[Array, Array]:
    """Return weight and centre (p,) of the prior of each fitted parameter, as a fit without some rows would have them.

    The prior of a logarithm, (ln x - ln m) / S, is taken along its tangent at x: weight 1 / (x S), centre
    x - x ln(x / m).
    """
    prior, x, log = _priors(fit)
    free = fit.problem.anywhere | {e.key for e in fit.model.effects if e.roughness() is not None}
    pulled = np.array([key not in free for key, _ in fit.parameters], dtype=bool)
    pull = np.sqrt(fit.scatter_of_parameters * prior.weight(x)) / np.where(log, x, 1.0)
    centre = np.where(log, x - x * prior.off(x), prior.value)
    return np.where(pulled, pull, 0.0), np.where(pulled, centre, 0.0)
