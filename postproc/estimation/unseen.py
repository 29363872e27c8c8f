"""What the parameters that a fit could not determine may be, and what the fitted ones then are instead."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.effects.contract import State
from postproc.estimation.fitted import Fit
from postproc.estimation.solving.step import Name, sizes
from postproc.model.uncertainty import derivatives

ELSEWHERE = 100
"""Poses anywhere between joint limits at which a model is asked for what measured rows do not show."""
NOTHING = 1e-7
"""Move [m] by an ordinary size that is none: such a parameter only says the same in other axes (joint 1, the base)."""


def unseen(fit: Fit) -> tuple[tuple[Name, ...], Array]:
    """Return the h parameters that the data does not determine, and directions (r, p + h) in which they may be off.

    Each direction is one standard deviation, over the p fitted parameters and the h. Parameters that only describe the
    same motion in other axes are left out. A held parameter x_h scatters by its ordinary size s about where
    it is held. If it is off, the fitted ones have taken on what the data saw of it, -G x_h with G = (A^T A)^-1 A^T A_h;
    what they could not take on bounds it: (A_h'^T A_h' / sigma^2 + s^-2)^-1 with A_h' = A_h - A G.
    """
    count = len(fit.parameters)
    if not fit.unknown:
        return (), np.zeros((0, count))
    found = [(e, [i for key, i in fit.unknown if key == e.key]) for e in fit.model.effects]
    masks = [(e, np.isin(np.arange(len(e.vector())), index)) for e, index in found if index]
    held = [(e.key, i) for e, mask in masks for i in np.flatnonzero(mask).tolist()]
    ordinary = np.concatenate([sizes(fit.problem, e)[mask] for e, mask in masks])
    columns = np.hstack([fit.problem.slopes(e, mask) for e, mask in masks]) * ordinary
    taken = fit.inverse @ (fit.columns.T @ columns)
    left = columns - fit.columns @ taken

    low, high = np.clip([fit.model.robot.lower, fit.model.robot.upper], -np.pi, np.pi)
    some = anywhere(fit.data.state, low, high)
    if some.approach is not None:  # all rows may have come from one side
        some = some.with_(approach=some.approach * np.where(np.arange(ELSEWHERE) % 2, -1.0, 1.0)[:, None])
    D = derivatives(fit.model, some, (*fit.parameters, *held))[0]
    moves = D[:, :, count:] * ordinary - D[:, :, :count] @ taken
    shown = np.flatnonzero(np.sqrt(np.mean(moves**2, axis=(0, 1))) > NOTHING)

    known = left[:, shown].T @ left[:, shown] / fit.scatter_of_parameters + np.eye(len(shown))
    lower = np.linalg.cholesky(np.linalg.inv(known))
    off = np.zeros((len(shown), count + len(held)))
    off[:, :count] = -(taken[:, shown] @ lower).T
    off[:, count + shown] = (ordinary[shown, None] * lower).T
    names = tuple(n for n in fit.unknown if n in fit.held or held.index(n) in shown)
    return names, off[:, [*range(count), *(count + held.index(name) for name in names)]]


def anywhere(state: State, low: Array, high: Array) -> State:
    """Return `ELSEWHERE` states with random joint angles, and payload, time .. as in random rows of a table.

    Args:
        low, high: (6,) limits of the angles [rad].
    """
    random = np.random.default_rng(0)
    rows = state.rows(random.integers(len(state), size=ELSEWHERE))
    return rows.with_(q=random.uniform(low, high, (ELSEWHERE, 6)))
