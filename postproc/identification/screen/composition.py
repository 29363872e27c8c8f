"""The best composition of an effect's forms: score tests of all, then more of its own while each is worth it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.estimation.evidence import f_test
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.identification.screen.candidate import Candidate, Screen, kind
from postproc.identification.screen.forms import Form, Forms, columns_of, forms_nearby
from postproc.identification.screen.gain import DIM, Gain, gain, score_tests

STARTS_OF_EACH = 2
"""Starts of every law, pair of bodies .. from which what forms an effect is looked for."""


def compose(screen: Screen, linear: Linear, key: str) -> Candidate | None:
    """Return the best composition of an effect's forms: the best form, and further ones while each raises the evidence.

    The search runs from the best form on, and again among the forms with fewest amplitudes alone, so that nothing is
    fitted that only goes with the rest (all joints for the sake of three). None where no form moves anything.

    Args:
        screen: the forms of all effects; linear: the fit that leaves the residual; key: of the effect.
    """
    forms = screen.forms(key, None)
    price = _prices(screen.odds(key, None)) + screen.rarity(key)
    if not np.isfinite(price).any():
        return None
    measured = score_tests(screen.problem, linear, forms)
    evidence = measured.evidence - price
    best = int(np.argmax(evidence))
    seen = np.flatnonzero((measured.count > 0) & np.isfinite(price))
    if not len(seen):
        return _candidate(linear, screen.appended(forms[best], None), measured.of(best), float(price[best]))
    narrow = int(forms.width[seen].min())
    thin = seen[forms.width[seen] == narrow]
    # A free function grows finer, too.
    widest = np.inf if forms[best].effect.roughness() is not None else narrow
    starts = [(best, np.inf), *([(int(thin[np.argmax(evidence[thin])]), widest)] if len(thin) < len(seen) else [])]
    grown = [
        _grow(screen, linear, screen.appended(forms[i], None), measured.of(i), float(price[i]), widest=w)
        for i, w in dict.fromkeys(starts)
    ]
    chosen = replace(max(grown, key=lambda c: c.evidence), visible=float(measured.visible[seen].max()))
    if not chosen.curved:
        return chosen
    others = [_candidate(linear, forms[i], measured.of(i), float(price[i])) for i in _starts(forms, evidence)]
    return replace(chosen, starts=(chosen, *(c for c in others if c.forming and c.effect is not chosen.effect)))


def _prices(odds: Array) -> Array:
    """Return (M,) price of each form, 2 log of the prior odds against it among all M.

    A start of a knee or a point counts as a form: while an effect is small, the data does not know its knee, and the
    best of many is good by chance (Davies 1987).

    Args:
        odds: (M,) relative prior odds of the forms.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(2 * (np.log(max(odds.sum(), 1e-300)) - np.log(odds)))


def _starts(forms: Forms, evidence: Array) -> list[int]:
    """Return indices of the two best forms of every `kind` (law, pair of bodies ..), to optimize knees or points from.

    Args:
        evidence: (M,) log evidence of each form.
    """
    order = np.argsort(-evidence, kind="stable").tolist()
    kinds = [kind(form.effect) for form in forms]
    return [i for at, i in enumerate(order) if [kinds[k] for k in order[:at]].count(kinds[i]) < STARTS_OF_EACH]


