"""Least squares of all parameters of a model on measured poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import FRAME_ROLES, Role
from postproc.estimation.fitted import Fit
from postproc.estimation.priors import prior_of
from postproc.estimation.problem import Problem, Weights, make_weights
from postproc.estimation.solving.determined import slope
from postproc.estimation.solving.reweight import far_off, reweighted
from postproc.estimation.solving.rounding import blurred, rounded
from postproc.estimation.solving.session_laws import session_laws
from postproc.estimation.solving.smooth import choose_smoothness, enough_for_smoothness
from postproc.estimation.solving.solve import ROUGHLY, Terms, solve
from postproc.estimation.solving.start import moved_instrument, seen_from, start_frames, turned_tool
from postproc.estimation.solving.step import Masks
from postproc.measure.checks.repeats import Noise, estimate_noise, significantly_below
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.ordered import with_ordered_channels
from postproc.watch import Watch, unwatched

PLACED_FIRST = "instrument_frame", "session", "work_object", "setup", "tool_frame", "reflector"
FIRST = (*PLACED_FIRST, "joint_offset", "joint_compliance")
LAST = ("link_geometry",)
"""Where two parameters do the same, the later effect is not fitted: frames before offsets before geometry."""
PLAIN_TERMS = Terms()
MOST_ROWS_FITTED = 20_000
"""Rows that are fitted at most. Each costs 25 kB while a fit lasts, and so many determine everything."""
THINNED_POSES = 100
"""Poses that remain where repeats stay together; where fewer would, some of the repeats of all are taken."""


def fit_model(
    model: Model,
    data: Measurements,
    effects: Sequence[Effect] = (),
    *,
    noise: float | None = None,
    terms: Terms = PLAIN_TERMS,
    watch: Watch = unwatched,
) -> Fit:
    """Fit all effects of a model, and further ones, on measured poses, starting from the model's present values.

    Args:
        effects: further effects; one with the key of an effect of the model replaces it.
        noise: standard deviation per axis [m] stated by the user; by default that of repeats or ``sigma_mm``.
        watch: is called with what is being done and the share of the work that is done.
        terms: which parameters are free, the smoothness of free functions and when to stop; chosen by the data by
            default.

    Raises:
        PostprocError: DAT020, fewer measured numbers than parameters.
    """
    watch("all parameters", 0.1)
    fit = _fitted(model, _thinned(data.rows(data.usable)), effects, noise, terms)
    if data.rounded is not None or fit.problem.weights.turn is None:
        return fit
    watch("whether angles were rounded", 0.6)
    judged = replace(fit.data, rounded=rounded(fit))
    if not judged.rounded:
        return _fitted(model, judged, effects, noise, terms)
    return replace(fit, problem=replace(fit.problem, data=judged))


def _thinned(data: Measurements) -> Measurements:
    """Return the data, thinned evenly to about `MOST_ROWS_FITTED` rows where it has more.

    Poses with all their repeats are omitted where enough poses remain, single rows otherwise.
    """
    if len(data) <= MOST_ROWS_FITTED:
        return data
    step = -(-len(data) // MOST_ROWS_FITTED)
    many = int(data.repeats.max()) > THINNED_POSES * step
    kept = data.one_in(step) if many else np.arange(len(data)) % step == 0
    return replace(data.rows(kept), sampled_from=data.sampled_from or len(data))


def _fitted(model: Model, data: Measurements, effects: Sequence[Effect], noise: float | None, terms: Terms) -> Fit:
    """Fit the model with further effects on all given rows, and return the fit.

    Where the model explains part of the scatter of repeats, it is fitted once more with weights of the smaller noise.

    Args:
        effects, noise, terms: as in `fit_model`.
    """
    new = {e.key: e.with_vector(prior_of(e, model).value) if e.is_null else e for e in effects}
    every = [new.pop(e.key, e) for e in model.effects] + list(new.values())
    every.sort(key=_sorting_key)
    if not placed_by_points(data):
        every = [e for e in every if e.role is not Role.INSTRUMENT_FRAME or not e.is_null]
    data = replace(data, state=with_ordered_channels(model, data.state, every))
    figures = estimate_noise(data, model.robot, noise)
    problem = Problem(model.with_effects(*every), data, make_weights(data, figures))
    fit = _solved(problem, figures, frozenset(e.key for e in effects), terms)
    quieter = _noise_within_repeats(fit)
    if quieter is None:
        return fit
    problem = fit.problem.weighted(make_weights(fit.data, quieter))
    return solve(problem, quieter, replace(terms, free=fit.free, strength=fit.strength))


def _noise_within_repeats(fit: Fit) -> Noise | None:
    """Return the noise by the residual within repeats; None unless that is clearly below their raw scatter.

    Repeats at another time, temperature or force differ by what the model explains.
    """
    within, known = estimate_noise(fit.data, fit.model.robot, error=fit.observed_error), fit.noise
    from_repeats = known.origin == "repeats" and not known.rounding and fit.problem.weights.turn is None
    return within if from_repeats and within.sigma and significantly_below(within.sigma**2, within.dof, known) else None


def _solved(problem: Problem, figures: Noise, fresh: frozenset[str], terms: Terms) -> Fit:
    """Return the fit of a problem from its starting frames on, with the likeliest smoothness of each free function.

    Where a smoothness is not stated, a rough fit comes first, then the choice of smoothness, then the fit.

    Args:
        figures: the noise.
        fresh: keys of effects that no fit has seen, which start at null where the rows do not determine them.
        terms: which parameters are free, stated smoothness, and when to stop.
    """
    problem, figures = blurred(start_frames(problem), figures)
    every = problem.model.effects  # with the frames of sessions that saw the arm from elsewhere
    masks = {e.key: terms.free[e.key] if e.key in terms.free else default_free(e, problem) for e in every}
    terms = replace(terms, free=masks)
    rough = [e.key for e in every if e.roughness() is not None and e.key not in terms.strength]
    if not rough:
        return solve(problem, figures, terms, fresh)
    # The choice of smoothness needs a place to stand on, not the very minimum: the free functions as they are.
    still = {key: np.zeros(len(masks[key]), dtype=bool) for key in rough}
    place = replace(terms, free={**masks, **still}, closely=max(terms.closely, ROUGHLY))
    few = enough_for_smoothness(problem)
    fit = solve(few, figures, place, fresh)
    problem = fit.problem if few is problem else problem
    smooth = {key: choose_smoothness(fit, key, problem.equilibrium.state) for key in rough}
    finer = [smooth[e.key].effect if e.key in smooth else e for e in fit.model.effects]
    masks = {**masks, **{key: np.ones(len(s.effect.vector()), dtype=bool) for key, s in smooth.items()}}
    strength = {**terms.strength, **{key: s.strength for key, s in smooth.items()}}
    return solve(problem.at(finer), figures, replace(terms, free=masks, strength=strength))


def _sorting_key(effect: Effect) -> int:
    """Return the sorting key of an effect: frames first, geometry and free functions last.

    Of two effects with the same influence on the measurements, the later one is not fitted.
    """
    if effect.roughness() is not None:
        return 100
    return FIRST.index(effect.key) if effect.key in FIRST else 99 if effect.key in LAST else 50


def evaluate(model: Model, data: Measurements, *, noise: float | None = None) -> Fit:
    """Return a model with measurements, with nothing fitted but frames that the model lacks.

    An instrument frame or tool frame of the model stays as it is, except where the instrument was clearly set up
    elsewhere: then its frame is fitted.

    Args:
        noise: standard deviation per axis [m] stated by the user; that of repeats or ``sigma_mm`` by default.

    Raises:
        PostprocError: DAT034 where the model has an effect of the row or time of another measuring session.
    """
    session_laws(model, data)
    fit = _evaluated(model, _thinned(data.rows(data.usable)), noise)
    return fit if fit.data.sampled_from or not data.wrong else _with_wrong_rows(fit, data.rows(data.filled))


def _with_wrong_rows(fit: Fit, data: Measurements) -> Fit:
    """Return an evaluation with the rows of the data that cannot be right added and excluded, to report their errors.

    Args:
        fit: the evaluation on the usable rows; data: usable and wrong rows.
    """
    used = data.usable
    values = np.zeros((len(data), fit.problem.weights.values.shape[1]))
    values[used] = fit.problem.weights.values
    turn = fit.problem.weights.turn
    matrices = np.tile(np.eye(1 if turn is None else turn.shape[1]), (len(data), 1, 1))
    if turn is not None:
        matrices[used] = turn
    problem = Problem(fit.model, data, Weights(values, None if turn is None else matrices))
    excluded = sorted({*np.flatnonzero(~used).tolist(), *np.flatnonzero(used)[list(fit.excluded)].tolist()})
    return replace(fit, problem=problem, excluded=tuple(excluded))


def _evaluated(model: Model, data: Measurements, noise: float | None) -> Fit:
    """Return the model with usable rows and nothing fitted but frames.

    These are the frames that the model lacks, and the instrument's where it was set up elsewhere. Rows far off are
    excluded.

    Args:
        noise: standard deviation per axis [m] stated by the user; None for that of the data.
    """
    figures = estimate_noise(data, model.robot, noise)
    frames: tuple[Role, ...] = FRAME_ROLES[:1] if data.tool_known else FRAME_ROLES
    frames = frames if placed_by_points(data) else frames[1:]
    data = replace(data, state=with_ordered_channels(model, data.state))
    lacking: list[Effect] = [effect_in_role(role).null() for role in frames if model.in_role(role) is None]
    complete = model.with_effects(*lacking, *model.effects)
    problem = start_frames(Problem(complete, data, make_weights(data, figures)))
    complete = problem.model
    for role in (Role.SESSION_FRAMES, Role.WORK_OBJECTS, Role.REFLECTOR_POINTS, Role.SETUPS):
        placed = complete.in_role(role)
        if placed is not None and placed is not model.in_role(role):
            lacking.append(placed)
    frame = model.in_role(Role.INSTRUMENT_FRAME)
    place = None if frame is None else moved_instrument(problem, np.asarray(np.isfinite(data.position).all(axis=1)))
    if frame is not None and place is not None:
        problem = seen_from(problem, place)
        lacking.append(frame)
    nothing = {e.key: np.zeros(len(e.vector()), dtype=bool) for e in complete.effects}
    masks = {**nothing, **{e.key: ~nothing[e.key] for e in lacking}}
    if lacking:
        return _placed(problem, figures, masks)
    excluded = far_off(problem, problem.weights)
    values = problem.weights.values.copy()
    values[list(excluded)] = 0.0
    problem = problem.weighted(Weights(values, problem.weights.turn))
    return Fit(problem, masks, (), (), np.zeros((len(problem.residual), 0)), np.zeros(0), figures, excluded)


def _placed(problem: Problem, figures: Noise, masks: Masks) -> Fit:
    """Return a fit of frames to the positions alone where these suffice, the tool then turned by the orientations.

    An error that all orientations share, such as a probe mounted anew, would otherwise turn the instrument and move the
    points. Without positions, or with too few, the frames are fitted to all measured numbers.

    Args:
        figures: the noise; masks: which parameters are free, by effect (those of the frames).
    """
    data, terms = problem.data, Terms(masks, robust=True)
    if len(data.observations) == 1 or data.observed.name != "position":
        return solve(problem, figures, terms)
    points = replace(data, rotation=None, joint=None)
    alone = Problem(problem.model, points, make_weights(points, figures))
    try:
        fit = solve(alone, figures, terms)
    except PostprocError:  # too few points
        return solve(problem, figures, terms)
    if any(key == "instrument_frame" for key, _ in fit.unidentifiable):
        return solve(problem, figures, terms)
    placed = problem.at(fit.model.effects)
    if "tool_frame" in masks and masks["tool_frame"].any():
        placed = turned_tool(placed)
    weights, excluded = reweighted(placed, problem.weights, figures, False)
    placed = placed.weighted(weights)
    at = slope(placed, masks, set(), {})
    return Fit(placed, masks, at_bound=(), noise=figures, excluded=excluded, **at.shared)


def placed_by_points(data: Measurements) -> bool:
    """Return whether an instrument saw the arm: set-ups stand in the frame of the base, and need no other."""
    return data.readings is None or bool(np.isfinite(data.position).any()) or data.rotation is not None


def default_free(effect: Effect, problem: Problem) -> NDArray[np.bool_]:
    """Return (q,) mask of the entries of an effect that a fit moves by default: all that any of its variants frees."""
    if type(effect).structures():
        return np.ones(len(effect.vector()), dtype=bool)
    chosen = np.zeros(len(effect.vector()), dtype=bool)
    for form in type(effect).variants(problem.sensitivity.state, effect):
        if len(form.refit) == len(chosen):
            chosen |= form.refit
    return chosen
