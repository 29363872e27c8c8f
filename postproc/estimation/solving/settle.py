"""A fit moved from where the rows alone would have it to its posterior, which is what programs are corrected with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.arrays import Array
from postproc.estimation.fitted import Fit
from postproc.estimation.posterior import yielding
from postproc.estimation.priors import is_placed, prior_of
from postproc.estimation.solving.determined import slope

SETTLE_PASSES = 4
SETTLED_CHANGE = 0.02
"""Standard deviations below which a move of every parameter is none."""


def settled(fit: Fit) -> Fit:
    """Return the fit at the likeliest parameters of its posterior, where what no row shows stands at its prior.

    The model bends little on the way: the posterior is computed again where it moves by more than `SETTLED_CHANGE`.
    """
    for _ in range(SETTLE_PASSES):
        after = fit.posterior
        names = (*after.names, *after.unidentifiable)
        vectors = {e.key: e.vector().copy() for e in fit.model.effects}
        before = np.array([vectors[key][i] for key, i in names])
        for (key, i), x in zip(names, after.mean, strict=True):
            vectors[key][i] = x
        effects = [e.with_vector(np.clip(vectors[e.key], *e.bounds())) for e in fit.model.effects]
        problem = fit.problem.at(effects)
        ends = {e.key: np.any(e.vector() == np.stack(e.bounds()), axis=0) for e in effects}
        stopped = {(key, i) for key, i in fit.at_bound if ends[key][i]}
        at = slope(problem, fit.free, stopped, fit.strength, fit.parameters)
        moved = np.abs(after.mean - before) / np.maximum(after.deviations, 1e-300)
        bound = tuple(sorted(stopped))
        fit = replace(fit, problem=problem, at_bound=bound, **at.found)
        if not (moved > SETTLED_CHANGE).any():
            break
    pull, centre = _pulled(fit)
    return replace(fit, pull=pull, centre=centre)


def _pulled(fit: Fit) -> tuple[Array, Array]:
    """Return weight and centre (p,) of the prior of each fitted parameter, as a fit without some rows would have them.

    The prior of a logarithm, (ln x - ln m) / S, is taken along its tangent at x: weight 1 / (x S), centre
    x - x ln(x / m).
    """
    priors = {e.key: prior_of(e, fit.model) for e in fit.model.effects}
    free = {e.key for e in fit.model.effects if is_placed(e) or e.roughness() is not None}
    pull, centre = np.zeros(len(fit.parameters)), np.zeros(len(fit.parameters))
    vectors = {e.key: e.vector() for e in fit.model.effects}
    for k, (key, i) in enumerate(fit.parameters):
        if key in free:
            continue
        x, prior = vectors[key][i], priors[key]
        log = bool(prior.log[i] and x > 0)
        off = np.log(x / prior.value[i]) if log else x - prior.value[i]
        unit, centre[k] = (x, x - x * off) if log else (1.0, prior.value[i])
        weight = yielding(np.array([off]), prior.spread[i : i + 1], np.array([log]))[0]
        pull[k] = np.sqrt(fit.scatter_of_parameters * weight) / unit
    return pull, centre
