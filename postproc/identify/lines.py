"""Gear lines that stand for a free function of a joint's angle give way to it where rows held out say so."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.effects.joint_error_map import JointErrorMap
from postproc.effects.transmission_error import GEAR, TransmissionError
from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.solve import Terms
from postproc.identify.candidate import Candidate, Screen
from postproc.identify.judgement import CLEARLY, fitted_best, predicts_better
from postproc.identify.ranking import Search
from postproc.identify.selection import compose
from postproc.identify.whole import Missing

LINES, MAP = "transmission_error", "joint_error_map"
MANY = 3
"""Lines in all from which a map is tried in their place; on one joint two are enough."""


def lines_or_map(search: Search, missing: list[Missing], noise: float | None) -> list[Missing]:
    """What is missing with a map in the place of all gear lines, or of those of crowded joints, if it predicts better.

    A line pays for two numbers and a map for many, so that a search takes lines one by one where a smooth function is
    meant. Where other joints have one, half as clearly is enough. The search is left with the better fit. Lines of a
    motor's order stay: no map reaches them.
    """
    trial = _trial(search, missing, noise)
    standing = search.fit.model.effect(MAP) is not None
    if trial is None or not predicts_better(trial.fit, search.fit, CLEARLY / 2 if standing else CLEARLY):
        return missing
    search.fit = trial.fit
    kept = [m for m in missing if m.candidate.key != MAP and (m is not trial.told or trial.stay.any())]
    return [*kept, Missing(trial.map)]


def perhaps_a_map(search: Search, missing: list[Missing], noise: float | None) -> list[Missing]:
    """What is missing, with the map as what gear lines could be as well where they do not predict better than it."""
    trial = _trial(search, missing, noise)
    if trial is None or predicts_better(search.fit, trial.fit, CLEARLY / 2):
        return missing
    return [m.or_else(MAP) if m is trial.told else m for m in missing]


@dataclass(frozen=True)
class Trial:
    """A map in the place of some lines: of which effect, which lines stay, the map, and the fit with it."""

    told: Missing
    stay: NDArray[np.bool_]
    map: Candidate
    fit: Fit


def _trial(search: Search, missing: list[Missing], noise: float | None) -> Trial | None:
    """The map that predicts best in the place of all lines or of those of crowded joints; None where lines are few."""
    told = next((m for m in missing if m.candidate.key == LINES), None)
    lines = search.fit.model.effect(LINES)
    if told is None or not isinstance(lines, TransmissionError) or MAP not in search.classes:
        return None
    joint, motor = np.array(lines.joint), np.array(lines.order) > GEAR
    alone = motor | (np.bincount(joint[~motor], minlength=7)[joint] == 1)
    choices = [alone] if not alone.all() else []
    choices += [motor] if (~motor).sum() >= MANY and not (alone == motor).all() else []
    trials = [Trial(told, stay, *found) for stay in choices if (found := _mapped(search, lines, stay, noise))]
    return min(trials, key=lambda t: t.fit.held_out_rms, default=None)


def _with_lines(fit: Fit, lines: TransmissionError, stay: NDArray[np.bool_], noise: float | None) -> Fit:
    """The fit with some of its gear lines alone."""
    kept = [e for e in fit.model.effects if e.key != LINES]
    free = {key: mask for key, mask in fit.free.items() if key != LINES}
    if stay.any():
        some: Any = {name: np.array(getattr(lines, name))[stay] for name in lines.__dataclass_fields__}
        kept.append(TransmissionError(**some))
    terms = Terms(free, fit.strength, beside=fit.problem.beside)
    return fit_model(fit.model.with_effects(*kept), fit.data, noise=noise, terms=terms)


def _mapped(
    search: Search, lines: TransmissionError, stay: NDArray[np.bool_], noise: float | None
) -> tuple[Candidate, Fit] | None:
    """The map in the place of lines that do not stay, with the fit that it gives.

    As it is composed, or of all joints of the lines, whichever predicts better: few rows do not earn a map joint by
    joint, and three joints with one are all of them.
    """
    plain = _with_lines(search.fit, lines, stay, noise)
    screen = Screen(plain.problem, {MAP: search.classes[MAP]}, plain.free)
    composed = compose(screen, plain.linear, MAP)
    if composed is None or not isinstance(composed.effect, JointErrorMap):
        return None
    joints = tuple(sorted({*np.array(lines.joint)[~stay].tolist(), *composed.effect.joint}))
    whole = composed.effect.on(joints)
    every = replace(composed, effect=whole, free=np.ones(len(whole.vector()), dtype=bool), starts=())
    some = [composed, every] if joints != composed.effect.joint else [composed]
    found = [f for c in some if (f := fitted_best(plain, screen, c))]
    if not found:
        return None
    candidate, after = min(found, key=lambda f: f[1].held_out_rms)
    fitted = after.model.effect(MAP)
    assert isinstance(fitted, JointErrorMap)
    return replace(candidate, label=fitted.label), after
