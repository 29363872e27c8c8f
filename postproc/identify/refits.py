"""Fits with what a search has found: with some of it, on part of the data, and at the end on all of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.solve import Terms
from postproc.identify.candidate import Candidate, Screen
from postproc.identify.judgement import refit
from postproc.identify.selection import grown

ENOUGH = 3000
"""Measured numbers beyond which the search takes every second, third .. pose."""


def refit_all(base: Fit, fitted: Fit, candidates: Sequence[Candidate], noise: float | None) -> Fit:
    """The base with some of the effects that a fit has found, all from where that fit has them, beside its patterns.

    The springs too: those that the base has found without a load do not suit it, down to their sign.
    """
    keys = {c.key for c in candidates}
    same = {k for k, mask in base.free.items() if np.array_equal(mask, fitted.free.get(k, ()))}
    start = {e.key: e for e in base.model.effects}
    start.update({e.key: e for e in fitted.model.effects if e.key in keys | same})
    free = {**base.free, **{key: fitted.free[key] for key in keys}}
    strength = {k: v for k, v in fitted.strength.items() if k in start}
    known = frozenset(base.parameters + fitted.parameters)
    terms = Terms(free, strength, determined=known, beside=fitted.problem.beside)
    return fit_model(base.model.with_effects(*start.values()), base.data, noise=noise, terms=terms)


def thinned(base: Fit, noise: float | None) -> Fit:
    """The base on every k-th pose where there are more than the search needs.

    The full data then gives the final fit.
    """
    step = int(base.problem.weights.used.sum() // ENOUGH)
    if step < 2:
        return base
    groups = base.data.repeats
    kept = (groups % step == 0) & ~np.isin(np.arange(len(groups)), base.set_aside)
    return fit_model(base.model, base.data.rows(kept), noise=noise, terms=Terms(base.free, base.strength))


def final_fit(base: Fit, fitted: Fit, candidates: list[Candidate], noise: float | None) -> Fit:
    """The missing effects fitted on the whole data; free functions get the order and smoothness that it can carry."""
    fit = refit_all(base, fitted, [c for c in candidates if c.effect.roughness() is None], noise)
    for candidate in (c for c in candidates if c.effect.roughness() is not None):
        screen = Screen(fit.problem, {candidate.key: type(candidate.effect)})
        best = grown(screen, fit.linear, candidate)
        after = None if best is None else refit(fit, best)
        fit = fit if after is None else after
    return fit
