"""A fitted model as least squares found it: parameters, residuals, errors on rows it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.asking import of_parameters
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.held_out import contiguous_blocks, hold_out, standardised
from postproc.estimation.independent import independent_share, record_share, repeated_share
from postproc.estimation.linear import Linear, basis_of, solve_positive
from postproc.estimation.problem import Problem
from postproc.estimation.solving.step import Masks
from postproc.measure.checks.repeats import Noise
from postproc.measure.errors import rms
from postproc.measure.measurements import Measurements
from postproc.measure.observations import Observation
from postproc.model.arm import Model

WEAK = 0.1
"""Share of the weight of priors that counts where the residual of few readings tells their noise."""
ASSUMED = 10.0
"""Degrees of freedom with which the assumed noise of few readings counts beside what they show of it."""


@dataclass(frozen=True)
class Solution:
    """A fitted model as least squares found it.

    Args:
        problem: the fitted model and the measurements.
        free: which parameters the fit was asked to move: masks over ``effect.vector()`` by effect key.
        unidentifiable: parameters, as (effect key, index), that kept their value: the data does not determine them.
        at_bound: parameters, as (effect key, index), that stopped at a bound.
        columns: (N, p) whitened derivatives by the parameters that were fitted, in the order of ``parameters``.
        penalty: (p,) weights of the smoothness penalty, 0 where there is none.
        noise: of the instrument and the arm, by which the numbers were weighted.
        excluded: indices of rows of ``problem.data`` so far off that they are excluded from the fit.
        strength: of the smoothness penalty, by effect key.
        pull: (p,) weights of the priors, and centre: (p,) the values to which they pull; None before a fit is moved to
            its posterior (`settle`).
    """

    problem: Problem
    free: Masks
    unidentifiable: tuple[tuple[str, int], ...]
    at_bound: tuple[tuple[str, int], ...]
    columns: Array
    penalty: Array
    noise: Noise
    excluded: tuple[int, ...] = ()
    strength: Mapping[str, float] = field(default_factory=dict)
    pull: Array | None = None
    centre: Array | None = None

    @property
    def model(self) -> Model:
        """The fitted model."""
        return self.problem.model

    @property
    def data(self) -> Measurements:
        """The measurements that were fitted, excluded rows included."""
        return self.problem.data

    @cached_property
    def parameters(self) -> tuple[tuple[str, int], ...]:
        """(effect key, index in its vector) of every parameter that was fitted, in the order of ``columns``."""
        out = set(self.unidentifiable) | set(self.at_bound)
        every = [(e.key, int(i)) for e in self.model.effects for i in np.flatnonzero(self.free.get(e.key, []))]
        return tuple(p for p in every if p not in out)

    @cached_property
    def excluded_rows(self) -> list[tuple[int, int]]:
        """(file number, row number) of the rows that are excluded or cannot be right, sorted."""
        data = self.data
        rows = {(data.file[i] if data.file else 0, data.row[i] if data.row else i + 1) for i in self.excluded}
        return sorted(rows | data.wrong)

    @cached_property
    def unknown(self) -> tuple[tuple[str, int], ...]:
        """Parameters (effect key, index) that the data does not determine: unidentifiable, or fixed and seen in no row.

        Lost motion of a joint that was always approached from one side, for example, stays null in a fit of the lost
        motion of the other joints.
        """
        parameters = list(self.unidentifiable)
        for effect in self.model.effects:
            mask = self.free.get(effect.key, np.zeros(0, dtype=bool))
            fixed = effect.amplitudes() & ~mask if mask.any() else np.zeros(0, dtype=bool)
            if fixed.any():
                size = ordinary_sizes(effect, self.model.robot)[fixed]
                columns = self.linear.project(self.problem.columns(effect, fixed) * size)
                silent = np.sum(columns**2, axis=0) < self.variance
                parameters += [(effect.key, int(i)) for i in np.flatnonzero(fixed)[silent]]
        return tuple(parameters)

    @cached_property
    def linear(self) -> Linear:
        """The fit as a linear problem: residual, basis of its columns, and the shares that are independent."""
        return replace(self._linear, serial=self.serial)

    @cached_property
    def _linear(self) -> Linear:
        """The fit as a linear problem, as if neighbouring rows of a record were independent.

        What parameters x predict that a penalty or a prior pulls to m is added to the residual, y = r + A (x - m), so
        that y - U U^T y is the residual again.
        """
        turns = self.problem.whiten(self.problem.sensitivity.matrix[:, :, :6])
        share = independent_share(self.problem.residual, turns, self.problem.row)
        return replace(self._as_if_independent(), independent=min(share, self.informative))

    def _as_if_independent(self, share: float = 1.0) -> Linear:
        """Return the fit as a linear problem in which all numbers are independent.

        Args:
            share: of the weight of the priors that counts.
        """
        off, weight = of_parameters(self.model.effects, self.parameters), self.penalty
        if self.pull is not None and self.centre is not None:
            off, weight = off - self.centre, np.hypot(weight, share * self.pull)
        soft = np.flatnonzero(weight)
        y = self.problem.residual + self.columns[:, soft] @ off[soft]
        return Linear(y, basis_of(self.columns, weight), self.problem.row)

    def basis(self, share: float = 1.0) -> Array:
        """Return (N, k) basis of what the fit can still move.

        Args:
            share: of the smoothness penalty that still counts; 1 for all of it.
        """
        weight = share * self.penalty
        return basis_of(self.columns, weight if self.pull is None else np.hypot(weight, self.pull))

    @cached_property
    def serial(self) -> float:
        """Share of rows that count as independent; below 1 where neighbouring rows of a record have similar errors."""
        # What stopped at a bound did so for the same reason as what is missing.
        stopped = [self._stopped(e) for e in self.model.effects if any(key == e.key for key, _ in self.at_bound)]
        return record_share(self.problem, self._linear, stopped)

    def _stopped(self, effect: Effect) -> Array:
        """Return (N, k) whitened columns of an effect's parameters that stopped at a bound."""
        mask = np.zeros(len(effect.vector()), dtype=bool)
        mask[[i for key, i in self.at_bound if key == effect.key]] = True
        return self.problem.columns(effect, mask)

    @cached_property
    def informative(self) -> float:
        """Share of measured numbers that are new information; below 1 where repeats of a pose share rounded angles."""
        turn = self.problem.weights.turn
        return 1.0 if turn is None else repeated_share(turn, self.data.repeats)

    @cached_property
    def freedom(self) -> float:
        """Degrees of freedom: informative numbers minus fitted parameters (their effective number under a penalty)."""
        return self.informative * len(self.problem.residual) - self.linear.parameters

    @cached_property
    def variance(self) -> float:
        """Residual variance in units of the assumed one: the whitened sum of squares over the degrees of freedom.

        Where priors take part in a fit of few readings, it is that with priors of a tenth of their weight, with
        `ASSUMED` degrees of freedom of the assumed noise: what priors keep a fit from reaching is no noise. Without
        any, an arm that shrinks to a tip would have none.
        """
        if not self.problem.few:
            return float(self.problem.residual @ self.problem.residual) / max(self.freedom, 1.0)
        free = self._as_if_independent(WEAK)
        freedom = self.informative * len(free.residual) - float(np.sum(free.nuisance**2))
        return (float(free.projected_residual @ free.projected_residual) + ASSUMED) / (max(freedom, 0.0) + ASSUMED)

    @cached_property
    def inverse(self) -> Array:
        """(p, p) inverse (A^T A + diag(penalty)^2)^-1 of the normal equations, in the order of ``parameters``."""
        gram = self.columns.T @ self.columns + np.diag(self.penalty**2)
        return solve_positive(gram, np.eye(len(gram)))

    @cached_property
    def overconfidence(self) -> float:
        """Factor, at least 1, by which the residual variance on unseen poses exceeds that on the fitted rows.

        A free function that few poses determine is too confident, since the same rows chose its smoothness. The factor
        is 1 without a penalty.
        """
        if not self.penalty.any():
            return 1.0
        linear, observed = self.linear, np.zeros(self.problem.weights.values.shape, dtype=bool)
        observed[:, self.observed.columns] = True
        out = standardised(linear.residual, linear.nuisance, self.data.repeats[linear.row])
        square = np.mean(out[observed[self.problem.weights.used]] ** 2)
        return max(float(square) / max(self.variance, 1e-300), 1.0)

    @property
    def observed(self) -> Observation:
        """The kind of measured numbers that the figures are about (position, orientation or joint), with its unit."""
        return self.data.observed

    @cached_property
    def rms(self) -> float:
        """Root mean square error per axis (or joint) over the rows in the fit [m], [rad] of angles."""
        return rms(self._in_fit(self.observed_error))

    @property
    def observed_error(self) -> Array:
        """(n, k) measured minus predicted of the observed kind [m], [rad] of angles; NaN where not measured."""
        return self.problem.error[:, self.observed.columns]

    @cached_property
    def position_error(self) -> Array:
        """(n, 3) measured minus predicted position [m], instrument axes; NaN where not measured or excluded."""
        return self._in_fit(self.problem.error[:, :3])

    def _in_fit(self, error: Array) -> Array:
        """Return errors (n, k) with NaN in the excluded rows."""
        error = error.copy()
        error[list(self.excluded)] = np.nan
        return error

    @cached_property
    def held_out_error(self) -> Array:
        """(n, k) errors [m], [rad] of contiguous blocks of rows, each predicted by a fit to the other blocks."""
        return self.held_out_by(contiguous_blocks(self.data.fold_group))

    @property
    def held_out_blocks(self) -> int:
        """Number of the blocks of consecutive rows that are held out one after another."""
        return int(contiguous_blocks(self.data.fold_group).max()) + 1

    def held_out_by(self, blocks: NDArray[np.int_]) -> Array:
        """Return (n, k) errors [m], [rad] of blocks of rows, each predicted by a fit to the other blocks.

        Args:
            blocks: (n,) number of the block of each row.
        """
        linear = self.linear
        out = hold_out(linear.residual, linear.nuisance, blocks[linear.row])
        return self.problem.weights.measured(out)[:, self.observed.columns]

    @cached_property
    def held_out_rms(self) -> float:
        """Root mean square error [m], [rad] of angles, of rows predicted without their block, over rows and axes."""
        return rms(self.held_out_error)

    @cached_property
    def _square(self) -> float:
        """Residual variance [m^2], [rad^2] of the observed numbers, corrected for the degrees of freedom."""
        used = self.problem.weights.used[:, self.observed.columns]
        if self.problem.few:
            return self.variance * rms(1.0 / self.problem.weights.values[:, self.observed.columns][used]) ** 2
        error = self.observed_error[used]
        return rms(error) ** 2 * self.informative * len(self.problem.residual) / max(self.freedom, 1.0)
