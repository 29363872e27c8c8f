"""How fine and how smooth a free function should be, chosen on rows that the fit has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.identify.fitted import Fit, rms
from postproc.identify.linear import contiguous_blocks, hold_out, soft_bases
from postproc.identify.problem import Problem

STRENGTHS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
ENOUGH = 8000
"""Measured numbers on which the choice is made; long records are thinned to that."""
NO_BETTER = 0.01
"""A finer function must bring the held-out error down by this share, or the coarser one is kept."""
IN_VAIN, COSTLY = 4, 300
"""Finer functions in a row that do not, before those of so many coefficients are left out."""


@dataclass(frozen=True)
class Smoothness:
    """A free function as the data can carry it: its resolution, with null amplitudes, and its strength."""

    effect: Effect
    strength: float


def choose_smoothness(fit: Fit, key: str) -> Smoothness:
    """Resolution and penalty of one free function with the smallest held-out error, without refitting the model.

    The fit is linear in the amplitudes near its solution: with y = r + A x the penalised problem
    min |y - A x|^2 + |w x|^2 is solved for every strength at once for all blocks, and its held-out residuals are exact.
    The penalty, not the number of coefficients, keeps the function smooth: more of them than rows do no harm.
    """
    effect = fit.model.effect(key)
    assert effect is not None
    few, y, others, soft = _beside(fit, key)
    blocks = contiguous_blocks(few.data.repeats)[few.row]
    scale = float(np.sqrt(max(fit.variance, 1e-12)))
    best, chosen, vain = np.inf, Smoothness(effect, scale), 0
    for form in effect.resolutions(fit.problem.sensitivity.state):
        rough = form.roughness()
        assert rough is not None
        if vain >= IN_VAIN and len(rough) > COSTLY:
            break
        A = np.hstack([others, few.columns(form, np.ones(len(rough), dtype=bool))])
        weights = np.concatenate([np.zeros(others.shape[1]), scale * rough / form.scale()])
        known = np.concatenate([soft, np.zeros(len(rough))])
        errors = [rms(e) for e in hold_out(y, *soft_bases(A, known, weights, STRENGTHS), blocks)]
        if min(errors) < (1 - NO_BETTER) * best:
            best, chosen, vain = min(errors), Smoothness(form, scale * STRENGTHS[int(np.argmin(errors))]), 0
        else:
            vain += 1
    return chosen


def _beside(fit: Fit, key: str) -> tuple[Problem, Array, Array, Array]:
    """Rows enough to choose on: the problem, y = r + A x, columns and penalties of all effects but one."""
    problem = fit.problem
    groups = fit.data.repeats
    kept = groups % max(1, -(-len(problem.residual) // ENOUGH)) == 0
    few = Problem(problem.model, fit.data.rows(kept), problem.weights.rows(kept))
    columns, y = [], few.residual.copy()
    for effect in few.model.effects:
        mask = np.zeros(len(effect.vector()), dtype=bool)
        mask[[i for k, i in fit.parameters if k == effect.key]] = True
        own = few.columns(effect, mask)
        y += own @ effect.vector()[mask]
        columns += [own] if effect.key != key else []
    soft = fit.penalty[[k != key for k, _ in fit.parameters]]
    return few, y, np.hstack(columns), soft
