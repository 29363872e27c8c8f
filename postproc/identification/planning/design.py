"""Which poses tell most: where they may be, and the regressions that compare them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import Problem
from postproc.estimation.solving.determined import WIDE
from postproc.estimation.solving.step import Name
from postproc.identification.screen.candidate import Screen
from postproc.identification.screen.composition import compose
from postproc.identification.screen.forms import ordinary
from postproc.identification.screen.nonlinear import refit_form


@dataclass(frozen=True)
class Room:
    """Where poses may be.

    Args:
        region: (2, 3) lowest and highest x, y, z of the TCP in the base frame [m].
        candidates: (c, 6) joint angles [rad] of the only poses that may be chosen; axes: (c, 6) where the external axes
            stand at them [m], [rad].
        sight: half the opening angle [rad] of the reflector on the tool, whose axis is +z of the tool: the instrument
            must stand inside that cone.
        measured_range: joints stay inside the range of the data so far.
        payloads: that poses may have [kg], none for those of the data so far; force: that pulls at the TCP [N], in a
            direction of its own at each pose.
    """

    region: Array | None = None
    candidates: Array | None = None
    sight: float | None = None
    measured_range: bool = False
    axes: Array | None = None
    payloads: tuple[float, ...] = ()
    force: float = 0.0

    def holds(self, problem: Problem) -> NDArray[np.bool_]:
        """Return (n,) mask of the poses of a problem that are inside the region and in sight of the instrument."""
        T = problem.equilibrium.T_base_tcp
        good = np.ones(len(T), dtype=bool)
        if self.region is not None:
            good &= ((T[:, :3, 3] >= self.region[0]) & (T[:, :3, 3] <= self.region[1])).all(axis=1)
        if self.sight is not None:
            seen = problem.T_instrument_tcp
            # The instrument is the origin of its own frame.
            toward = -seen[:, :3, 3] / np.maximum(np.linalg.norm(seen[:, :3, 3], axis=1), 1e-9)[:, None]
            good &= np.einsum("ni,ni->n", toward, seen[:, :3, 2]) >= np.cos(self.sight)
        return good


FULL_RANGE = Room()


PRIOR = 1 / (10 * WIDE) ** 2
"""Precision of a parameter before anything is measured, in ordinary sizes: that of the weak pull in a fit."""
LEAST_SQUARE = 1e-6
"""Of the displacement by an effect, in standard deviations of the noise: none at all has no inverse."""


def _columns(fit: Fit, pool: Problem) -> tuple[Array, Array, Array]:
    """Return whitened columns of all free parameters for their ordinary sizes, and the parameters' prior precision.

    Args:
        pool: c poses that may be measured.

    Returns:
        (N, p) on the data of the fit, (c, 3, p) on the pool, (p,) precision.
    """
    masks = [(effect, np.asarray(fit.free[effect.key], dtype=bool)) for effect in fit.model.effects]
    old, new = zip(*(_of_effect(fit, pool, *one) for one in masks), strict=True)
    tied = [np.full(mask.sum(), 1e-6 if effect.is_frame else PRIOR) for effect, mask in masks]
    return np.hstack(old), np.concatenate(new, axis=2), np.concatenate(tied)


def _of_effect(fit: Fit, pool: Problem, effect: Effect, mask: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return whitened columns of an effect's p parameters in a mask (q,) for their ordinary sizes.

    Args:
        pool: c poses that may be measured.

    Returns:
        (N, p) on the data of the fit, (c, 3, p) on the pool.
    """
    size = ordinary(fit.model, effect, mask)
    return fit.problem.columns(effect, mask) * size, pool.columns(effect, mask).reshape(len(pool.data), 3, -1) * size


AS_GOOD_AS_UNKNOWN = 10.0
"""A parameter that all poses of the pool together leave so unsure, in ordinary sizes, no pose determines."""


