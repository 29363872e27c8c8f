"""Channels that follow the rows in their order, filled in once for a table or a program."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from postproc.channels.expression import in_order
from postproc.channels.state import State
from postproc.effects.base import Effect
from postproc.model.arm import Model
from postproc.model.chain import deflected_chain
from postproc.model.deflection import Deflection
from postproc.model.loads import loaded_state


def with_ordered_channels(model: Model, state: State, effects: Iterable[Effect] = ()) -> State:
    """Return states in their order with the derived channels that effects read: lags, play, the row before.

    Loads are those of the arm without deflection; rows without commanded joints have no value.

    Args:
        state: all rows of a table, or all samples along a program; effects: beside those of the model.
    """
    wanted = [(c, e.site) for e in (*model.effects, *effects) for c in e.ordered_channels]
    wanted = [(c, site) for c, site in wanted if c.name not in state.channels]
    commanded = np.isfinite(state.q).all(axis=1)
    if not wanted or not commanded.any():
        return state
    seen = model.with_arm(state if commanded.all() else state.rows(commanded))
    if any("load" in c.reads for c, _ in wanted):
        seen = loaded_state(model.with_effects(), seen, Deflection(np.zeros((len(seen), 6)), {}, None, None), ())
    elif any("pose" in c.reads for c, _ in wanted):
        seen = seen.with_(T_base_body=deflected_chain(model.robot, seen.q, {}, False).T_base_body)
    for c, site in wanted:
        seen = in_order([c], seen, site)
    derived = {name: np.full(len(state), np.nan) for name in seen.channels if name not in state.channels}
    for name, values in derived.items():
        values[commanded] = seen.channels[name]
    return state.with_(channels={**state.channels, **derived})
