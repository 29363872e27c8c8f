"""Every effect at its best on what a fit leaves, best first."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from postproc.effects.base import Effect
from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.linear import Linear
from postproc.fit.solve import ROUGHLY, Terms
from postproc.identify.candidate import Candidate, Screen, Stock
from postproc.identify.judgement import fitted_best
from postproc.identify.refits import refit_all
from postproc.identify.selection import compose
from postproc.identify.shaped import formed
from postproc.patterns.every import Patterns
from postproc.patterns.suspects import Look, Suspect, look

NEAR = 0.9
"""Share of the best evidence from which a rival is fitted in full: columns do not foretell large effects exactly."""


@dataclass
class Search:
    """The state of the search: the fit so far, what was added, and patterns outside the library."""

    fit: Fit
    classes: Mapping[str, type[Effect]]
    patterns: Patterns
    outside: list[Suspect]
    cache: dict[bytes, Stock] = field(default_factory=dict)
    followed: dict[Hashable, Look] = field(default_factory=dict)
    ranked: dict[Hashable, list[Candidate]] = field(default_factory=dict)
    looks: dict[Hashable, tuple[Any, ...]] = field(default_factory=dict)
    apart: dict[Hashable, tuple[Fit, Fit]] = field(default_factory=dict)

    def screen(self) -> Screen:
        problem = self.fit.problem
        used = problem.weights.used.tobytes()
        self.cache[used] = self.cache.get(used, Stock()).at(problem.weights)
        return Screen(problem, self.classes, self.fit.free, self.cache[used])

    def suspects(self, linear: Linear, asked: float = 0.0) -> list[Suspect]:
        """What the rest of a fit follows, strongest first (`Look`); looked for once in each linear problem."""
        like = f"{linear.square:.5g}", linear.parameters, linear.freedom
        if like not in self.followed:
            self.followed[like] = look(self.fit.problem, linear, self.patterns)
        return self.followed[like].suspects(asked)

    def beside(self, outside: list[Suspect]) -> Search:
        """The search with other patterns beside the fit, and everything fitted again.

        Without any, the fit that they were put beside, if nothing has been named since; else one in which what only
        forms an effect stays as it is: what the patterns tell would bend it.
        """
        if list(map(id, outside)) == list(map(id, self.outside)):
            return self
        known = id(self.fit), *map(id, outside)
        if known not in self.looks:
            fit = self.fit
            moves = np.concatenate([one.moves for one in outside], axis=2) if outside else None
            free = {e.key: fit.free[e.key] & (bool(outside) | e.amplitudes()) for e in fit.model.effects}
            terms = Terms(free, fit.strength, False, ROUGHLY, frozenset(fit.parameters), moves)
            after = fit_model(fit.model, fit.data, noise=fit.noise.stated, terms=terms)
            self.looks[known] = after, fit, *outside
            bare = self.looks.get((id(fit),), (None,))[0] if self.outside else fit
            if bare is not None:
                self.looks[(id(after),)] = bare, after
        return replace(self, fit=self.looks[known][0], outside=outside)

    def only(self, base: Fit, some: Sequence[Candidate]) -> Fit:
        """The base with some of the effects that were found (`refit_all`); fitted once for each fit of the whole."""
        like = id(self.fit), frozenset(c.key for c in some)
        if like not in self.apart:
            self.apart[like] = self.fit, refit_all(base, self.fit, some, base.noise.stated)
        return self.apart[like][1]


def ranking(search: Search) -> list[Candidate]:
    """Every testable effect at its best on the present fit, best first; worked out once for the same parts."""
    linear = search.fit.linear
    held = sorted(e.key for e in search.fit.model.effects)
    parts = f"{linear.square:.3g}", linear.parameters, *held, *search.classes
    if parts not in search.ranked:
        search.ranked[parts] = _ranking(search)
    return search.ranked[parts]


def _ranking(search: Search) -> list[Candidate]:
    """Every testable effect at its best, best first.

    Those that a linear problem cannot judge after a full refit, and so all that come near the best.
    """
    screen, linear = search.screen(), search.fit.linear
    found = [c for key in search.classes if (c := compose(screen, linear, key)) is not None]
    if not found:
        return []

    def settled(candidate: Candidate) -> Candidate:
        best = fitted_best(search.fit, screen, candidate, ROUGHLY)
        return replace(candidate, evidence=-np.inf) if best is None else best[0]

    if _audible(search.fit):
        least = max(0.0, 0.5 * max(c.evidence for c in found))
        found = [formed(screen, linear, c, least) if c.far else c for c in found]
    near = max(0.0, NEAR * max(c.evidence for c in found))
    found = [settled(c) if c.forming and c.evidence > near else c for c in found]
    near = max(0.0, NEAR * max(c.evidence for c in found))
    rivals = [c for c in found if c.evidence > near]
    if len(rivals) > 1:
        found = [settled(c) if c in rivals and c.fit is None else c for c in found]
    return sorted((_nested(c, found) for c in found), key=lambda c: -c.evidence)


def _audible(fit: Fit) -> bool:
    """Whether more is left than the noise, as far as that is known."""
    rest, freedom = fit.linear.square, fit.linear.freedom
    return fit.noise.sigma is None or rest > freedom + 3 * np.sqrt(2 * max(freedom, 1))


def _nested(candidate: Candidate, found: list[Candidate]) -> Candidate:
    """What stands beside another effect that is missing as well is worth nothing before that one is in.

    Every arm winds up in its joints: what else bends, a model without those springs cannot tell.
    """
    beside = type(candidate.effect).beside
    first = any(c.key == beside and c.evidence > 0 for c in found)
    return replace(candidate, evidence=min(candidate.evidence, 0.0)) if first else candidate
