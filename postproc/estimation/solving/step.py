"""One step of a fit: the residual's slope by the parameters, and where the normal equations lead inside the bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.asking import of_parameters, with_parameters
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.linear import MANY_COLUMNS
from postproc.estimation.problem import Problem, Weights

SMALL = 0.3
"""Share of its ordinary size by which a parameter may move without changing the others' columns."""

STEP_DAMPING = 1e-9
"""Least pull on a column of unit length, a hundredth of what a column must add to the others to be fitted."""

Masks = Mapping[str, NDArray[np.bool_]]
Name = tuple[str, int]


@dataclass(frozen=True)
class Slope:
    """The derivatives of the residual by the parameters at one point, valid for as long as the model hardly bends.

    Args:
        columns: (N, p) whitened derivatives by the parameters that the data determines.
        parameters: the p parameters, as (effect key, index).
        unidentifiable: free parameters that the data does not determine.
        penalty: (p,) weights of the smoothness penalty. anchor: (p,) those combined with the pull to ``centre`` (p,):
            a weak one to null, or that of the priors.
        weights: with which the columns are whitened. prior: whether the pull is that of the priors.
        damping: pull towards where the model stands, on columns of unit length (Levenberg 1944, Marquardt 1963).
    """

    columns: Array
    parameters: tuple[Name, ...]
    unidentifiable: tuple[Name, ...]
    penalty: Array
    anchor: Array
    centre: Array
    weights: Weights
    prior: bool = False
    damping: float = 0.0

    @property
    def shared(self) -> dict[str, Any]:
        """What a `Solution` at this point has of the slope; priors that took part do so without some of the rows."""
        pull = np.where(self.penalty > 0, 0.0, self.anchor) if self.prior else None
        same = {"unidentifiable": self.unidentifiable, "columns": self.columns, "penalty": self.penalty}
        return {**same, "pull": pull, "centre": self.centre if self.prior else None}

    def values(self, problem: Problem) -> Array:
        """Return (p,) values of the slope's parameters in a problem's model."""
        return of_parameters(problem.model.effects, self.parameters)

    def cost(self, problem: Problem) -> float:
        """Return the whitened sum of squares plus the squared ways from the centre, each times its anchor weight."""
        pulled = self.anchor * (self.values(problem) - self.centre)
        return float(problem.residual @ problem.residual + pulled @ pulled)

    @cached_property
    def length(self) -> Array:
        """(p,) Euclidean lengths of the columns, each with its anchor weight appended; 1 in place of 0.

        Where priors take part, those of what unknowns of set-ups, which have none, leave of the columns.
        """
        columns = self.columns
        if self.prior and self._flat.any():
            Q = np.linalg.qr(columns[:, self._flat])[0]
            columns = np.where(self._flat, columns, columns - Q @ (Q.T @ columns))
        length = np.sqrt(np.einsum("np,np->p", columns, columns) + self.anchor**2)
        return np.where(length > 0, length, 1.0)

    @property
    def _flat(self) -> NDArray[np.bool_]:
        """(p,) parameters that are eliminated, not damped: linear unknowns without a prior, where others have one."""
        return self.prior & (self.anchor == 0)

    @cached_property
    def gram(self) -> Array:
        """(p, p) products A^T A of the columns, scaled to length 1."""
        return np.asarray((self.columns.T @ self.columns) / np.outer(self.length, self.length))

    @cached_property
    def factor(self) -> Array:
        """(p, p) upper triangular R of [A; diag(anchor); sqrt(damping)] = Q R, for columns scaled to length 1.

        More than `MANY_COLUMNS` go through the normal equations, whose rounding errors the next steps correct.
        """
        # What hardly anything determines is damped, so that every step has one solution.
        damping = np.sqrt(self.damping) * ~self._flat
        pull = np.hypot(np.maximum(self.anchor / self.length, STEP_DAMPING), damping)
        if len(self.parameters) > MANY_COLUMNS:
            from scipy.linalg import LinAlgError, cholesky

            try:
                return np.asarray(cholesky(self.gram + np.diag(pull**2), overwrite_a=True, check_finite=False))
            except LinAlgError:
                pass
        return np.asarray(np.linalg.qr(np.vstack([self.columns / self.length, np.diag(pull)]), mode="r"))

    def damped(self, damping: float) -> Slope:
        """Return the slope with another damping of its steps."""
        if damping == self.damping:
            return self
        other = replace(self, damping=damping)
        other.__dict__.update(length=self.length)
        if len(self.parameters) > MANY_COLUMNS:
            other.__dict__.update(gram=self.gram)
        else:
            added = np.diag(np.sqrt(damping) * ~self._flat)
            other.__dict__.update(factor=np.linalg.qr(np.vstack([self.factor, added]), mode="r"))
        return other

    def solved(self, right: Array) -> Array:
        """Return (A^T A + diag(anchor)^2)^-1 b for b (p,) or (p, k).

        It solves the semi-normal equations with `factor` (Bjoerck 1996, Sec. 2.4.6).
        """
        from scipy.linalg import cho_solve

        scaled = (right.T / self.length).T
        return np.asarray((cho_solve((self.factor, False), scaled, check_finite=False).T / self.length).T)

    def still_holds(self, problem: Problem, further: Problem) -> bool:
        """Return whether the slope is valid at a further problem, too: it has amplitudes only, all moved a little.

        Args:
            problem: where the slope is valid; further: the problem with other parameters, which may have moved by
                `SMALL` of their ordinary sizes.
        """
        effects, names = problem.model.effects, self.parameters
        move = np.abs(self.values(further) - self.values(problem))
        small = move < SMALL * of_parameters(effects, names, lambda e: sizes(problem, e))
        return bool(np.all(of_parameters(effects, names, Effect.amplitudes)) and small.all())

    def bends(self, problem: Problem, further: Problem) -> float:
        """Return the error of the predicted change of the residual between two problems, as a share of that change.

        Args:
            problem, further: the same measurements with the model's parameters before and after a step.
        """
        predicted = self.columns @ (self.values(further) - self.values(problem))
        missed = problem.residual - predicted - further.residual
        return float(np.linalg.norm(missed)) / max(float(np.linalg.norm(predicted)), 1e-300)

    def predicted_cost(self, problem: Problem, step: Array) -> float:
        """Return the `cost` that the linear model predicts for a problem after a step (p,) of its parameters."""
        residual = problem.residual - self.columns @ step
        pulled = self.anchor * (self.values(problem) + step - self.centre)
        return float(residual @ residual + pulled @ pulled)

    def reweighted(self, weights: Weights) -> Slope | None:
        """Return the slope at other weights; None where they use measured numbers that it has no rows for."""
        old, new = self.weights, weights
        if (new.used & ~old.used).any():
            return None
        kept = new.used[old.used]
        ratio = new.values[new.used] / old.values[new.used]
        columns = self.columns if kept.all() else self.columns[kept]
        return replace(self, columns=columns * ratio[:, None], weights=new)

    def step(self, problem: Problem) -> tuple[Array, set[Name]]:
        """Return the step (p,) to the least cost of the linear model inside the bounds, and what stopped at a bound.

        This is least squares in a box. With x_B the parameters that would leave the box, the others are eliminated: the
        cost is (x_B - a_B)^T K^-1 (x_B - a_B) more than at the free minimum a, with K the block of (A^T A)^-1. This
        small problem is solved with bounds (Lawson and Hanson 1974, Ch. 23), and again with more parameters until no
        other one leaves the box.
        """
        x, effects = self.values(problem), problem.model.effects
        lowest, highest = of_parameters(effects, self.parameters, lambda e: np.transpose(e.bounds())).reshape(-1, 2).T
        reach = of_parameters(effects, self.parameters, _longest_step)
        low, high = np.maximum(lowest, x - reach) - x, np.minimum(highest, x + reach) - x
        aim = step = self.solved(self.columns.T @ problem.residual - self.anchor**2 * (x - self.centre))
        boxed = np.zeros(len(x), dtype=bool)
        while (leaving := ~boxed & ((step < low) | (step > high))).any():
            boxed |= leaving
            moves = self.solved(np.eye(len(x))[:, boxed])
            inside = _boxed(aim[boxed], moves[boxed], low[boxed], high[boxed])
            step = aim - moves @ np.linalg.solve(moves[boxed], aim[boxed] - inside)
            step[boxed] = inside
        stopped = boxed & ((x + step <= lowest) | (x + step >= highest))
        return step, {p for p, at in zip(self.parameters, stopped, strict=True) if at}

    def moved(self, problem: Problem, step: Array) -> Problem:
        """Return the problem with a step (p,) added to the parameters, which are clipped at their bounds."""
        return problem.at(with_parameters(problem.model.effects, self.parameters, self.values(problem) + step))


