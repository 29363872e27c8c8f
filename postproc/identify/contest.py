"""Names against patterns once the search is done: an effect goes that only mends a pattern without a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.worth import schwarz
from postproc.identify.ranking import Search
from postproc.identify.unnamed import with_patterns
from postproc.identify.whole import Missing, formed_anew, worth
from postproc.patterns.suspects import Suspect


def contested(search: Search, base: Fit, missing: list[Missing]) -> list[Missing]:
    """The named effects that do more than mend a pattern; the search is left with them and the patterns beside them.

    A law that nobody knows is never met exactly, and what is left of it looks like one effect or another. So each
    effect is taken out in turn and the patterns are found anew: it goes where as many of them, of the same channels at
    the same places, leave nothing for it that a smooth function of the same channels there does not tell as well, and
    the first of them tells more than the effect would in its place. And it goes where those that stand beside it leave
    nothing for it: half of a law has brought it in.
    """
    if not missing:
        return missing
    left = with_patterns(search)
    while left.outside:
        rivals = []
        for one in (m for m in missing if base.model.effect(m.candidate.key) is None):
            others = [m for m in missing if m is not one]
            without = replace(left, fit=left.only(base, [m.candidate for m in others]))
            if without.fit.set_aside == left.fit.set_aside:
                both = (left.fit, without.fit)
                if (alone := _worth(one, *both, without.fit, [])) <= 0:
                    rivals.append((alone, without, others))
                    continue
                rival = with_patterns(without, len(left.outside))
                stands_for = alike(left.outside, rival.outside)
                if stands_for and rival.outside[0].evidence > _worth(one, *both, rival.beside([]).fit, []):
                    rivals.append((_worth(one, *both, rival.fit, rival.outside), rival, others))
        least = min(rivals, key=lambda r: r[0], default=None)
        if least is None or least[0] > 0:
            break
        _, left, missing = least
        left = max(with_patterns(left), left, key=lambda one: worth(base, one, missing))
    search.fit, search.outside = left.fit, left.outside
    return missing


def formed_beside(search: Search, base: Fit, missing: list[Missing]) -> list[Missing]:
    """What is missing, each effect formed anew beside the patterns, and these found anew where that changed something.

    A line of a gear that is named in the end leaves nothing to the pattern that stood for it.
    """
    anew = formed_anew(search, base, missing) if search.outside else missing
    if anew is not missing:
        left = with_patterns(search)
        search.fit, search.outside = left.fit, left.outside
    return anew


def _worth(one: Missing, whole: Fit, without: Fit, seen: Fit, free: Sequence[Suspect]) -> float:
    """What a name is worth on a fit without it, at the price of its own search.

    Args:
        whole, without: with and without it; seen: without it, with other patterns beside; free: those of them that may
            be of any smooth shape.
    """
    key, linear, problem = one.candidate.key, seen.linear, seen.problem
    for suspect in free:
        linear = linear.extended(suspect.freely(problem))
    effect = whole.model.effect(key) or one.candidate.effect
    fitted = np.isin(np.arange(len(effect.vector())), [i for k, i in whole.parameters if k == key])
    after = linear.extended(problem.columns(effect, fitted))
    # What holds a free function lets it have fewer parameters than it has coefficients.
    own = max(whole.linear.parameters - without.linear.parameters, 1)
    fall, count = linear.square - after.square, min(after.parameters - linear.parameters, own)
    return schwarz(linear.square, fall, count, linear.freedom, np.exp(one.candidate.searched / 2))


def alike(some: Sequence[Suspect], others: Sequence[Suspect]) -> bool:
    """Whether some patterns stand for others, if any: for each of these one of its channels at its place."""
    return bool(others) and all(
        any(one.where == s.where and set(one.channels) & set(s.channels) for one in some) for s in others
    )
