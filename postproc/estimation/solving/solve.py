"""The iteration of a fit: steps along a slope that is renewed where the model bends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.estimation.priors import prior_of
from postproc.estimation.problem import Problem
from postproc.estimation.solving.determined import slope
from postproc.estimation.solving.reweight import reweighted
from postproc.estimation.solving.start import FEWEST_POSES_TO_PLACE
from postproc.estimation.solving.step import Masks, Name, Slope, sizes
from postproc.measure.checks.repeats import Noise

FIT_SWEEPS = 60
ROUNDS = 6
"""Sweeps in which weights follow the residual; twice as many for robust fits."""
BENT_SHARE = 0.02
"""Share of a step by which the model may miss what its slope predicted before the slope is renewed."""
FAITHFUL = 5e-3
"""The same where the slope still holds at the end of the step (no slope knows how loads follow a move)."""
SETTLED, ROUGHLY = 1e-7, 1e-4
"""Share of the sum of squares below which a step is none; for a fit that only has to be compared with others."""
LEAST_STEP_SHARE = 1e-3
"""Share of what one number has of the sum of squares: steps below it are a thirtieth of a standard deviation."""
LEAST, FREED, UNFAITHFUL = 1e-3, 1e-8, 1e-2
"""Damping with which steps begin to be shortened and below which they are free again, and the share of the predicted
fall below which a step is none. Freed too soon, every second step in a bent valley begins from ``LEAST`` anew."""
EASED = 0.1
"""Least factor between the damping of a step and of the next one."""


@dataclass(frozen=True)
class Terms:
    """What a fit moves, and on which terms.

    Args:
        free: masks of the entries of an effect's vector that are fitted, by effect key; for an effect that is not
            named, all that its variants free.
        strength: of the smoothness penalty by effect key; for a free function that is not named, resolution and
            strength are chosen by the data.
        robust: whether all rows get Huber weights; rows far off are excluded in any case and named.
        closely: the fit ends at a step that lowers the sum of squares by less than this share.
        determined: parameters that a fit of the same rows with fewer effects has found. Their values may stand for an
            effect that it lacked: where this fit cannot determine them, they go back to null.
    """

    free: Masks = field(default_factory=dict)
    strength: Mapping[str, float] = field(default_factory=dict)
    robust: bool = False
    closely: float = SETTLED
    determined: frozenset[Name] = frozenset()


def solve(problem: Problem, noise: Noise, terms: Terms, fresh: frozenset[str] = frozenset()) -> Fit:
    """Fit by least squares (Levenberg and Marquardt) inside the bounds, without rows far off.

    A slope serves several steps where the model hardly bends, and a fit ends where a valid one predicts no further
    fall. A parameter that only repeats one that has since stopped at a bound is then fitted in its place.

    Args:
        noise: that of the weights; terms: with masks for all effects; fresh: keys of effects that no fit has seen.

    Raises:
        PostprocError: DAT020, fewer measured numbers than parameters.
    """
    base = problem.weights
    excluded: tuple[int, ...] = ()
    stopped, replaced, returned = set[Name](), set[Name](), set[Name]()
    at: Slope | None = None
    place, good, damping = problem, False, 0.0
    prior, kept = _prior(problem, fresh, terms.determined), tuple[Name, ...]()

    def sloped(frozen: Set[Name] = frozenset()) -> Slope:
        """Return the slope at the present problem, without some parameters."""
        return slope(problem, terms.free, replaced | frozen, terms.strength, kept)

    for sweep in range(FIT_SWEEPS):
        if sweep < (2 * ROUNDS if terms.robust else ROUNDS):
            weights, excluded = reweighted(problem, base, noise, terms.robust)
            if not np.allclose(weights.values, problem.weights.values, rtol=1e-3, atol=0.0):
                problem, at, good = problem.weighted(weights), at and at.reweighted(weights), False
        if at is None:
            at, place, good = sloped(), problem, True
            # Coefficients of a free function follow from its smoothness where the data is silent.
            _require_enough(problem, int(np.sum(at.penalty == 0.0 if not at.prior else at.anchor == 0.0)))
            kept = at.parameters
            problem = _unidentifiable_at_prior(problem, at, prior, fresh, returned)
            if problem is not place:
                at = None
                continue
        little = max(terms.closely, LEAST_STEP_SHARE / len(problem.residual)) * at.cost(problem) + 1e-12
        further, fallen, stopped, next_damping = advance(problem, at, little, damping, 10 if good else 2)
        damping = next_damping if good else damping
        settled = fallen <= little
        if settled and good:
            blocking = _blocking(at, stopped, sloped)
            if not blocking:
                break
            replaced, at = replaced | blocking, None
            continue
        bends = np.inf if further is problem else at.bends(problem, further)
        good = good and bends < FAITHFUL and at.still_holds(problem, further)
        problem = further
        if not good and (settled or bends > BENT_SHARE):
            at = None
    stopped |= replaced
    # Screening looks for directions in addition to these columns: they must be those of the very place.
    if at is None or place is not problem or stopped.intersection(at.parameters):
        at = sloped(stopped)
    same = {"noise": noise, "excluded": excluded, "strength": terms.strength, **at.shared}
    return Fit(problem, terms.free, at_bound=tuple(sorted(stopped)), **same)


def _blocking(at: Slope, stopped: set[Name], slope_without: Callable[[set[Name]], Slope]) -> set[Name]:
    """Return the parameters stopped at a bound that alone keep another one from being fitted in their place.

    A parameter is not fitted where the data does not determine it together with the others.

    Args:
        at: the present slope; stopped: parameters (effect key, index) that stopped at a bound.
        slope_without: returns the slope without some parameters.
    """
    freed = set(at.unidentifiable).difference(slope_without(stopped).unidentifiable) if stopped else set()
    return {p for p in stopped if freed and freed.intersection(slope_without(stopped - {p}).unidentifiable)}


def _prior(problem: Problem, fresh: frozenset[str], determined: frozenset[Name]) -> dict[str, Array]:
    """Return the values (q,), by effect key, that parameters take where the data cannot determine them.

    For amplitudes of new effects, and those in ``determined``, it is that of `prior_of`; for others the model's value.

    Args:
        fresh: keys of effects that no fit has seen.
        determined: parameters that a fit with fewer effects has found (`Terms`).
    """
    prior = {}
    for effect in problem.model.effects:
        x, amplitude = effect.vector(), effect.amplitudes()
        gone = [amplitude[i] and (effect.key in fresh or (effect.key, i) in determined) for i in range(len(x))]
        prior[effect.key] = np.where(gone, prior_of(effect, problem.model).value, x)
    return prior


def _unidentifiable_at_prior(
    problem: Problem, at: Slope, prior: Mapping[str, Array], fresh: Set[str], returned: set[Name]
) -> Problem:
    """Return the problem with unidentifiable parameters put back to their prior values, each at most once.

    Frames and free functions stay. So do parameters of new effects whose change the others could make up for only by
    implausible values, or that fitted parameters of the effect need: a slack length means nothing without the hose.

    Args:
        at: slope, with the unidentifiable parameters; prior: values (q,) by effect key.
        fresh: keys of effects that no fit has seen.
        returned: parameters that have been put back; it grows here, since they might otherwise come and go for ever.
    """
    effects = []
    for effect in problem.model.effects:
        x, indices = effect.vector(), {i for key, i in at.unidentifiable if key == effect.key}
        back = np.array([i in indices and (effect.key, i) not in returned for i in range(len(x))])
        back &= x != prior[effect.key]
        if effect.key in fresh:
            back &= effect.amplitudes()  # where the points of a new hose are is a guess
        at_prior = effect.with_vector(np.where(back, prior[effect.key], x))
        known = effect.is_frame or effect.roughness() is not None or not back.any()
        mute = at_prior.is_null and any(key == effect.key for key, _ in at.parameters)
        change = prior[effect.key] - x
        if known or mute or (effect.key in fresh and not _made_up_for(problem, at, effect, back, change)):
            effects.append(effect)
        else:
            effects.append(at_prior)
            returned |= {(effect.key, i) for i in np.flatnonzero(back).tolist()}
    changed = any(new is not old for new, old in zip(effects, problem.model.effects, strict=True))
    return problem.at(effects) if changed else problem


def _made_up_for(problem: Problem, at: Slope, effect: Effect, mask: NDArray[np.bool_], change: Array) -> bool:
    """Return whether fitted parameters can make up for a change of unidentifiable ones with values of ordinary size.

    Values may also become smaller than they are. A turn of the last joint makes up for anything that turns the tool,
    but by far too large an angle.

    Args:
        at: slope of the fitted parameters; mask: (q,) unidentifiable parameters of the effect.
        change: (q,) of its vector.
    """
    wanted = problem.slopes(effect, mask) @ change[mask]
    step = -np.linalg.lstsq(at.columns, wanted, rcond=None)[0]
    every = [e for e in problem.model.effects if not e.is_frame]
    values = {(e.key, i): x for e in every for i, x in enumerate(e.vector())}
    size = {(e.key, i): x for e in every for i, x in enumerate(sizes(problem, e))}
    others = [(name, by) for name, by in zip(at.parameters, step, strict=True) if name in values]
    return all(abs(values[name] + by) <= max(10 * size[name], abs(values[name])) for name, by in others)


def _require_enough(problem: Problem, fitted: int) -> None:
    """Raise DAT020 where there are no more measured numbers than fitted parameters.

    Below four poses, all rows of a pose count as one.

    Args:
        fitted: number of fitted parameters.
    """
    rows, poses = len(problem.data), len(np.unique(np.round(problem.data.state.q, 6), axis=0))
    numbers, counted = len(problem.residual), f"{len(problem.residual)} measured numbers"
    if poses < min(FEWEST_POSES_TO_PLACE, rows) and not problem.few:
        # Rows of one pose show the noise, and nothing of the arm.
        numbers, counted = numbers * poses // rows, f"{rows} rows of {poses} pose{'s' * (poses > 1)}"
    if numbers <= fitted:
        message = f"{counted} cannot determine {fitted} parameters"
        help_ = "measure more poses, or fit fewer effects"
        raise PostprocError.of("DAT020", message, problem.data.source, help=help_)


def advance(
    problem: Problem, at: Slope, little: float, damping: float, tries: int
) -> tuple[Problem, float, set[Name], float]:
    """Make one step at which the cost falls, damped more until it does, at most ``tries`` times.

    The better the fall of a step agrees with the prediction, the less the next one is damped; from a step that does not
    lower the cost on, by a factor 2, 4, 8 .. more (Nielsen 1999).

    Args:
        at: slope of the residual; little: predicted fall of the cost below which no step is made.
        damping: of the first try (`Slope`).

    Returns:
        The problem after the step, the fall of its cost, what stopped at a bound, the damping of the next step. Without
        a step, the problem is the same and the fall 0.
    """
    stopped: set[Name] = set()
    now = at.cost(problem)
    for failed in range(tries):
        step, stopped = at.damped(damping).step(problem)
        predicted = now - at.predicted_cost(problem, step)
        if predicted <= little:
            break
        trial = at.moved(problem, step)
        try:
            cost = at.cost(trial)
        except PostprocError:
            cost = np.inf
        faithful = (now - cost) / predicted
        if faithful > UNFAITHFUL:
            damping *= max(EASED, 1 - (2 * faithful - 1) ** 3)
            if damping < FREED:
                damping = 0.0 if faithful > 0.25 else LEAST
            return trial, now - cost, stopped, damping
        damping = 2.0 ** (failed + 1) * damping if damping else LEAST
    return problem, 0.0, stopped, damping
