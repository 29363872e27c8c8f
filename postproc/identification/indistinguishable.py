"""What the data does not tell from an effect that was found: what explains the same, and what hides behind it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.estimation.evidence import CLOSE_EVIDENCE, ROUNDING_SHARE, schwarz
from postproc.estimation.fitted import Fit
from postproc.estimation.linear import Linear
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.gain import DIM

PARTS, SHARE = 20, 0.7
"""Random parts of the poses that are asked, and how many poses each has."""
MOST_ALTERNATIVES = 8
"""Rivals that are asked, the best by evidence first."""
TELLING_SQUARE = 9.0
"""Square of the deviations by which two effects must differ to be told apart."""
FREE_PENALTY_SHARE = 1e-3
"""Share of its penalty that a free function keeps where it is asked what it could do."""


def indistinguishable(
    ranking: Sequence[Candidate], chosen: Candidate, before: Fit, after: Fit
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return keys of effects that explain the data nearly as well as the chosen one, and of those hidden behind it.

    An effect explains it nearly as well where its log evidence is close, or Schwarz's criterion is, which does not
    depend on ordinary sizes and on how many forms were tried; or where some poses alone would have favoured it
    (`contenders`). Hidden is an effect of which the fit with the chosen one can do most.

    Args:
        ranking: every effect on the fit without the chosen one; before: that fit; after: the fit with it.
    """
    linear = before.linear

    def plain(c: Candidate) -> float:
        """Return the candidate's log evidence by Schwarz's criterion."""
        return float(schwarz(linear.square, linear.square - c.rss_reduction, c.count, linear.freedom))

    others = [c for c in ranking if c.key != chosen.key and c.evidence > 0]
    least, least_plain = chosen.evidence - CLOSE_EVIDENCE, plain(chosen) - CLOSE_EVIDENCE
    similar = {c.key for c in others if c.evidence > least or plain(c) > least_plain}
    similar |= set(contenders(ranking, chosen, before))
    further = [c for c in others if c.key not in similar]
    problem, free = after.problem, after.basis(FREE_PENALTY_SHARE) if further else None
    relaxed = after.linear if free is None else Linear(problem.residual, free, problem.row)
    unseen = tuple(c.key for c in further if _hidden(c, before, after, relaxed))
    return tuple(c.key for c in others if c.key in similar), unseen


def _hidden(candidate: Candidate, before: Fit, after: Fit, relaxed: Linear) -> bool:
    """Return whether a fit without an effect can do most of what the effect would explain on its own.

    Along directions v_i of its amplitudes that are independent before (v_i^T C^T M C v_i = 1) and after, it explains
    (v_i^T C^T M y)^2, of which the fit with the chosen effect leaves the share l_i: below a few times the noise nobody
    can tell the two apart. A free function can do anything, and is never called hidden.

    Args:
        before, after: the fits without and with the chosen effect.
        relaxed: the latter as a linear problem, its free functions hardly penalised.
    """
    effect = candidate.effect
    if effect.roughness() is not None or after.model.effect(candidate.key) is not None:
        return False
    alone, further = (candidate.columns(fit.problem) for fit in (before, after))
    value, vector = np.linalg.eigh(alone.T @ before.linear.project(alone))
    seen = value > DIM * np.max(value, initial=0.0)
    unit = vector[:, seen] / np.sqrt(value[seen])
    remaining, turn = np.linalg.eigh(unit.T @ (further.T @ relaxed.project(further)) @ unit)
    explained = (turn.T @ unit.T @ (alone.T @ before.linear.projected_residual)) ** 2
    # What is no more than noise says nothing: many such directions are not one effect that hides.
    hidden = (explained > TELLING_SQUARE * after.variance) & (explained * remaining < TELLING_SQUARE * after.variance)
    return bool(explained[hidden].sum() > 0.5 * explained.sum())


def contenders(ranking: Sequence[Candidate], chosen: Candidate, before: Fit) -> list[str]:
    """Return keys of effects with more evidence than the chosen one on any of twenty random parts of the poses.

    Log evidence assumes rows that are independent given the model. Where the model misses more than noise, a difference
    of evidence says less than it seems, and other poses would have favoured another effect: what resampling does not
    settle, the data does not tell (stability selection: Meinshausen and Buehlmann 2010). On each part, the gain nu
    log(S / S') is computed anew, and the price of an effect stays as it is.

    Args:
        ranking: every effect on the fit without the chosen one; before: that fit.
    """
    rivals = [c for c in ranking if c.key != chosen.key and c.evidence > 0 and c.effect.roughness() is None]
    rivals = rivals[:MOST_ALTERNATIVES]
    if not rivals:
        return []
    compared = [next((c for c in ranking if c.key == chosen.key), chosen), *rivals]
    linear, groups = before.linear, before.data.repeats[before.linear.row]
    columns = [c.columns(before.problem) for c in compared]

    def evidence_on(kept: NDArray[np.bool_]) -> Array:
        """Return (c,) gain of each effect on a part of the rows."""
        basis, y = np.linalg.qr(linear.nuisance[kept])[0], linear.residual[kept]
        residual = y - basis @ (basis.T @ y)
        before, falls = float(residual @ residual), [_fall(some[kept], basis, residual) for some in columns]
        after = np.maximum(before - np.array(falls), ROUNDING_SHARE * before)
        return np.asarray(np.mean(kept) * linear.freedom * np.log(before / after))

    paid = evidence_on(np.ones(len(groups), dtype=bool)) - [c.evidence for c in compared]
    poses, random = np.unique(groups), np.random.default_rng(0)
    parts = [random.choice(poses, round(SHARE * len(poses)), replace=False) for _ in range(PARTS)]
    evidence = np.array([evidence_on(np.isin(groups, some)) - paid for some in parts])
    won = np.asarray((evidence[:, 1:] > evidence[:, :1]).any(axis=0))
    return [c.key for c, wins in zip(rivals, won, strict=True) if wins]


def _fall(columns: Array, basis: Array, residual: Array) -> float:
    """Return by how much columns (N, m) lower the sum of squares of a residual (N,) beside a fit.

    Args:
        basis: (N, k) orthonormal basis of the columns of that fit; rest: the residual.
    """
    projected = columns - basis @ (basis.T @ columns)
    length = np.linalg.norm(projected, axis=0)
    unit = np.linalg.qr(projected[:, length > 0] / length[length > 0])[0]
    return float(np.sum((unit.T @ residual) ** 2))
