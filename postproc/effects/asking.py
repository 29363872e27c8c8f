"""What an effect gives at some states: what it leaves out filled in, lists made arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from postproc.arrays import Array
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
    moved = {b: x for b, x in _bodies(result.body).items() if np.any(x)}
    return Displacement(_array(result.joint), moved, _array(result.tool), _array(result.instrument))


def load_of(effect: Effect, state: State) -> Load:
    """The load of an effect; nothing where a channel that it reads is not there (``load`` itself comes later)."""
    if any(state.channel(name) is None for name in effect.reads if name != "load"):
        return Load()
    given = effect.load(state)
    if isinstance(given, Load):
        return Load(_array(given.joint), _bodies(given.body))
    return Load() if given is None else given


def _array(part: Any) -> Array | None:
    return None if part is None else np.asarray(part, dtype=float)


def _bodies(parts: Mapping[int, Any]) -> dict[int, Array]:
    return {b: np.asarray(x, dtype=float) for b, x in parts.items()}