def sharpen(fit: Fit, pool: Problem, n: int) -> tuple[list[int], float, float, list[Name], list[Name]]:
    """Choose n poses of a pool that shrink the parameters' covariance most, one after another (greedy D-optimal).

    Args:
        fit: of the data so far; pool: poses that may be measured.

    Returns:
        The indices of the poses; the largest standard deviation [ordinary sizes] of parameters that poses can
        determine, before and after; the three of these that are determined worst before; the parameters that no pose
        determines.
    """
    A, Z, tied = _columns(fit, pool)
    P: Array = np.asarray(np.linalg.inv(A.T @ A + np.diag(tied)), dtype=float)
    entries = [(e.key, int(i)) for e in fit.model.effects for i in np.flatnonzero(fit.free[e.key])]
    arm = np.concatenate([np.full(np.sum(fit.free[e.key]), not e.is_frame) for e in fit.model.effects])
    width = np.sqrt(np.diag(P))
    every = Z.reshape(-1, Z.shape[2])
    determined = np.sqrt(np.diag(np.linalg.inv(np.linalg.inv(P) + every.T @ every))) < AS_GOOD_AS_UNKNOWN
    known = arm & determined
    before = float(width[known].max(initial=0.0))
    worst = [entries[i] for i in np.argsort(-np.where(known, width, 0.0))[:3] if known[i]]
    chosen, P = choose(Z, P, n)
    after = np.sqrt(np.diag(P))
    never = [entries[i] for i in np.flatnonzero(arm & ~determined)]
    return chosen, before, float(after[known].max(initial=0.0)), worst, never


def choose(
    Z: Array, P: Array, n: int, weigh: Array | None = None, groups: NDArray[np.int_] | None = None
) -> tuple[list[int], Array]:
    """Choose n of c candidates one after another, and return their indices and the covariance (p, p) with them.

    The next one raises ln det(I + Z P Z^T) most (D-optimal), or lowers tr(W P) most, which is by tr((I + Z P Z^T)^-1
    Z P W P Z^T) (L-optimal; Atkinson, Donev and Tobias 2007).

    Args:
        Z: (c, m, p) whitened columns. P: (p, p) covariance without them.
        weigh: (p, p) positive semidefinite W; None for D-optimal.
        groups: (c, 2) number of the posture of each, of which one is chosen at most, and of what it touches, of which
            all are chosen as often as there are postures for; None where no two have a posture in common.
    """
    single = np.column_stack([np.arange(len(Z)), np.zeros(len(Z), dtype=int)])
    posture, touched = (single if groups is None else groups).T
    chosen, free, times = list[int](), np.ones(len(Z), dtype=bool), np.zeros(touched.max(initial=0) + 1, dtype=int)
    for _ in range(n):
        ZP = Z @ P
        S = np.eye(Z.shape[1]) + ZP @ Z.mT
        if weigh is None:
            gain = np.linalg.slogdet(S)[1]
        else:
            gain = np.trace(np.linalg.solve(S, ZP @ weigh @ ZP.mT), axis1=1, axis2=2)
        rare = free & (times[touched] == times[touched[free]].min(initial=n))
        best = int(np.argmax(np.where(rare, gain, -np.inf)))
        chosen.append(best)
        free &= posture != posture[best]
        times[touched[best]] += 1
        P = updated(P, Z[best])
    return chosen, P


