"""Names against patterns once the search is done: an effect goes that only mends a pattern without a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.worth import schwarz
from postproc.identify.ranking import Search
from postproc.identify.refits import refit_all
from postproc.identify.search import patterns_left
from postproc.identify.whole import Missing
from postproc.patterns.suspects import Suspect

MENDS = 0.1
"""A named effect beside a pattern must explain at least this share of all that stands above the noise.

A pattern that is a third off the law in places leaves a tenth of its square, which anything smooth can take up.
"""


def contested(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """The named effects that do more than mend a pattern; the search is left with them and the patterns beside them.

    A law that nobody knows is never met exactly, and what is left of it looks like one effect or another. So each
    effect is taken out in turn and the patterns are found anew: it goes where as many of them, of the same channels at
    the same places, tell nearly as much, and the first of them more than the effect would in its place.
    """
    if not missing:
        return missing
    search.outside = patterns_left(search)
    square, fit = search.linear().square, search.fit
    silent = square if fit.noise.position is None else min(square, float(len(fit.linear.residual)))
    near = MENDS * (base.linear.square - silent)
    while search.outside:
        rivals = []
        for one in (m for m in missing if base.model.effect(m.candidate.key) is None):
            others = [m for m in missing if m is not one]
            rival = replace(search, fit=refit_all(base, search.fit, [m.candidate for m in others], noise))
            if rival.fit.set_aside == search.fit.set_aside:
                rival.outside = patterns_left(rival, len(search.outside))
                if alike(search.outside, rival.outside) and rival.outside[0].evidence > _worth(one, search, rival):
                    rivals.append((rival.linear().square, rival, others))
        best = min(rivals, key=lambda r: r[0], default=None)
        if best is None or best[0] > search.linear().square + near:
            break
        search.fit, missing = best[1].fit, best[2]
        search.outside = patterns_left(search)
    return missing


def _worth(one: Missing, search: Search, without: Search) -> float:
    """What a name is worth in the place of the patterns, at the price of its own search."""
    key, linear = one.candidate.key, without.fit.linear
    after = linear.extended(search.fit.columns[:, [k == key for k, _ in search.fit.parameters]])
    fall, count = linear.square - after.square, after.parameters - linear.parameters
    return schwarz(linear.square, fall, count, linear.freedom, np.exp(one.candidate.searched / 2))


def alike(some: Sequence[Suspect], others: Sequence[Suspect]) -> bool:
    """Whether some patterns stand for others, if any: for each of these one of its channels at its place."""
    return bool(others) and all(
        any(one.where == s.where and set(one.channels) & set(s.channels) for one in some) for s in others
    )
