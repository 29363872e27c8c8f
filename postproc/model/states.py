"""Some of n states."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from postproc.effects.contract import State

CONSTANT = ("gravity", "robot", "channels", "session_names", "T_flange_tcp")


def take(state: State, rows: Any) -> State:
    """The states of some rows (slice, mask or indices); constants and one tool for all stay as they are."""
    picked: dict[str, Any] = {}
    for field in fields(State):
        value = getattr(state, field.name)
        if field.name not in CONSTANT and value is not None:
            picked[field.name] = np.asarray(value)[rows]
    if state.T_flange_tcp.ndim == 3:
        picked["T_flange_tcp"] = state.T_flange_tcp[rows]
    return state.with_(**picked, channels={name: np.asarray(value)[rows] for name, value in state.channels.items()})