def separate(fit: Fit, pool: Problem, pair: list[type[Effect]], n: int) -> tuple[list[int], float, float]:
    """Choose n poses of a pool that tell two effects apart best, one after another (greedy T-optimal).

    Each effect has the size that the data suggests, an ordinary one at least.

    Args:
        fit: of the data so far, without both effects; pool: poses that may be measured; pair: their classes.

    Returns:
        The indices of the poses; by how many standard deviations the effects differ, before and after.

    Raises:
        PostprocError: DAT024 where one of them moves nothing on these poses.
    """
    A, Z, tied = _columns(fit, pool)
    screen = Screen(fit.problem, {cls.key: cls for cls in pair})
    forms = [_of_effect(fit, pool, *_form(fit, pool, screen, cls)) for cls in pair]
    if still := [cls.key for cls, (_, new) in zip(pair, forms, strict=True) if not new.any()]:
        message = f"`{still[0]}` moves nothing on poses that this arm can reach standing still"
        raise PostprocError.of("DAT024", message, help="choose an effect of the geometry, the load or the side")
    sides = []
    for (old, new), (old_other, new_other) in (forms, forms[::-1]):
        size = _size(fit, old)[:, None]
        measured, planned = np.hstack([A, old_other, old @ size]), np.concatenate([Z, new_other, new @ size], axis=2)
        prior = np.concatenate([tied, np.full(old_other.shape[1], PRIOR), [LEAST_SQUARE]])
        sides.append((planned, np.linalg.inv(measured.T @ measured + np.diag(prior)), float(np.sum((old @ size) ** 2))))
    before, chosen = _distance(sides), list[int]()
    for _ in range(n):
        gain = np.sum([_gain(Z, P) / max(total, 1e-12) for Z, P, total in sides], axis=0)
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        sides = [(Z, updated(P, Z[best]), total + float(np.sum(Z[best, :, -1] ** 2))) for Z, P, total in sides]
    return chosen, before, _distance(sides)


def _distance(sides: Iterable[tuple[Array, Array, float]]) -> float:
    """Return the size, in standard deviations of the noise, of what other columns cannot explain of the last one.

    Args:
        sides: columns on the pool, covariance (p, p), sum of squares of the last one; the least distance counts.
    """
    return float(np.sqrt(min(max(1 / P[-1, -1] - LEAST_SQUARE, 0.0) for _, P, _ in sides)))


def _gain(Z: Array, P: Array) -> Array:
    """Return (c,) growth of the unexplained square by measuring each pose of a pool, e^T (I + z P z^T)^-1 e.

    Here e is what all other columns z cannot explain of the last one at the pose, and P their covariance without it.

    Args:
        Z: (c, 3, p) columns on the pool. P: (p, p) covariance of all.
    """
    ZP, last = Z @ P, P[-1, -1]
    e = ZP[:, :, -1:] / last
    return np.asarray((e.mT @ np.linalg.solve(np.eye(3) + ZP @ Z.mT - last * e @ e.mT, e))[:, 0, 0])


def updated(P: Array, z: Array) -> Array:
    """Return the covariance (p, p) after measuring rows z (3, p), (P^-1 + z^T z)^-1, by the matrix inversion lemma."""
    Pz = P @ z.T
    return np.asarray(P - Pz @ np.linalg.solve(np.eye(len(z)) + z @ Pz, Pz.T))


def _form(fit: Fit, pool: Problem, screen: Screen, cls: type[Effect]) -> tuple[Effect, NDArray[np.bool_]]:
    """Return an effect in the form to plan for, and (q,) mask of its amplitudes.

    The form is the best one on the data, else the first variant on the pool.

    Args:
        pool: poses that may be measured; screen: the forms of the effect on the data; cls: class of the effect.
    """
    candidate = compose(screen, fit.linear, cls.key)
    if candidate is not None:
        candidate = refit_form(screen, fit.linear, candidate)
        return candidate.effect, candidate.free & candidate.effect.amplitudes()
    for form in cls.variants(pool.sensitivity.state, None):
        return form.effect, np.asarray(form.free)
    return cls.null(), cls.null().amplitudes()


def _size(fit: Fit, columns: Array) -> Array:
    """Return (p,) amplitudes, in ordinary sizes, that the data suggests for columns (N, p), of norm 1 at least."""
    linear = fit.linear
    projected = linear.project(columns)
    x = np.linalg.solve(columns.T @ projected + np.eye(columns.shape[1]), columns.T @ linear.projected_residual)
    size = float(np.linalg.norm(x))
    return np.asarray(x / size * max(size, 1.0) if size > 1e-6 else np.ones(len(x)) / np.sqrt(len(x)))
