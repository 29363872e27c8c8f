"""The search for what a model lacks: the best by log evidence, confirmed on rows held out, again; and one pass back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from postproc.effects.base import Effect
from postproc.effects.sums import SumOfTerms
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.solve import Terms
from postproc.identification.acceptance import (
    CLEARLY,
    convincing,
    judged,
    predicts_better,
    refit,
    within_noise,
)
from postproc.identification.candidates.candidate import Candidate
from postproc.identification.candidates.composition import compose
from postproc.identification.indistinguishable import indistinguishable
from postproc.identification.state import SearchState
from postproc.patterns.place import with_and_without_a_row
from postproc.patterns.suspects import Suspect

MOST_EFFECTS = 6
"""Effects and patterns that are taken at most."""
PATTERNS = 3
"""Patterns that stand beside one another at most."""


def search(start: SearchState) -> SearchState:
    """Return the state with what the model lacks: effects of the library, and patterns without a name where they win.

    Every effect in its best form, and every pattern, is judged on what the fit leaves. That of the largest log evidence
    is taken if it is significant and held-out rows confirm it; everything is refitted; again until nothing significant
    is left. After one pass back (`backward`), the search goes on once more: with effects alone, or with one pattern
    fewer if there is a pattern. The result stays if the log evidence of the whole is larger.
    """
    state = backward(forward(start))
    if not (state.keys or state.outside):
        return state
    bare, most = state.beside(()), len(state.outside) - 1
    other = forward(bare, most=PATTERNS if most < 0 else 0)
    if other is bare:
        return state
    other = backward(other) if most < 0 else with_patterns(backward(other), most)
    return max(state, other, key=lambda s: s.log_evidence)


def forward(state: SearchState, named: bool = True, most: int = PATTERNS) -> SearchState:
    """Return the state with effects and patterns added one by one, always that of the largest log evidence.

    What held-out data does not confirm is tried again once another one is in the model.

    Args:
        named: whether effects are tried, or patterns only; most: how many patterns at most.
    """
    refused: set[str] = set()
    for _ in range(MOST_EFFECTS):
        ranked = state.ranked if named else []
        best: Candidate | Suspect | None = next((c for c in ranked if c.key not in refused and convincing(c)), None)
        asked = 0.0 if best is None else best.evidence
        left = state.patterns_left(asked) if most else []
        pattern = next((s for s in left if s.key not in refused), None)
        if pattern is not None and pattern.evidence > asked:
            if len(state.outside) == most:
                break
            best = pattern
        if best is None:
            break
        taken = accepted(state, best)
        state, refused = (taken, set()) if taken is not None else (state, refused | {best.key})
    return state


def accepted(state: SearchState, best: Candidate | Suspect) -> SearchState | None:
    """Return the state with an effect or a pattern, everything refitted; None where the data does not confirm it.

    Regions of the joint space that the fit has not seen must be predicted better. Where more than noise is left,
    neighbouring poses share errors that make anything significant: then the gain must exceed `CLEARLY` standard errors
    over the regions.
    """
    taken = state.beside((*state.outside, best)) if isinstance(best, Suspect) else _with_effect(state, best)
    if taken is None or not predicts_better(taken.fit, state.fit, 0.0 if within_noise(taken.fit) else CLEARLY):
        return None
    return taken


def _with_effect(state: SearchState, best: Candidate) -> SearchState | None:
    """Return the state with an effect; None where it lives on a single row, or is worth nothing once it is fitted."""
    before = state.fit
    whole, less = with_and_without_a_row(before.linear, best.columns(before.problem))
    if best.evidence + min(0.0, less - whole) < 0:
        return None
    after = refit(before, best)
    taken = best if after is None else judged(before, after, best)
    return None if after is None or taken.evidence < 0 else state.with_effect(taken, after)


def backward(state: SearchState) -> SearchState:
    """Return the state after a backward pass: each effect stays, goes, or is replaced, by the evidence of the whole.

    An effect that was taken first was judged on a residual that contained the others, too. So each is taken out in
    turn; the patterns are found anew; and the best may then be the same effect in another form, another one, or none.
    Where that changed something, the pass begins again with what is left.
    """
    done: set[str] = set()
    for _ in range(MOST_EFFECTS**2):
        one = next((m for m in state.missing if m.key not in done and m.key not in state.given), None)
        if one is None:
            break
        done.add(one.key)
        bare = state.without(one.key)
        mine = next((c for c in bare.ranked if c.key == one.key), None)
        needed = mine is not None and convincing(mine)
        rivals = [*([state] if needed else []), *_instead(state, bare, one, mine if needed else None)]
        best = max(rivals, key=lambda s: s.log_evidence, default=state)
        if best is not state:
            state, done = best, set()
            continue
        alike, unseen = indistinguishable(bare.ranked, one, bare.fit, state.fit)
        state = state.told(replace(one, alike=alike, unseen=unseen))
    return state


def _instead(state: SearchState, bare: SearchState, one: Candidate, mine: Candidate | None) -> Iterator[SearchState]:
    """Yield states that may replace a state as to one effect: without it, or with something else in its place.

    That may be the effect in another form, the effect of the largest evidence, or a freer function. The state without
    the effect is yielded where it is not needed, or where patterns may explain the same and both fits set the same rows
    aside.

    Args:
        bare: the state without the effect; one: the effect as it was taken.
        mine: the effect as it would be taken beside the others; None where it is not needed.
    """
    effect = state.fit.model.effect(one.key)
    empty = with_patterns(bare, len(state.outside)) if state.outside else bare
    if mine is None or (state.outside and empty.fit.excluded == state.fit.excluded):
        yield empty
    if len(state.missing) + len(state.outside) > 1:
        if mine is not None and mine.label != one.label and mine.effect.roughness() is None:
            yield from filter(None, [accepted(bare, mine)])
        others = (c for c in bare.ranked if c.key not in state.keys and convincing(c))
        other = next(others, None)
        if other is not None and (mine is None or other.evidence > mine.evidence):
            yield from filter(None, [accepted(bare, other)])
    for kept, key in effect.generalised() if isinstance(effect, SumOfTerms) else ():
        part = bare if kept is None else bare.with_effect(*_only(bare, one, kept))
        found = compose(part.screen, part.fit.linear, key) if key in state.classes else None
        yield from filter(None, [None if found is None else accepted(part, found)])


def _only(bare: SearchState, one: Candidate, kept: Effect) -> tuple[Candidate, Fit]:
    """Return an effect reduced to some of its terms, and the fit with these alone.

    Args:
        bare: the state without the effect; one: the effect as it was taken; kept: the effect with the terms to keep.
    """
    fit, free = bare.fit, np.ones(len(kept.vector()), dtype=bool)
    terms = Terms({**fit.free, one.key: free}, fit.strength)
    after = fit_model(fit.model, fit.data, [kept], noise=fit.noise.stated, terms=terms)
    return replace(one, effect=kept, free=free, fit=None), after


def with_patterns(state: SearchState, most: int = PATTERNS) -> SearchState:
    """Return the state with its patterns searched anew, at most ``most``, each the strongest beside those before it."""
    return forward(state.beside(()), named=False, most=most)
