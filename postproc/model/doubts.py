"""What a model says that no arm can be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.effects.asking import load_of
from postproc.effects.base import Effect
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.model.uncertainty.prediction import read_uncertainty

SURE_SIGMAS = 2.0
"""Standard deviations by which a fitted value is below the least that an arm has before that is more than chance."""


def doubts(model: Model) -> Iterator[tuple[str, str, Diagnostic]]:
    """Yield (effect key, parameter name, diagnostic MOD005) for each effect with values that no arm has.

    Examples are a negative compliance or mass; of several such values of one effect the first is named.
    """
    effects = {effect.key: effect for effect in model.effects}
    for key, effect in effects.items():
        none = effect.impossible(model.robot, effects) | below_least(model, effect)
        if none.any():
            first = int(np.argmax(none))
            entry = f"{effect.names()[first]} = {effect.vector()[first]:g}"
            help_ = f"check signs and units (`postproc effects show {key}`); a fit that came to this misses a load: "
            finding = Diagnostic("MOD005", "error", f"no arm has `{entry}` of `{key}`", help=help_ + "`diagnose`")
            yield key, list(effect.parameters())[effect.layout.parameter[first]], finding


def contradicted(model: Model, source: Source | None = None) -> list[Diagnostic]:
    """Return MOD015 for each reason for which nothing is promised with a fitted model: what its rows contradict.

    Args:
        source: the file that the model is used for.
    """
    help_ = "mend what it says, and fit again: how far the model is off is not known"
    text = "what this model was fitted to contradicts itself"
    return [
        Diagnostic("MOD015", "warning", f"{text}: {why}", source, help=help_, matter=Matter.CONTRADICTED)
        for why in model.fit.get("contradicted", ())
    ]


def flange_mass(model: Model, state: State) -> Array:
    """Return (n,) the mass [kg] of the last body and all that hangs on it: link, stated payload, masses of effects.

    Of an effect counts what changes with gravity, F(g) - F(0) = m g: the pull of a hose is no weight.
    """
    mass = np.full(len(state), model.robot.mass[6])
    if state.payload_mass is not None:
        mass = mass + state.payload_mass
    adding = [e for e in model.effects if type(e).load is not Effect.load]
    seen = equilibrium(model, state).state if adding else state
    for effect in adding:
        loads = [load_of(effect, s).body.get(6) for s in (seen, seen.with_(gravity=np.zeros(3)))]
        if loads[0] is not None and loads[1] is not None:
            mass = mass + (loads[0] - loads[1])[:, :3] @ model.gravity / (model.gravity @ model.gravity)
    return np.asarray(mass)


def below_least(model: Model, effect: Effect) -> NDArray[np.bool_]:
    """Return a mask (p,) of the effect's parameters that are surely below the least that an arm can have.

    That is by more than two standard deviations of the fit, or at all where the model notes no uncertainty.
    """
    sigma, known = np.zeros(len(effect.vector())), read_uncertainty(model)
    if known is not None:
        for k, (key, index) in enumerate(known.parameters):
            if key == effect.key:
                sigma[index] = np.sqrt(max(known.covariance[k, k], 0.0))
    return np.asarray(effect.vector() < effect.layout.least - SURE_SIGMAS * sigma)