def sizes(problem: Problem, effect: Effect) -> Array:
    """Return (q,) ordinary sizes of an effect's parameters: their typical magnitudes on the problem's arm."""
    return ordinary_sizes(effect, problem.model.robot)


def _longest_step(effect: Effect) -> Array:
    """Return (q,) how far parameters may go in one step: amplitudes anywhere, other ones by half their value.

    Half the scale of a parameter counts where that is more.
    """
    return np.where(effect.amplitudes(), np.inf, 0.5 * np.maximum(np.abs(effect.vector()), effect.scale()))


def _boxed(aim: Array, covariance: Array, low: Array, high: Array) -> Array:
    """Return (m,) the point x of a box that minimizes |L^-1 (x - a)|^2, where L L^T is a covariance.

    Args:
        aim: (m,) a, the minimum without the box; covariance: (m, m); low, high: (m,) lower and upper limits of the box.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import lsq_linear

    unit = np.sqrt(np.diag(covariance))
    lower = np.linalg.cholesky(covariance / np.outer(unit, unit))
    metric = solve_triangular(lower, np.eye(len(aim)), lower=True)
    best = lsq_linear(metric, metric @ (aim / unit), (low / unit, high / unit), method="bvls")
    return np.asarray(np.clip(best.x * unit, low, high))
