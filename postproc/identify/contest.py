"""Names against patterns once the search is done: an effect goes that only mends a pattern without a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.identify.backward import terms_needed
from postproc.identify.candidate import Candidate
from postproc.identify.fitted import Fit
from postproc.identify.forms import schwarz
from postproc.identify.linear import Linear
from postproc.identify.ranking import Search
from postproc.identify.refits import refit_all
from postproc.identify.search import Missing, clear, worth_saying
from postproc.identify.suspects import Suspect

MOST = 3
"""Patterns that are taken one after another at most."""
MENDS = 0.1
"""A named effect beside a pattern must explain at least this share of all that stands above the noise.

A pattern that is a third off the law in places leaves a tenth of its square, which anything smooth can take up.
"""


@dataclass(frozen=True)
class _Whole:
    """Named effects, the patterns that they need beside them, and the sum of squares that both leave.

    Args:
        other: whether what they leave follows something else than these patterns.
    """

    named: tuple[Missing, ...]
    outside: tuple[Suspect, ...]
    square: float
    other: bool


def contested(search: Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """The named effects that do more than mend a pattern; the search is left with them and the patterns beside them.

    A law that nobody knows is never met exactly, and what is left of it looks like one effect or another. So each
    effect is taken out in turn and the patterns are found anew: it goes where patterns of the same channels then tell
    nearly as much. No pattern of another channel is looked for in order to take its place.
    """
    if not missing:
        return missing
    full = search.fit
    held = [m for m in missing if base.model.effect(m.candidate.key) is not None]
    best = _explained(search, full, tuple(m for m in missing if m not in held))
    noise_left = best.square if full.noise.position is None else min(best.square, float(len(full.linear.residual)))
    near = MENDS * (base.linear.square - noise_left)
    while best.named and best.outside:
        rivals = []
        for one in best.named:
            named = tuple(m for m in best.named if m is not one)
            dropped = [m.candidate for m in missing if m not in named and m not in held]
            fit = refit_all(base, full, [m.candidate for m in missing if m in named or m in held], noise)
            if fit.set_aside == full.set_aside:
                rivals.append(_explained(search, fit, named, best.outside, dropped))
        alike = (r for r in rivals if _tells_as_much(r, best, near))
        rival = min(alike, key=lambda r: r.square, default=best)
        if rival is best:
            break
        best = rival
    kept = [m for m in missing if m in best.named or m in held]
    if len(kept) < len(missing):
        search.fit = refit_all(base, full, [m.candidate for m in kept], noise)
    search.outside = list(best.outside)
    return kept if held else terms_needed(search, base, kept, noise)


def _tells_as_much(rival: _Whole, best: _Whole, near: float) -> bool:
    """Whether the patterns of another whole are like those of the best and leave hardly more.

    No more at all where what is left follows something else, and where they sit elsewhere: a casting that gives in
    every direction takes part of most effects.
    """
    at = {s.where for s in rival.outside}
    mended = not rival.other and all(s.where in at for s in best.outside)
    return all(akin(s, rival.outside) for s in best.outside) and rival.square - best.square <= near * mended


def _explained(
    search: Search,
    fit: Fit,
    named: tuple[Missing, ...],
    like: Sequence[Suspect] | None = None,
    dropped: Sequence[Candidate] = (),
) -> _Whole:
    """Named effects with the patterns that they need, the strongest first.

    As long as these are like some others, and tell more than a name that was dropped would.
    """
    outside: list[Suspect] = []
    linear, other = fit.linear, False
    while len(outside) < MOST:
        found = search.suspects(fit, linear)
        if not found or not clear(found[0], linear, worth_saying(fit)):
            break
        other = like is not None and not akin(found[0], like)
        if other:
            break
        if any(_named_worth(search.fit, linear, one) > found[0].evidence for one in dropped):
            break
        outside.append(found[0])
        linear = linear.extended(found[0].columns(fit.problem))
    return _Whole(named, tuple(outside), linear.square, other)


def _named_worth(full: Fit, linear: Linear, dropped: Candidate) -> float:
    """What a name is worth that a fit holds, in a linear problem without it, at the price of its own search."""
    columns = full.columns[:, [key == dropped.key for key, _ in full.parameters]]
    after = linear.extended(columns)
    count = after.parameters - linear.parameters
    return schwarz(linear.square, linear.square - after.square, count, linear.freedom, np.exp(dropped.searched / 2))


def akin(suspect: Suspect, others: Sequence[Suspect]) -> bool:
    """Whether a pattern follows a channel of another one, and not at another joint."""

    def elsewhere(other: Suspect) -> bool:
        return suspect.where != other.where and suspect.where.startswith("joint") and other.where.startswith("joint")

    return any(set(suspect.channels) & set(other.channels) and not elsewhere(other) for other in others)
