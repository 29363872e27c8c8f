"""Which parameters the data determines, and the residual's slope by them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.asking import of_parameters
from postproc.effects.base import Effect
from postproc.estimation.priors import may_be_anywhere, prior_at
from postproc.estimation.problem import Problem
from postproc.estimation.solving.step import Masks, Name, Slope, sizes

WIDE = 3.0
"""Ordinary sizes by which parameters scatter: amplitudes about null, places about the origin of their body."""


def slope(
    problem: Problem, masks: Masks, frozen: set[Name], strength: Mapping[str, float], before: Collection[Name] = ()
) -> Slope:
    """Return the derivatives of the residual by all free parameters that the data determines.

    The others are unidentifiable: a change by ten ordinary sizes, or by the parameter's value, would stay below the
    noise of the data set, or the parameter only repeats those before it (rank 1e-7). Effects count in the model's
    order.

    Args:
        masks: which parameters are free, by effect key; frozen: parameters that are excluded all the same.
        strength: of the smoothness penalty, by effect key.
        before: parameters of the slope before; of two that do the same these are kept, so that the choice stays.
    """
    kept: list[Array] = []
    parameters: list[Name] = []
    unidentifiable: list[Name] = []
    basis = np.zeros((len(problem.residual), 0))
    for effect in problem.model.effects:
        mask = np.array(masks[effect.key], dtype=bool)
        mask[[i for key, i in frozen if key == effect.key]] = False
        if not mask.any():
            continue
        index = np.flatnonzero(mask)
        columns = problem.slopes(effect, mask)
        if effect.roughness() is not None:
            # Its penalty determines what the data does not; such effects stand last, so they take nothing from others.
            good = np.einsum("np,np->p", columns, columns) > 0
        else:
            good = np.zeros(len(index), dtype=bool)
            prior = problem.few and effect.key not in problem.anywhere
            far = np.maximum(10 * sizes(problem, effect), np.abs(effect.vector()))[index]
            first = np.array([(effect.key, int(i)) in before for i in index])
            for group in (first, ~first):
                if group.any():
                    good[group], extended = _determined(columns[:, group], far[group], basis, prior)
                    basis = basis if prior else extended
        kept.append(columns if good.all() else columns[:, good])
        parameters += [(effect.key, int(i)) for i in index[good]]
        unidentifiable += [(effect.key, int(i)) for i in index[~good]]
    stacked = kept[0] if len(kept) == 1 else np.hstack(kept) if kept else basis
    penalty = _penalty(problem, parameters, strength)
    weak, centre = _pulls(problem, parameters)
    determined = stacked, tuple(parameters), tuple(unidentifiable)
    return Slope(*determined, penalty, np.hypot(penalty, weak), centre, problem.weights, problem.few)


def _determined(columns: Array, ordinary: Array, basis: Array, prior: bool) -> tuple[NDArray[np.bool_], Array]:
    """Return (k,) mask of the columns that add a new direction to a basis, and the basis (N, b + ..) extended by them.

    Args:
        columns: (N, k) whitened derivatives by k parameters; ordinary: (k,) largest plausible change of each parameter.
        basis: (N, b) orthonormal. prior: whether priors take part, which tell columns apart that repeat each other.
    """
    from scipy.linalg import qr

    length = np.linalg.norm(columns, axis=0)
    alive = length > 0
    unit = columns / np.where(alive, length, 1.0)
    for _ in range(2):
        unit = unit - basis @ (basis.T @ unit)
    # Pivoting is slow on long columns: their triangle holds the same lengths and angles.
    triangle, pivot = qr(np.linalg.qr(unit, mode="r"), mode="r", pivoting=True)
    diagonal = np.zeros(len(ordinary))
    diagonal[pivot[: min(triangle.shape)]] = np.abs(np.diag(triangle))
    diagonal = np.linalg.norm(unit, axis=0) if prior else diagonal
    good = alive & (diagonal > 1e-7) & (diagonal * length * ordinary > 1.0)
    return good, np.hstack([basis, np.linalg.qr(unit[:, good])[0]]) if good.any() else basis


def _penalty(problem: Problem, parameters: list[Name], strength: Mapping[str, float]) -> Array:
    """Return (p,) weights of the smoothness penalty, 0 for parameters of effects that are no free functions.

    Args:
        strength: of the penalty, by effect key.
    """

    def weight(effect: Effect) -> Array:
        """Return those of one effect."""
        rough = effect.roughness()
        return 0.0 * effect.scale() if rough is None else strength.get(effect.key, 0.01) * rough / effect.scale()

    return of_parameters(problem.model.effects, parameters, weight)


def _pulls(problem: Problem, parameters: list[Name]) -> tuple[Array, Array]:
    """Return (p,) weights of the pull on some parameters, and (p,) the values to which it goes.

    It is weak and goes to null (`pull`), but for readings without a tracker: these are few, say little of many
    parameters, and are fitted together with the priors.
    """
    effects = problem.model.effects
    if not problem.few:
        return of_parameters(effects, parameters, lambda e: pull(problem, e)), np.zeros(len(parameters))
    # About null: where a step has led makes no size ordinary.
    prior = prior_at(problem.model, [e.with_vector(e.null_vector()) for e in effects], parameters)
    free = problem.anywhere | {e.key for e in effects if e.roughness() is not None}
    deviation, pulled = prior.deviation(), np.array([key not in free for key, _ in parameters], dtype=bool)
    known = np.isfinite(deviation) & (deviation > 0) & pulled
    return np.where(known, 1.0 / np.where(known, deviation, 1.0), 0.0), np.where(known, prior.value, 0.0)


def pull(problem: Problem, effect: Effect) -> Array:
    """Return (q,) weights of a weak pull of an effect's amplitudes to null: one over ten times `WIDE` ordinary sizes.

    Frames have none. The pull is far below the noise for anything that the data determines, and keeps what the data
    barely determines from running away. Coordinates of either sign (the ends of a hose) are pulled by one over `WIDE`
    ordinary sizes: along a valley of equal fits lies one that an arm may have.
    """
    if may_be_anywhere(effect):  # instruments and reflectors may be anywhere
        return np.zeros(len(effect.vector()))
    places = ~effect.amplitudes() & (effect.bounds()[0] < 0)
    wide = np.where(effect.amplitudes(), 10 * WIDE, np.where(places, WIDE, np.inf))
    return np.asarray(1 / (wide * sizes(problem, effect)))
