"""The search for missing effects: forward with full refits, rivals without a name, and back again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.effects.base import Effect
from postproc.identify.fitted import Fit
from postproc.identify.forms import Form, schwarz
from postproc.identify.judgement import MATERIAL, confusable, convincing, fitted_best, judged, refit
from postproc.identify.linear import Linear
from postproc.identify.patterns import Patterns
from postproc.identify.refits import refit_all
from postproc.identify.selection import Candidate, Screen, compose
from postproc.identify.shaped import formed
from postproc.identify.solve import ROUGHLY
from postproc.identify.suspects import Suspect, find_suspects
from postproc.identify.tried import ODDS

MOST = 6
"""Effects that are added one after another at most."""
NEAR = 0.9
"""Share of the best evidence from which a rival is fitted in full: columns do not foretell large effects exactly."""


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Args:
        candidate: what it is; held_out_after: held-out rms once it and those before it are in [m].
        not_separable: effects that explain this data nearly as well.
    """

    candidate: Candidate
    held_out_after: float
    not_separable: tuple[str, ...]


@dataclass
class Search:
    """The state of the search: the fit so far, what was added, and patterns outside the library."""

    fit: Fit
    classes: Mapping[str, type[Effect]]
    patterns: Patterns
    outside: list[Suspect]
    cache: dict[tuple[bytes, tuple[str, ...]], dict[str, list[Form]]] = field(default_factory=dict)
    seen: dict[tuple[float, int, int], list[Suspect]] = field(default_factory=dict)

    def screen(self) -> Screen:
        fresh = {k: forms for k, forms in self._made().items() if self.fit.model.effect(k) is None}
        return Screen(self.fit.problem, self.classes, fresh, self.fit.free)

    def remember(self, screen: Screen) -> None:
        self._made().update({k: forms for k, forms in screen.first.items() if self.fit.model.effect(k) is None})

    def _made(self) -> dict[str, list[Form]]:
        """Forms are made once for the rows in use and the springs that loads act on.

        Other refits move their columns by no more than a few parts in a thousand.
        """
        springs = tuple(e.key for e in self.fit.model.effects if "load" in e.reads)
        return self.cache.setdefault((self.fit.problem.weights.used.tobytes(), springs), {})

    def suspects(self, fit: Fit, linear: Linear) -> list[Suspect]:
        """What the rest of a fit follows, strongest first; looked for once in each linear problem."""
        key = (linear.square, linear.parameters, linear.freedom)
        if key not in self.seen:
            self.seen[key] = find_suspects(fit.problem, linear, self.patterns)
        return self.seen[key]

    def linear(self) -> Linear:
        linear = self.fit.linear
        for suspect in self.outside:
            linear = linear.extended(suspect.columns(self.fit.problem))
        return linear


def ranking(search: Search) -> list[Candidate]:
    """Every testable effect at its best on the present fit, best first.

    Those that a linear problem cannot judge after a full refit, and so all that come near the best.
    """
    screen, linear = search.screen(), search.linear()
    found = [c for key in search.classes if (c := compose(screen, linear, key)) is not None]
    search.remember(screen)
    if not found or search.outside:
        return sorted((_nested(c, found) for c in found), key=lambda c: -c.evidence)

    def settled(candidate: Candidate) -> Candidate:
        best = fitted_best(search.fit, screen, linear, candidate, ROUGHLY)
        return replace(candidate, evidence=-np.inf) if best is None else best[0]

    if _audible(search.fit):
        found = [formed(screen, linear, c) if c.far else c for c in found]
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
    return fit.noise.position is None or rest > freedom + 3 * np.sqrt(2 * max(freedom, 1))


def _nested(candidate: Candidate, found: list[Candidate]) -> Candidate:
    """What stands beside another effect that is missing as well is worth nothing before that one is in.

    Every arm winds up in its joints: what else bends, a model without those springs cannot tell.
    """
    beside = type(candidate.effect).beside
    first = any(c.key == beside and c.evidence > 0 for c in found)
    return replace(candidate, evidence=min(candidate.evidence, 0.0)) if first else candidate


