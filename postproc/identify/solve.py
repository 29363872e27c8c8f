"""The iteration of a fit: steps inside the bounds, what is held, how rows and orientations are weighted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.identify.linear import MANY
from postproc.identify.problem import Problem, Weights
from postproc.measure.repeat import Noise

FRAMES = ("instrument_frame", "tool_frame")

Masks = Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True)
class Solution:
    """Where the iteration ended.

    Args:
        problem: at the fitted parameters. held, at_bound: parameters as (effect, index).
        columns: (N, p) whitened derivatives by the fitted parameters; penalty: (p,) weights of smoothness.
        set_aside: rows left out.
    """

    problem: Problem
    held: tuple[tuple[str, int], ...]
    at_bound: tuple[tuple[str, int], ...]
    columns: Array
    penalty: Array
    set_aside: tuple[int, ...]


def solve(problem: Problem, masks: Masks, figures: Noise, robust: bool, penalty: Mapping[str, float]) -> Solution:
    """Least squares by Gauss-Newton inside the bounds; rows far off are set aside on the way.

    Raises:
        PostprocError: DAT020, fewer measured numbers than parameters.
    """
    stopped: set[tuple[str, int]] = set()
    aside: tuple[int, ...] = ()
    base_weights = problem.weights
    fell = np.inf
    for sweep in range(25):
        columns, parameters, held = determined_columns(problem, masks, set())
        if len(problem.residual) <= len(parameters):
            message = f"{len(problem.residual)} measured numbers cannot determine {len(parameters)} parameters"
            help_ = "measure more poses, or fit fewer effects"
            raise PostprocError(Diagnostic("DAT020", "error", message, problem.data.source, help=help_))
        soft = _penalty(problem, parameters, penalty)
        now = _cost(problem, parameters, soft)
        settled = sweep > 1 and fell <= 1e-7 * now + 1e-12
        weights = problem.weights
        # Orientations find their weight in a few rounds; after that only the parameters move.
        if 1 <= sweep <= (12 if robust else 5):
            aside = far_off(problem, base_weights, len(parameters))
            values = _balanced(base_weights, problem, figures).values.copy()
            if robust:
                values = values * _huber(problem, values)[:, None]
            values[list(aside)] = 0.0
            weights = Weights(values)
        changed = not np.array_equal(weights.values > 0, problem.weights.values > 0)
        if settled and not changed:
            break
        step, stopped = _solve(problem, columns, parameters, soft)
        problem, after = _advance(problem, parameters, step, soft, now)
        fell = now - after
        if not np.allclose(weights.values, problem.weights.values, rtol=1e-3):
            problem = Problem(problem.model, problem.data, weights)
            fell = np.inf
    columns, parameters, held = determined_columns(problem, masks, stopped)
    soft = _penalty(problem, parameters, penalty)
    return Solution(problem, held, tuple(sorted(stopped)), columns, soft, aside)


def determined_columns(
    problem: Problem, masks: Masks, frozen: set[tuple[str, int]]
) -> tuple[Array, list[tuple[str, int]], tuple[tuple[str, int], ...]]:
    """Whitened columns of all free parameters that the data determines, effect by effect; the others are held.

    A parameter is held where a change of ten ordinary sizes would stay below the noise of the whole data set, or
    where it only repeats what stands before it (rank 1e-7).
    """
    from scipy.linalg import qr

    kept: list[Array] = []
    parameters: list[tuple[str, int]] = []
    held: list[tuple[str, int]] = []
    basis = np.zeros((len(problem.residual), 0))
    for effect in problem.model.effects:
        mask = np.array(masks[effect.key], dtype=bool)
        mask[[i for key, i in frozen if key == effect.key]] = False
        index = np.flatnonzero(mask)
        if not len(index):
            continue
        columns = problem.columns(effect, mask)
        length = np.linalg.norm(columns, axis=0)
        alive = length > 0
        if effect.roughness() is not None:
            # Its penalty determines what the data does not; such effects stand last, so nothing is held against them.
            kept.append(columns[:, alive])
            parameters += [(effect.key, int(i)) for i in index[alive]]
            held += [(effect.key, int(i)) for i in index[~alive]]
            continue
        ordinary = 10 * effect.scale()[index]
        fresh = columns - basis @ (basis.T @ columns)
        fresh = fresh - basis @ (basis.T @ fresh)
        unit = fresh / np.where(alive, length, 1.0)
        triangle, pivot = qr(unit, mode="r", pivoting=True)
        diagonal = np.zeros(len(index))
        diagonal[pivot[: min(triangle.shape)]] = np.abs(np.diag(triangle))
        good = alive & (diagonal > 1e-7) & (diagonal * length * ordinary > 1.0)
        held += [(effect.key, int(i)) for i in index[~good]]
        if good.any():
            kept.append(columns[:, good])
            parameters += [(effect.key, int(i)) for i in index[good]]
            basis = np.hstack([basis, np.linalg.qr(unit[:, good])[0]])
    return np.hstack(kept) if kept else basis, parameters, tuple(held)


def _penalty(problem: Problem, parameters: list[tuple[str, int]], strength: Mapping[str, float]) -> Array:
    weights = {}
    for effect in problem.model.effects:
        rough = effect.roughness()
        if rough is not None:
            weights[effect.key] = strength.get(effect.key, 0.01) * rough / effect.scale()
    return np.array([weights[key][i] if key in weights else 0.0 for key, i in parameters])


def _values(problem: Problem, parameters: list[tuple[str, int]]) -> Array:
    vectors = {e.key: e.vector() for e in problem.model.effects}
    return np.array([vectors[key][i] for key, i in parameters])


def _anchor(problem: Problem, parameters: list[tuple[str, int]], soft: Array) -> Array:
    """The penalty, and for all parameters but frames a weak pull to null with a deviation of thirty ordinary sizes.

    It is far below the noise of anything that the data determines, and keeps what it barely determines from running
    away.
    """
    scales = {
        e.key: e.scale() if e.key not in FRAMES else np.full(len(e.vector()), np.inf) for e in problem.model.effects
    }
    null = {e.key: e.amplitudes() for e in problem.model.effects}
    weak = np.array([(1 / (30 * scales[key][i]) if null[key][i] else 0.0) for key, i in parameters])
    return np.asarray(np.hypot(soft, weak))


def _cost(problem: Problem, parameters: list[tuple[str, int]], soft: Array) -> float:
    anchor = _anchor(problem, parameters, soft)
    return float(problem.residual @ problem.residual + np.sum((anchor * _values(problem, parameters)) ** 2))


def _solve(
    problem: Problem, columns: Array, parameters: list[tuple[str, int]], soft: Array
) -> tuple[Array, set[tuple[str, int]]]:
    """The Gauss-Newton step inside the bounds, and the parameters that stop at one.

    What would leave its bounds is put on them and the rest solved again, until nothing leaves.
    """
    anchor = _anchor(problem, parameters, soft)
    x = _values(problem, parameters)
    low, high = _bounds(problem, parameters)
    reach = _reach(problem, parameters)
    bounded = (low, high)
    low, high = np.maximum(low, x - reach), np.minimum(high, x + reach)
    length = np.sqrt(np.sum(columns**2, axis=0) + anchor**2)
    length = np.where(length > 0, length, 1.0)
    tied = np.flatnonzero(anchor)
    extra = np.zeros((len(tied), len(x)))
    extra[np.arange(len(tied)), tied] = anchor[tied]
    A = np.vstack([columns, extra])
    b = np.concatenate([problem.residual, -anchor[tied] * x[tied]])
    step = np.zeros(len(x))
    free = np.ones(len(x), dtype=bool)
    # One factor of the whole problem: every active set is then a small one.
    R, rhs = _factor(A / length, b)
    for _ in range(len(x)):
        target = rhs - R[:, ~free] @ (step[~free] * length[~free])
        solution, *_ = np.linalg.lstsq(R[:, free], target, rcond=1e-12)
        step[free] = solution / length[free]
        outside = free & ((x + step < low) | (x + step > high))
        if not outside.any():
            break
        step[outside] = np.clip(x + step, low, high)[outside] - x[outside]
        free &= ~outside
    stopped = ~free & ((x + step <= bounded[0]) | (x + step >= bounded[1]))
    return step, {p for p, held in zip(parameters, stopped, strict=True) if held}


def _factor(A: Array, b: Array) -> tuple[Array, Array]:
    """R and R^-T A^T b of A = Q R; many columns through the normal equations, whose error the next step corrects."""
    if A.shape[1] > MANY:
        from scipy.linalg import LinAlgError, cholesky, solve_triangular

        try:
            R = cholesky(A.T @ A)
            return np.asarray(R), np.asarray(solve_triangular(R, A.T @ b, trans="T"))
        except LinAlgError:
            pass
    Q, R = np.linalg.qr(A)
    return np.asarray(R), np.asarray(Q.T @ b)


def _reach(problem: Problem, parameters: list[tuple[str, int]]) -> Array:
    """How far a parameter may go in one step: one that only forms an effect (a knee, a point) by half of itself."""
    found = []
    for key, i in parameters:
        effect = problem.model.effect(key)
        assert effect is not None
        size = max(abs(float(effect.vector()[i])), float(effect.scale()[i]))
        found.append(np.inf if effect.amplitudes()[i] else 0.5 * size)
    return np.array(found)


def _bounds(problem: Problem, parameters: list[tuple[str, int]]) -> tuple[Array, Array]:
    every = {e.key: e.bounds() for e in problem.model.effects}
    return np.array([every[key][0][i] for key, i in parameters]), np.array([every[key][1][i] for key, i in parameters])


def _advance(
    problem: Problem, parameters: list[tuple[str, int]], step: Array, soft: Array, now: float
) -> tuple[Problem, float]:
    """The largest of 1, 1/2, 1/4 .. of the step at which the cost falls."""
    share = 1.0
    for _ in range(10):
        effects = []
        for effect in problem.model.effects:
            x = effect.vector().copy()
            for k, (key, i) in enumerate(parameters):
                if key == effect.key:
                    x[i] += share * step[k]
            low, high = effect.bounds()
            effects.append(effect.with_vector(np.clip(x, low, high)))
        trial = problem.at(effects)
        try:
            cost = _cost(trial, parameters, soft)
        except PostprocError:
            cost = np.inf
        if cost <= now * (1 + 1e-9):
            return trial, cost
        share /= 2
    return problem, now


def _balanced(weights: Weights, problem: Problem, figures: Noise) -> Weights:
    """Orientations (and joint angles) weighted by their own residual where repeats did not give their noise."""
    values = weights.values.copy()
    start = 3
    for measured, known in (
        (problem.data.rotation is not None, figures.rotation),
        (problem.data.joint is not None, None),
    ):
        if not measured:
            continue
        stop = start + (3 if start == 3 and problem.data.rotation is not None else 6)
        if known is None:
            own = robust_rms(problem.error[:, start:stop])
            reference = robust_rms(problem.error[:, :3]) * np.nanmax(values[:, :3], initial=0.0)
            if own > 0 and reference > 0:
                values[:, start:stop] = (values[:, start:stop] > 0) * reference / own
            elif own > 0:
                values[:, start:stop] = (values[:, start:stop] > 0) / own
        start = stop
    return Weights(values)


def robust_rms(error: Array) -> float:
    """1.4826 times the median absolute value of the finite numbers."""
    good = error[np.isfinite(error)]
    return 1.4826 * float(np.median(np.abs(good))) if len(good) else 0.0


def far_off(problem: Problem, weights: Weights, fitted: int) -> tuple[int, ...]:
    """Rows farther off than ten typical rows: typing errors and lost beams, never more than one row in twenty."""
    probe = Problem(problem.model, problem.data, weights)
    probe.__dict__["rest"], probe.__dict__["error"] = problem.rest, problem.error
    square = probe.row_square()
    typical = float(np.median(square))
    far = np.flatnonzero(square > max(100 * typical, 1e-12))
    return tuple(int(i) for i in far) if len(far) <= max(1, len(square) // 20) else ()


def _huber(problem: Problem, values: Array) -> Array:
    length = np.sqrt(np.nansum((problem.error * values) ** 2, axis=1))
    limit = 1.5 * float(np.median(length))
    return np.asarray(np.sqrt(np.minimum(1.0, limit / np.maximum(length, 1e-300))))
