"""What parameters that no row has told cost a program under its loads, as a sentence and as entries of a document."""

from __future__ import annotations

import numpy as np

from postproc.compensation.judgement.accuracy import Accuracy
from postproc.effects.registry import effect_library
from postproc.model.undetermined import PULLING_POSES, Undetermined
from postproc.numbers import mm
from postproc.report.blocks import Values
from postproc.results.wording import in_words, readable, with_sigma

MATTERING_SHARE = 0.3
"""Share of the stated distance above which what no row has told is said."""
LEAST_M = 5e-5


def undetermined_values(known: Undetermined | None) -> Values:
    """Return the entries ``undetermined_under_load_mm`` and ``undetermined_parameter`` of a conversion's document."""
    if known is None:
        return {"undetermined_under_load_mm": 0.0, "undetermined_parameter": None}
    return {
        "undetermined_under_load_mm": mm(known.within_95),
        "undetermined_parameter": {
            "parameter": known.name,
            "value": known.value,
            "sigma": known.sigma,
            "within_95_percent_mm": mm(known.largest),
            "pull": [] if known.pull is None else known.pull.tolist(),
            "pull_shows_mm": mm(known.told),
        },
    }


def undetermined_text(accuracy: Accuracy) -> str:
    """Return sentences on the parameter that no row has told, its cost, and how to tell it; empty where it is little.

    Args:
        accuracy: that of the conversion.
    """
    known = accuracy.undetermined
    if known is None or known.within_95 < max(LEAST_M, MATTERING_SHARE * accuracy.within_95):
        return ""
    alone = "" if known.largest > 0.99 * known.within_95 else f", {1e3 * known.largest:.2f} mm by it alone"
    return (
        f" Of that, {1e3 * known.within_95:.2f} mm are open under these loads because the measured rows say little of "
        f"{_parameter_text(known)}{alone}. {_pull_text(known)}"
    )


def _parameter_text(known: Undetermined) -> str:
    """Return the parameter with its value: ``the compliance of joint 1 (4.22 ± 0.90 µrad/(N m))``."""
    effect = effect_library().get(known.effect)
    name = known.name.partition(".")[2]
    if effect is None or (declared := effect.parameters().get(name.partition("[")[0])) is None:
        return f"`{known.name}` ({with_sigma(known.value, known.sigma)})"
    factor, unit = readable(declared.unit)
    return f"{in_words(effect, name)} ({with_sigma(factor * known.value, factor * known.sigma)} {unit})"


def _pull_text(known: Undetermined) -> str:
    """Return the cheapest measurement that tells the parameter; that `plan` says it where no pull does."""
    if known.pull is None or known.told < LEAST_M / 5:
        return "`postproc plan` says which poses tell it."
    axis = int(np.argmax(known.pull))
    size, way = known.pull[axis], "xyz"[axis % 3]
    how = f"pull with {size:.0f} N along {way}" if axis < 3 else f"turn with {size:.0f} N m about {way}"
    return (
        f"To tell it, {how} of the base at {PULLING_POSES} poses of the program, "
        "measure with and without, and fit again: "
        f"the TCP moves by {1e3 * known.told:.2f} mm for each standard deviation."
    )
