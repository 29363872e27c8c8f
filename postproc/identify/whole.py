"""What a search has found as a whole: its worth, and its effects formed anew beside one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.worth import schwarz
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import fitted_best
from postproc.identify.ranking import Search
from postproc.identify.selection import compose
from postproc.patterns.tried import ODDS


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Args:
        candidate: what it is; alike: effects that explain this data nearly as well; unseen: effects that would not be
            seen beside it; held_out_after: held-out rms once it and those before it are in [m].
    """

    candidate: Candidate
    alike: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()
    held_out_after: float = float("nan")

    @property
    def not_separable(self) -> tuple[str, ...]:
        """What this data does not tell it from."""
        return (*self.alike, *self.unseen)

    def or_else(self, key: str) -> Missing:
        """The same, which this data does not tell from a further effect."""
        unseen = tuple(k for k in self.unseen if k != key)
        return replace(self, alike=tuple(dict.fromkeys([*self.alike, key])), unseen=unseen)


def worth(before: Fit, search: Search, missing: Sequence[Missing]) -> float:
    """What a finished search explains of the base's residual, less its parameters and what its parts are unlikely."""
    return worth_if_left(left_by(before, search.fit), before, search, missing)


def worth_if_left(left: float, before: Fit, search: Search, missing: Sequence[Missing]) -> float:
    """The same of a search that came to leave a sum of squares (`left_by`).

    A pattern costs the odds of something without a name, a named effect half of them: five weak effects that stand in
    for one smooth pattern lose against it.
    """
    first, after = before.linear, search.fit.linear
    added = max(after.parameters - first.parameters, 1)
    gained = schwarz(first.square, first.square - left, added, first.freedom, 1.0)
    return gained - ODDS * (len(search.outside) + 0.5 * len(missing))


def left_by(before: Fit, after: Fit) -> float:
    """The sum of squares that a fit leaves, at the weights of the base.

    Numbers whose scatter a fit tells by what it leaves count by their likelihood, that is at weights of the same
    geometric mean.
    """
    weights, others = before.problem.weights, after.problem.weights
    both = weights.used & others.used
    return after.linear.square * float(np.exp(2 * np.mean(np.log(weights.values[both] / others.values[both]))))


def formed_anew(search: Search, base: Fit, missing: list[Missing]) -> list[Missing]:
    """What is missing, each effect formed anew beside the others and the patterns (`anew`)."""
    for at, one in enumerate(missing):
        key, others = one.candidate.key, [m.candidate for m in missing if m is not one]
        if (others or search.outside) and base.model.effect(key) is None:
            without = replace(search, fit=search.only(base, others))
            mine = compose(without.screen(), without.fit.linear, key)
            missing = missing if mine is None else anew(search, base, missing, at, without, mine)
    return missing


def anew(search: Search, base: Fit, missing: list[Missing], at: int, without: Search, mine: Candidate) -> list[Missing]:
    """What is missing with one effect in the form that suits what came after it, where the whole is worth more so.

    What came first was formed beside a residual that held the others, too: a spring in two rates may have looked like
    a smooth one, and what its form leaves would be taken for a law that nobody knows; an early line of a gear may have
    told what a later effect or a pattern tells. The search's fit goes with it.

    Args:
        at: which one; without: the search with the fit without it; mine: how it is composed there.
    """
    before = missing[at].candidate.label
    if mine.effect.roughness() is not None or mine.label == before:
        return missing
    found = fitted_best(without.fit, without.screen(), mine)
    if found is None or found[0].label == before:
        return missing
    candidate, fit = found
    if worth(base, replace(search, fit=fit), missing) <= worth(base, search, missing):
        return missing
    search.fit = fit
    return [*missing[:at], replace(missing[at], candidate=candidate), *missing[at + 1 :]]
