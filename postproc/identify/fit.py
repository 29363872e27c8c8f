"""Least squares of all parameters of a model on measured poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.base import Effect
from postproc.effects.instrument_frame import InstrumentFrame
from postproc.effects.tool_frame import ToolFrame
from postproc.identify.linear import Linear, contiguous_blocks, hold_out
from postproc.identify.problem import Problem, Weights, make_weights
from postproc.identify.start import start_frames
from postproc.measure.measurements import Measurements
from postproc.measure.repeat import Noise, estimate_noise
from postproc.model.arm import Model

FIRST = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
FRAMES = ("instrument_frame", "tool_frame")
LAST = ("link_geometry",)
"""Where two parameters do the same, the effect that stands later is held: frames before offsets before geometry."""

Masks = Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True)
class Fit:
    """A fitted model and what the data says about it.

    Args:
        problem: the fitted model beside the measurements.
        free: parameters that were fitted, by effect: masks over ``effect.vector()``.
        held: parameters that the data cannot determine, as (effect, index).
        at_bound: parameters that stopped at a bound.
        columns: (N, p) whitened derivatives by the free parameters that were fitted, in the order of ``parameters``.
        penalty: (p,) weights of the smoothness penalty, 0 where there is none.
        noise: of the instrument. set_aside: rows (of ``problem.data``) so far off that they were left out of the fit.
        strength: of the smoothness penalty by effect.
    """

    problem: Problem
    free: Masks
    held: tuple[tuple[str, int], ...]
    at_bound: tuple[tuple[str, int], ...]
    columns: Array
    penalty: Array
    noise: Noise
    set_aside: tuple[int, ...] = ()
    strength: Mapping[str, float] = field(default_factory=dict)

    @property
    def model(self) -> Model:
        return self.problem.model

    @property
    def data(self) -> Measurements:
        return self.problem.data

    @cached_property
    def parameters(self) -> tuple[tuple[str, int], ...]:
        """(effect, index in its vector) of every column."""
        out = set(self.held) | set(self.at_bound)
        every = [(e.key, int(i)) for e in self.model.effects for i in np.flatnonzero(self.free.get(e.key, []))]
        return tuple(p for p in every if p not in out)

    @cached_property
    def linear(self) -> Linear:
        """The fit as a linear problem: residual and an orthonormal basis of its columns (penalties as extra rows)."""
        A, r = self.columns, self.problem.residual
        row = self.problem.row
        if self.penalty.any():
            soft = np.flatnonzero(self.penalty)
            extra = np.zeros((len(soft), A.shape[1]))
            extra[np.arange(len(soft)), soft] = self.penalty[soft]
            values = self._vector()[soft]
            A, r = np.vstack([A, extra]), np.concatenate([r, -self.penalty[soft] * values])
            row = np.concatenate([row, np.full(len(soft), -1)])
        length = np.linalg.norm(A, axis=0)
        basis = np.linalg.qr(A / np.where(length > 0, length, 1.0))[0] if A.shape[1] else A
        return Linear(r, basis, row)

    def _vector(self) -> Array:
        values = {e.key: e.vector() for e in self.model.effects}
        return np.array([values[key][i] for key, i in self.parameters])

    @cached_property
    def freedom(self) -> float:
        """Measured numbers minus fitted parameters (the effective number, where a penalty holds them)."""
        entries = self.linear.row >= 0
        return float(entries.sum() - np.sum(self.linear.nuisance[entries] ** 2))

    @cached_property
    def variance(self) -> float:
        """Residual variance over the stated one, sum of squares / (N - p); scipy's cost needs the factor 2 for this."""
        return float(self.problem.residual @ self.problem.residual) / max(self.freedom, 1.0)

    @cached_property
    def covariance(self) -> Array:
        """(p, p) of the fitted parameters: variance (A^T A + penalty)^-1."""
        length = np.sqrt(np.sum(self.columns**2, axis=0) + self.penalty**2)
        scale = np.where(length > 0, length, 1.0)
        A = self.columns / scale
        inverse = np.linalg.pinv(A.T @ A + np.diag((self.penalty / scale) ** 2), rcond=1e-14, hermitian=True)
        return np.asarray(self.variance * inverse / np.outer(scale, scale))

    @cached_property
    def intervals(self) -> dict[str, Array]:
        """Half width of the 95 % interval of each parameter by effect (Student's t), NaN where it was not fitted."""
        from scipy.special import stdtrit

        width = stdtrit(max(self.freedom, 1.0), 0.975) * np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        result = {e.key: np.full(len(e.vector()), np.nan) for e in self.model.effects}
        for (key, i), w in zip(self.parameters, width, strict=True):
            result[key][i] = w
        return result

    @cached_property
    def rms(self) -> float:
        """Position error per axis of the rows in the fit [m]."""
        return rms(self.position_error)

    @cached_property
    def position_error(self) -> Array:
        """(n, 3) measured minus predicted [m], NaN in rows that were set aside."""
        error = self.problem.error[:, :3].copy()
        error[list(self.set_aside)] = np.nan
        return error

    @cached_property
    def held_out_error(self) -> Array:
        """(n, 3) position error of every row as the other blocks predict it [m]; ten contiguous blocks, repeats together."""
        blocks = contiguous_blocks(self.data.repeats)
        linear = self.linear
        number = np.where(linear.row >= 0, blocks[np.maximum(linear.row, 0)], -1)
        out = hold_out(linear, (), number)[linear.row >= 0]
        error = np.full(self.problem.weights.values.shape, np.nan)
        used = self.problem.weights.used
        error[used] = out / self.problem.weights.values[used]
        return error[:, :3]

    @cached_property
    def held_out_rms(self) -> float:
        return rms(self.held_out_error)

    def recorded(self) -> Model:
        """The fitted model with its table [fit], ready to be written."""
        from postproc.identify.record import recorded_model

        return recorded_model(self)

    def as_json(self) -> dict[str, Any]:
        from postproc.identify.record import fit_json

        return fit_json(self)

    def text(self) -> str:
        from postproc.identify.report import fit_text

        return fit_text(self)


