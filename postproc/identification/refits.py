"""Fits with what a search has found: with some of it, on part of the data, and at the end on all of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.determined import slope
from postproc.estimation.solving.solve import SETTLED, Terms, advance
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.ordered import with_ordered_channels

MOST_NUMBERS_SEARCHED = 2000
"""Measured numbers that a search takes at most: beyond it every second, third .. pose."""
STEPS, MISSED = 4, 0.02
"""Steps that are made at most, and the share of the sum of squares by which one may miss what its slope foretells."""


def refit_all(base: Fit, fitted: Fit, added: Iterable[str], closely: float = SETTLED) -> Fit:
    """Fit the base again with some of the effects of another fit, starting from where that fit has them.

    The springs start there, too: those of the base, found without a load, do not suit it, not even in their sign. On
    more rows than those of the other fit, free functions get the resolution and smoothness that these rows can
    determine.

    Args:
        base: the fit whose rows and free parameters count; fitted: the fit with the effects.
        added: keys of the effects to keep beside those of the base; closely: as in `Terms`.
    """
    keys = set(added)
    same = {k for k, mask in base.free.items() if np.array_equal(mask, fitted.free.get(k, ()))}
    start = {e.key: e for e in base.model.effects}
    start.update({e.key: e for e in fitted.model.effects if e.key in keys | same})
    free = {**base.free, **{key: fitted.free[key] for key in keys}}
    restarted = keys if len(fitted.data) < len(base.data) else set()
    strength = {k: v for k, v in fitted.strength.items() if k in start and k not in restarted}
    known = frozenset(base.parameters + fitted.parameters)
    terms = Terms(free, strength, closely=closely, determined=known)
    return fit_model(base.model.with_effects(*start.values()), base.data, noise=base.noise.stated, terms=terms)


def with_channels_of(classes: Iterable[type[Effect]], model: Model, data: Measurements) -> Measurements:
    """Return measurements with the channels of the rows' order that some classes of effects read filled in."""
    return replace(data, state=with_ordered_channels(model, data.state, [cls.null() for cls in classes]))


def thinned(base: Fit) -> Fit:
    """Return the base fitted to every k-th pose, at most about `MOST_NUMBERS_SEARCHED` measured numbers."""
    kept = base.problem.subsample(MOST_NUMBERS_SEARCHED)
    if kept.all():
        return base
    kept[list(base.excluded)] = False
    return fit_model(base.model, base.data.rows(kept), noise=base.noise.stated, terms=Terms(base.free, base.strength))


def without(fit: Fit, keys: Iterable[str]) -> Fit:
    """Return a fit without some of its effects, the others where the linear model predicts them, not fitted again.

    Residual and columns are those at the present parameters, and held-out errors are taken one step of least squares
    from there. Where such a step would miss the predicted fall (a load on springs that it has shaped itself), it is
    made, and another one is looked at, `STEPS` times at most.

    Args:
        keys: of the effects that are left out.
    """
    gone = set(keys)
    free = {key: mask for key, mask in fit.free.items() if key not in gone}
    problem = fit.problem.at([e for e in fit.model.effects if e.key not in gone])
    at = slope(problem, free, set(), fit.strength)
    for _ in range(STEPS):
        aim = at.predicted_cost(problem, at.step(problem)[0])
        further, fallen, *_ = advance(problem, at, 0.0, 0.0, 10)
        if further is problem or at.cost(problem) - fallen < (1 + MISSED) * aim:
            break
        problem, at = further, slope(further, free, set(), fit.strength)
    return replace(fit, problem=problem, free=free, at_bound=(), **at.shared)
