"""What effects are worth, as 2 log of odds: their forms by a score test, fitted parameters by Laplace's method."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.evidence import DECADES, ROUNDING_SHARE, log_evidence, schwarz
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.estimation.solving.determined import WIDE
from postproc.identification.screen.forms import Forms, Stack
from postproc.robot.arm import Robot

DIM = 1e-6
"""Below a thousandth of its length a direction is what the fitted parameters can do as well (this is the square)."""


@dataclass(frozen=True)
class Gain:
    """What M forms would bring, (M,) each, or what one of them would.

    Args:
        rss_reduction: by how much it lowers the whitened sum of squares.
        count: number of parameters (those that only shape the effect included).
        visible: displacement by the form at its ordinary size, in units of the noise, beside the fitted parameters.
        evidence: 2 log of the odds against nothing, before counting how many forms were tried.
    """

    rss_reduction: Array
    count: NDArray[np.int_]
    visible: Array
    evidence: Array

    def of(self, m: int) -> Gain:
        """Return the gain of the m-th form."""
        return Gain(self.rss_reduction[m], self.count[m], self.visible[m], self.evidence[m])


@dataclass(frozen=True)
class JointTurns:
    """The joints' turns beside the fitted parameters, their products summed over the numbers of each row.

    What only turns joints has one number a row: six times as many products would be summed without this.

    Args:
        rows: (R,) indices of the measured rows; square: (R, 6, 6) products of the whitened turns of every two joints.
        inside: (k, R, 6) products of a basis of the fitted parameters with the turns; along: (R, 6) of the residual.
    """

    rows: NDArray[np.int_]
    square: Array
    inside: Array
    along: Array

    @classmethod
    def of(cls, linear: Linear, turns: Array) -> JointTurns:
        """Return the products of the whitened turns (N, 6) of the joints beside a fit."""
        along = linear.by_row(linear.projected_residual[:, None], turns)[:, 0]
        inside = linear.by_row(linear.nuisance, turns).transpose(1, 0, 2)
        return cls(np.unique(linear.row), linear.by_row(turns, turns), inside, along)

    def products(self, stack: Stack) -> tuple[Array, Array, Array]:
        """Return `_products` of a stack of forms that turn joints."""
        M, joints = len(stack.index), np.array(stack.joint)
        V = stack.values[self.rows].reshape(len(self.rows), M, -1)
        gram, inside = np.empty((M, len(joints), len(joints))), np.empty((M, len(self.inside), len(joints)))
        for i in np.unique(joints):
            first = np.flatnonzero(joints == i)
            inside[:, :, first] = np.tensordot(self.inside[:, :, i], V[:, :, first], 1).transpose(1, 0, 2)
            for j in np.unique(joints):
                second = np.flatnonzero(joints == j)
                some = (V[:, :, first] * self.square[:, i, j, None, None]).transpose(1, 2, 0)
                gram[:, first[:, None], second] = some @ V[:, :, second].transpose(1, 0, 2)
        return gram, inside, np.einsum("nmw,nw->mw", V, self.along[:, joints])


def score_tests(problem: Problem, linear: Linear, forms: Forms) -> Gain:
    """Return the gain of every form, (M,) each, beside the fitted parameters (score test, no refit).

    Args:
        problem: the fitted model beside the data; linear: the same fit as a linear problem.
    """
    order = np.argsort(np.concatenate([stack.index for stack in forms.stacks]))
    turned = any(stack.joint is not None for stack in forms.stacks)
    turns = JointTurns.of(linear, problem.turns) if turned else None
    parts = [_of_stack(linear, stack, turns) for stack in forms.stacks]
    return Gain(*(np.concatenate([getattr(f, each.name) for f in parts])[order] for each in fields(Gain)))


def gain(linear: Linear, columns: Array, forming: int = 0, flexible: bool = False) -> Gain:
    """Return the gain by (N, m) whitened columns of one form, each for the ordinary size of its parameter.

    Args:
        linear: the fit without the form; forming: number of further parameters that a full fit would move.
        flexible: whether the form is a free function.
    """
    one = np.zeros(1, dtype=int)
    stack = Stack(one, columns, None, one + forming, np.array([flexible]), one)
    return _of_stack(linear, stack).of(0)


def _products(linear: Linear, stack: Stack) -> tuple[Array, Array, Array]:
    """Return C^T C (M, w, w), U^T C (M, k, w) and C^T y (M, w) of the columns C of each of M forms.

    Args:
        linear: the fit, with a basis U of its columns and the residual y.
    """
    M = len(stack.index)
    inside = (linear.nuisance.T @ stack.values).reshape(linear.nuisance.shape[1], M, -1).transpose(1, 0, 2)
    return stack.gram, inside, (stack.values.T @ linear.projected_residual).reshape(M, -1)


def _of_stack(linear: Linear, stack: Stack, turns: JointTurns | None = None) -> Gain:
    """Return reduction of the sum of squares, count, visible size and evidence, (M,) each, of the M forms in a stack.

    For a form with whitened columns C, and data y, G = C^T P C and b = C^T P y, where P projects out the fitted
    parameters. With parameters that scatter by a = 3 d ordinary sizes, least squares lower the sum of squares by
    b^T (G + s^2/a^2)^-1 b; the factor d (some decades) of the largest evidence is taken, which costs 2 |log d| of it.
    Directions that the data cannot see cost and bring nothing.

    Args:
        turns: what turns joints beside the fit; None for a stack of columns.
    """
    before, freedom, forming = linear.square, float(linear.freedom), stack.forming
    gram, inside, along = _products(linear, stack) if turns is None or stack.joint is None else turns.products(stack)
    M, length = len(along), np.diagonal(gram, axis1=1, axis2=2)
    G = gram - inside.transpose(0, 2, 1) @ inside
    value, vector = np.linalg.eigh(G)
    value = np.maximum(value, 0.0)
    part = np.einsum("mij,mi->mj", vector, along) ** 2
    # How much of each direction the fitted parameters leave, against what it is in columns of length one.
    seen = value > DIM * np.einsum("mij,mi->mj", vector**2, length)
    count = seen.sum(axis=1)
    reduction = np.minimum(np.sum(part * seen / np.where(seen, value, 1.0), axis=1), before)
    free = freedom - count - forming
    s2 = np.maximum(before - reduction, ROUNDING_SHARE * before) / np.maximum(free, 1.0)
    evidence = np.full(M, -np.inf)
    for decade in DECADES:
        wide = ((WIDE * decade) ** 2 / s2)[:, None]
        after = before - np.sum(wide * part / (1 + wide * value), axis=1)
        evidence = np.maximum(evidence, log_evidence(before, after, freedom, wide * value) - 2 * abs(np.log(decade)))
    # A knee or a point is never known as well as an amplitude: half of Schwarz's price.
    evidence -= 0.5 * forming * np.log(max(freedom, 1.0))
    # A hose only pulls: what it would have to push explains nothing.
    pushes = (stack.sign == 1) & (along[:, 0] < 0)
    evidence[pushes], reduction[pushes] = -np.inf, 0.0
    # A free function must earn every coefficient, or it would stand in for any effect of a few parameters.
    for m in np.flatnonzero(stack.flexible):
        evidence[m] = min(evidence[m], schwarz(before, before - reduction[m], count[m], freedom))
    good = (count > 0) & (free >= 1)
    visible = np.sqrt(value.sum(axis=1))
    every = (reduction, 0.0), (count + forming, 0), (visible, 0.0), (evidence, -np.inf)
    return Gain(*(np.where(good, value_of, nothing) for value_of, nothing in every))


def laplace(
    linear: Linear, remaining: float, gram: Array, effect: Effect, *, robot: Robot, index: NDArray[np.int_]
) -> float:
    """Return the log evidence of fitted parameters of one effect, each counted by what it moves in the data.

    Amplitudes scatter by three ordinary sizes a priori, or by a decade more or less as in `score_tests`; parameters
    that only shape the effect by their own value: a point or a knee that the data hardly sees costs hardly anything.
    The deviations of amplitudes, and of coordinates of either sign, from their prior count: a hose that is tied a metre
    and a half below the floor is implausible.

    Args:
        linear: the fit without the effect; remaining: the sum of squares with it.
        gram: (p, p) C^T M C of the parameters' columns; index: (p,) which entries of the effect's vector they are.
    """
    x, wide, amplitude = effect.vector()[index], ordinary_sizes(effect, robot)[index], effect.amplitudes()[index]
    places = ~effect.amplitudes() & (effect.bounds()[0] < 0)  # those that stopped at a bound, too
    implausible = float(np.sum((effect.vector()[places] / (WIDE * effect.scale()[places])) ** 2))
    s2 = remaining / max(linear.freedom - len(x), 1)
    evidence = -np.inf
    for decade in DECADES:
        scatter = np.where(amplitude, WIDE * decade * wide, np.maximum(np.abs(x), wide))
        information = np.maximum(np.linalg.eigvalsh(gram * np.outer(scatter, scatter)), 0.0) / s2
        after = remaining + s2 * (float(np.sum((x[amplitude] / scatter[amplitude]) ** 2)) + implausible)
        at_decade = log_evidence(linear.square, after, linear.freedom, information)
        evidence = max(evidence, float(at_decade) - 2 * abs(float(np.log(decade))))
    return evidence
