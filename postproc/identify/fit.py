"""Least squares of all parameters of a model on measured poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.effects.instrument_frame import InstrumentFrame
from postproc.effects.tool_frame import ToolFrame
from postproc.identify.linear import Linear, basis_of, contiguous_blocks, hold_out, independent_share, serial_share
from postproc.identify.problem import Problem, make_weights
from postproc.identify.reweight import far_off
from postproc.identify.solve import SETTLED, solve
from postproc.identify.start import start_frames
from postproc.identify.step import FRAMES, Masks, slope
from postproc.measure.measurements import Measurements
from postproc.measure.repeat import Noise, estimate_noise
from postproc.measure.trajectory import GAP_S
from postproc.model.arm import Model

FIRST = ("instrument_frame", "tool_frame", "joint_offset", "joint_compliance")
LAST = ("link_geometry",)
"""Where two parameters do the same, the effect that stands later is held: frames before offsets before geometry."""


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
        """The fit as a linear problem: residual and a basis of its columns.

        Penalised shares are put back into the residual, y = r + A x, so that y - U U^T y is the residual again.
        """
        soft = np.flatnonzero(self.penalty)
        y = self.problem.residual + self.columns[:, soft] @ self._vector()[soft]
        turns = self.problem.whiten(self.problem.sensitivity.matrix[:, :, :6])
        share = independent_share(self.problem.residual, turns, self.problem.row)
        return Linear(y, basis_of(self.columns, self.penalty), self.problem.row, share, self.serial)

    @cached_property
    def serial(self) -> float:
        """Share of the rows that count as independent.

        Neighbours in a record of the moving arm resemble each other, repeats share what rounded angles are off.
        """
        state, weights = self.data.state, self.problem.weights
        if state.v is None or state.time is None or np.median(np.diff(np.sort(state.time))) > GAP_S:
            # Poses one by one: what drifts from each to the next is missing physics, not noise.
            each = np.bincount(self.data.repeats)
            return float(np.sum(each / (1 + (each - 1) * self.noise.shared)) / len(state))
        order = np.argsort(state.time, kind="stable")
        return serial_share(np.where(weights.used, self.problem.error * weights.values, np.nan)[order])

    def _vector(self) -> Array:
        values = {e.key: e.vector() for e in self.model.effects}
        return np.array([values[key][i] for key, i in self.parameters])

    @cached_property
    def freedom(self) -> float:
        """Measured numbers minus fitted parameters (the effective number, where a penalty holds them)."""
        return float(len(self.problem.residual) - self.linear.parameters)

    @cached_property
    def variance(self) -> float:
        """Residual variance over the stated one, sum of squares / (N - p); scipy's cost needs the factor 2 for this."""
        return float(self.problem.residual @ self.problem.residual) / max(self.freedom, 1.0)

    @cached_property
    def covariance(self) -> Array:
        """(p, p) of the fitted parameters: variance (A^T A + penalty)^-1 over the share of independent rows."""
        length = np.sqrt(np.sum(self.columns**2, axis=0) + self.penalty**2)
        scale = np.where(length > 0, length, 1.0)
        A = self.columns / scale
        inverse = np.linalg.pinv(A.T @ A + np.diag((self.penalty / scale) ** 2), rcond=1e-14, hermitian=True)
        return np.asarray(self.variance / self.serial * inverse / np.outer(scale, scale))

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
        """(n, 3) position error of every row as the other blocks predict it [m].

        Ten contiguous blocks, repeats together.
        """
        blocks = contiguous_blocks(self.data.repeats)
        linear = self.linear
        out = hold_out(linear, (), blocks[linear.row])
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
    closely: float = SETTLED,
) -> Fit:
    """Fit all effects of a model, and further ones, on measured poses; a warm start from the model's present values.

    Args:
        effects: further effects; one with the key of an effect of the model replaces it.
        free: which entries of an effect's vector are fitted; the forms of its variants where an effect is not named.
        noise: standard deviation per axis [m] stated by the user; repeats or ``sigma_mm`` else.
        robust: Huber weights for all rows; rows far off are set aside in any case and named.
        penalty: strength of the smoothness penalty by effect; with the resolution of the free function it is chosen on
            held-out rows where it is not given.
        closely: share of the sum of squares below which a step is the last.

    Raises:
        PostprocError: DAT020, fewer measured numbers than parameters.
    """
    data = data.rows(data.usable)
    new = {e.key: e for e in effects}
    every = [new.pop(e.key, e) for e in model.effects] + list(new.values())
    every.sort(key=_place)
    figures = estimate_noise(data, noise)
    problem = start_frames(Problem(model.with_effects(*every), data, make_weights(data, figures)))
    problem, figures = problem.blurred(figures)
    masks = {e.key: free[e.key] if free and e.key in free else default_free(e, problem) for e in every}
    problem = _null_where_held(problem, masks, frozenset(e.key for e in effects))
    strength = dict(penalty or {})
    fit = _fitted(problem, masks, figures, robust, strength, closely)
    rough = [e.key for e in fit.model.effects if e.roughness() is not None and e.key not in strength]
    if not rough:
        return fit
    from postproc.identify.smooth import choose_smoothness

    smooth = {key: choose_smoothness(fit, key) for key in rough}
    strength.update({key: s.strength for key, s in smooth.items()})
    masks.update({key: np.ones(len(s.effect.vector()), dtype=bool) for key, s in smooth.items()})
    finer = [smooth[e.key].effect if e.key in smooth else e for e in fit.model.effects]
    return _fitted(fit.problem.at(finer), masks, figures, robust, strength, closely)


def _place(effect: Effect) -> int:
    if effect.roughness() is not None:
        return 100
    return FIRST.index(effect.key) if effect.key in FIRST else 99 if effect.key in LAST else 50


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
        return _fitted(problem, masks, figures, True, {})
    none = np.zeros((len(problem.residual), 0))
    aside = far_off(problem, problem.weights)
    return Fit(problem, masks, (), (), none, np.zeros(0), figures, aside)


def _null_where_held(problem: Problem, masks: Masks, fresh: frozenset[str]) -> Problem:
    """What the data cannot determine of a new effect stands at null, whatever its starting values were."""
    if all(e.is_null or e.roughness() is not None for e in problem.model.effects if e.key in fresh):
        return problem
    masks = {e.key: masks[e.key] & (e.roughness() is None) for e in problem.model.effects}
    held = [(key, i) for key, i in slope(problem, masks, set(), {}).held if key in fresh and key not in FRAMES]
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


def _fitted(
    problem: Problem,
    masks: Masks,
    figures: Noise,
    robust: bool,
    penalty: Mapping[str, float],
    closely: float = SETTLED,
) -> Fit:
    s = solve(problem, masks, figures, robust, penalty, closely)
    at = s.slope
    return Fit(s.problem, masks, at.held, s.at_bound, at.columns, at.penalty, figures, s.set_aside, dict(penalty))