def _grow(screen: Screen, linear: Linear, form: Form, first: Gain, price: float, *, widest: float) -> Candidate:
    """Return the candidate of a form with further forms of its effect, added while each raises the evidence.

    Args:
        linear: the fit without the effect; first: gain of the form; price: 2 log of the prior odds against it.
        widest: number of amplitudes that a form may have at most to be added.
    """
    effect, free, labels, total = form.effect, form.refit, [form.label], first
    price += type(effect).unlikely
    columns = _columns(screen.problem, form, free)
    while True:
        if nearer := _sharpened(screen.problem, linear, effect, total, len(labels)):
            nearest, total, cost = nearer
            effect, labels, columns = nearest.effect, nearest.label.split("; "), nearest.columns(screen.problem)
            price += cost
        # As little as `gains` sees of a direction that the fitted parameters nearly make themselves.
        inner = linear.extended(columns, DIM**0.5)
        further = _further(screen, inner, form.key, effect, widest) if total.evidence > price else None
        if further is None:
            break
        option, cost = further
        mask = option.refit | free if kind(option.effect) == kind(effect) else option.refit
        wide = _columns(screen.problem, option, mask, columns)
        flexible = option.effect.roughness() is not None
        trial = gain(linear, wide, int((mask & ~option.effect.amplitudes()).sum()), flexible)
        if trial.evidence - cost <= total.evidence:
            break
        # A free function in another resolution is the same thing better said.
        labels = [*(labels[:-1] if flexible else labels), option.label]
        effect, free, total, columns = option.effect, mask, trial, wide
        price += cost
    label = "; ".join(text for text in labels if text)
    return _candidate(linear, replace(form, effect=effect, refit=free, label=label), total, price)


def _candidate(linear: Linear, form: Form, brought: Gain, price: float) -> Candidate:
    """Return a form as a candidate with its log evidence and p value.

    Args:
        brought: gain of the form; price: 2 log of the prior odds against finding it.
    """
    reduction, count, visible = float(brought.rss_reduction), int(brought.count), float(brought.visible)
    p = f_test(linear.square, linear.square - reduction, count, linear.freedom - count, price)
    evidence = float(brought.evidence) - price
    return Candidate(form.key, form.effect, form.refit, form.label, evidence, reduction, count, price, visible, p)


def _sharpened(
    problem: Problem, linear: Linear, effect: Effect, gain_: Gain, new: int
) -> tuple[Form, Gain, float] | None:
    """Return an effect with its new terms varied to where they explain most, its gain, and the price of the search.

    All new terms vary, since the first were found while the others were missing. None where nothing is better.

    Args:
        linear: the fit without the effect; gain_: gain of the present effect; new: how many of its last terms are new.
    """
    best, paid = None, 0.0
    while near := forms_nearby(problem, effect, new):
        odds = np.array([form.odds for form in near])
        costs, brought = 2 * np.log((1.0 + odds.sum()) / odds), score_tests(problem, linear, near)
        k = int(np.argmax(brought.evidence - costs))
        if brought.evidence[k] - costs[k] <= gain_.evidence:
            break
        best, effect, gain_, paid = near[k], near[k].effect, brought.of(k), paid + float(costs[k])
    return None if best is None else (best, gain_, paid)


def _further(screen: Screen, inner: Linear, key: str, effect: Effect, widest: float) -> tuple[Form, float] | None:
    """Return the best form to add to an effect, and its price; None where the evidence of none exceeds its price.

    Args:
        inner: the fit with the effect's columns; key: of the effect.
        widest: number of amplitudes that a form may have at most.
    """
    forms, prices = screen.forms(key, effect), _prices(screen.odds(key, effect))
    if not forms:
        return None
    evidence = np.where(forms.width <= widest, score_tests(screen.problem, inner, forms).evidence - prices, -np.inf)
    k = int(np.argmax(evidence))
    return None if evidence[k] <= 0 else (screen.appended(forms[k], effect), float(prices[k]))


def _columns(problem: Problem, form: Form, mask: NDArray[np.bool_], before: Array | None = None) -> Array:
    """Return `columns_of` for a form's effect and a mask (q,), put together from known columns where these are all.

    Args:
        before: (N, k) columns of the terms before the form's own, if any.
    """
    new_columns = form.columns(problem)
    joined = new_columns if before is None else np.hstack([before, new_columns])
    complete = joined.shape[1] == (mask & form.effect.amplitudes()).sum()
    return joined if complete else columns_of(problem, form.effect, mask)
