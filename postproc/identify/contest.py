"""Names against patterns once the search is done: an effect stays only if no pattern tells the same with less."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.identify.fit import Fit
from postproc.identify.judgement import settled
from postproc.identify.linear import Linear, independent_share
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

    @cached_property
    def linear(self) -> Linear:
        """What it leaves, with the patterns among the fitted parameters."""
        problem, linear = self.fit.problem, self.fit.linear
        for suspect in self.outside:
            linear = linear.extended(suspect.columns(problem))
        turns = problem.whiten(problem.sensitivity.matrix[:, :, :6])
        return replace(linear, independent=independent_share(linear.rest, turns, linear.row))

    @property
    def parameters(self) -> int:
        return self.linear.parameters

    def square(self, rows: NDArray[np.bool_]) -> float:
        """Sum of squares that it leaves on some rows; refits leave out other rows where they lie far off."""
        used = self.fit.problem.weights.used
        both = used & rows
        return self.linear.square if np.array_equal(both, used) else float(np.sum(self.linear.rest[both[used]] ** 2))


def contested(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """The named effects that earn their place beside patterns without a name.

    Each is taken out in turn, and all together; the patterns that the rest needs are found anew, and of all wholes the
    one that is worth most stays. A named effect pays for the forms that were tried, a pattern for all patterns and the
    odds of what nobody has a name for (a free function of one joint as well), both for every parameter (Schwarz 1978).
    The search is left with that whole.
    """
    if not missing:
        return missing
    nothing = _Whole(base, [], [])
    best = _explained(search, search.fit, missing)
    while best.missing:
        keys = [m.candidate.key for m in best.missing]
        others = [_without(search, base, best, {key}, noise) for key in keys]
        every = [*others, _without(search, base, best, set(keys), noise)] if len(keys) > 1 else others
        rival = max(every, key=lambda whole: _gained(nothing, best, whole))
        if _gained(nothing, best, rival) <= 0:
            rival = min(others, key=lambda whole: whole.square(best.fit.problem.weights.used))
            if not _mended(nothing, best, rival):
                break
        best = rival
    search.fit, search.outside = best.fit, best.outside
    return best.missing


def _without(search: Search, base: Fit, best: _Whole, dropped: set[str], noise: float | None) -> _Whole:
    kept = [m for m in best.missing if m.candidate.key not in dropped]
    return _explained(search, refit_all(base, best.fit, [m.candidate for m in kept], noise), kept)


def _explained(search: Search, fit: Fit, missing: list[Missing]) -> _Whole:
    """A fit with the patterns that it still needs, the strongest first."""
    whole = _Whole(fit, missing, [])
    while len(whole.outside) < MOST:
        found = find_suspects(fit.problem, whole.linear, search.patterns)
        if not found or not clear(found[0], whole.linear, worth_saying(fit)):
            break
        whole = replace(whole, outside=[*whole.outside, found[0]])
    return whole


def _gained(nothing: _Whole, best: _Whole, rival: _Whole) -> float:
    """2 log of the odds of one whole against another, by the independent numbers of what the better one leaves."""
    rows = nothing.fit.problem.weights.used & best.fit.problem.weights.used & rival.fit.problem.weights.used
    left, right = best.square(rows), rival.square(rows)
    freedom = (best if left < right else rival).linear.freedom
    before = nothing.square(rows)
    return _worth(rival, nothing, before, right, freedom) - _worth(best, nothing, before, left, freedom)


def _worth(whole: _Whole, nothing: _Whole, before: float, left: float, freedom: int) -> float:
    free = [m for m in whole.missing if m.candidate.effect.roughness() is not None]
    searched = sum(m.candidate.searched for m in whole.missing) + ODDS * len(free)
    each = float(np.log(freedom))
    named = whole.fit.linear.parameters - nothing.parameters
    own = sum(-settled(left, left, freedom, whole.fit, m.candidate.key) for m in whole.missing)
    # A name has the benefit of the doubt: its parameters cost what they move at ordinary sizes, or Schwarz's price.
    cost = min(named * each, own) + (whole.parameters - whole.fit.linear.parameters) * each
    return freedom * float(np.log(before / left)) - cost - searched - sum(s.price for s in whole.outside)


def _mended(nothing: _Whole, best: _Whole, rival: _Whole) -> bool:
    """Whether what the rival does without only mends a pattern: a law that nobody knows is never met exactly."""
    if not best.outside or not rival.outside:
        return False
    rows = nothing.fit.problem.weights.used & best.fit.problem.weights.used & rival.fit.problem.weights.used
    left = best.square(rows)
    return rival.square(rows) - left < MENDS * (nothing.square(rows) - left)
