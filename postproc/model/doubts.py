"""What a model says that no arm can be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic
from postproc.effects.base import Effect
from postproc.model.arm import Model
from postproc.model.uncertainty import read_uncertainty

SURE = 2.0
"""Standard deviations by which a fitted value is below the least that an arm has before that is more than chance."""


def doubts(model: Model) -> Iterator[tuple[str, str, Diagnostic]]:
    """Effect, parameter and MOD005 of values that no arm has: springs that yield against their load, links that weigh
    less than nothing.
    """
    beside = {effect.key: effect for effect in model.effects}
    for key, effect in beside.items():
        none = effect.impossible(model.robot, beside) | below_least(model, effect)
        if none.any():
            first = int(np.argmax(none))
            entry = f"{effect.names()[first]} = {effect.vector()[first]:g}"
            help_ = f"check signs and units (`postproc effects show {key}`); a fit that came to this misses a load: "
            found = Diagnostic("MOD005", "error", f"no arm has `{entry}` of `{key}`", help=help_ + "`diagnose`")
            yield key, list(effect.parameters())[effect.layout.parameter[first]], found


def below_least(model: Model, effect: Effect) -> NDArray[np.bool_]:
    """(p,) parameters that are below the least that an arm can have, by more than the chance of their fit."""
    sigma, known = np.zeros(len(effect.vector())), read_uncertainty(model)
    if known is not None:
        for k, (key, index) in enumerate(known.parameters):
            if key == effect.key:
                sigma[index] = np.sqrt(max(known.covariance[k, k], 0.0))
    return np.asarray(effect.vector() < effect.layout.least - SURE * sigma)
