"""Whether an effect that was fitted in full is worth it, and what else would explain the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.identify.fit import fit_model
from postproc.identify.fitted import Fit
from postproc.identify.forms import DECADES, WIDE, ordinary, schwarz
from postproc.identify.linear import Linear, basis_of, f_test
from postproc.identify.selection import Candidate, Screen, columns_of, corrected, linear_part
from postproc.identify.sensitivity import at_least_ordinary
from postproc.identify.solve import SETTLED

SIGNIFICANT = 5e-3
"""Chance of a false alarm allowed for an effect after counting everything that was tried."""
MATERIAL = 0.01
"""An effect must explain at least this share of what is left, however many rows make it significant."""
QUIET = 1.2
"""Residual variance, in that of the repeats, at which no other start can be better."""
CLOSE = 8.0
"""Effects whose evidence differs by less than this (odds of 50 to 1) are not separable with this data."""


def with_amplitudes(screen: Screen, linear: Linear, candidate: Candidate) -> Effect:
    """The candidate's effect at the amplitudes that the linear problem suggests, inside its bounds."""
    mask = linear_part(candidate.effect, candidate.free)
    size = ordinary(screen.problem.model, candidate.effect, mask)
    columns = columns_of(screen, linear, candidate.effect, candidate.free)
    s2 = max(linear.square - candidate.fall, 1e-12) / max(linear.freedom - candidate.count, 1)
    gram = columns.T @ linear.project(columns) + s2 / WIDE**2 * np.eye(columns.shape[1])
    x = candidate.effect.vector().copy()
    x[mask] += size * np.linalg.solve(gram, columns.T @ linear.rest)
    low, high = candidate.effect.bounds()
    return candidate.effect.with_vector(np.clip(x, low, high))


def refit(base: Fit, screen: Screen, linear: Linear, candidate: Candidate, closely: float = SETTLED) -> Fit | None:
    """The model with a candidate, everything fitted again, from where it was judged; None where that fails."""
    if candidate.fit is not None:
        model, new = candidate.fit.model, candidate.effect
    else:
        model, new = base.model, with_amplitudes(screen, linear, candidate)
        if type(new).load is not Effect.load:
            # The columns stood for springs that are not stiffer than is ordinary, and so must the start.
            model = model.with_effects(*(at_least_ordinary(model, e) for e in model.effects))
    try:
        return fit_model(
            model,
            base.data,
            [new],
            free={**base.free, candidate.key: candidate.free},
            noise=base.noise.position if base.noise.origin == "user" else None,
            penalty={k: v for k, v in base.strength.items() if k != candidate.key},
            closely=closely,
        )
    except PostprocError:
        return None


def fitted_best(
    base: Fit, screen: Screen, linear: Linear, candidate: Candidate, closely: float = SETTLED
) -> tuple[Candidate, Fit] | None:
    """The best of a candidate's starts after full fits, with its fit; None where none settles."""
    found: list[tuple[Candidate, Fit]] = []
    for start in candidate.starts or (candidate,):
        after = refit(base, screen, linear, start, closely)
        if after is not None:
            found.append((judged(base, after, start), after))
            if after.noise.position is not None and after.variance < QUIET:
                break
    return max(found, key=lambda pair: pair[0].evidence, default=None)


def judged(base: Fit, after: Fit, candidate: Candidate) -> Candidate:
    """The candidate with the fall of its full refit in place of the linear one."""
    before = base.linear.square
    rest = min(after.linear.square, before)
    freedom = base.linear.freedom
    linear = max(before - candidate.fall, 1e-12 * before)
    gained = freedom * float(np.log(linear / max(rest, 1e-12 * before)))
    effect = after.model.effect(candidate.key) or candidate.effect
    p = candidate.p_value
    if gained > 0:
        # F statistics of the linear test, with the residual that the full refit reaches.
        p = min(p, corrected(f_test(before, rest, candidate.count, freedom - candidate.count), candidate.searched))
    if (candidate.free & candidate.effect.amplitudes()).sum() > candidate.count:
        p = candidate.p_value
    if candidate.curved:
        # The linear evidence belongs to the start, not to where the fit has moved a knee or a compliance.
        worth = settled(before, rest, freedom, after, candidate.key) - candidate.searched
    else:
        worth = candidate.evidence + gained
    free = after.free.get(candidate.key, candidate.free)
    return replace(candidate, effect=effect, free=free, evidence=worth, fall=before - rest, p_value=p, fit=after)


def settled(before: float, rest: float, freedom: int, after: Fit, key: str) -> float:
    """What an effect is worth at the end of a full fit, 2 log of odds, all its parameters counted by what they move.

    nu log(S / (S' + s^2 |a/w|^2)) - log det(I + W C^T M C W / s^2): Laplace's approximation of the marginal likelihood,
    with S and S' the sums of squares without the effect and with it, C its columns at the fit, a its amplitudes, and W
    how far each parameter scatters: amplitudes by three ordinary sizes, or decades off as in `gains`, what only forms
    the effect by its own size. A point or a knee that the data hardly sees costs hardly anything.
    Source: MacKay (2003), Ch. 27.

    Args:
        before, rest: S and S'. freedom: nu. key: of the effect in the fit ``after``.
    """
    effect = after.model.effect(key)
    own = np.array([k == key for k, _ in after.parameters])
    index = np.array([i for k, i in after.parameters if k == key], dtype=int)
    if effect is None or not len(index):
        return -np.inf
    x, scale = effect.vector()[index], ordinary_sizes(effect, after.model.robot)[index]
    amplitude = effect.amplitudes()[index]
    others = Linear(after.problem.residual, basis_of(after.columns[:, ~own], after.penalty[~own]), after.problem.row)
    s2 = rest / max(freedom - len(index), 1)
    columns = after.columns[:, own]
    gram = columns.T @ others.project(columns)
    worth = -np.inf
    for decade in DECADES:
        wide = np.where(amplitude, WIDE * decade * scale, np.maximum(np.abs(x), scale))
        strength = np.maximum(np.linalg.eigvalsh(gram * np.outer(wide, wide)), 0.0)
        far = s2 * float(np.sum((x[amplitude] / wide[amplitude]) ** 2))
        gained = freedom * np.log(before / max(rest + far, 1e-12 * before)) - np.sum(np.log1p(strength / s2))
        worth = max(worth, float(gained) - 2 * abs(float(np.log(decade))))
    return worth


def convincing(candidate: Candidate, base: Fit, effects: int) -> bool:
    """Worth its parameters, significant after counting effects and forms, and large enough to matter."""
    before = base.linear.square
    return candidate.evidence > 0 and candidate.p_value * effects < SIGNIFICANT and candidate.fall > MATERIAL * before


def confusable(ranking: Sequence[Candidate], chosen: Candidate, before: Linear) -> tuple[str, ...]:
    """Effects that explain the same data nearly as well as the chosen one.

    Either their evidence is close, or Schwarz's criterion is, which knows nothing of ordinary sizes and of how many
    forms were tried: what does the same by the data is said to do so, however much less ordinary it is.

    Args:
        before: the fit without any of them.
    """

    def plain(c: Candidate) -> float:
        return schwarz(before.square, c.fall, c.count, before.freedom, 1.0)

    return tuple(
        c.key
        for c in ranking
        if c.key != chosen.key
        and c.evidence > 0
        and (c.evidence > chosen.evidence - CLOSE or plain(c) > plain(chosen) - CLOSE)
    )
