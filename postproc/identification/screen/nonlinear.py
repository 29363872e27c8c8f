"""What forms an effect, a knee or the ends of a hose, where it explains most, before anything is fitted in full."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.asking import displacement_of, loads_of
from postproc.effects.base import Effect
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.evidence import CLOSE_EVIDENCE, f_test
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.estimation.solving.determined import pull
from postproc.identification.screen.candidate import Candidate, Screen, kind
from postproc.identification.screen.gain import laplace
from postproc.model.derivatives.places import displacement_parts, load_parts

SCREENED_POSES = 120
"""Poses on which a shape is looked for; parameters of the fit ask for more."""
STAGES = ((3, 6), (6, 4), (25, 3))
"""Steps of a search, and how many laws, pairs of bodies .. go on after them, each from its best start.

No start is left out by what its columns alone explain: the ends of a hose may be right where they explain least.
"""
LAST_STEP_SHARE = 3e-3
"""Share of the sum of squares below which a step is the last."""
AT_LAST = 60, 1e-6
"""Steps on all poses in the end, and that share: a full fit follows, whose every step costs as much as ten of these."""
TWICE = 2.0
"""As much more of the sum of squares may an effect take off in the end as after the first steps."""


@dataclass(frozen=True)
class SubsampledProblem:
    """Some poses of a problem, and the residual of the fitted parameters on them.

    Args:
        problem: those poses; linear: their residual, and the fitted parameters of the whole problem.
        known: results of `by_load`, by their arguments.
    """

    problem: Problem
    linear: Linear
    known: dict[Hashable, Array] = field(default_factory=dict)

    def answers(self, effects: Sequence[Effect]) -> Array:
        """Return (N, m) whitened displacements of the measured numbers by each of m effects of one class.

        Springs yield to the loads of an effect.
        """
        seen, n, cls = self.problem.softer, len(self.problem.data), type(effects[0])
        answer = np.zeros((n, seen.matrix.shape[1], len(effects)))
        if cls.displacement is not Effect.displacement or cls.joint_basis is not Effect.joint_basis:
            moves = [displacement_parts(displacement_of(e, seen.state)) for e in effects]
            for at in sorted({at for moved in moves for at in moved}):
                parts = [np.broadcast_to(moved.get(at, 0.0), (n, 6)) for moved in moves]
                answer += seen.matrix[:, :, at : at + 6] @ np.stack(parts, axis=2)
        if cls.load is not Effect.load:
            for at, every in load_parts(loads_of(effects, seen.state)).items():
                answer += self.by_load(at) @ every
        return np.asarray(answer[self.problem.weights.used])

    def by_load(self, first: int) -> Array:
        """Return (n, r, 6) whitened displacements by unit torques at the joints, or by the unit wrench on a body.

        Args:
            first: index among all 54 loads of the first of the six.
        """
        seen = self.problem.softer
        at = len(self.problem.data), first, *(e.key for e in seen.springs)
        if at not in self.known:
            unit = np.zeros((6, len(seen.state), 54))
            unit[np.arange(6), :, np.arange(first, first + 6)] = 1.0
            moved = np.zeros((*seen.matrix.shape[:2], 6))
            for k, one in enumerate(unit):
                moved[:, :, k] = seen.by_places(seen.by_load(one, seen.state))
            self.known[at] = moved
        return self.known[at]


def subsampled(screen: Screen, linear: Linear) -> SubsampledProblem:
    """Return every k-th pose of the screen's problem, about `SCREENED_POSES` or twice the number of parameters.

    With U U^T the hat matrix of the whole, that of some rows is U_s (U_s^T U_s + f (I - U^T U))^-1 U_s^T: a penalty, if
    there is one, counts by the share f of the rows.

    Args:
        linear: the fit on all poses.
    """
    problem, known = screen.problem, screen.stock.by_load
    step = max(1, round(len(problem.data) / max(SCREENED_POSES, 2 * linear.parameters)))
    if step == 1:
        return SubsampledProblem(problem, linear, known)
    some = np.arange(len(problem.data)) % step == 0
    few = problem.some(some)
    kept = some[linear.row]
    U = linear.nuisance[kept]
    gram = U.T @ U + (np.eye(U.shape[1]) - linear.nuisance.T @ linear.nuisance) / step
    value, vector = np.linalg.eigh(gram)
    good = value > 1e-9
    basis = U @ (vector[:, good] / np.sqrt(value[good]))
    kept_linear = Linear(linear.residual[kept], basis, few.row, linear.independent, linear.serial)
    return SubsampledProblem(few, kept_linear, known)


def refit_form(screen: Screen, linear: Linear, candidate: Candidate, least: float = -np.inf) -> Candidate:
    """Return a candidate with its knees and points optimized from all of its starts; the best few become its starts.

    It comes back unchanged where it has no such parameters, or where the model has the effect, fitted already.

    Args:
        screen: the forms of all effects; linear: the fit that leaves the residual.
        least: log evidence below which the candidate is of no interest, and comes back unchanged.
    """
    fitted = screen.problem.model.effect(candidate.key) is not None
    if fitted or not candidate.forming or not candidate.starts or not candidate.effect.is_null:
        return candidate
    seen = subsampled(screen, linear)
    some = list(candidate.starts)
    for tries, enough in STAGES:
        moved = sorted((_optimised(seen, c, tries) for c in some), key=lambda pair: pair[1])
        first: dict[tuple[object, ...], Candidate] = {}
        for c, _ in moved:
            first.setdefault(kind(c.effect), c)
        some = list(first.values())[:enough]
        if tries == STAGES[0][0]:
            forms = [(c, v) for c in some for v in c.effect.relatives(screen.problem.sensitivity.state, c.label)]
            some += [replace(c, effect=v.effect, label=v.label, price=c.price - 2 * np.log(v.odds)) for c, v in forms]
        before = float(seen.linear.projected_residual @ seen.linear.projected_residual)
        share = min(TWICE * (1 - moved[0][1] / before), 0.999)
        if -linear.freedom * np.log1p(-share) - candidate.price < least:
            return candidate
    all_poses = SubsampledProblem(screen.problem, linear, screen.stock.by_load)
    some = [_optimised(all_poses, c, *AT_LAST)[0] for c in some]
    every = sorted((_judged(screen, linear, c) for c in some), key=lambda c: -c.evidence)
    near = tuple(c for c in every if c.evidence > every[0].evidence - CLOSE_EVIDENCE)
    return replace(max(every[0], candidate, key=lambda c: c.evidence), visible=candidate.visible, starts=near)


def _optimised(
    seen: SubsampledProblem, start: Candidate, tries: int, closely: float = LAST_STEP_SHARE
) -> tuple[Candidate, float]:
    """Return a candidate with its parameters optimized on some poses, and the sum of squares that is left there.

    Args:
        tries, closely: as in `optimise_nonlinear`.
    """
    effect, remaining = optimise_nonlinear(seen, start.effect, start.free, tries, closely)
    return replace(start, effect=effect), remaining


def _judged(screen: Screen, linear: Linear, start: Candidate) -> Candidate:
    """Return a candidate with amplitudes, fall of the sum of squares, log evidence and p value from all rows.

    Args:
        linear: the fit on all rows; start: the candidate, its knees and points optimized.
    """
    effect = start.effect
    columns = screen.problem.columns(effect, start.free)
    inside = linear.project(columns)
    x, index, amplitude = effect.vector(), np.flatnonzero(start.free), effect.amplitudes()[start.free]
    low, high = effect.bounds()
    indices = index[amplitude]
    best = np.linalg.lstsq(inside[:, amplitude], linear.projected_residual, rcond=1e-9)[0]
    x[indices] = np.clip(best, low[indices], high[indices])
    moved = columns[:, amplitude] @ x[indices]
    reduction = float(moved @ (2 * linear.projected_residual - inside[:, amplitude] @ x[indices]))
    remaining = max(linear.square - reduction, 0.0)
    effect = effect.with_vector(x)
    evidence = (
        laplace(linear, remaining, columns.T @ inside, effect, robot=screen.problem.model.robot, index=index)
        - start.price
    )
    p = f_test(linear.square, remaining, start.count, linear.freedom - start.count, start.price)
    return replace(start, effect=effect, evidence=evidence, rss_reduction=reduction, p_value=p)


def optimise_nonlinear(
    seen: SubsampledProblem,
    effect: Effect,
    free: NDArray[np.bool_],
    tries: int = STAGES[-1][0],
    closely: float = LAST_STEP_SHARE,
) -> tuple[Effect, float]:
    """Return the effect with its free parameters at the least sum of squares, and that sum.

    Variable projection (Golub and Pereyra 1973) inside the bounds: every step projects out the fitted parameters.

    Args:
        seen: the poses that count; free: (q,) mask; tries: steps at most.
        closely: share of the sum of squares below which a step is the last; below `LAST_STEP_SHARE` `pull` is added.
    """
    from scipy.optimize import least_squares

    index = np.flatnonzero(free)
    x, amplitude = effect.vector().copy(), effect.amplitudes()[index]
    size = ordinary_sizes(effect, seen.problem.model.robot)[index]
    low, high = (bound[index] for bound in effect.bounds())
    inside = 1e-6 * np.minimum(size, high - low)

    def at(z: Array) -> Effect:
        """Return the effect with its free parameters at z."""
        y = x.copy()
        y[index] = z
        return effect.with_vector(y)

    def project(effects: Sequence[Effect]) -> Array:
        """Return (N, m) displacements by the effects with the fitted parameters projected out."""
        return seen.linear.project(seen.answers(effects))

    # The first steps of a hose that hardly pulls yet would lead to where it does nothing.
    weak = pull(seen.problem, effect)[index] * (closely < LAST_STEP_SHARE)

    def misfit(z: Array) -> Array:
        """Return the residual at z, and the weak pulls below it."""
        return np.concatenate([seen.linear.projected_residual - project([at(z)])[:, 0], weak * z])

    def slope(z: Array) -> Array:
        """Return the derivative of `misfit` at z."""
        step = np.where(z + inside > high, -inside, inside)
        answers = project([at(z), *(at(z + one) for one in np.diag(step))])
        return np.vstack([(answers[:, :1] - answers[:, 1:]) / step, np.diag(weak)])

    begin = x[index].copy()
    if effect.is_null:
        # Where the amplitudes vanish nothing forms an effect: those that the data suggests.
        ones = begin * ~amplitude + np.diag(size)[amplitude]
        C = project([at(one) for one in ones])
        s2 = float(seen.linear.projected_residual @ seen.linear.projected_residual) / max(len(C), 1)
        a = np.linalg.solve(C.T @ C + 0.01 * s2 * np.eye(C.shape[1]), C.T @ seen.linear.projected_residual)
        begin[amplitude] = size[amplitude] * np.where(np.abs(a) > 0.1, a, 0.1)
    start = np.clip(begin, low + inside, high - inside)
    scale = np.where(amplitude, size, 0.5 * size)
    bounds, few = (low, high), {"ftol": closely, "xtol": closely / 30, "max_nfev": tries}
    solution = least_squares(misfit, start, slope, bounds=bounds, x_scale=scale, **few)
    residual = solution.fun[: len(seen.linear.projected_residual)]
    return at(solution.x), float(residual @ residual)
