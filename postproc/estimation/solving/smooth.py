"""How fine and how smooth a free function should be: the likeliest, whatever else is fitted with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.estimation.linear import Linear, basis_of
from postproc.estimation.problem import Problem

STRENGTHS = np.geomspace(1e-3, 1e3, 121)
MOST_NUMBERS_SMOOTHED = 8000
"""Measured numbers on which the choice is made; long records are thinned to that."""
LARGEST_SHARE_OF_NUMBERS = 0.5
"""Share of the numbers, parameters taken off, that a free function may take up at most."""
AS_MUCH = 1.0
"""A coarser function says as much where its log likelihood is lower by no more than this."""


@dataclass(frozen=True)
class Smoothness:
    """A free function with the smoothness that suits the data.

    Args:
        effect: in the chosen resolution, with null amplitudes. strength: factor of its roughness penalty.
        likelihood: log restricted likelihood that both reach.
    """

    effect: Effect
    strength: float
    likelihood: float


def choose_smoothness(fit: Fit, key: str, state: State) -> Smoothness:
    """Return the resolution and penalty of a free function with the largest restricted likelihood.

    Near its solution the fit is linear in the amplitudes, y = A b + C x + noise, with nothing known of b and x of
    variance s^2 / (f v)^2 for the strength f and the roughness v. With M the projection on what A leaves, and V diag(l)
    V^T = v^-1 C^T M C v^-1, the likelihood of M y is, up to a constant and with s at its best,

    -(N - p) / 2 log(y^T M y - sum of (V^T v^-1 C^T M y)^2 / (l + f^2)) - 1/2 sum of log(1 + l / f^2).

    The penalty, not the number of coefficients, keeps the function smooth: more of them than rows do no harm.
    Source: Patterson and Thompson (1971); for smoothing Wahba (1985).

    Args:
        fit: with all other effects near their best values; key: of the free function.
        state: of all rows, which limit how fine it can be.
    """
    effect = fit.model.effect(key)
    assert effect is not None
    y, others, soft = _linear_parts(fit, key)
    known, few = Linear(y, basis_of(others, soft), fit.problem.row), fit.problem
    kinds = [(likeliest(known, few, forms[0]), forms[1:]) for forms in effect.resolutions(state)]
    chosen, coarser = max(kinds, key=lambda kind: kind[0].likelihood)
    best = chosen.likelihood
    for form in coarser:
        smoothness = likeliest(known, few, form)
        if smoothness.likelihood < best - AS_MUCH:
            break
        chosen, best = smoothness, max(best, smoothness.likelihood)
    return chosen


def likeliest(known: Linear, few: Problem, form: Effect) -> Smoothness:
    """Return a free function of one resolution with the strength of its roughness penalty that is likeliest.

    Args:
        known: residual and basis of the fit without the function; few: the problem with the rows of ``known``.
        form: the function with null amplitudes.
    """
    rough = form.roughness()
    assert rough is not None
    columns = few.columns(form, np.ones(len(rough), dtype=bool)) * (form.scale() / rough)
    value, vector = np.linalg.eigh(columns.T @ known.project(columns))
    value = np.maximum(value, 0.0)
    explained = (vector.T @ (columns.T @ known.projected_residual)) ** 2
    square = STRENGTHS[:, None] ** 2
    remaining = known.square - np.sum(explained / (value + square), axis=1)
    freedom = len(known.residual) - known.parameters
    likelihood = -0.5 * (freedom * np.log(np.maximum(remaining, 1e-300)) + np.sum(np.log1p(value / square), axis=1))
    # A function that takes up everything is as likely at any strength below: nothing remains that could be noise.
    likelihood[np.sum(value / (value + square), axis=1) > LARGEST_SHARE_OF_NUMBERS * freedom] = -np.inf
    best = int(np.argmax(likelihood))
    return Smoothness(form, float(STRENGTHS[best]), float(likelihood[best]))


def enough_for_smoothness(problem: Problem) -> Problem:
    """Return a problem thinned to every k-th pose, at most about `MOST_NUMBERS_SMOOTHED` measured numbers."""
    rows = problem.subsample(MOST_NUMBERS_SMOOTHED)
    return problem if rows.all() else problem.some(rows)


def effective_parameters(fit: Fit, key: str) -> float:
    """Return the effective number of parameters of a free function, which its penalty makes smaller than their count.

    Args:
        key: of the free function.
    """
    in_function = np.array([name == key for name, _ in fit.parameters], dtype=bool)
    others = basis_of(fit.columns[:, ~in_function], fit.penalty[~in_function])
    return float(np.sum(basis_of(fit.columns, fit.penalty) ** 2) - np.sum(others**2))


def _linear_parts(fit: Fit, key: str) -> tuple[Array, Array, Array]:
    """Return the linear problem (y, columns, penalties) in which one free function is fitted anew.

    Returns:
        (N,) y, the residual plus what the fitted parameters of all effects predict; (N, p) whitened columns and (p,)
        penalties of all effects but the free function.

    Args:
        key: of the free function, which is part of y and has no columns.
    """
    problem = fit.problem
    columns, y = list[Array](), problem.residual.copy()
    for effect in problem.model.effects:
        mask = np.full(len(effect.vector()), effect.key == key)
        mask[[i for k, i in fit.parameters if k == effect.key]] = True
        derivatives = problem.columns(effect, mask)
        y += derivatives @ effect.vector()[mask]
        columns += [derivatives] if effect.key != key else []
    soft = fit.penalty[[k != key for k, _ in fit.parameters]]
    return y, np.hstack(columns) if columns else np.zeros((len(y), 0)), soft
