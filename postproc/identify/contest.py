"""Names against patterns once the search is done: an effect stays only if no pattern tells the same with less."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.identify.fit import Fit
from postproc.identify.forms import schwarz
from postproc.identify.search import Missing, Search, clear, refit_all, worth_saying
from postproc.identify.suspects import ODDS, Suspect, find_suspects

MOST = 3
"""Patterns that are taken one after another at most."""


MENDS = 0.1
"""A named effect beside a pattern must explain at least this share of all that is explained.

A pattern that is a third off the law in places leaves a tenth of its square, which anything smooth can take up.
"""


@dataclass(frozen=True)
class _Whole:
    """A finished explanation: what is named, the fit with it, and the patterns that are still needed beside it."""

    fit: Fit
    missing: list[Missing]
    outside: list[Suspect]


def contested(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """The named effects that earn their place beside patterns without a name.

    Each is taken out in turn, and all together; the patterns that the rest needs are found anew, and of all wholes the
    one that is worth most stays. A named effect pays for the forms that were tried, a pattern for all patterns and the
    odds of what nobody has a name for (a free function of one joint as well), both for every parameter (Schwarz 1978).
    The search is left with that whole.
    """
    if not missing:
        return missing
    best = _explained(search, search.fit, missing)
    while best.missing:
        keys = [m.candidate.key for m in best.missing]
        others = [_without(search, base, best, {key}, noise) for key in keys]
        if len(keys) > 1:
            others.append(_without(search, base, best, set(keys), noise))
        rival = max(others, key=lambda whole: _worth(base, whole, best))
        if _worth(base, rival, best) <= _worth(base, best, rival):
            rival = min(others[: len(keys)], key=lambda whole: _square(whole, base, best))
            if not _beside(base, best, rival):
                break
        best = rival
    search.fit, search.outside = best.fit, best.outside
    return best.missing


def _without(search: Search, base: Fit, best: _Whole, dropped: set[str], noise: float | None) -> _Whole:
    kept = [m for m in best.missing if m.candidate.key not in dropped]
    return _explained(search, refit_all(base, best.fit, [m.candidate for m in kept], noise), kept)


def _beside(base: Fit, best: _Whole, rival: _Whole) -> bool:
    """Whether what was taken out only mends a pattern: a law that nobody knows is never met exactly."""
    if not best.outside or not rival.outside:
        return False
    with_it, without = _square(best, base, rival), _square(rival, base, best)
    before = _square(_Whole(base, [], []), best.fit, rival)
    return without - with_it < MENDS * (before - with_it)


def _explained(search: Search, fit: Fit, missing: list[Missing]) -> _Whole:
    """A fit with the patterns that it still needs, the strongest first."""
    trial = replace(search, fit=fit, outside=[])
    while len(trial.outside) < MOST:
        linear = trial.linear()
        found = find_suspects(fit.problem, linear, search.patterns)
        if not found or not clear(found[0], linear, worth_saying(fit)):
            break
        trial.outside = [*trial.outside, found[0]]
    return _Whole(fit, missing, trial.outside)


def _worth(base: Fit, whole: _Whole, beside: _Whole) -> float:
    """2 log of the odds of a whole against the base, on the rows that both wholes use."""
    named = 0.0
    if whole.missing:
        before, added = base.linear, whole.fit.linear.parameters - base.linear.parameters
        alone = replace(whole, outside=[])
        square, left = _square(_Whole(base, [], []), whole.fit, beside), _square(alone, base, beside)
        named = schwarz(square, square - left, added, before.freedom, 1.0)
    free = [m for m in whole.missing if m.candidate.effect.roughness() is not None]
    searched = sum(m.candidate.searched for m in whole.missing) + ODDS * len(free)
    return named - searched + sum(s.evidence for s in whole.outside)


def _square(whole: _Whole, other: Fit, beside: _Whole) -> float:
    """What a whole leaves on the rows that all use; refits leave out other rows where they lie far off."""
    problem = whole.fit.problem
    linear = whole.fit.linear
    for suspect in whole.outside:
        linear = linear.extended(suspect.columns(problem))
    used = problem.weights.used
    rows = used & other.problem.weights.used & beside.fit.problem.weights.used
    return linear.square if np.array_equal(rows, used) else float(np.sum(linear.rest[rows[used]] ** 2))
