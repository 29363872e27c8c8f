"""The search for missing effects, forward: which of its ways is worth most."""

from __future__ import annotations

from dataclasses import replace

from postproc.fit.fitted import Fit
from postproc.identify.alike import CLOSE
from postproc.identify.candidate import Candidate
from postproc.identify.ranking import NEAR, Search
from postproc.identify.way import Rival, Way
from postproc.identify.whole import Missing


def select_forward(search: Search, first: list[Candidate]) -> list[Missing]:
    """Effects of the library one after another; patterns without a name where they explain the data better than that.

    Where a pattern first comes near a name, the name is taken. Where the pattern is worth more, or the names turn out
    to be more parts or leave more than the noise, the search goes on from there once more with the pattern taken, and
    stays there where the whole is worth clearly more: early on, a pattern may only look better because other effects
    are missing, and two names together may tell what one pattern tells. A pattern that is far ahead goes first, and
    the names only as far as they may come near it.

    Args:
        first: every effect on the model as it came.
    """
    start = Way(search.fit, replace(search, outside=[]), known=first)
    at, fork = start.to_fork()
    named, beside, rival = at, None, None
    if fork is not None:
        if fork.lead > fork.name.evidence:
            beside = at.take(fork.pattern).to_end()
            rival = Rival(beside.search.fit, beside.worth - CLOSE)
        named = at.take(fork.name).to_end(rival)
    best = _plainer(start, named, rival)
    if fork is not None and (fork.lead > 0 or at.parts + 1 < best.parts or _more_left(best.search.fit)):
        clearly = Rival(best.search.fit, best.worth + CLOSE)
        beside = beside or at.take(fork.pattern).to_end(clearly)
        best = beside if beside.worth > clearly.worth else best
    search.fit, search.outside, search.classes = best.search.fit, best.search.outside, best.search.classes
    return best.missing


def _plainer(start: Way, named: Way, rival: Rival | None) -> Way:
    """A finished way, or the one without what it took first where that can take the shape of plainer effects.

    Both ends of a hose and its slack are eight numbers: where another name came near it, the search is made without it,
    too, and the whole that is worth more stays. One name alone has lost against it already.
    """
    key = named.missing[0].candidate.key if named.missing and named.missing[0].candidate.far else ""
    hose = next((c for c in start.ranked if c.key == key), None)
    others = [c for c in start.ranked if c is not hose]
    if hose is None or not any(c.evidence > NEAR * hose.evidence for c in others):
        return named
    classes = {k: c for k, c in start.search.classes.items() if k != key}
    reached = named.worth
    rivals = [Rival(named.search.fit, reached), *([rival] if rival else [])]
    best = max(rivals, key=lambda r: r.worth)
    plain, fork = replace(start, known=others, search=replace(start.search, classes=classes)).to_fork(best)
    plain = plain if fork is None else plain.take(fork.name).to_end(best)
    if len(plain.missing) < 2 or plain.worth <= reached:
        return named
    return replace(plain, search=replace(plain.search, classes=named.search.classes))


def _more_left(fit: Fit) -> bool:
    """Whether more is left than the noise, where that is known."""
    return fit.noise.sigma is not None and fit.unexplained > 0
