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
from postproc.identification.acceptance import CLEARLY, convincing, judged, predicts_better, refit, within_noise
from postproc.identification.indistinguishable import indistinguishable
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.composition import compose
from postproc.identification.screen.place import with_and_without_a_row
from postproc.identification.state import SearchState

MOST_EFFECTS = 6
"""Effects and curves that are added at most."""
MOST_CURVES = 3
"""Curves that stand in a model at most."""


def search(start: SearchState) -> SearchState:
    """Return the state with what the model lacks: effects of the library, and curves without a name where they win.

    Every effect in its best form, and every curve, is judged on what the fit leaves. That of the largest log evidence
    is added if it is significant and held-out rows confirm it; everything is refitted; again until nothing significant
    remains. After one pass back (`backward`), the search goes on once more: with effects alone, or with one curve fewer
    if there is a curve. The result stays if the log evidence of all that was added is larger.
    """
    state = backward(forward(start))
    if not (state.keys or state.curves):
        return state
    bare, most = state.with_curves(()), len(state.curves) - 1
    other = forward(bare, most=MOST_CURVES if most < 0 else 0)
    if other is bare:
        return state
    other = backward(other) if most < 0 else with_curves_anew(backward(other), most)
    return max(state, other, key=lambda s: s.log_evidence)


def forward(state: SearchState, named: bool = True, most: int = MOST_CURVES) -> SearchState:
    """Return the state with effects and curves added one by one, always that of the largest log evidence.

    What held-out data does not confirm is tried again once another one is in the model.

    Args:
        named: whether effects of the library are tried, or curves only; most: how many curves at most.
    """
    refused: set[str] = set()
    for _ in range(MOST_EFFECTS):
        if not named and len(state.curves) == most:
            break
        best = next(state.candidates(refused, named, most > 0), None)
        if best is None or (best.curve is not None and len(state.curves) == most):
            break
        added = accepted(state, best)
        state, refused = (added, set()) if added is not None else (state, refused | {best.name})
    return state


def accepted(state: SearchState, best: Candidate) -> SearchState | None:
    """Return the state with a candidate added, everything refitted; None where the data does not confirm it.

    Regions of the joint space that the fit has not seen must be predicted better. Where more than noise remains,
    neighbouring poses share errors that make anything significant: then the gain must exceed `CLEARLY` standard errors
    over the regions.
    """
    added = _with_effect(state, best) if best.curve is None else state.with_curves((*state.curves, best))
    if added is None or not predicts_better(added.fit, state.fit, 0.0 if within_noise(added.fit) else CLEARLY):
        return None
    return added


def _with_effect(state: SearchState, best: Candidate) -> SearchState | None:
    """Return the state with an effect; None where it lives on a single row, or is worth nothing once it is fitted."""
    before = state.fit
    all_rows, less = with_and_without_a_row(before.linear, best.columns(before.problem))
    if best.evidence + min(0.0, less - all_rows) < 0:
        return None
    after = refit(before, best)
    added = best if after is None else judged(before, after, best)
    return None if after is None or added.evidence < 0 else state.with_effect(added, after)


def backward(state: SearchState) -> SearchState:
    """Return the state after a backward pass: each effect stays, goes, or is replaced, by the evidence of all together.

    An effect that was added first was judged on a residual that contained the others, too. So each is taken out in
    turn; the curves are found anew; and the best may then be the same effect in another form, another one, or none.
    Where that changed something, the pass begins again with what is there then.
    """
    done: set[str] = set()
    for _ in range(MOST_EFFECTS**2):
        one = next((m for m in state.missing if m.key not in done and m.key not in state.keys_of_base), None)
        if one is None:
            break
        done.add(one.key)
        without = state.without(one.key)
        readded = next((c for c in without.ranked if c.key == one.key), None)
        needed = readded is not None and convincing(readded)
        rivals = [*([state] if needed else []), *_replacements(state, without, one, readded if needed else None)]
        best = max(rivals, key=lambda s: s.log_evidence, default=state)
        if best is not state:
            state, done = best, set()
            continue
        similar, unseen = indistinguishable(without.ranked, one, without.fit, state.fit)
        state = state.with_rivals(replace(one, rivals=similar, unseen=unseen))
    return state


def _replacements(
    state: SearchState, without: SearchState, one: Candidate, readded: Candidate | None
) -> Iterator[SearchState]:
    """Yield states that may replace a state as to one effect: without it, or with something else in its place.

    That may be the effect in another form, the effect of the largest evidence, or a freer function. The state without
    the effect is yielded where it is not needed, or where curves may explain the same and both fits set the same rows
    aside.

    Args:
        without: the state without the effect; one: the effect as it was added.
        readded: the effect as it would be added beside the others; None where it is not needed.
    """
    effect = state.fit.model.effect(one.key)
    empty = with_curves_anew(without, len(state.curves)) if state.curves else without
    if readded is None or (state.curves and empty.fit.excluded == state.fit.excluded):
        yield empty
    if len(state.missing) + len(state.curves) > 1:
        if readded is not None and readded.label != one.label and readded.effect.roughness() is None:
            yield from filter(None, [accepted(without, readded)])
        others = (c for c in without.ranked if c.key not in state.keys and convincing(c))
        other = next(others, None)
        if other is not None and (readded is None or other.evidence > readded.evidence):
            yield from filter(None, [accepted(without, other)])
    for kept, key in effect.generalised() if isinstance(effect, SumOfTerms) else ():
        part = without if kept is None else without.with_effect(*_reduced(without, one, kept))
        freer = compose(part.screen, part.fit.linear, key) if key in state.classes else None
        yield from filter(None, [None if freer is None else accepted(part, freer)])


def _reduced(without: SearchState, one: Candidate, kept: Effect) -> tuple[Candidate, Fit]:
    """Return an effect reduced to some of its terms, and the fit with these alone.

    Args:
        without: the state without the effect; one: the effect as it was added; kept: the effect with the terms to keep.
    """
    fit, free = without.fit, np.ones(len(kept.vector()), dtype=bool)
    terms = Terms({**fit.free, one.key: free}, fit.strength)
    after = fit_model(fit.model, fit.data, [kept], noise=fit.noise.stated, terms=terms)
    return replace(one, effect=kept, free=free, fit=None), after


def with_curves_anew(state: SearchState, most: int = MOST_CURVES) -> SearchState:
    """Return the state with its curves searched anew, at most ``most``, each the strongest beside those before it."""
    return forward(state.with_curves(()), named=False, most=most)


def without_redundant_names(state: SearchState) -> SearchState:
    """Return the state without names that its curves leave nothing to tell; where it has no curves, as it is.

    An effect that was added early was judged on what the curves explain now. So each that is worth less than the
    strongest of them, the weakest first, is judged again beside them: it goes where curves found anew in its place, one
    more than before, have the larger log evidence, or where the same curves alone predict regions that the fit has not
    seen as well.
    """
    for one in sorted(state.missing, key=lambda m: m.evidence):
        strongest = max((c.evidence for c in state.curves), default=-np.inf)
        if one.evidence > strongest or one.key in state.keys_of_base:
            continue
        less = state.without(one.key)
        better = predicts_better(state.fit, less.fit, 0.0 if within_noise(state.fit) else CLEARLY)
        other = with_curves_anew(less, len(state.curves) + 1)
        if not better or other.log_evidence > state.log_evidence:
            state = other
    return state
