"""What the parameters that a fit could not determine may be, and what the fitted ones then are instead."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.fit.fitted import Fit
from postproc.fit.step import sizes
from postproc.model.uncertainty import derivatives

ELSEWHERE = 60
"""Poses anywhere between the joint limits at which a parameter may show that these rows did not."""
NOTHING = 1e-7
"""Move [m] by an ordinary size that is none: such a parameter only says the same in other axes (joint 1, the base)."""


def unseen(fit: Fit) -> Array:
    """(r, p + h) directions in which parameters may be off unseen, each by one standard deviation.

    Of the p that were fitted and the h that were held. A held parameter x_h scatters by its ordinary size s about where
    it is held. If it is off, the fitted ones have taken on what the data saw of it, -G x_h with G = (A^T A)^-1 A^T A_h;
    what they could not take on bounds it: (A_h'^T A_h' / sigma^2 + s^-2)^-1 with A_h' = A_h - A G.
    """
    count = len(fit.parameters)
    if not fit.held:
        return np.zeros((0, count))
    every = {e.key: np.zeros(len(e.vector()), dtype=bool) for e in fit.model.effects}
    for key, i in fit.held:
        every[key][i] = True
    held = [(e.key, int(i)) for e in fit.model.effects for i in np.flatnonzero(every[e.key])]
    ordinary = np.concatenate([sizes(fit.problem, e)[every[e.key]] for e in fit.model.effects])
    columns = (
        np.hstack([fit.problem.slopes(e, every[e.key]) for e in fit.model.effects if every[e.key].any()]) * ordinary
    )
    taken = fit.inverse @ (fit.columns.T @ columns)
    left = columns - fit.columns @ taken

    robot, random = fit.model.robot, np.random.default_rng(0)
    some = fit.data.state.rows(random.integers(len(fit.data), size=ELSEWHERE))
    q = np.clip(robot.lower, -np.pi, np.pi) + np.ptp(np.clip([robot.lower, robot.upper], -np.pi, np.pi), axis=0) * (
        random.random((ELSEWHERE, 6))
    )
    D = derivatives(fit.model, some.with_(q=q), (*fit.parameters, *held))[0]
    moves = D[:, :, count:] * ordinary - D[:, :, :count] @ taken
    shown = np.flatnonzero(np.sqrt(np.mean(moves**2, axis=(0, 1))) > NOTHING)

    known = left[:, shown].T @ left[:, shown] / fit.scatter_of_parameters + np.eye(len(shown))
    lower = np.linalg.cholesky(np.linalg.inv(known))
    found = np.zeros((len(shown), count + len(held)))
    found[:, :count] = -(taken[:, shown] @ lower).T
    found[:, count + shown] = (ordinary[shown, None] * lower).T
    return found[:, [*range(count), *(count + held.index(name) for name in fit.held)]]