def select_forward(search: Search, first: list[Candidate]) -> list[Missing]:
    """Effects of the library one after another; patterns without a name where they explain the data better than that.

    Where a pattern beat a named effect on the way, the search goes on from there once more with the pattern taken, and
    the whole that is worth more is kept: early on, a pattern may only look better because other effects are missing.
    """
    forks: list[_Fork] = []
    named = replace(search, outside=[])
    missing = _select(named, first, [], forks)
    for fork in forks:
        other = _select(fork.search, fork.ranked, fork.missing, None)
        if _worth(search.fit.linear, fork.search, other) > _worth(search.fit.linear, named, missing):
            named, missing = fork.search, other
    search.fit, search.outside, search.classes = named.fit, named.outside, named.classes
    return missing


def _worth(before: Linear, search: Search, missing: list[Missing]) -> float:
    """What a finished search explains of the base's residual, less its parameters and what its parts are unlikely.

    A pattern costs the odds of something without a name, a named effect half of them: five weak effects that stand in
    for one smooth pattern lose against it.
    """
    after = search.linear()
    added = max(after.parameters - before.parameters, 1)
    gained = schwarz(before.square, before.square - after.square, added, before.freedom, 1.0)
    return gained - ODDS * (len(search.outside) + 0.5 * len(missing))


@dataclass(frozen=True)
class _Fork:
    """A search where a pattern is worth more than the best named effect."""

    search: Search
    ranked: list[Candidate]
    missing: list[Missing]


def _select(
    search: Search, ranked: list[Candidate], missing: list[Missing], forks: list[_Fork] | None
) -> list[Missing]:
    """One effect or pattern after another.

    Args:
        forks: where names go before patterns that beat them, and the first such place is kept; None where patterns go
            before.
    """
    for _ in range(MOST):
        best = next((c for c in ranked if convincing(c, search.fit, len(search.classes))), None)
        suspects = search.suspects(search.fit, search.linear())
        outside = suspects[0] if suspects and clear(suspects[0], search.linear(), worth_saying(search.fit)) else None
        beaten = best is not None and outside is not None and outside.evidence > best.evidence
        if beaten and forks == []:
            forks.append(_Fork(replace(search), ranked, missing))
        if best is not None and not (beaten and forks is None):
            taken = _take(search, best, ranked)
            if taken is None:
                search.classes = {k: c for k, c in search.classes.items() if k != best.key}
            else:
                missing = [m for m in missing if m.candidate.key != best.key] + [taken]
        elif outside is not None and len(search.outside) < 3:
            search.outside = [*search.outside, outside]
        else:
            break
        ranked = ranking(search)
    return missing


def _take(search: Search, best: Candidate, ranked: list[Candidate]) -> Missing | None:
    """The effect in the model, everything refitted.

    None where rows that the fit has not seen are not predicted better.
    """
    screen = search.screen()
    after = refit(search.fit, screen, search.linear(), best)
    if after is None or after.held_out_rms >= search.fit.held_out_rms:
        return None
    before, search.fit = search.fit, after
    return Missing(judged(before, after, best), after.held_out_rms, confusable(ranked, best, before, after))


def worth_saying(fit: Fit) -> float:
    """Share of the residual that a pattern must explain: more where no repeats tell how much of it is noise."""
    return 3 * MATERIAL if fit.noise.position is not None else 15 * MATERIAL


def clear(suspect: Suspect, linear: Linear, share: float) -> bool:
    """Whether a pattern is worth its search and explains a share of what is left."""
    return suspect.evidence > 0 and suspect.fall > share * linear.square


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
            after = refit(without, trial.screen(), trial.linear(), better)
            enough = (1 + MATERIAL) * search.fit.held_out_rms if needed else without.held_out_rms
            if after is not None and after.held_out_rms < enough:
                alike = confusable(rivals, better, without, after)
                missing[at] = Missing(judged(without, after, better), after.held_out_rms, alike)
                search.fit = after
                at += 1
                continue
        if mine is None or not needed:
            missing = [m for m in missing if m.candidate.key != one.key]
            search.fit, at = without, 0
            continue
        missing[at] = replace(missing[at], not_separable=confusable(rivals, mine, without, search.fit))
        at += 1
    return missing
