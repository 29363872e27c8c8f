"""The patterns without a name that a fit leaves."""

from __future__ import annotations

from postproc.fit.leftover import SLOW
from postproc.identify.judgement import MATERIAL
from postproc.identify.ranking import Search
from postproc.measure.trajectory import is_record
from postproc.patterns.suspects import Suspect

PATTERNS = 3
"""Patterns that stand beside one another at most."""


def clear(search: Search, asked: float = 0.0) -> list[Suspect]:
    """The patterns that are worth their search and explain a share of what is left, strongest first.

    Only those that are worth what is asked are sure to be found. Where no repeats tell how much of it is noise, more:
    what one function of the angles leaves looks like another one. What follows the time from pose to pose is not the
    arm's.
    """
    fit, linear = search.fit, search.fit.linear
    known, poses = fit.noise.sigma is not None, not is_record(fit.data.state)

    def enough(suspect: Suspect) -> bool:
        slow = poses and {*SLOW, "row"}.issuperset(suspect.channels)
        return suspect.fall > (3 if known or slow else 15) * MATERIAL * linear.square

    return [s for s in search.suspects(linear, asked) if s.evidence > 0 and enough(s)]


def with_patterns(search: Search, most: int = PATTERNS) -> Search:
    """A search with the patterns that its fit leaves, found anew: each the strongest once those before it are taken."""
    left = search.beside([])
    while len(left.outside) < most and (found := clear(left)):
        left = search.beside([*left.outside, found[0]])
    return left
