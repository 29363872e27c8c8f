"""The search for missing effects, forward: the best named one, or a pattern without a name, one after another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.fit.fitted import Fit
from postproc.fit.leftover import SLOW
from postproc.fit.worth import schwarz
from postproc.identify.alike import CLOSE, confusable
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import MATERIAL, convincing, judged, predicts_better, reaches_further, refit, white
from postproc.identify.ranking import NEAR, Search, ranking
from postproc.identify.selection import columns_of
from postproc.identify.whole import Missing, formed_anew, left_by, worth
from postproc.measure.trajectory import is_record
from postproc.patterns.place import with_and_without_a_row
from postproc.patterns.suspects import Suspect
from postproc.patterns.tried import ODDS

MOST = 6
"""Effects that are added one after another at most."""
PATTERNS = 3
"""Patterns that stand beside one another at most."""


def select_forward(search: Search, first: list[Candidate]) -> list[Missing]:
    """Effects of the library one after another; patterns without a name where they explain the data better than that.

    Where a pattern beat a named effect on the way, or nearly and further parts were needed or more is left than the
    noise, the search goes on from there once more with the pattern taken, and stays there where the whole is worth
    clearly more: early on, a pattern may only look better because other effects are missing, and two names together may
    tell what one pattern tells.
    """
    base, named = search.fit, replace(search, outside=[])
    missing, fork = _select(named, base, first, [], True)
    named, missing = _plainer(search, first, named, missing, fork)
    if fork is not None and (fork.more or fork.parts < len(missing) + len(named.outside) or _more_left(named.fit)):
        reached = worth(base, named, missing) + CLOSE
        beside, other = fork.way or fork.gone(base, _Rival(named.fit, reached))
        if worth(base, beside, other) > reached:
            named, missing = beside, other
    search.fit, search.outside, search.classes = named.fit, named.outside, named.classes
    return missing


def _plainer(
    search: Search, first: list[Candidate], named: Search, missing: list[Missing], fork: _Fork | None
) -> tuple[Search, list[Missing]]:
    """A finished search, or the one without what it took first where that can take the shape of plainer effects.

    Both ends of a hose and its slack are eight numbers: where another name came near it, the search is made without it,
    too, and the whole that is worth more stays. One name alone has lost against it already.
    """
    key = missing[0].candidate.key if missing and missing[0].candidate.far else ""
    best = next((c.evidence for c in first if c.key == key), np.inf)
    others = [c for c in first if c.key != key]
    if not any(c.evidence > NEAR * best for c in others):
        return named, missing
    rest = replace(search, outside=[], classes={k: c for k, c in search.classes.items() if k != key})
    before = search.fit
    reached = worth(before, named, missing)
    rival = max((r for r in (_Rival(named.fit, reached), fork and fork.rival) if r), key=lambda r: r.worth)
    plain, _ = _select(rest, before, others, [], True, rival)
    if len(plain) < 2 or worth(before, rest, plain) <= reached:
        return named, missing
    rest.classes = named.classes
    return rest, plain


@dataclass(frozen=True)
class _Rival:
    """Another way of a search that was gone to its end: its fit, and what a way must be worth to be preferred to it."""

    fit: Fit
    worth: float

    def beats(self, base: Fit, search: Search, missing: list[Missing]) -> bool:
        """Whether a way cannot be worth so much any more, even if it came to leave no more than noise.

        That is what a finished way leaves, less the odds of a pattern, or less what stands above the noise, if known.
        """
        above = max(1.0, self.fit.variance) if self.fit.noise.position is not None else 1.0
        left = left_by(base, self.fit) / above * float(np.exp(-ODDS / base.linear.freedom))
        return worth(base, search, missing, min(left, left_by(base, search.fit))) <= self.worth


@dataclass
class _Fork:
    """Where a pattern is worth as much as the best name but for the odds.

    Args:
        more: whether it is worth more than the name, odds counted.
        way: what a search comes to with it; rival: to the way without. Where the pattern is far ahead, they come first.
    """

    search: Search
    outside: Suspect
    missing: list[Missing]
    more: bool
    way: tuple[Search, list[Missing]] | None = None
    rival: _Rival | None = None

    @property
    def parts(self) -> int:
        return len(self.missing) + len(self.search.outside) + 1

    def gone(self, base: Fit, rival: _Rival | None = None) -> tuple[Search, list[Missing]]:
        """The search with the pattern, as far as it may be worth more than a rival."""
        beside = self.search.beside([*self.search.outside, self.outside])
        missing, _ = _select(beside, base, None, self.missing, False, rival)
        return beside, missing

    def first(self, base: Fit) -> _Rival:
        """The same to its end, as what another way must nearly be worth."""
        self.way = self.gone(base)
        self.rival = _Rival(self.way[0].fit, worth(base, *self.way) - CLOSE)
        return self.rival


def _select(
    search: Search,
    base: Fit,
    known: list[Candidate] | None,
    missing: list[Missing],
    first: bool,
    rival: _Rival | None = None,
) -> tuple[list[Missing], _Fork | None]:
    """One effect or pattern after another, and where a pattern came near a name that went before it.

    Args:
        base: the model as it came. known: the ranking, where it has been worked out.
        first: whether a name goes before the first pattern that comes near it. rival: what it must be worth more
            than; a pattern far ahead of the name is one.
    """
    fork: _Fork | None = None
    refused: set[str] = set()
    for _ in range(MOST):
        if rival is not None and rival.beats(base, search, missing):
            break
        ranked = ranking(search) if known is None else known
        fresh = (c for c in ranked if c.key not in refused)
        best = next((c for c in fresh if convincing(c, search.fit, len(search.classes))), None)
        anew = missing if best is None or search.outside or refused else formed_anew(search, base, missing)
        if anew is not missing:
            missing, known = anew, None
            continue
        # Patterns that cannot come near the name need not be known better than that.
        least = 0.0 if best is None else best.evidence - (ODDS if first and fork is None else 0.0)
        outside = next(iter(clear(search, max(0.0, least))), None)
        lead = outside.evidence - best.evidence if best is not None and outside is not None else float("-inf")
        if first and fork is None and outside is not None and lead > -ODDS:
            fork = _Fork(replace(search), outside, missing, lead > 0)
            if best is not None and rival is None and lead > best.evidence:
                rival = fork.first(base)
        elif lead > 0:
            best = None
        if best is None and (outside is None or len(search.outside) == PATTERNS):
            break
        if best is not None:
            taken = _take(search, _one_or_more(search, best), ranked)
            if taken is None:
                known = ranked
                refused.add(best.key)
                continue
            missing = _with(missing, taken)
        elif (anew := missing if search.outside or refused else formed_anew(search, base, missing)) is not missing:
            missing = anew
        elif outside is not None:
            more = search.beside([*search.outside, outside])
            search.fit, search.outside = more.fit, more.outside
        known, refused = None, set()
    return missing, fork


def _with(missing: list[Missing], taken: Missing) -> list[Missing]:
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


def _one_or_more(search: Search, best: Candidate) -> Candidate:
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


def _take(search: Search, best: Candidate, ranked: list[Candidate]) -> Missing | None:
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


def _more_left(fit: Fit) -> bool:
    """Whether more is left than the noise, where that is known."""
    return fit.noise.position is not None and fit.unexplained > 0


def with_patterns(search: Search, most: int = PATTERNS) -> Search:
    """A search with the patterns that its fit leaves, found anew: each the strongest once those before it are taken."""
    left = search.beside([])
    while len(left.outside) < most and (found := clear(left)):
        left = search.beside([*left.outside, found[0]])
    return left


def clear(search: Search, asked: float = 0.0) -> list[Suspect]:
    """The patterns that are worth their search and explain a share of what is left, strongest first.

    Only those that are worth what is asked are sure to be found. Where no repeats tell how much of it is noise, more:
    what one function of the angles leaves looks like another one. What follows the time from pose to pose is not the
    arm's.
    """
    fit, linear = search.fit, search.fit.linear
    known, poses = fit.noise.position is not None, not is_record(fit.data.state)

    def enough(suspect: Suspect) -> bool:
        slow = poses and {*SLOW, "row"}.issuperset(suspect.channels)
        return suspect.fall > (3 if known or slow else 15) * MATERIAL * linear.square

    return [s for s in search.suspects(linear, asked) if s.evidence > 0 and enough(s)]
