"""What effects are worth on what a fit leaves, fitted in full where a linear problem cannot judge them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.evidence import DECADES, ROUNDING_SHARE
from postproc.estimation.fitted import Fit
from postproc.estimation.held_out import neighbouring_blocks
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear, basis_of
from postproc.estimation.problem import Problem, at_least_ordinary
from postproc.estimation.solving.determined import WIDE
from postproc.estimation.solving.solve import ROUGHLY, SETTLED, Terms
from postproc.identification.screen.candidate import Candidate, Screen
from postproc.identification.screen.composition import compose
from postproc.identification.screen.forms import ordinary
from postproc.identification.screen.gain import laplace
from postproc.identification.screen.nonlinear import refit_form
from postproc.model.arm import Model

SIGNIFICANT = 5e-3
"""Chance of a false alarm allowed for an effect, everything that was tried counted; of 22 poses a stricter one misses
effects that are there."""
NEARLY_AS_GOOD = 0.9
"""Share of the best evidence from which a rival is fitted in full: columns do not foretell large effects exactly."""
CLEARLY = 2.0
"""Standard errors over parts of the joint space by which those left out must be predicted better where more than noise
is left."""


def with_amplitudes(problem: Problem, linear: Linear, candidate: Candidate) -> Effect:
    """Return a candidate's effect with the amplitudes that best fit what the fit leaves, clipped at its bounds.

    Args:
        problem: the fitted model beside the data; linear: the same fit as a linear problem.
    """
    mask = candidate.free & candidate.effect.amplitudes()
    size = ordinary(problem.model, candidate.effect, mask)
    columns = candidate.columns(problem)
    s2 = max(linear.square - candidate.rss_reduction, 1e-12) / max(linear.freedom - candidate.count, 1)
    weak = s2 / (WIDE * DECADES[-1]) ** 2 * np.eye(columns.shape[1])
    x = candidate.effect.vector().copy()
    x[mask] += size * np.linalg.solve(columns.T @ linear.project(columns) + weak, columns.T @ linear.projected_residual)
    low, high = candidate.effect.bounds()
    return candidate.effect.with_vector(np.clip(x, low, high))


def refit(base: Fit, candidate: Candidate, closely: float = SETTLED) -> Fit | None:
    """Return the base model with a candidate's effect, everything fitted again; None where the fit fails.

    Amplitudes with values that no arm can have are set to null, and the rest is fitted again.

    Args:
        closely: the fit ends at a step that lowers the sum of squares by less than this share.
    """
    if candidate.fit is not None:
        model, new = candidate.fit.model, candidate.effect
    else:
        model, new = base.model, candidate.effect
        if new.is_null:
            new = with_amplitudes(base.problem, base.linear, candidate)
        if type(new).load is not Effect.load:
            # The columns stood for springs that are not stiffer than is ordinary, and so must the start.
            model = model.with_effects(*(at_least_ordinary(model, e) for e in model.effects))
    strength = {k: v for k, v in base.strength.items() if k != candidate.key}

    def fitted(start: Model, effect: Effect, free: NDArray[np.bool_]) -> Fit | None:
        """Return the base with an effect, its parameters ``free`` fitted from these values; None where that fails."""
        masks, known = {**base.free, candidate.key: free}, frozenset(base.parameters)
        terms = Terms(masks, strength, closely=closely, determined=known)
        try:
            return fit_model(start, base.data, [effect], noise=base.noise.stated, terms=terms)
        except PostprocError:
            return None

    after = fitted(model, new, candidate.free)
    if after is None or not (none := impossible(after, candidate.key)).any():
        return after
    # What no arm can be is held at null, and the rest fitted again, if anything is left.
    refitted = after.model.effect(candidate.key) or new
    movable = candidate.free & ~none
    if not (movable & refitted.amplitudes()).any():
        return after
    possible = refitted.with_vector(np.where(none, refitted.null_vector(), refitted.vector()))
    return fitted(after.model, possible, movable) or after


def impossible(fit: Fit, key: str) -> NDArray[np.bool_]:
    """Return (q,) mask of an effect's parameters with values that no arm can have.

    Those are values that `Effect.impossible` names, those farther from null than `Parameter.most` says, and amplitudes
    that stopped at a bound other than null. The mask is empty where the model has no such effect.
    """
    effect = fit.model.effect(key)
    if effect is None:
        return np.zeros(0, dtype=bool)
    far = np.abs(effect.vector() - effect.null_vector()) > effect.layout.most * ordinary_sizes(effect, fit.model.robot)
    none = far | effect.impossible(fit.model.robot, {e.key: e for e in fit.model.effects})
    stopped = np.isin(np.arange(len(none)), [i for k, i in fit.at_bound if k == key])
    return np.asarray(none | (stopped & effect.amplitudes() & (effect.vector() != effect.null_vector())))


def fitted_best(
    base: Fit, screen: Screen, candidate: Candidate, closely: float = SETTLED
) -> tuple[Candidate, Fit] | None:
    """Return the best of a candidate's starts after full fits, with its fit; None where no fit succeeds.

    The first fit that leaves nothing but noise is the last one.

    Args:
        base: the fit without the candidate; screen: the forms of all effects on it; closely: as in `refit`.
    """
    fits: list[tuple[Candidate, Fit]] = []
    for start in refit_form(screen, base.linear, candidate).starts or (candidate,):
        after = refit(base, start, closely)
        if after is not None:
            fits.append((judged(base, after, start), after))
            if within_noise(after):
                break
    return max(fits, key=lambda pair: pair[0].evidence, default=None)


def judged(base: Fit, after: Fit, candidate: Candidate) -> Candidate:
    """Return the candidate with the log evidence and the fall of the sum of squares of its full refit.

    The evidence is -inf where the refit is physically impossible. What the refit leaves counts at the weights of the
    base, as it does for candidates that are not fitted in full: rows that only stand out beside this candidate stand
    out beside its rivals, too.

    Args:
        base: the fit without the candidate; after: the refit.
    """
    before = base.linear.square
    residual, reweighted = after.problem.residual, after.problem.weighted(base.problem.weights).residual
    remaining = min(after.linear.square + float(reweighted @ reweighted - residual @ residual), before)
    freedom = base.linear.freedom
    linear = max(before - candidate.rss_reduction, ROUNDING_SHARE * before)
    gained = freedom * float(np.log(linear / max(remaining, ROUNDING_SHARE * before)))
    effect = after.model.effect(candidate.key) or candidate.effect
    if candidate.curved:
        # The linear evidence belongs to the start, not to where the fit has moved a knee or a compliance.
        evidence = refit_evidence(base.linear, remaining, after, candidate.key) - candidate.price
    else:
        evidence = candidate.evidence + gained
    if impossible(after, candidate.key).any():
        evidence = -np.inf
    free = after.free.get(candidate.key, candidate.free)
    return replace(candidate, effect=effect, free=free, evidence=evidence, rss_reduction=before - remaining, fit=after)


def refit_evidence(base: Linear, remaining: float, after: Fit, key: str) -> float:
    """Return the log evidence for one effect of a full fit beside the base, all its parameters counted (`laplace`).

    Args:
        base: the fit without the effect; remaining: sum of squares that the full fit leaves.
        after: the full fit; key: of the effect.
    """
    effect = after.model.effect(key)
    of_effect = np.array([k == key for k, _ in after.parameters])
    index = np.array([i for k, i in after.parameters if k == key], dtype=int)
    if effect is None or not len(index):
        return -np.inf
    basis = basis_of(after.columns[:, ~of_effect], after.penalty[~of_effect])
    others = Linear(after.problem.residual, basis, after.problem.row)
    columns = after.columns[:, of_effect]
    return laplace(base, remaining, columns.T @ others.project(columns), effect, robot=after.model.robot, index=index)


def within_noise(fit: Fit) -> bool:
    """Return whether a fit leaves no more than the noise, by three standard deviations; False where it is not known."""
    remaining, freedom = fit.linear.square, fit.linear.freedom
    return fit.noise.sigma is not None and remaining <= freedom + 3 * np.sqrt(2 * max(freedom, 1))


def predicts_better(after: Fit, before: Fit, errors: float) -> bool:
    """Return whether one fit predicts regions of the joint space that it has not seen better than another.

    Poses that are alike share what a model lacks, so that anything flexible predicts one by the other; a real effect
    acts in all the joint space. So regions of it are left out in turn (`neighbouring_blocks`). Either the mean fall of
    the squared error over the regions must exceed ``errors`` of its standard errors, or its signed ranks must (Wilcoxon
    1945): these allow for a region that nothing but itself determines, and for one that gains far more than the others.

    Args:
        after: the fit that may be better; before: the other one; errors: how many standard errors, 0 for any gain.
    """
    blocks = neighbouring_blocks(before.data.fold_group, before.data.state.q)
    # `scipy.stats.wilcoxon` gives the same, but takes a second to load.
    gain = np.bincount(blocks, np.nansum(before.held_out_by(blocks) ** 2 - after.held_out_by(blocks) ** 2, axis=1))
    rank = 1.0 + np.argsort(np.argsort(np.abs(gain)))
    clearly = gain.mean() > errors * gain.std(ddof=1) / np.sqrt(len(gain))
    return bool(clearly or np.sign(gain) @ rank > errors * np.linalg.norm(rank))


def convincing(candidate: Candidate) -> bool:
    """Return whether a candidate has positive log evidence and a p value below `SIGNIFICANT`.

    The p value counts where few measured numbers are left to estimate the noise: there the evidence is too sure.
    """
    return candidate.evidence > 0 and candidate.p_value < SIGNIFICANT


def ranking(fit: Fit, screen: Screen) -> list[Candidate]:
    """Return every testable effect in its best form on the residual of a fit, the best by log evidence first.

    Those that a linear problem cannot judge, and all that come near the best, are judged by a full refit.

    Args:
        screen: the forms of all effects whose channels the data has, on that fit.
    """
    linear = fit.linear
    candidates = [c for key in screen.classes if (c := compose(screen, linear, key)) is not None]
    if not candidates:
        return []

    def fitted(candidate: Candidate) -> Candidate:
        """Return the candidate judged by full fits; -inf evidence where none succeeds."""
        best = fitted_best(fit, screen, candidate, ROUGHLY)
        return replace(candidate, evidence=-np.inf) if best is None else best[0]

    if not within_noise(fit):
        least = max(0.0, 0.5 * max(c.evidence for c in candidates))
        candidates = [refit_form(screen, linear, c, least) if c.far else c for c in candidates]
    near = max(0.0, NEARLY_AS_GOOD * max(c.evidence for c in candidates))
    alone = sum(c.evidence > near for c in candidates) == 1
    candidates = [fitted(c) if c.evidence > near and (c.forming or not alone) else c for c in candidates]
    return sorted((_nested(c, candidates) for c in candidates), key=lambda c: -c.evidence)


def _nested(candidate: Candidate, candidates: list[Candidate]) -> Candidate:
    """Return the candidate, with evidence of 0 at most where its class's `after` effect is missing as well.

    Every arm has compliant joints: how other parts bend cannot be judged by a model without those springs.

    Args:
        candidates: the candidates of all effects.
    """
    parent = type(candidate.effect).after
    first = any(c.key == parent and c.evidence > 0 for c in candidates)
    return replace(candidate, evidence=min(candidate.evidence, 0.0)) if first else candidate
