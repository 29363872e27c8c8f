"""One way of the search: an effect or a pattern without a name after another, as long as more is worth it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.fit.fitted import Fit
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import convincing
from postproc.identify.ranking import Search, ranking
from postproc.identify.taking import one_or_more, take, together
from postproc.identify.unnamed import PATTERNS, clear
from postproc.identify.whole import Missing, formed_anew, left_by, worth, worth_if_left
from postproc.patterns.suspects import Suspect
from postproc.patterns.tried import ODDS

MOST = 6
"""Steps of a way at most."""


@dataclass(frozen=True)
class Way:
    """What one way of the search has taken so far; every step gives another one.

    Args:
        base: the model as it came. search: the fit with what was taken, the patterns of that, and what may be taken.
        missing: the effects that were taken. steps: that are left.
        known: every effect on the fit, where that has been worked out; refused: those that the fit does not take.
    """

    base: Fit
    search: Search
    missing: list[Missing] = field(default_factory=list)
    steps: int = MOST
    known: list[Candidate] | None = None
    refused: frozenset[str] = frozenset()

    @cached_property
    def ranked(self) -> list[Candidate]:
        return ranking(self.search) if self.known is None else self.known

    @property
    def parts(self) -> int:
        return len(self.missing) + len(self.search.outside)

    @property
    def worth(self) -> float:
        return worth(self.base, self.search, self.missing)

    def to_end(self, rival: Rival | None = None) -> Way:
        """The better of a name and a pattern in every step, as long as a rival may be beaten."""
        return self._until(np.inf, rival)[0]

    def to_fork(self, rival: Rival | None = None) -> tuple[Way, Fork | None]:
        """As far as no pattern comes near a name, and what may be taken there; without that at the end."""
        return self._until(-ODDS, rival)

    def _until(self, lead: float, rival: Rival | None) -> tuple[Way, Fork | None]:
        """As far as no pattern is worth so much more than a name (or less, where negative)."""
        way = self
        while way.steps and not (rival and rival.beats(way)):
            name = way._name()
            if (name or way._pattern()) and (anew := way._formed_anew()):
                way = anew
                continue
            # A pattern that is too far behind the name is not looked for.
            pattern = way._pattern(0.0 if name is None else name.evidence + min(0.0, lead))
            if name and pattern and pattern.evidence - name.evidence > lead:
                return way, Fork(name, pattern)
            better = max((one for one in (name, pattern) if one), key=lambda one: one.evidence, default=None)
            if better is None or (better is pattern and len(way.search.outside) == PATTERNS):
                break
            way = way.take(better)
        return way, None

    def _name(self) -> Candidate | None:
        fresh = (c for c in self.ranked if c.key not in self.refused)
        return next((c for c in fresh if convincing(c, self.search.fit, len(self.search.classes))), None)

    def _pattern(self, least: float = 0.0) -> Suspect | None:
        return next(iter(clear(self.search, max(0.0, least))), None)

    def _formed_anew(self) -> Way | None:
        """With the effects formed anew beside one another (`whole.formed_anew`), before the first pattern."""
        if self.search.outside or self.refused:
            return None
        search = replace(self.search)
        missing = formed_anew(search, self.base, self.missing)
        return None if missing is self.missing else self._on(search, missing)

    def take(self, one: Candidate | Suspect) -> Way:
        """With an effect or a pattern in the fit; where the fit does not take the effect, the same that knows so."""
        if isinstance(one, Suspect):
            return self._on(self.search.beside([*self.search.outside, one]), self.missing)
        search = replace(self.search)
        taken = take(search, one_or_more(search, one), self.ranked)
        if taken is not None:
            return self._on(search, together(self.missing, taken))
        refused = self.refused | {one.key}
        return replace(self, search=search, steps=self.steps - 1, known=self.ranked, refused=refused)

    def _on(self, search: Search, missing: list[Missing]) -> Way:
        return Way(self.base, search, missing, self.steps - 1)


@dataclass(frozen=True)
class Fork:
    """Where a pattern comes near the best name: either may be taken."""

    name: Candidate
    pattern: Suspect

    @property
    def lead(self) -> float:
        """How much more the pattern is worth."""
        return self.pattern.evidence - self.name.evidence


@dataclass(frozen=True)
class Rival:
    """A way that was gone to its end: its fit, and what another one must be worth to be preferred to it."""

    fit: Fit
    worth: float

    def beats(self, way: Way) -> bool:
        """Whether a way cannot be worth so much any more, even if it came to leave no more than noise.

        That is what a finished way leaves, less the odds of a pattern, or less what stands above the noise, if known.
        """
        above = max(1.0, self.fit.variance) if self.fit.noise.sigma is not None else 1.0
        noise = left_by(way.base, self.fit) / above * float(np.exp(-ODDS / way.base.linear.freedom))
        left = min(noise, left_by(way.base, way.search.fit))
        return worth_if_left(left, way.base, way.search, way.missing) <= self.worth
