"""Names against patterns once the search is done: an effect stays only if no pattern tells the same with less."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.identify.fitted import Fit
from postproc.identify.judgement import settled
from postproc.identify.linear import Linear, basis_of, independent_share
from postproc.identify.search import Missing, Search, clear, refit_all, worth_saying
from postproc.identify.suspects import ODDS, Suspect

MOST = 3
"""Patterns that are taken one after another at most."""
MENDS = 0.1
"""A named effect beside a pattern must explain at least this share of all that is explained.

A pattern that is a third off the law in places leaves a tenth of its square, which anything smooth can take up.
"""


@dataclass(frozen=True)
class _Whole:
    """An explanation of what a finished fit is about.

    Args:
        fit: with everything that was found; named: which of it stays; outside: the patterns that are needed beside it.
        bare: what those named leave; linear: what is left with the patterns among the fitted parameters.
    """

    fit: Fit
    named: tuple[Missing, ...]
    outside: tuple[Suspect, ...]
    bare: Linear
    linear: Linear


def contested(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """The named effects that earn their place beside patterns without a name.

    Each is taken out in turn, and all together; the patterns that the rest needs are found anew, and of all wholes the
    one that is worth most stays. A named effect pays for the forms that were tried, a pattern for all patterns and the
    odds of what nobody has a name for (a free function of one joint as well), both for every parameter (Schwarz 1978).
    The search is left with that whole.
    """
    if not missing:
        return missing
    fit, every = search.fit, tuple(m for m in missing if base.model.effect(m.candidate.key) is None)

    def explained(named: tuple[Missing, ...]) -> _Whole:
        # What forms an effect, and what acts through springs, cannot be taken out of a linear problem.
        curved = any(m.candidate.curved for m in every if m not in named)
        rest = [m.candidate for m in missing if m in named or m not in every]
        if curved:
            return _explained(search, refit_all(base, fit, rest, noise), named, named)
        return _explained(search, fit, every, named)

    nothing, best = explained(()), explained(every)
    while best.named:
        less = [tuple(m for m in best.named if m is not one) for one in best.named]
        others = [explained(some) if some else nothing for some in less]
        rival = max([*others, nothing], key=lambda whole: _worth(whole, nothing, best))
        # Where the names leave nothing, it takes the odds of one more pattern to say that nobody has a name for it.
        sure = 0.0 if best.outside else ODDS
        if _worth(rival, nothing, best) <= _worth(best, nothing, rival) + sure:
            rival = min(others, key=lambda whole: whole.linear.square)
            if not _mended(nothing, best, rival):
                break
        best = rival
    kept = [m for m in missing if m in best.named or m not in every]
    if len(kept) < len(missing):
        search.fit = refit_all(base, fit, [m.candidate for m in kept], noise)
    search.outside = list(best.outside)
    return kept


def _explained(search: Search, fit: Fit, every: tuple[Missing, ...], named: tuple[Missing, ...]) -> _Whole:
    """Some of the effects that a fit has found, with the patterns that they still need, the strongest first."""
    bare = _left(fit, {m.candidate.key for m in every} - {m.candidate.key for m in named})
    whole = _Whole(fit, named, (), bare, bare)
    while len(whole.outside) < MOST:
        found = [s for s in search.suspects(fit, whole.linear) if not _has_a_name(s)]
        if not found or not clear(found[0], whole.linear, worth_saying(fit)):
            break
        linear = _counted(fit, whole.linear.extended(found[0].columns(fit.problem)))
        whole = replace(whole, outside=(*whole.outside, found[0]), linear=linear)
    return whole


def _has_a_name(suspect: Suspect) -> bool:
    """A wave of a joint's own angle is a gear's error: the library was asked for it."""
    own = suspect.channel[0] == "q" and suspect.where == f"joint {suspect.channel[1:]}"
    return own and suspect.pattern.startswith("wave") and " of " not in suspect.pattern


def _left(fit: Fit, dropped: set[str]) -> Linear:
    """The linear problem of a fit without some of its effects: y + A_o x_o beside the columns of the others.

    A_o are the columns of their amplitudes, x_o the values: nothing is fitted again.
    """
    if not dropped:
        return fit.linear
    values = {e.key: e.vector() for e in fit.model.effects}
    amplitude = {e.key: e.amplitudes() for e in fit.model.effects}
    x = np.array([values[key][i] for key, i in fit.parameters])
    out = np.array([key in dropped for key, _ in fit.parameters])
    back = (out & np.array([amplitude[key][i] for key, i in fit.parameters])) | (fit.penalty > 0)
    y = fit.problem.residual + fit.columns[:, back] @ x[back]
    return _counted(fit, Linear(y, basis_of(fit.columns[:, ~out], fit.penalty[~out]), fit.problem.row))


def _counted(fit: Fit, linear: Linear) -> Linear:
    turns = fit.problem.whiten(fit.problem.sensitivity.matrix[:, :, :6])
    return replace(linear, independent=independent_share(linear.rest, turns, linear.row))


def _worth(whole: _Whole, nothing: _Whole, beside: _Whole) -> float:
    """2 log of the odds of a whole, by the independent numbers of what the better one of two leaves."""
    better = min(whole, beside, key=lambda w: w.linear.square)
    freedom, left = better.linear.freedom, whole.linear.square
    each = float(np.log(freedom))
    free = [m for m in whole.named if m.candidate.effect.roughness() is not None]
    searched = sum(m.candidate.searched for m in whole.named) + ODDS * len(free)
    own = sum(-settled(left, left, freedom, whole.fit, m.candidate.key) for m in whole.named)
    # A name has the benefit of the doubt: its parameters cost what they move at ordinary sizes, or Schwarz's price.
    cost = min(own, (whole.bare.parameters - nothing.bare.parameters) * each)
    cost += (whole.linear.parameters - whole.bare.parameters) * each
    gained = freedom * float(np.log(nothing.bare.square / left))
    return gained - cost - searched - sum(s.price for s in whole.outside)


def _mended(nothing: _Whole, best: _Whole, rival: _Whole) -> bool:
    """Whether what the rival does without only mends a pattern: a law that nobody knows is never met exactly."""
    left = best.linear.square
    return bool(best.outside and rival.outside) and rival.linear.square - left < MENDS * (nothing.bare.square - left)
