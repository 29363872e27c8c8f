"""Gear lines that stand for a free function of a joint's angle give way to it where rows held out say so."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.effects.transmission_error import GEAR, TransmissionError
from postproc.fit.fitted import Fit
from postproc.fit.least_squares import fit_model
from postproc.fit.solve import Terms
from postproc.identify.candidate import Candidate, Screen
from postproc.identify.judgement import fitted_best, predicts_better
from postproc.identify.ranking import Search
from postproc.identify.search import Missing
from postproc.identify.selection import compose

LINES, MAP = "transmission_error", "joint_error_map"
MANY = 3
"""Lines in all from which a map is tried in their place; on one joint two are enough."""
CLEARLY = 2.0
"""Standard errors by which the map must predict better; half as many where other joints have one already."""


def lines_or_map(search: Search, missing: list[Missing], noise: float | None) -> list[Missing]:
    """What is missing with a map in the place of all gear lines, or of those of crowded joints, if it predicts better.

    A line pays for two numbers and a map for many, so that a search takes lines one by one where a smooth function is
    meant. The search is left with the better fit. Lines of a motor's order stay: no map reaches them.
    """
    told = next((m for m in missing if m.candidate.key == LINES), None)
    lines = search.fit.model.effect(LINES)
    if told is None or not isinstance(lines, TransmissionError):
        return missing
    if MAP not in search.classes:
        return missing
    joint, motor = np.array(lines.joint), np.array(lines.order) > GEAR
    alone = motor | (np.bincount(joint[~motor], minlength=7)[joint] == 1)
    choices = [alone] if not alone.all() else []
    choices += [motor] if (~motor).sum() >= MANY and not (alone == motor).all() else []
    trials = [t for stay in choices if (t := _mapped(search, lines, stay, noise)) is not None]
    if not trials:
        return missing
    stay, candidate, after = min(trials, key=lambda t: t[2].held_out_rms)
    standing = search.fit.model.effect(MAP) is not None
    if not predicts_better(after, search.fit, CLEARLY / 2 if standing else CLEARLY):
        return missing
    search.fit = after
    kept = [m for m in missing if m.candidate.key != MAP and (m is not told or stay.any())]
    return [*kept, Missing(candidate, after.held_out_rms)]


def _with_lines(fit: Fit, lines: TransmissionError, stay: NDArray[np.bool_], noise: float | None) -> Fit:
    """The fit with some of its gear lines alone."""
    kept = [e for e in fit.model.effects if e.key != LINES]
    free = {key: mask for key, mask in fit.free.items() if key != LINES}
    if stay.any():
        some: Any = {name: np.array(getattr(lines, name))[stay] for name in lines.__dataclass_fields__}
        kept.append(TransmissionError(**some))
    return fit_model(fit.model.with_effects(*kept), fit.data, noise=noise, terms=Terms(free, fit.strength))


def _mapped(
    search: Search, lines: TransmissionError, stay: NDArray[np.bool_], noise: float | None
) -> tuple[NDArray[np.bool_], Candidate, Fit] | None:
    """Which lines stay, and the map in the place of the others with the fit that it gives."""
    plain = _with_lines(search.fit, lines, stay, noise)
    screen = Screen(plain.problem, {MAP: search.classes[MAP]}, plain.free)
    composed = compose(screen, plain.linear, MAP)
    found = composed and fitted_best(plain, screen, plain.linear, composed)
    return (stay, *found) if found else None
