"""The search for missing effects, back again: each must still be needed beside the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.worth import schwarz
from postproc.identify.alike import confusable
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import MATERIAL, convincing, fitted_best, judged, refit
from postproc.identify.ranking import Search, ranking
from postproc.identify.refits import refit_all
from postproc.identify.selection import compose
from postproc.identify.whole import Missing


def check_backward(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """Each effect that was added must still be needed beside the others, and be the best for its part."""
    at = 0
    while len(missing) > 1 and at < len(missing):
        one = missing[at].candidate
        others = [m.candidate for m in missing if m.candidate.key != one.key]
        without = refit_all(base, search.fit, others, noise)
        trial = replace(search, fit=without)
        ranked = ranking(trial)
        mine = next((c for c in ranked if c.key == one.key), None)
        taken = {c.key for c in others}
        rivals = [c for c in ranked if c.key not in taken]
        needed = mine is not None and convincing(mine, without, len(search.classes))
        better = next((c for c in rivals if c.key != one.key and convincing(c, without, len(search.classes))), None)
        clearly = mine is not None and better is not None and better.evidence > mine.evidence
        if better is not None and (not needed or (clearly and at < len(missing) - 1)):
            # What does the same part of the work takes the place, or an effect that others cover would leave a hole.
            after = refit(without, trial.linear(), better)
            enough = (1 + MATERIAL) * search.fit.held_out_rms if needed else without.held_out_rms
            found = better if after is None else judged(without, after, better)
            if after is not None and after.held_out_rms < enough and found.evidence > -np.inf:
                missing[at] = Missing(found, after.held_out_rms, *confusable(rivals, better, without, after))
                search.fit = after
                at += 1
                continue
        if mine is None or not needed:
            missing = [m for m in missing if m.candidate.key != one.key]
            search.fit, at = without, 0
            continue
        alike, unseen = confusable(rivals, mine, without, search.fit)
        missing[at] = _with_fewer_terms(search, without, replace(missing[at], alike=alike, unseen=unseen), mine)
        at += 1
    return missing


def terms_needed(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """What is missing, each with no more terms than it needs beside the patterns that were found after it."""
    if not search.outside:
        return missing
    for at, one in enumerate(missing):
        if base.model.effect(one.candidate.key) is not None:
            continue
        without = refit_all(base, search.fit, [m.candidate for m in missing if m is not one], noise)
        bare = replace(search, fit=without)
        mine = compose(bare.screen(), bare.linear(), one.candidate.key)
        missing[at] = one if mine is None else _with_fewer_terms(search, without, one, mine)
    return missing


def _with_fewer_terms(search: Search, without: Fit, one: Missing, mine: Candidate) -> Missing:
    """An effect as it is composed anew beside all others, unless what it has more is worth its parameters (Schwarz).

    An early term may have been the best for what a later effect or a pattern tells.
    """
    key, bare = mine.key, replace(search, fit=without)
    fitted = sum(k == key for k, _ in search.fit.parameters)
    if mine.effect.roughness() is not None or mine.free.sum() >= fitted:
        return one
    found = fitted_best(without, bare.screen(), bare.linear(), mine)
    if found is None:
        return one
    anew, after = found
    more, less = search.linear(), replace(search, fit=after).linear()
    fall, count = less.square - more.square, more.parameters - less.parameters
    if count <= 0 or schwarz(less.square, fall, count, less.freedom, 1.0) > 0:
        return one
    search.fit = after
    return replace(one, candidate=anew, held_out_after=after.held_out_rms)
