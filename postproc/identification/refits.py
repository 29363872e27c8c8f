"""Fits with what a search has found: with some of it, on part of the data, and at the end on all of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.determined import slope
from postproc.estimation.solving.solve import Terms, advance
from postproc.identification.candidates.candidate import Candidate

ENOUGH = 2000
"""Measured numbers that a search takes at most: beyond it every second, third .. pose."""
STEPS, MISSED = 4, 0.02
"""Steps that are made at most, and the share of the sum of squares by which one may miss what its slope foretells."""


def refit_all(base: Fit, fitted: Fit, candidates: Sequence[Candidate], noise: float | None) -> Fit:
    """The base with some of the effects that a fit has found, all from where that fit has them, beside its patterns.

    The springs too: those that the base has found without a load do not suit it, down to their sign. On more rows than
    those of the fit, free functions get the order and smoothness that these can carry.
    """
    keys = {c.key for c in candidates}
    same = {k for k, mask in base.free.items() if np.array_equal(mask, fitted.free.get(k, ()))}
    start = {e.key: e for e in base.model.effects}
    start.update({e.key: e for e in fitted.model.effects if e.key in keys | same})
    free = {**base.free, **{key: fitted.free[key] for key in keys}}
    anew = keys if len(fitted.data) < len(base.data) else set()
    strength = {k: v for k, v in fitted.strength.items() if k in start and k not in anew}
    known = frozenset(base.parameters + fitted.parameters)
    terms = Terms(free, strength, determined=known, beside=fitted.problem.beside)
    return fit_model(base.model.with_effects(*start.values()), base.data, noise=noise, terms=terms)


def thinned(base: Fit, noise: float | None) -> Fit:
    """The base on one pose in every so many where there are more than the search needs.

    The full data then gives the final fit.
    """
    step = -(-int(base.problem.weights.used.sum()) // ENOUGH)
    if step < 2:
        return base
    kept = base.data.one_in(step)
    kept[list(base.set_aside)] = False
    return fit_model(base.model, base.data.rows(kept), noise=noise, terms=Terms(base.free, base.strength))


def without(fit: Fit, keys: Iterable[str]) -> Fit:
    """A fit that lacks some of its effects, as its slope there foretells where the others would settle.

    Nothing is fitted again: the others' residual and columns are those where the fit has them, and held-out errors are
    taken one step from there. Where such a step misses what the slope foretells (a load on springs that it has formed
    itself), it is made, and another one looked at.
    """
    gone = set(keys)
    free = {key: mask for key, mask in fit.free.items() if key not in gone}
    problem = fit.problem.at([e for e in fit.model.effects if e.key not in gone])
    at = slope(problem, free, set(), fit.strength)
    for _ in range(STEPS):
        aim = at.foretold(problem, at.step(problem)[0])
        further, fallen, *_ = advance(problem, at, 0.0, 0.0, 10)
        if further is problem or at.cost(problem) - fallen < (1 + MISSED) * aim:
            break
        problem, at = further, slope(further, free, set(), fit.strength)
    return replace(fit, problem=problem, free=free, held=at.held, at_bound=(), columns=at.columns, penalty=at.penalty)
