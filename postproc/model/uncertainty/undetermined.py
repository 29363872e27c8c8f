"""What parameters that no row has told may cost a program under its own loads, and the pull that would tell most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.uncertainty.prediction import Uncertainty, derivatives, parameter_name, read_uncertainty

PULLS = np.vstack([np.diag([100.0] * 3 + [20.0] * 3)])
"""Loads on the TCP that a shop can apply, one a row: 100 N along and 20 N m about each axis of the base."""
PULLING_POSES = 3
"""Poses at which a pull is asked for."""


@dataclass(frozen=True, slots=True)
class Undetermined:
    """What a program may be off for parameters that stand at their priors.

    Args:
        within_95: distance [m] that holds 95 % of these errors at the worst state.
        effect, name: key and full name of the parameter that matters most there.
        index: its place in the effect's vector.
        value, sigma: of that parameter.
        largest: distance [m] that holds 95 % of the errors by that parameter alone.
        pull: (6,) load on the TCP [N], [N m] in base axes that moves the TCP most by it; None where no load does.
        pull_displacement: of the TCP [m] by one standard deviation of the parameter under that load, at the best poses.
    """

    within_95: float
    effect: str
    name: str
    index: int
    value: float
    sigma: float
    largest: float
    pull: Array | None
    pull_displacement: float


def undetermined_under_load(model: Model, state: State, within_95: float) -> Undetermined | None:
    """Return what parameters that stand at their priors leave open of the TCP at some states; None without any.

    With S the covariance of all parameters and u those at their priors, their share of the covariance of the position
    is D S_u S_uu^-1 S_u^T D^T: what else was fitted follows them.

    Args:
        state: n states with the loads of the program.
        within_95: standard deviations per axis (root mean square) that hold 95 % of the distances.
    """
    known = read_uncertainty(model)
    names = set(model.fit.get("undetermined", [])) - set(model.fit.get("base", []))
    if known is None or not names or not len(state):
        return None
    parameters = known.all_parameters
    at_prior = [k for k, (key, i) in enumerate(parameters) if parameter_name(model, key, i) in names]
    if not at_prior:
        return None
    S = full_covariance(known)
    inner = S[np.ix_(at_prior, at_prior)]
    scale = np.sqrt(np.diag(inner))
    D = derivatives(model, state, parameters)[0]
    scaled = D @ S[:, at_prior] / scale  # (n, 3, u), one column a standard deviation
    correlation = inner / np.outer(scale, scale)
    together = np.einsum("nix,xy,niy->n", scaled, np.linalg.pinv(correlation, hermitian=True), scaled)
    alone = np.sum(scaled**2, axis=1)
    worst = int(np.argmax(together))
    most = int(np.argmax(alone[worst]))
    column = at_prior[most]
    key, index = parameters[column]
    effect = model.effect(key)
    assert effect is not None
    pull, shown = _best_pull(model, state, parameters, S[:, column] / scale[most])
    return Undetermined(
        float(within_95 * np.sqrt(together[worst] / 3)),
        key,
        parameter_name(model, key, index),
        index,
        float(effect.vector()[index]),
        float(scale[most]),
        float(within_95 * np.sqrt(alone[worst, most] / 3)),
        pull,
        shown,
    )


def full_covariance(known: Uncertainty) -> Array:
    """Return the covariance (p + h, p + h) of the fitted and the open parameters together."""
    count, size = len(known.parameters), len(known.parameters) + len(known.not_identifiable)
    S = np.zeros((size, size))
    S[:count, :count] = known.covariance
    if len(known.unseen):
        S += known.unseen.T @ known.unseen
    return S


def _best_pull(
    model: Model, state: State, parameters: tuple[tuple[str, int], ...], move: Array
) -> tuple[Array | None, float]:
    """Return the load on the TCP that shows a change of parameters best, and by how much [m]; None where none does.

    Args:
        state: n states, of which `PULLING_POSES` are pulled at; move: (p,) change of the parameters.
    """
    some = state.rows(np.unique(np.linspace(0, len(state) - 1, PULLING_POSES).round().astype(int)))
    still = derivatives(model, some.with_(wrench=np.zeros((len(some), 6))), parameters)[0] @ move
    shown = []
    for load in PULLS:
        pulled = derivatives(model, some.with_(wrench=np.tile(load, (len(some), 1))), parameters)[0] @ move
        shown.append(float(np.sqrt(np.mean(np.sum((pulled - still) ** 2, axis=1)))))
    best = int(np.argmax(shown))
    return (PULLS[best], shown[best]) if shown[best] > 0 else (None, 0.0)
