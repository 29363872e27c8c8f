"""What an effect gives at some states, what it leaves out filled in; and parameters of several effects by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.expression import as_stationary, follows_order
from postproc.channels.state import State
from postproc.effects.base import Effect
from postproc.effects.contract import Displacement, Load


def displacement_of(effect: Effect, state: State) -> Displacement:
    """Evaluate the displacement of an effect; empty where a channel that it reads was not recorded."""
    if any(state.channel(name) is None for name in effect.reads if not follows_order(name)):
        return Displacement()
    result = effect.displacement(as_stationary(effect.ordered_channels, state))
    if result is None:
        return Displacement()
    if not isinstance(result, Displacement):
        return Displacement(joint=np.asarray(result, dtype=float))
    # Bodies that stay where they are cost a model as much as those that move.
    moved = {b: x for b, x in _bodies(result.body).items() if np.any(x)}
    parts = (_array(part) for part in (result.tool, result.instrument, result.setup))
    return Displacement(_array(result.joint), moved, *parts)


def load_of(effect: Effect, state: State) -> Load:
    """Evaluate the load of an effect; empty where a channel that it reads, other than ``load``, was not recorded."""
    if any(state.channel(name) is None for name in effect.reads if name != "load" and not follows_order(name)):
        return Load()
    result = effect.load(as_stationary(effect.ordered_channels, state))
    if isinstance(result, Load):
        return Load(_array(result.joint), _bodies(result.body))
    return Load() if result is None else result


def loads_of(effects: Sequence[Effect], state: State) -> Load:
    """Evaluate the loads of m effects of one class and structure, (n, 6, m) for each part; empty as in `load_of`."""
    cls = type(effects[0])
    if any(state.channel(name) is None for name in effects[0].reads if name != "load" and not follows_order(name)):
        return Load()
    at_once = cls.loads(effects, state)
    if at_once is not None:
        return at_once
    every, nothing = [load_of(e, state) for e in effects], np.zeros((len(state), 6))
    joints = [nothing if one.joint is None else one.joint for one in every]
    bodies = sorted({b for one in every for b in one.body})
    return Load(
        None if all(one.joint is None for one in every) else np.stack(joints, axis=2),
        {b: np.stack([one.body.get(b, nothing) for one in every], axis=2) for b in bodies},
    )


def of_parameters(
    effects: Iterable[Effect],
    names: Sequence[tuple[str, int]],
    figure: Callable[[Effect], NDArray[Any]] = Effect.vector,
) -> Array:
    """Return (p,) a figure of some parameters, their values by default.

    Args:
        names: effect key, and index in its vector, of each; figure: returns (q,) that of the parameters of an effect.
    """
    every = {e.key: figure(e) for e in effects}
    return np.array([every[key][i] for key, i in names])


def with_parameters(effects: Iterable[Effect], names: Sequence[tuple[str, int]], values: Array) -> list[Effect]:
    """Return effects with these values (p,) of some parameters, within their bounds; names as in `of_parameters`."""
    effects = [*effects]
    vectors = {e.key: e.vector().copy() for e in effects}
    for (key, i), value in zip(names, values, strict=True):
        vectors[key][i] = value
    return [e.with_vector(np.clip(vectors[e.key], *e.bounds())) for e in effects]


def _array(part: Any) -> Array | None:
    """Return a part of an effect's answer as a float array; None for None."""
    return None if part is None else np.asarray(part, dtype=float)


def _bodies(parts: Mapping[int, Any]) -> dict[int, Array]:
    """Return the parts of an effect's answer on bodies, by number of the body, as float arrays."""
    return {b: np.asarray(x, dtype=float) for b, x in parts.items()}
