"""The search for missing effects, back again: each must still be needed beside the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.identify.alike import confusable
from postproc.identify.judgement import MATERIAL, convincing, judged, refit
from postproc.identify.ranking import Search, ranking
from postproc.identify.whole import Missing, anew


def check_backward(search: Search, base: Fit, missing: list[Missing]) -> list[Missing]:
    """Each effect that was added must still be needed beside the others, and be the best for its part."""
    at = 0
    while len(missing) > 1 and at < len(missing):
        one = missing[at].candidate
        others = [m.candidate for m in missing if m.candidate.key != one.key]
        without = search.only(base, others)
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
            after = refit(without, better)
            enough = (1 + MATERIAL) * search.fit.held_out_rms if needed else without.held_out_rms
            found = better if after is None else judged(without, after, better)
            if after is not None and after.held_out_rms < enough and found.evidence > -np.inf:
                missing[at] = Missing(found, *confusable(rivals, better, without, after))
                search.fit = after
                at += 1
                continue
        if mine is None or not needed:
            missing = [m for m in missing if m.candidate.key != one.key]
            search.fit, at = without, 0
            continue
        alike, unseen = confusable(rivals, mine, without, search.fit)
        missing[at] = replace(missing[at], alike=alike, unseen=unseen)
        missing = anew(search, base, missing, at, trial, mine)
        at += 1
    return missing
