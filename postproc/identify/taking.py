"""An effect is taken into the model, where the fit is better by it in every way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.worth import schwarz
from postproc.identify.alike import CLOSE, confusable
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import judged, predicts_better, reaches_further, refit, white
from postproc.identify.ranking import Search, ranking
from postproc.identify.selection import columns_of
from postproc.identify.whole import Missing
from postproc.patterns.place import with_and_without_a_row


def take(search: Search, best: Candidate, ranked: list[Candidate]) -> Missing | None:
    """The effect in the model, everything refitted.

    None where a single row asks for it, rows that the fit has not seen are not predicted better, or no arm is like
    that. Where more than noise is left, what neighbours have in common makes anything significant: then by more than
    its own scatter from block to block, and in parts of the joint space that the fit has not seen, too. What no arm can
    be is not asked again, whatever comes beside it.
    """
    if _lives_on_a_row(search.fit, best):
        return None
    before = search.fit
    after = refit(before, best)
    if after is None or not predicts_better(after, before, 0.0 if white(after) else 1.0):
        return None
    if not (white(after) or reaches_further(after, before)):
        return None
    taken = judged(before, after, best)
    if taken.evidence < 0:
        if taken.evidence == -np.inf:
            search.classes = {k: c for k, c in search.classes.items() if k != best.key}
        return None
    search.fit = after
    return Missing(taken, *confusable(ranked, best, before, after))


def _lives_on_a_row(fit: Fit, best: Candidate) -> bool:
    """Whether an effect is worth nothing without the row that gains most by it."""
    linear, columns = fit.linear, columns_of(fit.problem, best.effect, best.free)
    both = with_and_without_a_row(linear, columns)
    whole, less = (schwarz(square, fall, best.count, linear.freedom, 1.0) for square, fall in both)
    return best.evidence + min(0.0, less - whole) < 0


def one_or_more(search: Search, best: Candidate) -> Candidate:
    """A sum of terms, or its first one alone where another effect tells clearly more beside that than the others do.

    Two lines of gears together may come before a hose that one of them resembles.
    """
    if best.first is None:
        return best
    after = refit(search.fit, best.first)
    if after is None:
        return best
    beside = ranking(replace(search, fit=after))
    more = max((c.evidence for c in beside if c.key == best.key), default=0.0)
    return best.first if any(c.evidence > more + CLOSE for c in beside) else best


def together(missing: list[Missing], taken: Missing) -> list[Missing]:
    """What is missing and what was taken; more of an effect that stands there goes with it (a further joint)."""
    at = next((i for i, m in enumerate(missing) if m.candidate.key == taken.candidate.key), None)
    if at is None:
        return [*missing, taken]
    first, more = missing[at], taken.candidate
    told = [more.label] if more.effect.roughness() is not None else [first.candidate.label, more.label]
    whole = replace(
        first.candidate, effect=more.effect, free=more.free, fit=more.fit, label="; ".join(filter(None, told))
    )
    return [*missing[:at], replace(first, candidate=whole), *missing[at + 1 :]]