def rms(error: Array) -> float:
    """Root mean square of all finite numbers, per axis."""
    good = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0


def fit_model(
    model: Model,
    data: Measurements,
    effects: Sequence[Effect] = (),
    *,
    free: Masks | None = None,
    noise: float | None = None,
    robust: bool = False,
    penalty: Mapping[str, float] | None = None,
) -> Fit:
    """Fit all effects of a model, and further ones, on measured poses; a warm start from the model's present values.

    Args:
        effects: further effects; one with the key of an effect of the model replaces it.
        free: which entries of an effect's vector are fitted; the forms of its variants where an effect is not named.
        noise: standard deviation per axis [m] stated by the user; repeats or ``sigma_mm`` else.
        robust: Huber weights for all rows; rows far off are set aside in any case and named.
        penalty: strength of the smoothness penalty by effect; chosen on held-out rows where it is not given.

    Raises:
        PostprocError: DAT020, fewer measured numbers than parameters.
    """
    data = data.rows(data.usable)
    new = {e.key: e for e in effects}
    every = [new.pop(e.key, e) for e in model.effects] + list(new.values())
    every.sort(key=lambda e: FIRST.index(e.key) if e.key in FIRST else 99 if e.key in LAST else 50)
    figures = estimate_noise(data, noise)
    problem = start_frames(Problem(model.with_effects(*every), data, make_weights(data, figures)))
    masks = {e.key: free[e.key] if free and e.key in free else default_free(e, problem) for e in every}
    problem = _null_where_held(problem, masks, frozenset(e.key for e in effects))
    strength = dict(penalty or {})
    fit = _iterate(problem, masks, figures, robust, strength)
    rough = [e.key for e in fit.model.effects if e.roughness() is not None and e.key not in strength]
    if not rough:
        return fit
    from postproc.identify.smooth import choose_strength

    strength.update({key: choose_strength(fit, key) for key in rough})
    return _iterate(fit.problem, masks, figures, robust, strength)


def evaluate(model: Model, data: Measurements, *, noise: float | None = None) -> Fit:
    """A model beside measurements with nothing fitted but frames that the model lacks.

    An instrument frame or a tool of the model's own is kept as it is.
    """
    data = data.rows(data.usable)
    figures = estimate_noise(data, noise)
    lacking = [cls.null() for cls in (InstrumentFrame, ToolFrame) if model.effect(cls.key) is None]
    if not lacking or data.tool_known:
        lacking = [e for e in lacking if e.key == "instrument_frame"]
    whole = model.with_effects(*lacking, *model.effects)
    problem = start_frames(Problem(whole, data, make_weights(data, figures)))
    nothing = {e.key: np.zeros(len(e.vector()), dtype=bool) for e in whole.effects}
    masks = {**nothing, **{e.key: ~nothing[e.key] for e in lacking}}
    if lacking:
        return _iterate(problem, masks, figures, True, {})
    return Fit(
        problem,
        masks,
        (),
        (),
        np.zeros((len(problem.residual), 0)),
        np.zeros(0),
        figures,
        _far_off(problem, problem.weights, 0),
    )


