"""What an effect gives at some states, with what it leaves out filled in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.effects.base import Effect
from postproc.effects.contract import Displacement, Load, State


def displacement_of(effect: Effect, state: State) -> Displacement:
    """The displacement of an effect; nothing where a channel that it reads was not recorded."""
    if any(state.channel(name) is None for name in effect.reads):
        return Displacement()
    result = effect.displacement(state)
    if result is None:
        return Displacement()
    if not isinstance(result, Displacement):
        return Displacement(joint=np.asarray(result, dtype=float))
    # Bodies that stay where they are cost a model as much as those that move.
    return replace(result, body={b: x for b, x in result.body.items() if np.any(x)})


def load_of(effect: Effect, state: State) -> Load:
    """The load of an effect; nothing where a channel that it reads is not there (``load`` itself comes later)."""
    if any(state.channel(name) is None for name in effect.reads if name != "load"):
        return Load()
    given = effect.load(state)
    return Load() if given is None else given
