"""The laws that were found as curves: how far each joint is turned along each angle, to be drawn and to be said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect, State
from postproc.estimation.fitted import Fit

CURVE_POINTS = 121
"""Angles at which a curve is told."""
LEAST_TURN_RAD = 1e-9
"""Turn [rad] below which a joint does not follow an angle."""


@dataclass(frozen=True)
class JointCurve:
    """How far an effect turns one joint as one joint angle varies, the other angles in the middle of their ranges.

    Args:
        joint: that is turned, from 1; channel: the angle that varies, ``q2``; at: (k,) its values [rad], over the
            measured range.
        turn: (k,) turn of the joint less its mean [rad]; sigma: (k,) standard deviation of that [rad].
    """

    joint: int
    channel: str
    at: Array
    turn: Array
    sigma: Array


def curves(fit: Fit, key: str) -> Iterator[JointCurve]:
    """Yield the curves of an effect, by its key, that turns joints by the joint angles alone; none of other effects."""
    effect = fit.model.effect(key)
    if effect is None or effect.reads != ("q",):
        return
    q = fit.data.state.q
    index = [k for k, (name, _) in enumerate(fit.parameters) if name == key]
    fitted = np.array([i for name, i in fit.parameters if name == key], dtype=int)
    covariance = fit.covariance[np.ix_(index, index)]
    for k in np.flatnonzero(np.ptp(q, axis=0) > 0):
        at = np.linspace(q[:, k].min(), q[:, k].max(), CURVE_POINTS)
        along = np.tile(np.median(q, axis=0), (CURVE_POINTS, 1))
        along[:, k] = at
        turn, slope = _turns(effect, fit.data.state.rows(np.zeros(CURVE_POINTS, dtype=int)).with_(q=along))
        for j in np.flatnonzero(np.ptp(turn, axis=0) > LEAST_TURN_RAD):
            known = slope[:, j, fitted] - slope[:, j, fitted].mean(axis=0)  # offsets take up its mean
            sigma = np.sqrt(np.maximum(np.einsum("np,pq,nq->n", known, covariance, known), 0.0))
            yield JointCurve(int(j) + 1, f"q{k + 1}", at, turn[:, j] - turn[:, j].mean(), sigma)


def _turns(effect: Effect, state: State) -> tuple[Array, Array]:
    """Return (n, 6) turn of every joint [rad] by an effect, and (n, 6, q) its derivative by every parameter."""

    def turned(x: Array) -> Array:
        """Return (n, 6) turns [rad] at the parameters x."""
        joint = displacement_of(effect.with_vector(x), state).joint
        return np.zeros((len(state), 6)) if joint is None else joint

    x, basis = effect.vector(), effect.joint_basis(state)
    if basis is None:
        steps = np.diag(1e-3 * effect.scale())
        return turned(x), np.stack([(turned(x + s) - turned(x - s)) / (2 * s.max()) for s in steps], axis=2)
    slope = np.zeros((len(state), 6, len(x)))
    slope[:, basis.joint, np.arange(len(x))] = basis.values
    return turned(x), slope