def _null_where_held(problem: Problem, masks: Masks, fresh: frozenset[str]) -> Problem:
    """What the data cannot determine of a new effect stands at null, whatever its starting values were."""
    held = [(key, i) for key, i in _columns(problem, masks, set())[2] if key in fresh and key not in FRAMES]
    if not held:
        return problem
    effects = []
    for effect in problem.model.effects:
        x, null, amplitude = effect.vector().copy(), effect.null_vector(), effect.amplitudes()
        index = [i for key, i in held if key == effect.key and amplitude[i]]
        x[index] = null[index]
        effects.append(effect.with_vector(x))
    return problem.at(effects)


def default_free(effect: Effect, problem: Problem) -> NDArray[np.bool_]:
    """What a fit moves where nobody chose a form: everything that any variant of the present form frees."""
    if effect.key == "joint_error_map" or type(effect).structures():
        return np.asarray(effect.amplitudes() | True)
    chosen = np.zeros(len(effect.vector()), dtype=bool)
    for form in type(effect).variants(problem.sensitivity.state, effect):
        if len(form.refit) == len(chosen):
            chosen |= form.refit
    return chosen


def _iterate(problem: Problem, masks: Masks, figures: Noise, robust: bool, penalty: Mapping[str, float]) -> Fit:
    stopped: set[tuple[str, int]] = set()
    aside: tuple[int, ...] = ()
    base_weights = problem.weights
    fell = np.inf
    for sweep in range(25):
        columns, parameters, held = _columns(problem, masks, set())
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
            aside = _far_off(problem, base_weights, len(parameters))
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
    columns, parameters, held = _columns(problem, masks, stopped)
    soft = _penalty(problem, parameters, penalty)
    return Fit(problem, masks, held, tuple(sorted(stopped)), columns, soft, figures, aside, dict(penalty))


def _columns(
    problem: Problem, masks: Masks, frozen: set[tuple[str, int]]
) -> tuple[Array, list[tuple[str, int]], tuple[tuple[str, int], ...]]:
    """Whitened columns of all free parameters that the data determines, effect by effect; the others are held.

    A parameter is held where a change of ten ordinary sizes would stay below the noise of the whole data set, or where it only
    repeats what stands before it (rank 1e-7).
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
        ordinary = 10 * effect.scale()[index]
        fresh = columns - basis @ (basis.T @ columns)
        fresh = fresh - basis @ (basis.T @ fresh)
        unit = fresh / np.where(alive, length, 1.0)
        triangle, pivot = qr(unit, mode="r", pivoting=True)
        diagonal = np.zeros(len(index))
        diagonal[pivot[: min(triangle.shape)]] = np.abs(np.diag(triangle))
        soft = np.zeros(len(index), dtype=bool) if effect.roughness() is None else np.ones(len(index), dtype=bool)
        good = soft & alive | alive & (diagonal > 1e-7) & (diagonal * length * ordinary > 1.0)
        held += [(effect.key, int(i)) for i in index[~good]]
        if good.any():
            kept.append(columns[:, good])
            parameters += [(effect.key, int(i)) for i in index[good]]
            more = unit[:, good]
            if soft.any():
                more = more[:, diagonal[good] > 1e-7]
            basis = np.hstack([basis, np.linalg.qr(more)[0]])
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
    """The penalty, and for all parameters but frames a weak pull to null: thirty ordinary sizes count as one standard deviation.

    It is far below the noise of anything that the data determines, and keeps what it barely determines from running away.
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
    # One QR of the whole problem: every active set is then a small one.
    Q, R = np.linalg.qr(A / length)
    rhs = Q.T @ b
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


def _far_off(problem: Problem, weights: Weights, fitted: int) -> tuple[int, ...]:
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
    return np.sqrt(np.minimum(1.0, limit / np.maximum(length, 1e-300)))
