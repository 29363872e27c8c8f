"""What a model says that no arm can be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.model.arm import Model
from postproc.model.uncertainty import read_uncertainty

SURE = 2.0
"""Standard deviations by which a fitted spring is below zero before that is more than chance."""


def doubts(model: Model) -> Iterator[Diagnostic]:
    """Warnings about values that no arm has (MOD005): springs that yield against their load, links without weight."""
    beside = {effect.key: effect for effect in model.effects}
    help_ = "check signs and units (`postproc effects show {}`); a fit that came to this misses a load: `diagnose`"
    for joint in _backward(model):
        message = f"joint {joint} yields against its load: its compliance is negative"
        yield Diagnostic("MOD005", "warning", message, help=help_.format("joint_compliance"))
    for key, effect in beside.items():
        if effect.impossible(model.robot, beside).any():
            yield Diagnostic("MOD005", "warning", f"no arm has the values of `{key}`", help=help_.format(key))


def _backward(model: Model) -> list[int]:
    """Joints, from 1, whose spring is negative beyond chance."""
    springs, known = model.effect("joint_compliance"), read_uncertainty(model)
    if springs is None:
        return []
    sigma = np.zeros(6)
    if known is not None:
        for k, (key, index) in enumerate(known.parameters):
            if key == springs.key:
                sigma[index] = np.sqrt(max(known.covariance[k, k], 0.0))
    return [int(j) + 1 for j in np.flatnonzero(springs.vector() < -SURE * sigma)]
